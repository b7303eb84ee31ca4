#include "laban/manifold/grbf.h"

#include <cmath>

#include "laban/base/error.h"

namespace laban::manifold {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::Matrix2Xd;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr Index kAffineTerms = 3;
// The affine part is free but for what keeps points on a line solvable.
constexpr double kAffineRidge = 1e-12;

Matrix2Xd grid(int a_side) {
  Matrix2Xd centers(2, static_cast<Index>(a_side) * a_side);
  const auto place = [a_side](int i) { return 2.0 * i / (a_side - 1.0) - 1.0; };
  for (int row = 0; row < a_side; ++row) {
    for (int column = 0; column < a_side; ++column) {
      centers.col(static_cast<Index>(row) * a_side + column) << place(column), place(row);
    }
  }
  return centers;
}

Vector2d scaled(const Region& region, const Vector2d& x) {
  return (2.0 * (x - region.low).array() / (region.high - region.low).array() - 1.0).matrix();
}

/// The radial functions of all centres and the affine terms, at a scaled point.
VectorXd basis_at(const GrbfOptions& options, const Matrix2Xd& centers, const Vector2d& x) {
  VectorXd values(centers.cols() + kAffineTerms);
  auto radial = values.head(centers.cols()).array();
  radial = (centers.colwise() - x).colwise().squaredNorm().transpose().array();
  if (options.basis == RadialBasis::kThinPlate) {
    // u^2 log u = u^2 log(u^2) / 2; the smallest normal number stands for 0, where the value is 0.
    radial = 0.5 * radial * radial.max(std::numeric_limits<double>::min()).log();
  } else {
    const double width = options.width * 2.0 / (options.centers_a_side - 1.0);
    radial = (radial * (-0.5 / (width * width))).exp();
  }
  values.tail<kAffineTerms>() << 1.0, x.x(), x.y();
  return values;
}

void check_region(const Region& region) {
  if (!region.low.allFinite() || !region.high.allFinite() ||
      ((region.high - region.low).array() <= 0.0).any()) {
    throw Error(ErrorKind::kData, "Grbf: the region has no inside");
  }
}

/// Orthonormal columns that span the weights w with P'w = 0.
MatrixXd side_condition(const Matrix2Xd& centers) {
  MatrixXd P(centers.cols(), kAffineTerms);
  P << VectorXd::Ones(centers.cols()), centers.transpose();
  const MatrixXd Q = P.householderQr().householderQ();
  return Q.rightCols(centers.cols() - kAffineTerms);
}

}  // namespace

std::vector<std::string> GrbfOptions::problems() const {
  std::vector<std::string> found;
  const auto rule = [&found](bool holds, const std::string& text) {
    if (!holds) found.push_back("GrbfOptions::" + text);
  };
  rule(centers_a_side >= 2 && centers_a_side <= 64,
       "centers_a_side = " + std::to_string(centers_a_side) + " (must be 2 .. 64)");
  rule(width > 0.0 && std::isfinite(width), "width (must be positive)");
  rule(ridge >= 0.0 && std::isfinite(ridge), "ridge (must be >= 0)");
  return found;
}

Grbf::Grbf(GrbfOptions options, const Region& region, MatrixXd coefficients)
    : options_(options), region_(region), B_(std::move(coefficients)) {
  if (const auto problems = options_.problems(); !problems.empty()) {
    throw Error(ErrorKind::kData, problems.front());
  }
  check_region(region_);
  centers_ = grid(options_.centers_a_side);
  if (B_.cols() != centers_.cols() + kAffineTerms || B_.rows() < 1) {
    throw Error(ErrorKind::kData, "Grbf: " + std::to_string(B_.cols()) + " coefficients for " +
                                      std::to_string(centers_.cols()) + " centres and 3 terms");
  }
}

VectorXd Grbf::psi(const Vector2d& x) const {
  return basis_at(options_, centers_, scaled(region_, x));
}

VectorXd Grbf::at(const Vector2d& x) const {
  return B_ * psi(x);
}

VectorXd Grbf::at(const Vector2d& x, int outputs) const {
  return B_.topRows(outputs) * psi(x);
}

MatrixXd Grbf::at_all(const Eigen::Ref<const Matrix2Xd>& x) const {
  return at_all(x, output_count());
}

MatrixXd Grbf::at_all(const Eigen::Ref<const Matrix2Xd>& x, int outputs) const {
  MatrixXd terms(B_.cols(), x.cols());
  for (Index n = 0; n < x.cols(); ++n) terms.col(n) = psi(x.col(n));
  return B_.topRows(outputs) * terms;
}

Vector2d Grbf::affine_inverse(const Eigen::Ref<const VectorXd>& y) const {
  if (y.size() > B_.rows() || y.size() < 1) {
    throw Error(ErrorKind::kData, "Grbf::affine_inverse: " + std::to_string(y.size()) +
                                      " values of " + std::to_string(B_.rows()) + " outputs");
  }
  const auto affine = B_.topRows(y.size()).rightCols<kAffineTerms>();
  const Vector2d inside = affine.rightCols<2>()
                              .colPivHouseholderQr()
                              .solve(y - affine.col(0))
                              .cwiseMax(-1.0)
                              .cwiseMin(1.0);
  return region_.low +
         (0.5 * (inside.array() + 1.0) * (region_.high - region_.low).array()).matrix();
}

Grbf fit_grbf(const Eigen::Ref<const Matrix2Xd>& x, const Eigen::Ref<const MatrixXd>& y,
              const Region& region, const GrbfOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  check_region(region);
  if (x.cols() < 1 || x.cols() != y.cols() || y.rows() < 1 || !x.allFinite() || !y.allFinite()) {
    throw Error(ErrorKind::kData, "fit_grbf: " + std::to_string(x.cols()) + " points and " +
                                      std::to_string(y.cols()) +
                                      " values (must be as many, at least one, and finite)");
  }
  const Matrix2Xd centers = grid(options.centers_a_side);
  const MatrixXd Z = side_condition(centers);
  const Index free = Z.cols();
  MatrixXd A(x.cols(), free + kAffineTerms);
  for (Index n = 0; n < x.cols(); ++n) {
    const VectorXd terms = basis_at(options, centers, scaled(region, x.col(n)));
    A.row(n) << terms.head(centers.cols()).transpose() * Z, terms.tail<kAffineTerms>().transpose();
  }
  const auto samples = static_cast<double>(x.cols());
  MatrixXd normal = A.transpose() * A / samples;
  normal.diagonal().head(free).array() += options.ridge;
  normal.diagonal().tail<kAffineTerms>().array() += kAffineRidge;
  const Eigen::LDLT<MatrixXd> solver(normal);
  const MatrixXd solved = solver.solve(A.transpose() * y.transpose() / samples);
  if (solver.info() != Eigen::Success || !solved.allFinite()) {
    throw Error(ErrorKind::kNumeric, "fit_grbf: the equations cannot be solved; raise the ridge");
  }
  MatrixXd B(y.rows(), centers.cols() + kAffineTerms);
  B << (Z * solved.topRows(free)).transpose(), solved.bottomRows<kAffineTerms>().transpose();
  return {options, region, std::move(B)};
}

}  // namespace laban::manifold
