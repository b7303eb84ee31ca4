#include "laban/align/unseen_costs.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "laban/align/nearest_fragments.h"
#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/parallel.h"

#include "align/content_scatter.h"

namespace laban::align {
namespace {

using base::Error;
using base::ErrorKind;

// Costs of one performer's fragments to all of their contents, by features that do not know him.
void match(const std::vector<Eigen::MatrixXd>& features, std::span<const int> groups,
           const std::vector<int>& own, Eigen::MatrixXd& costs) {
  const FragmentIndex index(features);
  for (const int i : own) {
    std::vector<int> candidates;
    for (int j = 0; j < static_cast<int>(groups.size()); ++j) {
      if (groups[static_cast<std::size_t>(j)] == groups[static_cast<std::size_t>(i)])
        candidates.push_back(j);
    }
    const int count = static_cast<int>(candidates.size());
    for (const Neighbor& neighbor :
         index.nearest(features[static_cast<std::size_t>(i)], count, candidates).neighbors) {
      costs(i, neighbor.fragment) = neighbor.mean_cost;
    }
  }
}

}  // namespace

Eigen::MatrixXd unseen_costs(std::span<const motion::PoseMatrix> fragments,
                             std::span<const int> groups, std::span<const int> performers,
                             const ContentMetricOptions& options) {
  if (groups.empty()) throw Error(ErrorKind::kUsage, "unseen_costs: no groups");
  const ContentMetric metric = fit_content_metric(fragments, groups, performers, options);
  const std::vector<Eigen::MatrixXd> rows =
      centered_rows(fragments, groups, performers, metric.reference());
  const ContentScatter scatter(rows, groups, performers, options.threads);
  std::map<int, std::vector<int>> fragments_of;
  for (std::size_t i = 0; i < rows.size(); ++i)
    fragments_of[performer_of(performers, i)].push_back(static_cast<int>(i));
  const std::vector<std::pair<int, std::vector<int>>> work(fragments_of.begin(),
                                                           fragments_of.end());
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd costs = Eigen::MatrixXd::Constant(count, count, math::kInfinity);
  math::parallel_for(static_cast<int>(work.size()), options.threads, [&](int n) {
    const auto& [performer, own] = work[static_cast<std::size_t>(n)];
    const std::optional<Eigen::MatrixXd> within = scatter.within(performer);
    const Eigen::MatrixXd map = within ? likelihood_ratio_map(scatter.total(performer), *within,
                                                              options.shrinkage, options.dimensions)
                                       : metric.map();
    std::vector<Eigen::MatrixXd> features;
    for (const Eigen::MatrixXd& one : rows) features.push_back(map * one);
    match(features, groups, own, costs);
  });
  return costs;
}

std::vector<GroupCostStatistics> with_unseen_thresholds(
    std::vector<GroupCostStatistics> statistics, const Eigen::Ref<const Eigen::MatrixXd>& unseen,
    std::span<const int> groups, std::span<const int> performers, double margin) {
  const auto count = static_cast<Eigen::Index>(groups.size());
  const bool fits = unseen.rows() == count && unseen.cols() == count &&
                    (performers.empty() || performers.size() == groups.size()) &&
                    std::all_of(groups.begin(), groups.end(), [&](int group) {
                      return group >= 0 && group < static_cast<int>(statistics.size());
                    });
  if (!fits) throw Error(ErrorKind::kData, "with_unseen_thresholds: sizes or groups do not fit");
  if (!(margin > 0.0)) {
    throw Error(ErrorKind::kUsage, "with_unseen_thresholds: margin must be > 0");
  }
  std::vector<double> dearest(statistics.size(), 0.0);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto group = static_cast<std::size_t>(groups[static_cast<std::size_t>(i)]);
    double nearest = math::kInfinity;
    for (Eigen::Index j = 0; j < count; ++j) {
      if (performer_of(performers, static_cast<std::size_t>(i)) ==
          performer_of(performers, static_cast<std::size_t>(j)))
        continue;
      nearest = std::min(nearest, unseen(i, j));
    }
    if (nearest < math::kInfinity) dearest[group] = std::max(dearest[group], nearest);
  }
  for (std::size_t g = 0; g < statistics.size(); ++g) {
    if (dearest[g] > 0.0) statistics[g].threshold = margin * dearest[g];
  }
  return statistics;
}

}  // namespace laban::align
