#include "laban/transfer/style_model.h"

#include <algorithm>
#include <optional>

#include "laban/align/unseen_costs.h"
#include "laban/base/error.h"
#include "laban/math/parallel.h"

namespace laban::transfer {
namespace {

using base::Error;
using base::ErrorKind;

/// Measures of the fragments, and what is usual among them.
struct Observer {
  std::vector<effort::Descriptors> descriptors;
  effort::ObserverReference reference;
};

Observer fit_observer(std::span<const Fragment> fragments, int threads) {
  std::vector<effort::Descriptors> descriptors(fragments.size());
  math::parallel_for(static_cast<int>(fragments.size()), threads, [&](int i) {
    const auto cell = static_cast<std::size_t>(i);
    descriptors[cell] = effort::describe(fragments[cell].pose);
  });
  std::vector<std::string> groups;
  for (const Fragment& fragment : fragments) groups.push_back(fragment.content);
  effort::ObserverReference reference = effort::fit_observer_reference(descriptors, groups);
  return {std::move(descriptors), std::move(reference)};
}

bool are_measured(std::span<const Fragment> fragments, const Observer& observer) {
  Eigen::Vector3d away = Eigen::Vector3d::Zero();
  for (std::size_t n = 0; n < fragments.size(); ++n) {
    const effort::Effort measured =
        effort::observe(observer.descriptors[n], observer.reference, fragments[n].content).effort;
    away += (effort::to_vector(measured) - effort::to_vector(*fragments[n].effort)).cwiseAbs();
  }
  return away.maxCoeff() <= kMeasuredWithin * static_cast<double>(fragments.size());
}

align::ContentMetric fit_metric(std::span<const Fragment> fragments, const TrainOptions& options) {
  if (options.metric_kind == align::MetricKind::kRaw) return align::ContentMetric::raw();
  return align::fit_content_metric(poses_of(fragments), number_contents(fragments).numbers,
                                   number_performers(fragments).numbers, options.metric);
}

/// What a match inside each content group costs: of someone new, where the metric is learnt.
std::vector<align::GroupCostStatistics> fit_match_costs(std::span<const Fragment> fragments,
                                                        const Eigen::MatrixXd& mean_cost,
                                                        const TrainOptions& options) {
  const std::vector<int> groups = number_contents(fragments).numbers;
  if (options.metric_kind == align::MetricKind::kRaw)
    return align::group_cost_statistics(mean_cost, groups);
  align::ContentMetricOptions metric = options.metric;
  metric.threads = options.threads;
  return align::group_cost_statistics(
      align::unseen_costs(poses_of(fragments), groups, number_performers(fragments).numbers,
                          metric),
      groups, align::kUnseenThreshold);
}

/// Fragments of i's content, nearest first, i itself leading.
std::vector<int> neighbors_of(int i, const Eigen::MatrixXd& mean_cost,
                              const std::vector<int>& groups) {
  std::vector<int> order;
  for (int j = 0; j < static_cast<int>(groups.size()); ++j) {
    if (groups[static_cast<std::size_t>(j)] == groups[static_cast<std::size_t>(i)])
      order.push_back(j);
  }
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    if ((a == i) != (b == i)) return a == i;
    return mean_cost(i, a) < mean_cost(i, b);
  });
  return order;
}

/// See StyleModel::content_margins; a fragment alone in its content is as near to it as to itself.
std::vector<double> content_margins_of(const Eigen::MatrixXd& mean_cost,
                                       const std::vector<int>& groups) {
  std::vector<double> margins(groups.size(), 0.0);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    std::optional<double> own, other;
    for (std::size_t k = 0; k < groups.size(); ++k) {
      if (k == i) continue;
      const double cost = mean_cost(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      auto& least = groups[k] == groups[i] ? own : other;
      least = std::min(cost, least.value_or(cost));
    }
    if (other) margins[i] = *other - own.value_or(0.0);
  }
  return margins;
}

}  // namespace

StyleModel train_style_model(const StyleCorpus& corpus, const TrainOptions& options) {
  corpus.check();
  for (const Fragment& fragment : corpus.fragments) {
    if (fragment.effort) continue;
    throw Error(ErrorKind::kData,
                "fragment '" + fragment.name + "' has no Effort label; label it or leave it out");
  }
  const std::vector<Fragment>& fragments = corpus.fragments;
  Numbering contents = number_contents(fragments);
  align::FragmentSet database(fit_metric(fragments, options), poses_of(fragments), contents.numbers,
                              number_performers(fragments).numbers);
  const Eigen::MatrixXd mean_cost =
      align::all_pair_costs(database.features(), options.threads).mean_cost;
  std::vector<std::vector<int>> neighbors;
  for (int i = 0; i < database.fragment_count(); ++i) {
    neighbors.push_back(neighbors_of(i, mean_cost, contents.numbers));
  }
  effort::ContentMap content_map = fit_corpus_content_map(fragments, options.content_map);
  std::vector<Eigen::VectorXd> coordinates = content_coordinates(fragments, content_map);
  const effort::StyleSamples samples = style_samples(corpus, coordinates);
  effort::StyleRegressor regressor =
      options.regressor ? effort::fit_style_regressor(samples, *options.regressor, options.learning)
                        : effort::fit_default_regressor(samples, options.learning);
  Observer observer = fit_observer(fragments, options.threads);
  const bool measured = are_measured(fragments, observer);
  return {fragments,
          contents,
          std::move(database),
          std::move(neighbors),
          content_margins_of(mean_cost, contents.numbers),
          fit_match_costs(fragments, mean_cost, options),
          std::move(content_map),
          std::move(coordinates),
          std::move(regressor),
          std::move(observer.reference),
          measured,
          options.record_json};
}

std::vector<int> cluster_contents(std::span<const Fragment> fragments, int group_count,
                                  int threads) {
  const std::vector<motion::PoseMatrix> poses = poses_of(fragments);
  const std::vector<int> performers = number_performers(fragments).numbers;
  align::ContentMetricOptions scaling;
  scaling.dimensions = motion::kAngleRowCount;
  scaling.threads = threads;
  const align::FragmentSet set(align::fit_content_metric(poses, {}, performers, scaling), poses,
                               std::vector<int>(poses.size(), 0), performers);
  align::ClusterOptions options;
  options.group_count = group_count;
  return align::content_groups(
      align::locally_scaled(align::all_pair_costs(set.features(), threads).mean_cost), options);
}

}  // namespace laban::transfer
