#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Dense>

namespace laban::effort {

/// How large values may be: everywhere alike, or in proportion to b(alpha) = alpha (1 - alpha), as
/// a departure from interpolation must be, for at alpha = 0 and 1 a blend is its seed.
enum class ProcessForm { kPlain, kBulge };

/// f(z) = offset + sum_n coefficients_n k(z, z_n), k a Gaussian, z_n both orders; times b(alpha) in
/// the form kBulge.
struct AveragedProcess {
  double relative_width = 0.0;  ///< in median distances; 0 if nothing was learnt
  double width = 0.0;
  double loss_weight = 0.0;  ///< 1 / noise ratio of the likeliest process; 0 if nothing was learnt
  double offset = 0.0;
  Eigen::VectorXd coefficients;  ///< 2 N, twins alike
  Eigen::VectorXd held_out;      ///< N residuals of the targets, each fold left out
};

/// b(alpha) = alpha (1 - alpha): 0 at both seeds, the same from either end.
[[nodiscard]] inline Eigen::ArrayXd bulge_of(const Eigen::Ref<const Eigen::RowVectorXd>& alpha) {
  return (alpha.array() * (1.0 - alpha.array())).transpose();
}

/// Gaussian processes of several widths and noise levels on one training set, and their average.
/// Each has the covariance k or 1 + k (a Gaussian of both orders, alone or with a constant of equal
/// size) times its form, and white noise: what is far from all samples, as blends of a performer
/// never seen may be, is worth 0 in the first and what the samples have in common in the second.
class ProcessGrid {
 public:
  /// @param samples   D x 2 N scaled features: the blends, then the same told from the other end.
  /// @param alpha     of the N blends, @param weights  of their losses, @param folds  one each.
  /// @param median    distance that relative widths are told in.
  ProcessGrid(const Eigen::MatrixXd& samples, const Eigen::Ref<const Eigen::RowVectorXd>& alpha,
              const Eigen::VectorXd& weights, std::span<const int> folds, double median,
              const std::vector<double>& relative_widths, const std::vector<double>& noise_ratios);

  /// The average of all processes of one width, with and without a constant, and of "nothing at
  /// all", each by its tempered evidence; the width is the one of most evidence. `targets` are not
  /// centred.
  [[nodiscard]] AveragedProcess average(const Eigen::VectorXd& targets, ProcessForm form) const;

 private:
  /// Eigenvectors and values of W^1/2 A K A W^1/2, with A the form's values at the samples.
  struct Spectrum {
    double constant = 0.0;  // summand of K: 0 or 1
    Eigen::VectorXd form;   // A
    Eigen::MatrixXd vectors;
    Eigen::VectorXd values;
  };
  struct Width {
    double relative = 0.0;
    std::array<std::array<Spectrum, 2>, 2> spectra;  // by ProcessForm and constant
  };
  /// What the processes of one spectrum make of the targets, relative to nothing at all.
  struct Share {
    double total = 0.0;            // sum of tempered evidence times prior
    double best = 0.0;             // greatest summand
    double noise_ratio = 0.0;      // of the best
    std::vector<double> summands;  // by noise ratio
  };
  Share share(const Spectrum& spectrum, const Eigen::VectorXd& whitened) const;
  void add(const Spectrum& spectrum, const Share& share, double norm,
           const Eigen::VectorXd& whitened, AveragedProcess& result) const;

  Eigen::VectorXd root_weights_;         // N
  std::vector<std::vector<int>> folds_;  // samples of each
  double median_;
  double bulge_unit_ = 1.0;  // times b(alpha) has mean square 1: both forms are of one size
  std::vector<double> noise_ratios_;
  std::vector<Width> widths_;
};

}  // namespace laban::effort
