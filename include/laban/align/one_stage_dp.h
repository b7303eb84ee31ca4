#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/progress.h"

namespace laban::align {

/// A run of input frames that plays one fragment from its first frame to its last.
struct Snippet {
  int begin = 0;        ///< first input frame
  int end = 0;          ///< one past the last input frame
  int fragment = 0;     ///< index of the fragment it plays
  double cost = 0.0;    ///< sum of local distances along its path (no snippet cost)
  int path_length = 0;  ///< cells of its path

  /// cost / path_length: mean local distance of a path cell.
  [[nodiscard]] double mean_cost() const noexcept { return cost / path_length; }
};

/// What a segmentation may do beyond the paper; the defaults are the paper's own rules.
struct SegmentOptions {
  /// Added once a snippet, in units of the local distance; >= 0. Discourages many short snippets.
  double snippet_cost = 0.0;
  /// A snippet may run at most this many times faster or slower than its fragment, everywhere
  /// along it; >= 2. nullopt: free steps.
  std::optional<int> slope_limit = std::nullopt;

  /// Broken rules, each like "SegmentOptions::snippet_cost = -1 (must be >= 0)"; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// An input cut into snippets.
struct Segmentation {
  std::vector<Snippet> snippets;  ///< in input order; they cover the input without gap or overlap
  double cost = 0.0;              ///< sum of the snippets' costs and of the snippet costs
};

/// The cheapest way to play a whole input as a chain of whole fragments: one-stage dynamic
/// programming  [Torresani06, eq. 8-11; Ney84; METHODS 1.5].
///
/// At (p, 0, i) a path comes from (p-1, 0, i) or from the last frame of any fragment at p-1; at
/// (p, q > 0, i) from (p-1, q, i), (p-1, q-1, i) or (p, q-1, i). With a slope limit s a path may
/// hold a fragment's frame, (p-1, q), or skip on, (p, q-1), only after a diagonal step or an entry,
/// and at most s - 1 times in a row: a fragment of n frames covers ceil(n / s) to n s input frames.
///
/// @param input      D x T, a column is a frame, T >= 1.
/// @param fragments  at least one, each D x T_i, T_i >= 1.
/// @returns nothing if the slope limit leaves no path (an input of too few frames for any chain);
///          always a value with free steps.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if a sequence is empty, D differs
///         or a value is not finite; Error{kUsage} "interrupted" if progress asks.
/// Time O(D T S), S = sum of T_i; memory O(T + D S), beside the input's own. Ties: as in dtw;
/// staying in a fragment before entering a new one; the lowest fragment index. With free steps the
/// snippets are found in single precision (chains within about 1e-5 of the mean cell of each other
/// are ties), and their costs are those of dtw in double precision.
[[nodiscard]] std::optional<Segmentation> segment(const Eigen::Ref<const Eigen::MatrixXd>& input,
                                                  std::span<const Eigen::MatrixXd> fragments,
                                                  const SegmentOptions& options = {},
                                                  base::Progress* progress = nullptr);

}  // namespace laban::align
