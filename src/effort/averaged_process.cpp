#include "effort/averaged_process.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "laban/base/error.h"
#include "laban/learn/gaussian_kernel.h"

namespace laban::effort {
namespace {

/// The evidence is raised to this power: labels have heavier tails than the processes' Gaussian
/// noise, and what one training set says of the best process the next one often contradicts. (The
/// generalised, or "safe", Bayes of [GruenwaldVanOmmen17]; on three corpora 0.2 gains more over
/// interpolation on average, but nothing that is sure on the factor of the heaviest tails.)
constexpr double kTemper = 0.05;

/// Before the labels are seen, nothing to learn is as likely as something.
constexpr double kPriorOfNothing = 0.5;

/// Summands of the covariance k; before the labels are seen, one is as likely as the other.
constexpr std::array kConstants = {0.0, 1.0};

std::vector<std::vector<int>> samples_of_folds(std::span<const int> folds) {
  std::map<int, std::vector<int>> lists;
  for (std::size_t n = 0; n < folds.size(); ++n) lists[folds[n]].push_back(static_cast<int>(n));
  std::vector<std::vector<int>> result;
  for (auto& [number, samples] : lists) result.push_back(std::move(samples));
  return result;
}

}  // namespace

ProcessGrid::ProcessGrid(const Eigen::MatrixXd& samples,
                         const Eigen::Ref<const Eigen::RowVectorXd>& alpha,
                         const Eigen::VectorXd& weights, std::span<const int> folds, double median,
                         const std::vector<double>& relative_widths,
                         const std::vector<double>& noise_ratios)
    : root_weights_(weights.cwiseSqrt()),
      folds_(samples_of_folds(folds)),
      median_(median),
      noise_ratios_(noise_ratios) {
  const Eigen::Index N = alpha.size();
  const Eigen::MatrixXd squared = learn::squared_distances(samples.leftCols(N), samples);
  Eigen::VectorXd bulge = bulge_of(alpha).matrix();
  const double size = std::sqrt(bulge.squaredNorm() / static_cast<double>(N));
  if (size > 0.0) bulge_unit_ = 1.0 / size;
  bulge *= bulge_unit_;
  const auto spectrum = [&](const Eigen::MatrixXd& gaussian, double constant,
                            const Eigen::VectorXd& form) {
    const Eigen::MatrixXd kernel = gaussian.array() + constant;
    const Eigen::VectorXd scale = form.cwiseProduct(root_weights_);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * kernel *
                                                                scale.asDiagonal());
    if (solver.info() != Eigen::Success) {
      throw base::Error(base::ErrorKind::kNumeric,
                        "style regressor: eigenvalues of a kernel did not converge");
    }
    return Spectrum{constant, form, solver.eigenvectors(), solver.eigenvalues().cwiseMax(0.0)};
  };
  for (const double relative : relative_widths) {
    const Eigen::MatrixXd both = learn::gaussian_kernel(squared, relative * median);
    const Eigen::MatrixXd gaussian = 0.5 * (both.leftCols(N) + both.rightCols(N));
    const auto spectra = [&](const Eigen::VectorXd& form) -> std::array<Spectrum, 2> {
      return {spectrum(gaussian, kConstants[0], form), spectrum(gaussian, kConstants[1], form)};
    };
    widths_.push_back({relative, {spectra(Eigen::VectorXd::Ones(N)), spectra(bulge)}});
  }
}

ProcessGrid::Share ProcessGrid::share(const Spectrum& spectrum,
                                      const Eigen::VectorXd& whitened) const {
  // Signal variance at its value of greatest likelihood, log p = -N/2 log(y' C^-1 y / N)
  // - 1/2 log |C| with C = K + ratio I; of nothing at all C = I. Constants cancel.
  const double count = static_cast<double>(whitened.size());
  const double prior =
      (1.0 - kPriorOfNothing) / static_cast<double>(kConstants.size() * noise_ratios_.size());
  const Eigen::ArrayXd squares =
      (spectrum.vectors.transpose() * whitened).array().square() / whitened.squaredNorm();
  Share result;
  for (const double ratio : noise_ratios_) {
    const Eigen::ArrayXd C = spectrum.values.array() + ratio;
    const double gain = -0.5 * count * std::log((squares / C).sum()) - 0.5 * C.log().sum();
    const double summand = prior * std::exp(kTemper * gain);
    if (summand > result.best) {
      result.best = summand;
      result.noise_ratio = ratio;
    }
    result.total += summand;
    result.summands.push_back(summand);
  }
  return result;
}

void ProcessGrid::add(const Spectrum& spectrum, const Share& share, double norm,
                      const Eigen::VectorXd& whitened, AveragedProcess& result) const {
  const Eigen::Index N = whitened.size();
  const Eigen::VectorXd turned = spectrum.vectors.transpose() * whitened;
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(N);
  for (std::size_t k = 0; k < noise_ratios_.size(); ++k) {
    const double part = share.summands[k] / norm;
    const Eigen::VectorXd inverse = (spectrum.values.array() + noise_ratios_[k]).inverse();
    const Eigen::VectorXd Gy = spectrum.vectors * inverse.cwiseProduct(turned);
    coefficients += part * spectrum.form.cwiseProduct(root_weights_).cwiseProduct(Gy);
    // Residual of fold S from its own left-out fit: (G_SS)^-1 (G y)_S (learn/cross_validation.h).
    for (const std::vector<int>& S : folds_) {
      const Eigen::MatrixXd V = spectrum.vectors(S, Eigen::all);
      const Eigen::MatrixXd G_SS = V * inverse.asDiagonal() * V.transpose();
      const Eigen::VectorXd residual = G_SS.llt().solve(Gy(S));
      result.held_out(S) += part * residual.cwiseQuotient(root_weights_(S));
    }
  }
  result.offset += spectrum.constant * coefficients.sum();
  result.coefficients.head(N) += 0.5 * coefficients;
  result.coefficients.tail(N) += 0.5 * coefficients;
}

AveragedProcess ProcessGrid::average(const Eigen::VectorXd& targets, ProcessForm form) const {
  AveragedProcess result;
  result.coefficients = Eigen::VectorXd::Zero(2 * targets.size());
  result.held_out = targets;
  const Eigen::VectorXd whitened = targets.cwiseProduct(root_weights_);
  if (widths_.empty() || !(whitened.squaredNorm() > 0.0)) return result;

  const auto spectra_of = [form](const Width& width) -> const std::array<Spectrum, 2>& {
    return width.spectra[static_cast<std::size_t>(form)];
  };
  const Width* chosen = nullptr;
  std::array<Share, 2> most;
  double total = 0.0;
  for (const Width& width : widths_) {
    const auto& [without, with] = spectra_of(width);
    std::array<Share, 2> found = {share(without, whitened), share(with, whitened)};
    const double sum = found[0].total + found[1].total;
    if (chosen != nullptr && !(sum > total)) continue;
    chosen = &width;
    most = std::move(found);
    total = sum;
  }
  const double norm = kPriorOfNothing + total;
  result.held_out *= kPriorOfNothing / norm;
  for (std::size_t n = 0; n < most.size(); ++n) {
    add(spectra_of(*chosen)[n], most[n], norm, whitened, result);
  }
  if (form == ProcessForm::kBulge) {
    result.coefficients *= bulge_unit_;
    result.offset *= bulge_unit_;
  }
  const Share& likeliest = most[most[1].best > most[0].best ? 1 : 0];
  result.relative_width = chosen->relative;
  result.width = chosen->relative * median_;
  result.loss_weight = 1.0 / likeliest.noise_ratio;
  return result;
}

}  // namespace laban::effort
