#pragma once

#include <span>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/content_groups.h"
#include "laban/align/content_metric.h"
#include "laban/motion/pose_matrix.h"

namespace laban::align {

/// What matches cost under a metric that does not know the one who is matched: entry (i, j) is the
/// mean path cost of fragments i and j of one content under the metric that fit_content_metric
/// learns of all performers but i's (of all, if too little is left: no two fragments of one
/// content). Infinity for two contents.
///
/// A metric is learnt to bring the fragments of one content together, and it brings those together
/// best that it was learnt from: how near they are to each other says too little of how near
/// someone new will be, and which of them are nearest is left to chance.
///
/// @param fragments, groups, performers, options  as fit_content_metric's; groups not empty.
/// @throws as fit_content_metric; Error{kUsage} without groups.
[[nodiscard]] Eigen::MatrixXd unseen_costs(std::span<const motion::PoseMatrix> fragments,
                                           std::span<const int> groups,
                                           std::span<const int> performers,
                                           const ContentMetricOptions& options = {});

/// group_cost_statistics with thresholds for someone new: the dearest, over a group's fragments, of
/// a fragment's unseen cost to its nearest by another performer, times `margin`. A group of one
/// performer keeps its threshold.
///
/// @param unseen      N x N of unseen_costs.
/// @param groups      N group numbers, 0 .. statistics.size() - 1.
/// @param performers  N; empty: everyone his own.
/// @throws Error{kData} if sizes differ; Error{kUsage} unless margin > 0.
[[nodiscard]] std::vector<GroupCostStatistics> with_unseen_thresholds(
    std::vector<GroupCostStatistics> statistics, const Eigen::Ref<const Eigen::MatrixXd>& unseen,
    std::span<const int> groups, std::span<const int> performers, double margin = 1.5);

}  // namespace laban::align
