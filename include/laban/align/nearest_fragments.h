#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Dense>

namespace laban::align {

/// A fragment near a sequence.
struct Neighbor {
  int fragment = 0;
  double cost = 0.0;       ///< SSD
  double mean_cost = 0.0;  ///< SSD / L
};

/// How `FragmentIndex::nearest` searches; the result is the same either way.
struct NearestOptions {
  /// Leave out what lower bounds exclude; false aligns with every fragment to the end.
  bool prune = true;
};

/// What `FragmentIndex::nearest` found.
struct NearestFragments {
  std::vector<Neighbor> neighbors;  ///< nearest first
  double pruned_share = 0.0;        ///< of the cells of all alignments, those never computed
};

/// Fragments prepared for many searches for the ones nearest to a sequence by mean path cost.
///
/// A search aligns with the fragments first that are likely to be near (by alignments of every 8th
/// frame, and before by a few frames' leading coordinates), and then leaves out only what cannot be
/// among the nearest. Fragments are kept in their principal axes; each run of 8 frames has a box
/// around its leading coordinates and around the norm of the others. The distances between the
/// boxes of two sequences, and the cheapest monotone path through them, bound every path cost from
/// below (in the manner of [Keogh05], without a band). What they let through is compared with the
/// sequence by its leading coordinates in 16 bits, their rounding allowed for; a path is given up
/// where it cannot come below the count-th best any more, whatever the boxes let follow. What is
/// left is aligned. Single precision: mean costs within 1e-5 of the mean cell may change places.
/// Immutable.
class FragmentIndex {
 public:
  /// @param fragments  at least one, each D x T_i with one D; they must outlive this.
  /// @throws Error{kData} as dtw. Memory about 4 (D + 23) bytes a frame.
  explicit FragmentIndex(std::span<const Eigen::MatrixXd> fragments);
  ~FragmentIndex();
  FragmentIndex(FragmentIndex&&) noexcept;
  FragmentIndex& operator=(FragmentIndex&&) noexcept;

  /// The `count` fragments nearest to a sequence by mean path cost (SSD / L), nearest first; all of
  /// them if there are fewer. Costs are `dtw`'s to 1e-5 of the mean cell. Ties go to the lowest
  /// index. A fragment is its own nearest, at 0.
  ///
  /// @param features    D x T.
  /// @param count       >= 1.
  /// @param candidates  indices of the fragments to look at; empty looks at all.
  /// @throws Error{kUsage} for count or candidates out of range; Error{kData} as dtw.
  [[nodiscard]] NearestFragments nearest(const Eigen::Ref<const Eigen::MatrixXd>& features,
                                         int count, std::span<const int> candidates = {},
                                         const NearestOptions& options = {}) const;

 private:
  struct Data;
  class Search;
  std::unique_ptr<const Data> data_;
};

/// One search: FragmentIndex(fragments).nearest(features, count, candidates).neighbors.
[[nodiscard]] std::vector<Neighbor> nearest(const Eigen::Ref<const Eigen::MatrixXd>& features,
                                            std::span<const Eigen::MatrixXd> fragments, int count,
                                            std::span<const int> candidates = {});

}  // namespace laban::align
