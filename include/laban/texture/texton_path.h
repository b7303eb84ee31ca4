#pragma once

#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/rng.h"
#include "laban/texture/motion_texture.h"

namespace laban::texture {

/// What a path must not and must pass.
struct PathRules {
  std::vector<int> avoid;  ///< textons that are not on it
  std::vector<int> via;    ///< textons that are, in this order
};

/// -log of the probability of a path's transitions; infinite if one of them is not known.
[[nodiscard]] double path_cost(const Eigen::MatrixXd& transitions, const std::vector<int>& path);

/// The cheapest path, its ends included ([Li02, eq. 5], the printed sign corrected: Dijkstra on
/// -log M). No texton follows itself on it (repeat_textons does that), and each leg between `via`s
/// is the cheapest.
/// @param transitions  Nt x Nt, row = from.
/// @returns nullopt if there is none.
/// @throws Error{kUsage} if a texton is not of 0 .. Nt - 1, or to be avoided and passed.
/// Time O(Nt^2) a leg; ties go to lower numbers.
[[nodiscard]] std::optional<std::vector<int>> cheapest_path(const Eigen::MatrixXd& transitions,
                                                            int from, int to,
                                                            const PathRules& rules = {});

/// The cheapest path of exactly `count` textons, self-transitions allowed: dynamic programming over
/// walks. `via` textons come in their order, each at a place of its own, at the ends too.
/// @returns nullopt if there is none.
/// @throws as cheapest_path; Error{kUsage} unless count >= 1.
/// Time O(count Nt^2 (1 + vias)).
[[nodiscard]] std::optional<std::vector<int>> path_of_length(const Eigen::MatrixXd& transitions,
                                                             int from, int to, int count,
                                                             const PathRules& rules = {});

/// Every texton of a path once and then again as often as its self-transition says: n more with
/// probability M_ii^n (1 - M_ii). One that nothing but itself ever followed is not repeated.
[[nodiscard]] std::vector<int> repeat_textons(const Eigen::MatrixXd& transitions,
                                              const std::vector<int>& path, base::Rng& rng);

}  // namespace laban::texture
