#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/content_metric.h"
#include "laban/align/one_stage_dp.h"
#include "laban/motion/pose_matrix.h"

namespace laban::align {

/// The fragments of a database, ready to be matched: their features under one metric, each
/// relative to its performer's mean pose. Immutable.
///
/// Invariant: at least one fragment; one group number and one performer number a fragment.
class FragmentSet {
 public:
  /// @param poses       the fragments.
  /// @param groups      content of each fragment.
  /// @param performers  performer of each fragment; a performer's mean pose is taken over all his
  ///                    fragments here.
  /// @throws Error{kData} if there is no fragment or sizes differ.
  FragmentSet(ContentMetric metric, std::span<const motion::PoseMatrix> poses,
              std::vector<int> groups, std::vector<int> performers);

  [[nodiscard]] const ContentMetric& metric() const noexcept { return metric_; }
  [[nodiscard]] int fragment_count() const noexcept { return static_cast<int>(features_.size()); }
  /// D x T_i features a fragment.
  [[nodiscard]] const std::vector<Eigen::MatrixXd>& features() const noexcept { return features_; }
  [[nodiscard]] const std::vector<int>& groups() const noexcept { return groups_; }
  [[nodiscard]] const std::vector<int>& performers() const noexcept { return performers_; }
  /// Mean pose of a fragment's performer, 63 values, radians.
  [[nodiscard]] const Eigen::VectorXd& mean_pose(int fragment) const;

 private:
  ContentMetric metric_;
  std::vector<Eigen::MatrixXd> features_;  // D x T_i
  std::vector<int> groups_;
  std::vector<int> performers_;
  std::vector<Eigen::VectorXd> mean_poses_;  // a fragment, 63 each
};

/// How an input of an unknown performer is matched.
struct SegmentInputOptions {
  SegmentOptions steps;  ///< snippet cost and slope limit of the dynamic programming
  /// Rounds of estimating the input's mean pose and segmenting again, >= 0; 0 uses the plain mean
  /// of its frames.
  int offset_rounds = 5;
};

/// An input cut into snippets that each play one fragment.
struct InputSegmentation {
  std::vector<Snippet> snippets;  ///< as Segmentation's; costs in the metric's units
  double cost = 0.0;
  Eigen::VectorXd mean_pose;  ///< 63 values: the input's own, as used in the last round
  Eigen::MatrixXd features;   ///< D x T: the input's features with that mean pose
  int rounds = 0;             ///< segmentations done
  bool converged = false;     ///< the last round changed no snippet
};

/// Cuts an input of an unknown performer into snippets, each matched to a fragment of the set.
///
/// The performer's mean pose is not known: the mean of the input's frames depends on which actions
/// it holds. It starts as that mean; after each segmentation it is estimated again from the
/// alignment, as the mean difference between input frames and the fragment frames they lie beside,
/// and the input is segmented again until no snippet changes or the rounds are used up.
///
/// @returns nothing if the slope limit leaves no path.
/// @throws Error{kData}, Error{kUsage} as `segment`; Error{kUsage} if offset_rounds < 0.
[[nodiscard]] std::optional<InputSegmentation> segment_input(
    const motion::PoseMatrix& input, const FragmentSet& fragments,
    const SegmentInputOptions& options = {});

}  // namespace laban::align
