#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

namespace laban::manifold {

/// Radial basis: u^2 log u (0 at u = 0), or exp(-u^2 / (2 width^2)).
enum class RadialBasis { kThinPlate, kGaussian };

struct GrbfOptions {
  RadialBasis basis = RadialBasis::kThinPlate;
  int centers_a_side = 15;  ///< on a square grid over the region, 2 .. 64 [Manifold 5.1]
  /// Of the Gaussian basis, in distances between neighbouring centres, > 0.
  double width = 1.5;
  /// Added to the diagonal of the normal equations of the mean squared error, in units of the
  /// region scaled to [-1, 1], >= 0; the affine part is free of it.
  double ridge = 1e-7;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// A rectangle of the plane on which a map is defined.
struct Region {
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  Eigen::Vector2d high = Eigen::Vector2d::Ones();
};

/// Generalised radial basis functions from the plane to M-vectors [Poggio90; Manifold eq. 1-2]:
/// y = B psi(x), psi = (phi(|x - c_1|) .. phi(|x - c_n|), 1, x_1, x_2). Immutable once fitted.
class Grbf {
 public:
  /// @param coefficients  M x (centers_a_side^2 + 3).
  /// @throws Error{kData} if sizes disagree or the region is empty.
  Grbf(GrbfOptions options, const Region& region, Eigen::MatrixXd coefficients);

  [[nodiscard]] int output_count() const noexcept { return static_cast<int>(B_.rows()); }
  [[nodiscard]] const GrbfOptions& options() const noexcept { return options_; }
  [[nodiscard]] const Region& region() const noexcept { return region_; }
  [[nodiscard]] const Eigen::MatrixXd& coefficients() const noexcept { return B_; }

  /// M values at a point, inside the region or not. Time O(M * centres).
  [[nodiscard]] Eigen::VectorXd at(const Eigen::Vector2d& x) const;
  /// The first `outputs` of them only.
  [[nodiscard]] Eigen::VectorXd at(const Eigen::Vector2d& x, int outputs) const;
  /// M x N values at 2 x N points.
  [[nodiscard]] Eigen::MatrixXd at_all(const Eigen::Ref<const Eigen::Matrix2Xd>& x) const;
  /// The first `outputs` of them only.
  [[nodiscard]] Eigen::MatrixXd at_all(const Eigen::Ref<const Eigen::Matrix2Xd>& x,
                                       int outputs) const;
  /// The point whose affine part comes nearest to the first y.size() outputs, clamped to the
  /// region: the paper's approximate inverse by the polynomial part. @throws Error{kData} if y has
  /// more values than there are outputs.
  [[nodiscard]] Eigen::Vector2d affine_inverse(const Eigen::Ref<const Eigen::VectorXd>& y) const;

 private:
  [[nodiscard]] Eigen::VectorXd psi(const Eigen::Vector2d& x) const;

  GrbfOptions options_;
  Region region_;
  Eigen::Matrix2Xd centers_;  // scaled to [-1, 1]
  Eigen::MatrixXd B_;
};

/// Fits all outputs at once by least squares with a small ridge; the weights w of the radial
/// functions keep the side condition P'w = 0, P the affine terms at the centres, so the affine part
/// is the map's own trend.
///
/// @param x  2 x N points, @param y  M x N values, N >= 1.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if sizes differ, there is no
///         sample, a value is not finite or the region is empty; Error{kNumeric} if the equations
///         cannot be solved (all points on a line: raise the ridge).
[[nodiscard]] Grbf fit_grbf(const Eigen::Ref<const Eigen::Matrix2Xd>& x,
                            const Eigen::Ref<const Eigen::MatrixXd>& y, const Region& region,
                            const GrbfOptions& options = {});

}  // namespace laban::manifold
