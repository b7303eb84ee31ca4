#pragma once

#include <span>

#include <Eigen/Dense>

#include "laban/align/content_groups.h"
#include "laban/align/content_metric.h"
#include "laban/motion/pose_matrix.h"

namespace laban::align {

/// Thresholds from unseen_costs: what nine of ten performers' fragments are at most from their
/// nearest. An input comes nearer than a fragment does: its mean pose is fitted to the match, and
/// it is cut where that helps. Of single takes of left-out performers (segmentation_study; HDM05)
/// 96 % of the frames then match where the database knows the content, 81 % where it lacks it; with
/// the costs inside the database, of a metric that knows everyone, 86 % and 48 %.
inline constexpr MatchThreshold kUnseenThreshold = {.percentile = 90.0, .margin = 1.0};

/// What matches cost under a metric that does not know the one who is matched: entry (i, j) is the
/// mean path cost of fragments i and j of one content under the metric that fit_content_metric
/// learns of all performers but i's (of all, if no two fragments of one content are left).
/// Infinity where no pair is meant: of two contents; of one performer, where others show the
/// content too.
///
/// A metric is learnt to bring the fragments of one content together, and it brings those together
/// best that it was learnt from: how near they are says too little of how near someone new will be.
///
/// @param fragments, groups, performers, options  as fit_content_metric's; groups not empty.
/// @returns N x N; for group_cost_statistics.
/// @throws as fit_content_metric; Error{kData} without groups.
[[nodiscard]] Eigen::MatrixXd unseen_costs(std::span<const motion::PoseMatrix> fragments,
                                           std::span<const int> groups,
                                           std::span<const int> performers,
                                           const ContentMetricOptions& options = {});

}  // namespace laban::align
