#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/content_metric.h"
#include "laban/align/one_stage_dp.h"
#include "laban/base/progress.h"
#include "laban/motion/pose_matrix.h"

namespace laban::align {

/// The fragments of a database, ready to be matched: their features under one metric, each
/// relative to its performer's mean pose. Immutable.
///
/// Invariant: at least one fragment, all of one frame rate; one group number and one performer
/// number a fragment.
class FragmentSet {
 public:
  /// @param poses       the fragments.
  /// @param groups      content of each fragment.
  /// @param performers  performer of each fragment; a performer's mean pose is taken over all his
  ///                    fragments here, every content counting the same.
  /// @throws Error{kData} if there is no fragment, or sizes or frame rates differ.
  FragmentSet(ContentMetric metric, std::span<const motion::PoseMatrix> poses,
              std::vector<int> groups, std::vector<int> performers);

  /// Of every fragment, Hz.
  [[nodiscard]] double frame_rate_hz() const noexcept { return frame_rate_hz_; }
  [[nodiscard]] const ContentMetric& metric() const noexcept { return metric_; }
  [[nodiscard]] int fragment_count() const noexcept { return static_cast<int>(features_.size()); }
  /// D x T_i features a fragment.
  [[nodiscard]] const std::vector<Eigen::MatrixXd>& features() const noexcept { return features_; }
  [[nodiscard]] const std::vector<int>& groups() const noexcept { return groups_; }
  [[nodiscard]] const std::vector<int>& performers() const noexcept { return performers_; }

 private:
  double frame_rate_hz_;
  ContentMetric metric_;
  std::vector<Eigen::MatrixXd> features_;  // D x T_i
  std::vector<int> groups_;
  std::vector<int> performers_;
};

/// How an input of an unknown performer is matched.
struct SegmentInputOptions {
  SegmentOptions steps = {};  ///< snippet cost and slope limit of the dynamic programming
  /// Most rounds of estimating the input's offset and segmenting again, >= 0; 0 keeps the plain
  /// mean of its frames.
  int offset_rounds = 10;
  /// The rounds look at every k-th frame of input and fragments, k = frame rate / this, rounded
  /// down, at least 1: the offset is an average and does not need every frame. > 0, Hz.
  double offset_rate_hz = 15.0;
  /// Fragments of a content that are asked where it ends and the next one begins, at most; 0 keeps
  /// the boundaries of the path of least cost. Not asked with a slope limit, which a moved boundary
  /// might break, nor with the raw metric. With 20 of them, weighted by how well they fit,
  /// boundaries of left-out performers came nearer to the truth than with 10, no nearer with all
  /// (METHODS 1.5's inputs).
  int boundary_voters = 20;

  /// Broken rules, those of `steps` included; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// An input cut into snippets that each play one fragment.
struct InputSegmentation {
  std::vector<Snippet> snippets;  ///< as Segmentation's; costs in the metric's units
  double cost = 0.0;              ///< as Segmentation's, of the boundaries as they are
  Eigen::MatrixXd features;       ///< D x T: the input's features less their offset, as matched
  int rounds = 0;                 ///< times the offset was estimated
  bool converged = false;         ///< the last round changed no snippet
};

/// Cuts an input of an unknown performer into snippets, each matched to a fragment of the set.
///
/// The performer's mean pose is not known: the mean of the input's frames depends on which actions
/// it holds. So the offset of the input's features is a further unknown beside the path, and their
/// common cost is lowered in turn: given the path, the best offset is the mean difference between
/// the input and fragment frames of its cells; given the offset, the best path is `segment`'s. It
/// starts from several guesses, at 5 frames a second: the mean of the input's frames is the
/// performer's (true if the input holds all that the database does), or it is that of one content
/// (true if the input holds that alone), which is believed where it ends at less than 0.7 of the
/// cost. The guess is followed at offset_rate_hz until no snippet changes; the cost (of the frames
/// that the rounds look at) never rises. A last segmentation takes every frame. Then each boundary
/// between two contents moves, at most 1 s, to where the boundary_voters nearest fragments of
/// either agree best, by every k-th frame again: the mean of their path costs decides, those that
/// fit well counting most, and of places that are as good the one where the input moves less.
/// With the raw metric nothing is estimated and no boundary moves, as in the paper.
///
/// @param input  at the fragments' frame rate.
/// @returns nothing if the slope limit leaves no path.
/// @throws Error{kUsage} if `options` has problems, or "interrupted" if progress asks; Error{kData}
///         as `segment`, or if the frame rates differ.
[[nodiscard]] std::optional<InputSegmentation> segment_input(
    const motion::PoseMatrix& input, const FragmentSet& fragments,
    const SegmentInputOptions& options = {}, base::Progress* progress = nullptr);

}  // namespace laban::align
