#include "laban/align/content_groups.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"

#include "align/lane_frames.h"
#include "align/local_distance.h"

namespace laban::align {
namespace {

using base::Error;
using base::ErrorKind;

void require_distances(const Eigen::Ref<const Eigen::MatrixXd>& distances, const char* place) {
  if (distances.rows() < 1 || distances.rows() != distances.cols() || !distances.allFinite() ||
      (distances - distances.transpose()).cwiseAbs().maxCoeff() >
          1e-9 * distances.cwiseAbs().maxCoeff()) {
    throw Error(ErrorKind::kData,
                std::string(place) + ": distances are " + std::to_string(distances.rows()) + " x " +
                    std::to_string(distances.cols()) + " (must be square, symmetric and finite)");
  }
}

// Groups alive and the mean distances between their members.
struct Linkage {
  Eigen::MatrixXd distance;       // N x N; rows of dead groups are unused
  std::vector<int> size;          // members of a group, 0 once joined to another
  std::vector<std::size_t> into;  // item -> group, by its first item

  explicit Linkage(const Eigen::Ref<const Eigen::MatrixXd>& distances)
      : distance(distances),
        size(static_cast<std::size_t>(distances.rows()), 1),
        into(static_cast<std::size_t>(distances.rows())) {
    std::iota(into.begin(), into.end(), std::size_t{0});
  }

  struct Nearest {
    std::size_t a = 0;
    std::size_t b = 0;
    double distance = math::kInfinity;
  };

  [[nodiscard]] double& between(std::size_t a, std::size_t b) {
    return distance(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
  }

  [[nodiscard]] Nearest nearest_two() {
    Nearest best;
    for (std::size_t a = 0; a < size.size(); ++a) {
      for (std::size_t b = a + 1; size[a] > 0 && b < size.size(); ++b) {
        if (size[b] > 0 && between(a, b) < best.distance) best = {a, b, between(a, b)};
      }
    }
    return best;
  }

  // Average linkage: the mean distance of a union is the mean of its parts', by their sizes.
  void join(std::size_t a, std::size_t b) {
    const double share_a = static_cast<double>(size[a]) / (size[a] + size[b]);
    for (std::size_t c = 0; c < size.size(); ++c) {
      const double mean = share_a * between(a, c) + (1.0 - share_a) * between(b, c);
      between(a, c) = mean;
      between(c, a) = mean;
    }
    size[a] += size[b];
    size[b] = 0;
    std::replace(into.begin(), into.end(), b, a);
  }
};

// Groups numbered by their first items.
std::vector<int> numbered(const std::vector<std::size_t>& into) {
  std::vector<int> number(into.size(), -1);
  std::vector<int> groups;
  int count = 0;
  for (const std::size_t first : into) {
    if (number[first] < 0) number[first] = count++;
    groups.push_back(number[first]);
  }
  return groups;
}

// Distances between the members of one group: of each pair, and of each member to its nearest.
struct Inside {
  std::vector<double> pairs;
  std::vector<double> nearest;
};

Inside inside_group(const Eigen::Ref<const Eigen::MatrixXd>& mean_cost, std::span<const int> groups,
                    int group) {
  Inside result;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    double nearest = math::kInfinity;
    for (std::size_t j = 0; j < groups.size(); ++j) {
      if (i == j || groups[i] != group || groups[j] != group) continue;
      const double cost = mean_cost(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      nearest = std::min(nearest, cost);
      if (i < j && cost < math::kInfinity) result.pairs.push_back(cost);
    }
    if (nearest < math::kInfinity) result.nearest.push_back(nearest);
  }
  return result;
}

// A fragment beside the fragments of a group, all by their places.
struct GroupOfPairs {
  std::size_t place;
  std::size_t group_begin;
};

// All fragments by falling length, as rows and as lanes. Groups of lanes begin at every half group:
// a fragment is aligned with those after it, and so wastes few lanes on those before.
struct PackedFragments {
  const LaneKernels& kernels = lane_kernels();
  const std::size_t lanes = static_cast<std::size_t>(kernels.lanes);
  Scaling scaling;
  std::vector<int> order;           // fragment at each place
  std::vector<PackedRows> rows;     // one a place
  std::vector<PackedLanes> groups;  // from place n lanes / 2 on

  explicit PackedFragments(std::span<const Eigen::MatrixXd> features)
      : scaling(Scaling::of(features)), order(longest_first(features)) {
    std::vector<Eigen::MatrixXf> scaled;
    for (const int i : order) {
      scaled.push_back(scaling.apply(features[static_cast<std::size_t>(i)]));
      rows.emplace_back(scaled.back(), kernels);
    }
    for (std::size_t begin = 0; begin < scaled.size(); begin += lanes / 2) {
      std::vector<const Eigen::MatrixXf*> group;
      for (std::size_t n = begin; n < std::min(begin + lanes, scaled.size()); ++n) {
        group.push_back(&scaled[n]);
      }
      groups.emplace_back(group, kernels);
    }
  }

  [[nodiscard]] const PackedLanes& group(std::size_t begin) const {
    return groups[begin / (lanes / 2)];
  }

  // Every pair of places once.
  [[nodiscard]] std::vector<GroupOfPairs> work() const {
    std::vector<GroupOfPairs> work;
    const std::size_t half = lanes / 2;
    for (std::size_t place = 0; place + 1 < order.size(); ++place) {
      const std::size_t first = (place + 1) / half * half;
      for (std::size_t begin = first; begin < order.size(); begin += lanes) {
        work.push_back({place, begin});
      }
    }
    return work;
  }
};

void align_group(const PackedFragments& packed, const GroupOfPairs& work, PairCosts& costs) {
  const PackedRows& x = packed.rows[work.place];
  const PackedLanes& y = packed.group(work.group_begin);
  const std::size_t count = std::min(packed.lanes, packed.order.size() - work.group_begin);
  const int i = packed.order[work.place];
  std::array<bool, kMostLanes> swapped = {};  // ties as in dtw(features[lower], features[higher])
  for (std::size_t l = 0; l < count; ++l) swapped[l] = packed.order[work.group_begin + l] < i;
  LaneDtw dtw(packed.kernels, y.frame_count());
  dtw.begin(x, y, swapped.data());
  while (dtw.advance()) continue;
  for (std::size_t l = 0; l < count; ++l) {
    const std::size_t place = work.group_begin + l;
    if (place <= work.place) continue;
    const int j = packed.order[place];
    const int last = packed.rows[place].frame_count() - 1;
    const double cost = packed.scaling.unscaled_cost(dtw.cost(static_cast<int>(l), last));
    costs.cost(i, j) = costs.cost(j, i) = cost;
    costs.mean_cost(i, j) = costs.mean_cost(j, i) = cost / dtw.length(static_cast<int>(l), last);
  }
}

}  // namespace

PairCosts all_pair_costs(std::span<const Eigen::MatrixXd> features, int threads) {
  for (std::size_t i = 0; i < features.size(); ++i) {
    const std::string place = "all_pair_costs: fragment " + std::to_string(i);
    require_sequence(features[i], place);
    require_same_rows(features[i].rows(), features[0].rows(), place);
  }
  const auto count = static_cast<Eigen::Index>(features.size());
  PairCosts costs{Eigen::MatrixXd::Zero(count, count), Eigen::MatrixXd::Zero(count, count)};
  if (features.empty()) return costs;
  const PackedFragments packed(features);
  const std::vector<GroupOfPairs> work = packed.work();
  math::parallel_for(static_cast<int>(work.size()), threads,
                     [&](int n) { align_group(packed, work[static_cast<std::size_t>(n)], costs); });
  return costs;
}

Eigen::MatrixXd locally_scaled(const Eigen::Ref<const Eigen::MatrixXd>& mean_cost, int neighbors) {
  require_distances(mean_cost, "locally_scaled");
  const Eigen::Index count = mean_cost.rows();
  if (neighbors < 1 || count < 2) {
    throw Error(ErrorKind::kUsage, "locally_scaled: " + std::to_string(neighbors) +
                                       " neighbors of " + std::to_string(count) +
                                       " fragments (must be >= 1 of >= 2)");
  }
  const Eigen::Index rank = std::min<Eigen::Index>(neighbors, count - 1);  // rank 0 is itself
  const double floor = 1e-12 * mean_cost.maxCoeff() + std::numeric_limits<double>::min();
  Eigen::ArrayXd scale(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    Eigen::VectorXd row = mean_cost.row(i).transpose();
    row(i) = -math::kInfinity;
    std::nth_element(row.data(), row.data() + rank, row.data() + count);
    scale(i) = std::sqrt(std::max(row(rank), floor));
  }
  const Eigen::ArrayXXd scales = (scale.matrix() * scale.matrix().transpose()).array();
  return (mean_cost.array() / scales).sqrt().matrix();
}

std::vector<std::string> ClusterOptions::problems() const {
  std::vector<std::string> found;
  if (group_count.has_value() == threshold.has_value()) {
    found.emplace_back("ClusterOptions: exactly one of group_count and threshold must be given");
  }
  if (group_count.has_value() && *group_count < 1) {
    found.push_back("ClusterOptions::group_count = " + std::to_string(*group_count) +
                    " (must be >= 1)");
  }
  if (threshold.has_value() && !(*threshold >= 0.0)) {
    found.push_back("ClusterOptions::threshold = " + std::to_string(*threshold) +
                    " (must be >= 0)");
  }
  return found;
}

std::vector<int> content_groups(const Eigen::Ref<const Eigen::MatrixXd>& distances,
                                const ClusterOptions& options) {
  std::vector<std::string> problems = options.problems();
  if (options.group_count.value_or(1) > distances.rows()) {
    problems.push_back("ClusterOptions::group_count = " + std::to_string(*options.group_count) +
                       " (must be at most the " + std::to_string(distances.rows()) + " items)");
  }
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
  require_distances(distances, "content_groups");
  Linkage linkage(distances);
  for (int alive = static_cast<int>(distances.rows()); alive > options.group_count.value_or(1);
       --alive) {
    const Linkage::Nearest nearest = linkage.nearest_two();
    if (options.threshold.has_value() && nearest.distance > *options.threshold) break;
    linkage.join(nearest.a, nearest.b);
  }
  return numbered(linkage.into);
}

std::vector<GroupCostStatistics> group_cost_statistics(
    const Eigen::Ref<const Eigen::MatrixXd>& mean_cost, std::span<const int> groups,
    const MatchThreshold& threshold) {
  if (!(threshold.margin > 0.0 && threshold.percentile >= 0.0 && threshold.percentile <= 100.0)) {
    throw Error(ErrorKind::kUsage,
                "group_cost_statistics: margin must be > 0 and percentile in [0, 100]");
  }
  if (groups.empty() || mean_cost.rows() != static_cast<Eigen::Index>(groups.size()) ||
      mean_cost.cols() != mean_cost.rows() || *std::min_element(groups.begin(), groups.end()) < 0) {
    throw Error(ErrorKind::kData,
                "group_cost_statistics: needs N >= 1 groups from 0 on and N x N costs");
  }
  const int group_count = *std::max_element(groups.begin(), groups.end()) + 1;
  std::vector<GroupCostStatistics> statistics(static_cast<std::size_t>(group_count));
  double dearest = 0.0;
  for (int g = 0; g < group_count; ++g) {
    const Inside inside = inside_group(mean_cost, groups, g);
    if (inside.pairs.empty()) continue;
    const double most = threshold.margin * math::percentile(inside.nearest, threshold.percentile);
    statistics[static_cast<std::size_t>(g)] = {math::median(inside.pairs), most, true};
    dearest = std::max(dearest, most);
  }
  for (GroupCostStatistics& s : statistics) {
    if (!s.has_pairs) s.threshold = dearest > 0.0 ? dearest : math::kInfinity;
  }
  return statistics;
}

}  // namespace laban::align
