#pragma once

#include <optional>

#include <Eigen/Dense>

namespace laban::loop {

/// Mean over all pairs of different frames of sum_k ||M_i(k) - M_j(k)||: the natural scale of
/// l2_similarity. At most 500 frames, evenly spread, are compared. 0 if all frames are equal.
/// @param angles  3K x F, radians: three rows a joint.
/// @throws Error{kData} if there is no frame or the rows are not triples.
[[nodiscard]] double mean_l2_distance(const Eigen::Ref<const Eigen::MatrixXd>& angles);

/// The paper's baseline [Graphcut, eq. 1]: D_ij = exp(-sum_k ||M_i(k) - M_j(k)|| / sigma), a
/// similarity in (0, 1], 1 on the diagonal.
///
/// @param angles  3K x F exponential maps, radians: M_i(k) are rows 3k .. 3k + 2 of column i.
/// @param sigma   > 0, radians; nullopt: mean_l2_distance (or 1 where that is 0).
/// @returns F x F, symmetric.
/// @throws Error{kUsage} for sigma <= 0; Error{kData} as mean_l2_distance. O(F^2 K).
[[nodiscard]] Eigen::MatrixXd l2_similarity(const Eigen::Ref<const Eigen::MatrixXd>& angles,
                                            std::optional<double> sigma = std::nullopt);

/// The diagonal of C in [Graphcut, eq. 2]: the variance of each row's velocity dM/dt, floored at
/// one hundredth of the rows' mean (a joint that hardly moves would otherwise outweigh all). All
/// ones if nothing moves.
/// @param angles  D x F, radians; frame_rate_hz > 0.
/// @returns D values, rad^2/s^2. @throws Error{kData} if there is no frame.
[[nodiscard]] Eigen::VectorXd velocity_variance(const Eigen::Ref<const Eigen::MatrixXd>& angles,
                                                double frame_rate_hz);

/// [Graphcut, eq. 2]: D_ij = (M_i - M_j)' C^-1 (M_i - M_j), C diagonal.
/// @param variance  the diagonal of C, D values > 0.
/// @returns F x F, symmetric, 0 on the diagonal.
/// @throws Error{kData} if sizes differ or a variance is not positive. O(F^2 D).
[[nodiscard]] Eigen::MatrixXd mahalanobis_distance(const Eigen::Ref<const Eigen::MatrixXd>& angles,
                                                   const Eigen::VectorXd& variance);

}  // namespace laban::loop
