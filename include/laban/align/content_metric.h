#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/motion/pose_matrix.h"

namespace laban::align {

/// How far two poses are apart (DESIGN 5, "What content distance is").
enum class MetricKind {
  kRaw,      ///< squared difference of the joint angles, the paper's own [Torresani06, eq. 3]
  kContent,  ///< relative to the performer's mean pose, through a linear map learnt from a database
};

/// The joint angles of a capture on the branch of the exponential map nearest to `reference`: one
/// constant shift by whole turns a joint for all frames, never a choice a frame (METHODS 0).
///
/// @param angles     63 x F, unwrapped along time, radians, F >= 1.
/// @param reference  63 values, radians.
[[nodiscard]] Eigen::MatrixXd on_branch_of(const Eigen::Ref<const Eigen::MatrixXd>& angles,
                                           const Eigen::Ref<const Eigen::VectorXd>& reference);

/// Rows of what the content metric looks at: the 63 angles; the height of the hips above the ground
/// in leg lengths, which tells a squat from a bow; the 60 places of the other joints seen from the
/// hips in leg lengths, which tell what hands and feet do whatever joints do it; and how fast the
/// hips travel, sideways and forward in leg lengths a second, which tells a walk from a gesture
/// made standing. Neither place nor heading (METHODS 1.1).
inline constexpr int kContentRowCount = motion::kAngleRowCount + 1 + 60 + 2;

/// A content distance as a linear map: the squared Euclidean distance of two columns of `features`
/// is the distance of the two poses. Immutable.
///
/// Invariant: the map is k x 126, 1 <= k <= 126 (raw: k = 63, the angles themselves), the reference
/// has 63 values, all finite.
class ContentMetric {
 public:
  /// The paper's metric: features are the angles themselves.
  [[nodiscard]] static ContentMetric raw();
  /// @param map        k x 126, acts on the rows above relative to the performer's mean pose.
  /// @param reference  63 values, radians: the pose whose branches the angles are put on.
  /// @throws Error{kData} if a size is wrong or a value is not finite.
  ContentMetric(Eigen::MatrixXd map, Eigen::VectorXd reference);

  [[nodiscard]] MetricKind kind() const noexcept { return kind_; }
  /// k x 126; with `reference` all there is to store.
  [[nodiscard]] const Eigen::MatrixXd& map() const noexcept { return map_; }
  /// 63 values, radians.
  [[nodiscard]] const Eigen::VectorXd& reference() const noexcept { return reference_; }
  [[nodiscard]] int dimension_count() const noexcept { return static_cast<int>(map_.rows()); }

  /// The mean pose of some clips: 126 values, the mean of their rows, angles on the reference's
  /// branches.
  /// @param groups  content of each clip: every content counts the same, whatever was captured more
  ///                often. Empty: every frame counts the same.
  /// @throws Error{kData} if there is no clip; Error{kUsage} if the sizes differ.
  [[nodiscard]] Eigen::VectorXd mean_pose(std::span<const motion::PoseMatrix> clips,
                                          std::span<const int> groups = {}) const;
  /// k x F features of a capture: map (rows - mean_pose), angles on the reference's branches. Raw:
  /// the angles, whatever the mean pose.
  /// @param mean_pose  126 values: of the performer, see `mean_pose`.
  [[nodiscard]] Eigen::MatrixXd features(const motion::PoseMatrix& pose,
                                         const Eigen::Ref<const Eigen::VectorXd>& mean_pose) const;

 private:
  ContentMetric(MetricKind kind, Eigen::MatrixXd map, Eigen::VectorXd reference);
  MetricKind kind_;
  Eigen::MatrixXd map_;        // k x 126; raw: 63 x 63
  Eigen::VectorXd reference_;  // 63, radians
};

/// How `fit_content_metric` learns.
struct ContentMetricOptions {
  /// Share of the within-content scatter replaced by a multiple of the identity, in [0, 1]; 0.1
  /// worked in a trial on real captures (DESIGN 5).
  double shrinkage = 0.1;
  /// Leading dimensions kept, 1 .. 126. On real captures 20 did as well as all (Bandai: 40 of 45
  /// inputs right with 20 and with 63) and make every search three times cheaper.
  int dimensions = 20;
  /// Threads; the result is the same for any number >= 1.
  int threads = 1;

  /// Broken rules, each like "ContentMetricOptions::shrinkage = 2 (must be in [0, 1])".
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Learns the linear map under which frames of one content are near and others far (DESIGN 5).
///
/// S_w: mean outer product of the frame differences along the DTW paths of pairs of one group by
/// two performers (of one performer too, if a group has no other pair); S_t: covariance of all
/// frames. Every pair counts once in its content and every content once in all, so that a content
/// that was captured often does not decide alone what contents have in common. Poses are relative
/// to their performer's mean pose; paths are found by the angles. Each of S_w's blocks, angles,
/// height, places and travel, is shrunk towards a multiple of the identity. The squared distance is
/// the quadratic part of the log-likelihood ratio "same content" against "any two frames", M =
/// S_w^-1 - (2 S_t)^-1 [Koestinger12]; it does better than the sqrt(Lambda) V' of S_t v = lambda
/// S_w v, which overrates the few directions of largest lambda. Rows come by falling lambda; those
/// of lambda <= 1/2 say nothing and are 0. Without two fragments in any group the map only scales
/// each joint to its spread over all frames, and height counts nothing.
///
/// @param fragments   at least one.
/// @param groups      the content of each fragment; equal numbers are one content. Empty: unknown.
/// @param performers  who did each fragment; equal numbers are one performer. Empty: everyone his
///                    own.
/// @throws Error{kUsage} if `options` has problems or sizes differ; Error{kData} if there is no
///         fragment.
[[nodiscard]] ContentMetric fit_content_metric(std::span<const motion::PoseMatrix> fragments,
                                               std::span<const int> groups,
                                               std::span<const int> performers,
                                               const ContentMetricOptions& options = {});

}  // namespace laban::align
