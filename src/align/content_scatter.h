#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/motion/pose_matrix.h"

namespace laban::align {

/// @throws Error{kUsage} "place: 3 groups for 4 fragments" if some were given, but not as many.
void require_sizes(std::size_t fragments, std::size_t given, const std::string& what,
                   const std::string& place);

/// Who did a fragment; where performers are not known everyone his own.
[[nodiscard]] inline int performer_of(std::span<const int> performers, std::size_t fragment) {
  return performers.empty() ? static_cast<int>(fragment) : performers[fragment];
}

/// kContentRowCount x F: angles on the reference's branches, height, places, travel.
[[nodiscard]] Eigen::MatrixXd content_rows(const motion::PoseMatrix& pose,
                                           const Eigen::VectorXd& reference);

/// A pose from which few clips are whole turns away, 63 values: the median of the clips' mean
/// poses, then the mean of what that puts on one branch.
[[nodiscard]] Eigen::VectorXd common_reference(std::span<const motion::PoseMatrix> clips);

/// The mean of all columns; with groups, of every group's mean.
[[nodiscard]] Eigen::VectorXd row_mean(std::span<const Eigen::MatrixXd> sequences,
                                       std::span<const int> groups = {});

/// The fragments' content_rows, each less its performer's mean pose, every content counting the
/// same. `groups` and `performers` as fit_content_metric's.
[[nodiscard]] std::vector<Eigen::MatrixXd> centered_rows(
    std::span<const motion::PoseMatrix> fragments, std::span<const int> groups,
    std::span<const int> performers, const Eigen::VectorXd& reference);

/// What the content metric is learnt from, kept by performer, so that any one can be left out.
class ContentScatter {
 public:
  /// @param rows  centered_rows; the rest as fit_content_metric's.
  ContentScatter(std::span<const Eigen::MatrixXd> rows, std::span<const int> groups,
                 std::span<const int> performers, int threads);

  /// S_t, the covariance of all frames: of every content counting the same, if contents are known.
  /// At least one performer must be left.
  [[nodiscard]] Eigen::MatrixXd total(std::optional<int> without = std::nullopt) const;
  /// S_w, see fit_content_metric; nullopt if no two fragments show one content.
  [[nodiscard]] std::optional<Eigen::MatrixXd> within(
      std::optional<int> without = std::nullopt) const;

 private:
  struct Moments {
    Eigen::MatrixXd outer;  // sum of x x'
    Eigen::VectorXd sum;
    double frames = 0.0;
  };
  struct Pairs {
    Eigen::MatrixXd scatter;  // sum over pairs
    double count = 0.0;
  };
  struct Content {
    std::map<int, Moments> moments;  // of each performer
    Pairs pairs;                     // all of them
    std::map<int, Pairs> pairs_of;   // those in which a performer takes part
  };

  static void add_pairs(std::span<const Eigen::MatrixXd> rows, std::span<const int> performers,
                        const std::vector<std::size_t>& members, Content& content);

  std::map<int, Content> contents_;
};

/// The k x kContentRowCount map of fit_content_metric from S_t and S_w.
/// @throws Error{kNumeric} if S_w has no square root.
[[nodiscard]] Eigen::MatrixXd likelihood_ratio_map(const Eigen::MatrixXd& total,
                                                   const Eigen::MatrixXd& within, double shrinkage,
                                                   int dimensions);

}  // namespace laban::align
