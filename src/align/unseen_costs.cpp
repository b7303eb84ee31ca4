#include "laban/align/unseen_costs.h"

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

// The fragments that show i's content: those of other performers, if there are any, else all.
std::vector<int> comparable(std::size_t i, std::span<const int> groups,
                            std::span<const int> performers) {
  std::vector<int> own;
  std::vector<int> others;
  for (std::size_t j = 0; j < groups.size(); ++j) {
    if (j == i || groups[j] != groups[i]) continue;
    const bool by_one = performer_of(performers, i) == performer_of(performers, j);
    (by_one ? own : others).push_back(static_cast<int>(j));
  }
  return others.empty() ? own : others;
}

}  // namespace

Eigen::MatrixXd unseen_costs(std::span<const motion::PoseMatrix> fragments,
                             std::span<const int> groups, std::span<const int> performers,
                             const ContentMetricOptions& options) {
  base::require_none(options.problems());
  if (fragments.empty() || groups.empty())
    throw Error(ErrorKind::kData, "unseen_costs: no fragments, or no groups");
  require_sizes(fragments.size(), groups.size(), "groups", "unseen_costs");
  require_sizes(fragments.size(), performers.size(), "performers", "unseen_costs");
  const auto count = static_cast<Eigen::Index>(fragments.size());
  Eigen::MatrixXd costs = Eigen::MatrixXd::Constant(count, count, math::kInfinity);
  const std::vector<Eigen::MatrixXd> rows =
      centered_rows(fragments, groups, performers, common_reference(fragments));
  const ContentScatter scatter(rows, groups, performers, options.threads);
  const std::optional<Eigen::MatrixXd> within_all = scatter.within();
  if (!within_all) return costs;  // no two of one content
  std::map<int, std::vector<std::size_t>> fragments_of;
  for (std::size_t i = 0; i < rows.size(); ++i)
    fragments_of[performer_of(performers, i)].push_back(i);
  const std::vector<std::pair<int, std::vector<std::size_t>>> work(fragments_of.begin(),
                                                                   fragments_of.end());
  math::parallel_for(static_cast<int>(work.size()), options.threads, [&](int n) {
    const auto& [performer, own] = work[static_cast<std::size_t>(n)];
    const std::optional<Eigen::MatrixXd> within = scatter.within(performer);
    const Eigen::MatrixXd map =
        likelihood_ratio_map(within ? scatter.total(performer) : scatter.total(),
                             within ? *within : *within_all, options.shrinkage, options.dimensions);
    std::vector<Eigen::MatrixXd> features;
    for (const Eigen::MatrixXd& one : rows) features.push_back(map * one);
    const FragmentIndex index(features);
    for (const std::size_t i : own) {
      const std::vector<int> others = comparable(i, groups, performers);
      if (others.empty()) continue;
      const auto found = index.nearest(features[i], static_cast<int>(others.size()), others);
      for (const Neighbor& neighbor : found.neighbors)
        costs(static_cast<Eigen::Index>(i), neighbor.fragment) = neighbor.mean_cost;
    }
  });
  return costs;
}

}  // namespace laban::align
