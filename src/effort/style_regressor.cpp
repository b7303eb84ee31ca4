#include "laban/effort/style_regressor.h"

#include <cmath>
#include <utility>

#include "laban/learn/gaussian_kernel.h"

#include "effort/averaged_process.h"
#include "effort/container_arrays.h"
#include "effort/error_spread.h"

namespace laban::effort {
namespace {

[[noreturn]] void fail(base::ErrorKind kind, const std::string& message) {
  throw base::Error(kind, "style regressor: " + message);
}

/// Components of a content coordinate, from the rows of z. @throws Error{kData} if none fits.
Eigen::Index component_count(Eigen::Index rows, int factors) {
  if (factors != kFactorCount && factors != kMaxFactorCount) {
    fail(base::ErrorKind::kData, std::to_string(factors) + " factors, must be 3 or 4");
  }
  const Eigen::Index components = (rows - 2 * factors - 1) / 2;
  if (components < 1 || feature_count(static_cast<int>(components), factors) != rows) {
    fail(base::ErrorKind::kData,
         std::to_string(rows) + " features, must be [c_i, c_j, e_i, e_j, alpha]: 2 n + " +
             std::to_string(feature_count(0, factors)) + " rows for n >= 1 content coordinates");
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
  return state.coefficients.cols() > 0 &&
         !(state.coefficients.row(factor).isZero(0.0) && state.bulge.row(factor).isZero(0.0));
}

/// b(alpha) of blends, from the last row of z.
Eigen::RowVectorXd bulge_row(const Eigen::Ref<const Eigen::MatrixXd>& z) {
  return bulge_of(z.bottomRows(1)).matrix().transpose();
}

void keep_in_bounds(const StyleRegressorState& state, EffortMatrix& predictions) {
  if (state.bounded) predictions = predictions.cwiseMax(kEffortMin).cwiseMin(kEffortMax);
}

bool sizes_agree(const ErrorSpread& spread, Eigen::Index rows, Eigen::Index factors) {
  return spread.unit.size() == factors && spread.bulge_share.size() == factors &&
         spread.scale.mean.size() == rows && spread.scale.inverse_scale.size() == rows &&
         spread.centers.rows() == rows && spread.centers.cols() % 2 == 0 &&
         spread.centers.cols() > 0;
}

bool is_sound(const ErrorSpread& spread) {
  return spread.scale.mean.allFinite() && spread.scale.inverse_scale.allFinite() &&
         spread.centers.allFinite() && spread.width > 0.0 && spread.width <= 1e300 &&
         spread.bulge_mean_square > 0.0 && spread.bulge_mean_square <= 1e300 &&
         spread.unit.allFinite() && spread.unit.minCoeff() >= 0.0 &&
         spread.bulge_share.allFinite() && spread.bulge_share.minCoeff() >= 0.0 &&
         spread.bulge_share.maxCoeff() <= 1.0;
}

/// Of FactorFit: width, relative width, loss weight, epsilon, held-out squared error.
constexpr int kFitRows = 5;

Eigen::MatrixXd to_matrix(const std::vector<FactorFit>& fits) {
  Eigen::MatrixXd result(kFitRows, std::ssize(fits));
  for (Eigen::Index f = 0; f < result.cols(); ++f) {
    const FactorFit& fit = fits[static_cast<std::size_t>(f)];
    result.col(f) << fit.width, fit.relative_width, fit.loss_weight, fit.epsilon,
        fit.held_out_squared_error;
  }
  return result;
}

std::vector<FactorFit> to_fits(const Eigen::MatrixXd& matrix) {
  std::vector<FactorFit> result;
  for (Eigen::Index f = 0; f < matrix.cols(); ++f) {
    result.push_back({matrix(0, f), matrix(1, f), matrix(2, f), matrix(3, f), matrix(4, f)});
  }
  return result;
}

ErrorSpread take_spread(const base::Container& container, const std::string& prefix,
                        Eigen::Index factors) {
  ErrorSpread spread;
  spread.scale.mean = take_array(container, prefix + ".spread_mean", -1, 1);
  spread.scale.inverse_scale = take_array(container, prefix + ".spread_inverse_scale", -1, 1);
  spread.centers = take_array(container, prefix + ".spread_centers", -1, -1);
  const Eigen::MatrixXd numbers = take_array(container, prefix + ".spread", factors, 3);
  spread.unit = numbers.col(0);
  spread.bulge_share = numbers.col(1);
  spread.width = numbers(0, 2);
  spread.bulge_mean_square = numbers(1, 2);
  return spread;
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
  if (e_i.size() != e_j.size()) {
    fail(base::ErrorKind::kData, "Efforts of " + std::to_string(e_i.size()) + " and " +
                                     std::to_string(e_j.size()) + " factors, must be equal");
  }
  Eigen::VectorXd z(feature_count(static_cast<int>(c_i.size()), static_cast<int>(e_i.size())));
  z << c_i, c_j, e_i, e_j, alpha;
  return z;
}

Eigen::MatrixXd swap_order(const Eigen::Ref<const Eigen::MatrixXd>& z, int factors) {
  const Eigen::Index n = component_count(z.rows(), factors);
  Eigen::MatrixXd result(z.rows(), z.cols());
  result.topRows(n) = z.middleRows(n, n);
  result.middleRows(n, n) = z.topRows(n);
  result.middleRows(2 * n, factors) = z.middleRows(2 * n + factors, factors);
  result.middleRows(2 * n + factors, factors) = z.middleRows(2 * n, factors);
  result.bottomRows(1) = (1.0 - z.bottomRows(1).array()).matrix();
  return result;
}

EffortMatrix linear_interpolation(const Eigen::Ref<const Eigen::MatrixXd>& z, int factors) {
  const Eigen::Index n = component_count(z.rows(), factors);
  const Eigen::Array<double, 1, Eigen::Dynamic> alpha = z.bottomRows(1).array();
  const auto e_i = z.middleRows(2 * n, factors).array();
  const auto e_j = z.middleRows(2 * n + factors, factors).array();
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
  static_cast<void>(component_count(features.rows(), factor_count()));
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
  if (!features.allFinite() || !labels.allFinite()) {
    fail(base::ErrorKind::kData, "a feature or label of a blend is not finite, all must be");
  }
}

StyleRegressor::StyleRegressor(StyleRegressorState state) : state_(std::move(state)) {
  const Eigen::Index rows = state_.scale.mean.size();
  const Eigen::Index factors = state_.offset.size();
  static_cast<void>(component_count(rows, static_cast<int>(factors)));
  if (state_.interpolation.size() != factors || state_.bulge_offset.size() != factors ||
      std::ssize(state_.fits) != factors || state_.weights.rows() != factors ||
      state_.coefficients.rows() != factors || state_.bulge.rows() != factors) {
    fail(base::ErrorKind::kData, "the numbers of factors of its arrays do not agree");
  }
  if (state_.scale.inverse_scale.size() != rows || state_.weights.cols() != rows ||
      state_.centers.cols() != state_.coefficients.cols() ||
      state_.centers.cols() != state_.bulge.cols() ||
      (state_.centers.cols() > 0 && state_.centers.rows() != rows) ||
      (state_.symmetric && state_.centers.cols() % 2 != 0) ||
      (state_.spread && !sizes_agree(*state_.spread, rows, factors))) {
    fail(base::ErrorKind::kData, "the sizes of its arrays do not agree");
  }
  if (!state_.scale.mean.allFinite() || !state_.scale.inverse_scale.allFinite() ||
      !state_.interpolation.allFinite() || !state_.offset.allFinite() ||
      !state_.weights.allFinite() || !state_.centers.allFinite() ||
      !state_.coefficients.allFinite() || !state_.bulge.allFinite() ||
      !state_.bulge_offset.allFinite()) {
    fail(base::ErrorKind::kData, "a number of the model is not finite, all must be");
  }
  if (state_.spread && !is_sound(*state_.spread)) {
    fail(base::ErrorKind::kData, "a number of its standard errors is not finite or out of range");
  }
  for (int f = 0; f < factor_count(); ++f) {
    const double width = state_.fits[static_cast<std::size_t>(f)].width;
    if (has_kernel(state_, f) && !(width > 0.0)) {
      fail(base::ErrorKind::kData,
           std::string("kernel width ") + std::to_string(width) + " for " +
               std::string(name_of(factors_of(factor_count())[static_cast<std::size_t>(f)])) +
               ", must be > 0");
    }
  }
  center_norms_ = state_.centers.colwise().squaredNorm().transpose();
}

EffortMatrix StyleRegressor::predict(const Eigen::Ref<const Eigen::MatrixXd>& z) const {
  StyleScratch scratch;
  return predict(z, scratch);
}

EffortMatrix StyleRegressor::predict(const Eigen::Ref<const Eigen::MatrixXd>& z,
                                     StyleScratch& scratch) const {
  require_features(z.rows(), feature_rows());
  scratch.standardized =
      state_.scale.inverse_scale.asDiagonal() * (z.colwise() - state_.scale.mean);
  EffortMatrix result = state_.interpolation.asDiagonal() * linear_interpolation(z, factor_count());
  result.noalias() += state_.weights * scratch.standardized;
  result.colwise() += state_.offset;
  const Eigen::RowVectorXd b = bulge_row(z);
  result.noalias() += state_.bulge_offset * b;
  if (state_.centers.cols() == 0) {
    keep_in_bounds(state_, result);
    return result;
  }
  squared_distances_into(state_.centers, center_norms_, scratch.standardized, scratch.squared);
  for (int f = 0; f < factor_count(); ++f) {
    if (!has_kernel(state_, f)) continue;
    apply_gaussian(scratch.squared, state_.fits[static_cast<std::size_t>(f)].width, scratch.kernel);
    result.row(f).noalias() += state_.coefficients.row(f) * scratch.kernel;
    if (state_.bulge.row(f).isZero(0.0)) continue;
    result.row(f) += b.cwiseProduct(state_.bulge.row(f) * scratch.kernel);
  }
  keep_in_bounds(state_, result);
  return result;
}

EffortMatrix StyleRegressor::predict_curves(const Eigen::Ref<const Eigen::MatrixXd>& pairs,
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
  const auto linear_part = [&](const Eigen::MatrixXd& z) -> EffortMatrix {
    scratch.standardized =
        state_.scale.inverse_scale.asDiagonal() * (z.colwise() - state_.scale.mean);
    EffortMatrix value =
        state_.interpolation.asDiagonal() * linear_interpolation(z, factor_count());
    value.noalias() += state_.weights * scratch.standardized;
    value.colwise() += state_.offset;
    return value;
  };
  const EffortMatrix start = linear_part(ends);
  ends.bottomRows(1).setOnes();
  const EffortMatrix slope = linear_part(ends) - start;
  const Eigen::RowVectorXd b = bulge_of(alpha).matrix().transpose();
  EffortMatrix result(factor_count(), P * M);
  for (Eigen::Index p = 0; p < P; ++p) {
    result.middleCols(p * M, M) = slope.col(p) * alpha + state_.bulge_offset * b;
    result.middleCols(p * M, M).colwise() += start.col(p);
  }
  if (state_.centers.cols() == 0) {
    keep_in_bounds(state_, result);
    return result;
  }

  // |s(z) - x_n|^2 = (all rows but the last: fixed by the pair) + (the last: fixed by alpha).
  scratch.standardized.bottomRows(1).setZero();
  const Eigen::RowVectorXd center_alpha = state_.centers.bottomRows(1);
  squared_distances_into(state_.centers, center_norms_, scratch.standardized, scratch.squared);
  scratch.squared.colwise() -= center_alpha.transpose().cwiseAbs2();
  const Eigen::MatrixXd alpha_squared =
      (scaled_alpha.replicate(center_alpha.size(), 1).colwise() - center_alpha.transpose())
          .cwiseAbs2();
  Eigen::MatrixXd along_alpha, curves;
  for (int f = 0; f < factor_count(); ++f) {
    if (!has_kernel(state_, f)) continue;
    const double width = state_.fits[static_cast<std::size_t>(f)].width;
    apply_gaussian(scratch.squared, width, scratch.kernel);
    apply_gaussian(alpha_squared, width, along_alpha);
    along_alpha.array() *=
        ((state_.bulge.row(f).transpose() * b).colwise() + state_.coefficients.row(f).transpose())
            .array();
    curves.noalias() = along_alpha.transpose() * scratch.kernel;  // M x P
    result.row(f) += curves.reshaped().transpose();
  }
  keep_in_bounds(state_, result);
  return result;
}

std::optional<StylePrediction> StyleRegressor::predict_with_error(
    const Eigen::Ref<const Eigen::MatrixXd>& z) const {
  StylePrediction result;
  result.mean = predict(z);
  result.standard_error.resize(factor_count(), z.cols());
  if (!state_.spread) {
    for (int f = 0; f < factor_count(); ++f) {
      result.standard_error.row(f).setConstant(
          std::sqrt(state_.fits[static_cast<std::size_t>(f)].held_out_squared_error));
    }
    return result;
  }
  const ErrorSpread& spread = *state_.spread;
  const Eigen::ArrayXd novelty =
      1.0 + unexplained_share(spread.centers, spread.scale.apply(z),
                              spread.scale.apply(swap_order(z, factor_count())), spread.width)
                .array();
  const Eigen::ArrayXd b = bulge_row(z).transpose();
  for (int f = 0; f < factor_count(); ++f) {
    const Eigen::ArrayXd shape =
        spread_shape(b, novelty, spread.bulge_share[f], spread.bulge_mean_square);
    result.standard_error.row(f) = (spread.unit[f] * shape).matrix().transpose();
  }
  return result;
}

EffortMatrix StyleRegressor::typical_errors(std::span<const double> alphas) const {
  // 1 + v of a blend that half follows from those learnt from.
  constexpr double kTypicalNovelty = 1.5;
  const auto count = static_cast<Eigen::Index>(alphas.size());
  EffortMatrix errors(factor_count(), count);
  const Eigen::ArrayXd b = bulge_of(Eigen::Map<const Eigen::RowVectorXd>(alphas.data(), count));
  for (int f = 0; f < factor_count(); ++f) {
    if (!state_.spread) {
      errors.row(f).setConstant(
          std::sqrt(state_.fits[static_cast<std::size_t>(f)].held_out_squared_error));
      continue;
    }
    const ErrorSpread& spread = *state_.spread;
    errors.row(f) =
        (spread.unit[f] * spread_shape(b, Eigen::ArrayXd::Constant(count, kTypicalNovelty),
                                       spread.bulge_share[f], spread.bulge_mean_square))
            .matrix()
            .transpose();
  }
  return errors;
}

void StyleRegressor::save(base::Container& container, const std::string& prefix) const {
  // Three numbers: laban 0.1's first models had two, no bulge and no spread; a program that knows
  // only those refuses three, instead of predicting without what it does not know.
  put_array(container, prefix + ".form",
            Eigen::Vector3d(static_cast<double>(state_.kind), state_.symmetric ? 1.0 : 0.0,
                            state_.bounded ? 1.0 : 0.0));
  put_array(container, prefix + ".mean", state_.scale.mean);
  put_array(container, prefix + ".inverse_scale", state_.scale.inverse_scale);
  put_array(container, prefix + ".interpolation", state_.interpolation);
  put_array(container, prefix + ".offset", state_.offset);
  put_array(container, prefix + ".weights", state_.weights);
  put_array(container, prefix + ".centers", state_.centers);
  put_array(container, prefix + ".coefficients", state_.coefficients);
  put_array(container, prefix + ".bulge_offset", state_.bulge_offset);
  put_array(container, prefix + ".bulge", state_.bulge);
  put_array(container, prefix + ".fits", to_matrix(state_.fits));
  if (!state_.spread) return;
  const ErrorSpread& spread = *state_.spread;
  put_array(container, prefix + ".spread_mean", spread.scale.mean);
  put_array(container, prefix + ".spread_inverse_scale", spread.scale.inverse_scale);
  put_array(container, prefix + ".spread_centers", spread.centers);
  Eigen::MatrixXd numbers = Eigen::MatrixXd::Zero(factor_count(), 3);
  numbers.col(0) = spread.unit;
  numbers.col(1) = spread.bulge_share;
  numbers(0, 2) = spread.width;
  numbers(1, 2) = spread.bulge_mean_square;
  put_array(container, prefix + ".spread", numbers);
}

StyleRegressor StyleRegressor::load(const base::Container& container, const std::string& prefix) {
  const Eigen::MatrixXd form = take_array(container, prefix + ".form", -1, 1);
  if (form.rows() != 2 && form.rows() != 3) {
    fail(base::ErrorKind::kFormat, "model array " + prefix + ".form: " +
                                       std::to_string(form.rows()) + " numbers, must be 2 or 3");
  }
  const bool is_first_version = form.rows() == 2;
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
  const Eigen::MatrixXd offset = take_array(container, prefix + ".offset", -1, 1);
  const Eigen::Index factors = offset.rows();
  if (factors != kFactorCount && factors != kMaxFactorCount) {
    fail(base::ErrorKind::kFormat, "model array " + prefix + ".offset: " + std::to_string(factors) +
                                       " factors, must be 3 or 4");
  }
  state.offset = offset;
  state.interpolation = take_array(container, prefix + ".interpolation", factors, 1);
  state.weights = take_array(container, prefix + ".weights", factors, -1);
  state.centers = take_array(container, prefix + ".centers", -1, -1);
  state.coefficients = take_array(container, prefix + ".coefficients", factors, -1);
  if (is_first_version) {
    state.bulge_offset = EffortVector::Zero(factors);
    state.bulge = EffortMatrix::Zero(factors, state.coefficients.cols());
  } else {
    state.bounded = form(2, 0) != 0.0;
    state.bulge_offset = take_array(container, prefix + ".bulge_offset", factors, 1);
    state.bulge = take_array(container, prefix + ".bulge", factors, -1);
  }
  if (container.arrays.contains(prefix + ".spread")) {
    state.spread = take_spread(container, prefix, factors);
  }
  state.fits = to_fits(take_array(container, prefix + ".fits", kFitRows, factors));
  try {
    return StyleRegressor(std::move(state));
  } catch (const base::Error& error) {
    throw base::Error(base::ErrorKind::kFormat, "model arrays " + prefix + ": " + error.what());
  }
}

}  // namespace laban::effort
