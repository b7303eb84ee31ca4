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

/// From one texton to the next, as the corpus did it once: `leaving` is a segment of the first,
/// `entering` one of the second, and the one follows the other in a take unless it is a jump.
struct TextonChange {
  int leaving = 0;
  int entering = 0;
  bool jump = false;
};

/// A random walk over textons, endless (METHODS 2.3, Texton path (a)).
///
/// The next texton is drawn from the row of M, then one of the corpus' own changes between the two.
/// Where a row is zero, or holds the texton itself alone and a take ended with it, nothing is known
/// to follow: then the walk jumps to a segment whose first two frames are nearest to the last two
/// of a segment of this texton, of another texton that others follow (of any, if there is none).
class TextonWalk {
 public:
  /// @param texture  must outlive the walk; at least one segment.
  /// @param first    texton to begin with; nullopt: drawn as often as it has segments.
  /// @throws Error{kUsage} if there is no such texton, or it has no segment.
  TextonWalk(const MotionTexture& texture, std::optional<int> first, base::Rng rng);

  [[nodiscard]] int texton() const noexcept { return texton_; }
  /// A segment of the texton now walked on, drawn at random.
  [[nodiscard]] int any_segment();
  [[nodiscard]] TextonChange next();
  /// The same with a given texton to go to; a jump if it never followed.
  [[nodiscard]] TextonChange go_to(int texton);

 private:
  [[nodiscard]] bool follows(int segment) const;
  [[nodiscard]] TextonChange nearest_change(std::optional<int> to) const;
  [[nodiscard]] std::optional<TextonChange> drawn_change(std::optional<int> to);

  const MotionTexture& texture_;
  std::vector<std::vector<int>> segments_;  // of each texton
  int texton_ = 0;
  std::vector<int> visits_;  // of each texton
  base::Rng rng_;
};

}  // namespace laban::texture
