#pragma once

#include <span>

#include <Eigen/Dense>

#include "laban/effort/style_regressor.h"

namespace laban::effort {

/// v(z) of ErrorSpread at M blends, `z` and `twins` scaled alike.
[[nodiscard]] Eigen::VectorXd unexplained_share(const Eigen::MatrixXd& centers,
                                                const Eigen::MatrixXd& z,
                                                const Eigen::MatrixXd& twins, double width);

/// 1 + v at each of the N training blends as the other folds alone see it.
/// @param centers  D x 2 N, @param folds  N.
[[nodiscard]] Eigen::ArrayXd held_out_novelty(const Eigen::MatrixXd& centers, double width,
                                              std::span<const int> folds);

/// The square root of ErrorSpread's formula; `novelty` is 1 + v.
[[nodiscard]] Eigen::ArrayXd spread_shape(const Eigen::ArrayXd& bulge,
                                          const Eigen::ArrayXd& novelty, double bulge_share,
                                          double bulge_mean_square);

/// Fits bulge_share and unit of one factor to its held-out residuals.
/// @param novelty  of held_out_novelty; the rest of `spread` is already there.
void fit_spread(const Eigen::ArrayXd& bulge, const Eigen::ArrayXd& novelty,
                const Eigen::VectorXd& held_out, int factor, ErrorSpread& spread);

}  // namespace laban::effort
