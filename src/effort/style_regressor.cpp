#include "laban/effort/style_regressor.h"

#include <cmath>
#include <utility>

#include "laban/learn/gaussian_kernel.h"

#include "effort/container_arrays.h"

namespace laban::effort {
namespace {

[[noreturn]] void fail(base::ErrorKind kind, const std::string& message) {
  throw base::Error(kind, "style regressor: " + message);
}

/// Components of a content coordinate, from the rows of z. @throws Error{kData} if none fits.
Eigen::Index component_count(Eigen::Index rows) {
  const Eigen::Index components = (rows - 2 * kFactorCount - 1) / 2;
  if (components < 1 || feature_count(static_cast<int>(components)) != rows) {
    fail(base::ErrorKind::kData, std::to_string(rows) +
                                     " features, must be [c_i, c_j, e_i, e_j, alpha]: 2 n + 7 rows "
                                     "for n >= 1 content coordinates");
  }
  return components;
}

void require_features(Eigen::Index rows, Eigen::Index expected) {
  if (rows != expected) {
    fail(base::ErrorKind::kData,
         std::to_string(rows) + " features a blend, the model has " + std::to_string(expected));
  }
}

/// exp(-squared / (2 width^2)), written into `kernel`.
void apply_gaussian(const Eigen::MatrixXd& squared, double width, Eigen::MatrixXd& kernel) {
  kernel = (squared.array() * (-0.5 / (width * width))).exp();
}

/// Squared distances C x N of standardized `centers` and samples, written into `squared`; round-off
/// may leave them at -1e-14, which a Gaussian does not mind.
void squared_distances_into(const Eigen::MatrixXd& centers, const Eigen::VectorXd& center_norms,
                            const Eigen::MatrixXd& samples, Eigen::MatrixXd& squared) {
  squared.noalias() = -2.0 * (centers.transpose() * samples);
  squared.colwise() += center_norms;
  squared.rowwise() += samples.colwise().squaredNorm();
}

bool has_kernel(const StyleRegressorState& state, int factor) {
  return state.coefficients.cols() > 0 && !state.coefficients.row(factor).isZero(0.0);
}

Eigen::MatrixXd to_matrix(const std::array<FactorFit, kFactorCount>& fits) {
  Eigen::MatrixXd result(5, kFactorCount);
  for (int f = 0; f < kFactorCount; ++f) {
    const FactorFit& fit = fits[static_cast<std::size_t>(f)];
    result.col(f) << fit.width, fit.relative_width, fit.loss_weight, fit.epsilon,
        fit.held_out_squared_error;
  }
  return result;
}

std::array<FactorFit, kFactorCount> to_fits(const Eigen::MatrixXd& matrix) {
  std::array<FactorFit, kFactorCount> result;
  for (int f = 0; f < kFactorCount; ++f) {
    result[static_cast<std::size_t>(f)] = {matrix(0, f), matrix(1, f), matrix(2, f), matrix(3, f),
                                           matrix(4, f)};
  }
  return result;
}

}  // namespace

std::string_view name_of(RegressorKind kind) {
  switch (kind) {
    case RegressorKind::kLinearInterpolation:
      return "linear-interpolation";
    case RegressorKind::kLinearRidge:
      return "linear-ridge";
    case RegressorKind::kKernelRidge:
      return "kernel-ridge";
    case RegressorKind::kSupportVector:
      return "svr";
    case RegressorKind::kResidualKernelRidge:
      return "residual-kernel-ridge";
  }
  LABAN_CHECK(false);
  return {};
}

std::optional<RegressorKind> regressor_named(std::string_view name) {
  for (const RegressorKind kind : kRegressors) {
    if (name_of(kind) == name) return kind;
  }
  return std::nullopt;
}

Eigen::VectorXd style_features(const Eigen::Ref<const Eigen::VectorXd>& c_i,
                               const Eigen::Ref<const Eigen::VectorXd>& c_j,
                               const EffortVector& e_i, const EffortVector& e_j, double alpha) {
  if (c_i.size() != c_j.size()) {
    fail(base::ErrorKind::kData, "content coordinates of " + std::to_string(c_i.size()) + " and " +
                                     std::to_string(c_j.size()) + " numbers, must be equal");
  }
  Eigen::VectorXd z(feature_count(static_cast<int>(c_i.size())));
  z << c_i, c_j, e_i, e_j, alpha;
  return z;
}

Eigen::MatrixXd swap_order(const Eigen::Ref<const Eigen::MatrixXd>& z) {
  const Eigen::Index n = component_count(z.rows());
  Eigen::MatrixXd result(z.rows(), z.cols());
  result.topRows(n) = z.middleRows(n, n);
  result.middleRows(n, n) = z.topRows(n);
  result.middleRows(2 * n, kFactorCount) = z.middleRows(2 * n + kFactorCount, kFactorCount);
  result.middleRows(2 * n + kFactorCount, kFactorCount) = z.middleRows(2 * n, kFactorCount);
  result.bottomRows(1) = (1.0 - z.bottomRows(1).array()).matrix();
  return result;
}

Eigen::Matrix3Xd linear_interpolation(const Eigen::Ref<const Eigen::MatrixXd>& z) {
  const Eigen::Index n = component_count(z.rows());
  const Eigen::Array<double, 1, Eigen::Dynamic> alpha = z.bottomRows(1).array();
  const auto e_i = z.middleRows(2 * n, kFactorCount).array();
  const auto e_j = z.middleRows(2 * n + kFactorCount, kFactorCount).array();
  return e_i.rowwise() * (1.0 - alpha) + e_j.rowwise() * alpha;
}

StyleSamples StyleSamples::subset(std::span<const int> columns) const {
  const std::vector<int> chosen(columns.begin(), columns.end());
  StyleSamples result;
  result.features = features(Eigen::all, chosen);
  result.labels = labels(Eigen::all, chosen);
  if (!groups.empty()) {
    for (const int column : chosen)
      result.groups.push_back(groups[static_cast<std::size_t>(column)]);
  }
  if (weights.size() != 0) result.weights = weights(chosen);
  return result;
}

void StyleSamples::check() const {
  static_cast<void>(component_count(features.rows()));
  if (labels.cols() != features.cols() ||
      (!groups.empty() && static_cast<Eigen::Index>(groups.size()) != features.cols()) ||
      (weights.size() != 0 && weights.size() != features.cols())) {
    fail(base::ErrorKind::kData,
         std::to_string(features.cols()) + " blends with " + std::to_string(labels.cols()) +
             " labels, " + std::to_string(groups.size()) + " groups and " +
             std::to_string(weights.size()) + " weights, must be equal (or no groups, no weights)");
  }
  for (const double weight : weights) {
    if (weight > 0.0 && weight <= 1e300) continue;
    fail(base::ErrorKind::kData,
         "weight " + std::to_string(weight) + " of a blend's label, must be > 0 and finite");
  }
  if (weights.size() > 0 &&
      (weights.size() != features.cols() || !weights.allFinite() || !(weights.minCoeff() > 0.0))) {
    fail(base::ErrorKind::kData, std::to_string(weights.size()) + " weights of " +
                                     std::to_string(features.cols()) +
                                     " blends, must be one each, finite and > 0");
  }
  if (!features.allFinite() || !labels.allFinite()) {
    fail(base::ErrorKind::kData, "a feature or label of a blend is not finite, all must be");
  }
}

StyleRegressor::StyleRegressor(StyleRegressorState state) : state_(std::move(state)) {
  const Eigen::Index rows = state_.scale.mean.size();
  static_cast<void>(component_count(rows));
  if (state_.scale.inverse_scale.size() != rows || state_.weights.cols() != rows ||
      state_.centers.cols() != state_.coefficients.cols() ||
      (state_.centers.cols() > 0 && state_.centers.rows() != rows) ||
      (state_.symmetric && state_.centers.cols() % 2 != 0)) {
    fail(base::ErrorKind::kData, "the sizes of its arrays do not agree");
  }
  if (!state_.scale.mean.allFinite() || !state_.scale.inverse_scale.allFinite() ||
      !state_.interpolation.allFinite() || !state_.offset.allFinite() ||
      !state_.weights.allFinite() || !state_.centers.allFinite() ||
      !state_.coefficients.allFinite() || !state_.signal_variance.allFinite()) {
    fail(base::ErrorKind::kData, "a number of the model is not finite, all must be");
  }
  for (int f = 0; f < kFactorCount; ++f) {
    const double width = state_.fits[static_cast<std::size_t>(f)].width;
    if (has_kernel(state_, f) && !(width > 0.0)) {
      fail(base::ErrorKind::kData, std::string("kernel width ") + std::to_string(width) + " for " +
                                       std::string(name_of(kFactors[static_cast<std::size_t>(f)])) +
                                       ", must be > 0");
    }
  }
  center_norms_ = state_.centers.colwise().squaredNorm().transpose();
}

Eigen::Matrix3Xd StyleRegressor::predict(const Eigen::Ref<const Eigen::MatrixXd>& z) const {
  StyleScratch scratch;
  return predict(z, scratch);
}

Eigen::Matrix3Xd StyleRegressor::predict(const Eigen::Ref<const Eigen::MatrixXd>& z,
                                         StyleScratch& scratch) const {
  require_features(z.rows(), feature_rows());
  scratch.standardized =
      state_.scale.inverse_scale.asDiagonal() * (z.colwise() - state_.scale.mean);
  Eigen::Matrix3Xd result = state_.interpolation.asDiagonal() * linear_interpolation(z);
  result.noalias() += state_.weights * scratch.standardized;
  result.colwise() += state_.offset;
  if (state_.centers.cols() == 0) return result;
  squared_distances_into(state_.centers, center_norms_, scratch.standardized, scratch.squared);
  for (int f = 0; f < kFactorCount; ++f) {
    if (!has_kernel(state_, f)) continue;
    apply_gaussian(scratch.squared, state_.fits[static_cast<std::size_t>(f)].width, scratch.kernel);
    result.row(f).noalias() += state_.coefficients.row(f) * scratch.kernel;
  }
  return result;
}

Eigen::Matrix3Xd StyleRegressor::predict_curves(const Eigen::Ref<const Eigen::MatrixXd>& pairs,
                                                std::span<const double> alphas,
                                                StyleScratch& scratch) const {
  const Eigen::Index D = feature_rows(), P = pairs.cols();
  const Eigen::Index M = static_cast<Eigen::Index>(alphas.size());
  require_features(pairs.rows() + 1, D);
  const Eigen::Map<const Eigen::RowVectorXd> alpha(alphas.data(), M);
  const Eigen::RowVectorXd scaled_alpha =
      (alpha.array() - state_.scale.mean[D - 1]) * state_.scale.inverse_scale[D - 1];

  // z at alpha = 0 and 1; all that is linear in z is linear in alpha between them.
  Eigen::MatrixXd ends(D, P);
  ends.topRows(D - 1) = pairs;
  ends.bottomRows(1).setZero();
  const auto linear_part = [&](const Eigen::MatrixXd& z) -> Eigen::Matrix3Xd {
    scratch.standardized =
        state_.scale.inverse_scale.asDiagonal() * (z.colwise() - state_.scale.mean);
    Eigen::Matrix3Xd value = state_.interpolation.asDiagonal() * linear_interpolation(z);
    value.noalias() += state_.weights * scratch.standardized;
    value.colwise() += state_.offset;
    return value;
  };
  const Eigen::Matrix3Xd start = linear_part(ends);
  ends.bottomRows(1).setOnes();
  const Eigen::Matrix3Xd slope = linear_part(ends) - start;
  Eigen::Matrix3Xd result(kFactorCount, P * M);
  for (Eigen::Index p = 0; p < P; ++p) {
    result.middleCols(p * M, M) = slope.col(p) * alpha;
    result.middleCols(p * M, M).colwise() += start.col(p);
  }
  if (state_.centers.cols() == 0) return result;

  // |s(z) - x_n|^2 = (all rows but the last: fixed by the pair) + (the last: fixed by alpha).
  scratch.standardized.bottomRows(1).setZero();
  const Eigen::RowVectorXd center_alpha = state_.centers.bottomRows(1);
  squared_distances_into(state_.centers, center_norms_, scratch.standardized, scratch.squared);
  scratch.squared.colwise() -= center_alpha.transpose().cwiseAbs2();
  const Eigen::MatrixXd alpha_squared =
      (scaled_alpha.replicate(center_alpha.size(), 1).colwise() - center_alpha.transpose())
          .cwiseAbs2();
  Eigen::MatrixXd along_alpha, curves;
  for (int f = 0; f < kFactorCount; ++f) {
    if (!has_kernel(state_, f)) continue;
    const double width = state_.fits[static_cast<std::size_t>(f)].width;
    apply_gaussian(scratch.squared, width, scratch.kernel);
    apply_gaussian(alpha_squared, width, along_alpha);
    along_alpha.array().colwise() *= state_.coefficients.row(f).transpose().array();
    curves.noalias() = along_alpha.transpose() * scratch.kernel;  // M x P
    result.row(f) += curves.reshaped().transpose();
  }
  return result;
}

std::optional<StylePrediction> StyleRegressor::predict_with_error(
    const Eigen::Ref<const Eigen::MatrixXd>& z) const {
  if (state_.kind != RegressorKind::kKernelRidge &&
      state_.kind != RegressorKind::kResidualKernelRidge) {
    return std::nullopt;
  }
  StyleScratch scratch;
  StylePrediction result;
  result.mean = predict(z, scratch);
  result.standard_error.resize(kFactorCount, z.cols());
  // The prior covariance of a symmetric model is k(z, w) + k(z, w told from the other end), so that
  // a sample and its twin are one. Their centers are n and n + N.
  const Eigen::Index N = state_.symmetric ? state_.centers.cols() / 2 : state_.centers.cols();
  const Eigen::MatrixXd centers_squared =
      learn::squared_distances(state_.centers, state_.centers.leftCols(N));
  const Eigen::MatrixXd twin = state_.scale.apply(swap_order(z));
  const Eigen::RowVectorXd twin_squared = (scratch.standardized - twin).colwise().squaredNorm();
  for (int f = 0; f < kFactorCount; ++f) {
    const FactorFit& fit = state_.fits[static_cast<std::size_t>(f)];
    if (fit.loss_weight == 0.0) {  // no machine: all that interpolation missed is left unexplained
      result.standard_error.row(f).setConstant(std::sqrt(state_.signal_variance[f]));
      continue;
    }
    Eigen::MatrixXd K = learn::gaussian_kernel(centers_squared, fit.width);
    Eigen::MatrixXd k = learn::gaussian_kernel(scratch.squared, fit.width);
    Eigen::RowVectorXd prior = Eigen::RowVectorXd::Ones(z.cols());
    if (state_.symmetric) {
      K.topRows(N) += K.bottomRows(N).eval();
      k.topRows(N) += k.bottomRows(N).eval();
      prior += learn::gaussian_kernel(twin_squared, fit.width);
    }
    Eigen::MatrixXd A = K.topRows(N);
    A.diagonal().array() += 1.0 / fit.loss_weight;
    const Eigen::LLT<Eigen::MatrixXd> factor(A);
    if (factor.info() != Eigen::Success) {
      fail(base::ErrorKind::kNumeric, "kernel + ridge is not positive definite to round-off");
    }
    const Eigen::RowVectorXd explained =
        factor.matrixL().solve(k.topRows(N)).colwise().squaredNorm();
    result.standard_error.row(f) =
        (state_.signal_variance[f] * (prior - explained).array().max(0.0)).sqrt();
  }
  return result;
}

void StyleRegressor::save(base::Container& container, const std::string& prefix) const {
  put_array(container, prefix + ".form",
            Eigen::Vector2d(static_cast<double>(state_.kind), state_.symmetric ? 1.0 : 0.0));
  put_array(container, prefix + ".mean", state_.scale.mean);
  put_array(container, prefix + ".inverse_scale", state_.scale.inverse_scale);
  put_array(container, prefix + ".interpolation", state_.interpolation);
  put_array(container, prefix + ".offset", state_.offset);
  put_array(container, prefix + ".weights", state_.weights);
  put_array(container, prefix + ".centers", state_.centers);
  put_array(container, prefix + ".coefficients", state_.coefficients);
  put_array(container, prefix + ".signal_variance", state_.signal_variance);
  put_array(container, prefix + ".fits", to_matrix(state_.fits));
}

StyleRegressor StyleRegressor::load(const base::Container& container, const std::string& prefix) {
  const Eigen::MatrixXd form = take_array(container, prefix + ".form", 2, 1);
  const double kind = form(0, 0);
  if (!(kind >= 0.0 && kind < kRegressorCount)) {
    fail(base::ErrorKind::kFormat, "model array " + prefix + ".form: regressor " +
                                       std::to_string(kind) + ", must be 0 .. " +
                                       std::to_string(kRegressorCount - 1));
  }
  StyleRegressorState state;
  state.kind = kRegressors[static_cast<std::size_t>(kind)];
  state.symmetric = form(1, 0) != 0.0;
  state.scale.mean = take_array(container, prefix + ".mean", -1, 1);
  state.scale.inverse_scale = take_array(container, prefix + ".inverse_scale", -1, 1);
  state.interpolation = take_array(container, prefix + ".interpolation", kFactorCount, 1);
  state.offset = take_array(container, prefix + ".offset", kFactorCount, 1);
  state.weights = take_array(container, prefix + ".weights", kFactorCount, -1);
  state.centers = take_array(container, prefix + ".centers", -1, -1);
  state.coefficients = take_array(container, prefix + ".coefficients", kFactorCount, -1);
  state.signal_variance = take_array(container, prefix + ".signal_variance", kFactorCount, 1);
  state.fits = to_fits(take_array(container, prefix + ".fits", 5, kFactorCount));
  try {
    return StyleRegressor(std::move(state));
  } catch (const base::Error& error) {
    throw base::Error(base::ErrorKind::kFormat, "model arrays " + prefix + ": " + error.what());
  }
}

}  // namespace laban::effort
