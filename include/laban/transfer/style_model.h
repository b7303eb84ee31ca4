#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/content_groups.h"
#include "laban/align/segment_input.h"
#include "laban/effort/observer.h"
#include "laban/effort/style_regressor.h"
#include "laban/transfer/style_corpus.h"

namespace laban::transfer {

/// Everything that style transfer needs, learnt from a corpus; one self-contained file `*.laban`.
///
/// Plain parts that train_style_model and load_style_model put together; nothing in it is changed
/// afterwards.
struct StyleModel {
  std::vector<Fragment> fragments;  ///< the style database; every one labelled, one frame rate
  Numbering contents;               ///< content groups of the fragments
  align::FragmentSet database;      ///< the fragments under the content metric
  /// For each fragment, the fragments of its content from the nearest on (itself first), by mean
  /// path cost: the K content neighbours are the first K (METHODS 1.1, 1.6).
  std::vector<std::vector<int>> neighbors;
  /// Of each fragment, by how much the nearest other of its content is nearer than the nearest of
  /// another content, in mean path cost: negative where it looks like something else. 0 where there
  /// is no other content, or the model's file is older than this.
  std::vector<double> content_margins;
  /// Of each content group: of matches of someone whom the metric does not know (unseen_costs).
  std::vector<align::GroupCostStatistics> match_costs;
  effort::ContentMap content_map;
  std::vector<Eigen::VectorXd> coordinates;  ///< of each fragment, by the content map
  effort::StyleRegressor regressor;
  effort::ObserverReference observer;  ///< fitted to the fragments; measures, never learns
  /// The fragments' labels are what the observer says of them, to kMeasuredWithin on average; a
  /// rater's are not, and what is measured says little about them.
  bool labels_measured = false;
  /// Training record, a JSON object: options as resolved, seed, input checksums, versions.
  std::string record_json;

  /// Those that it was taught: flow, weight, time, and space if every label gave it.
  [[nodiscard]] std::span<const effort::Factor> factors() const { return regressor.factors(); }
  [[nodiscard]] double frame_rate_hz() const { return fragments.front().pose.frame_rate_hz; }
};

/// Labels whose mean distance from what the observer measures is no more, in Effort points, for
/// every factor, count as measured: the observer of a few fragments less, or rounding, is as far.
inline constexpr double kMeasuredWithin = 0.1;

struct TrainOptions {
  align::ContentMetricOptions metric;
  align::MetricKind metric_kind = align::MetricKind::kContent;
  effort::ContentMapOptions content_map;
  /// nullopt: effort::fit_default_regressor's choice.
  std::optional<effort::RegressorKind> regressor;
  effort::StyleRegressorOptions learning;
  int threads = 1;
  std::string record_json = "{}";
};

/// Learns a style model from a labelled corpus (METHODS 1.1, 1.3).
/// @throws Error{kData} if a fragment or blend has no label or the corpus is not sound; as the
///         parts' own fits.
[[nodiscard]] StyleModel train_style_model(const StyleCorpus& corpus,
                                           const TrainOptions& options = {});

/// The content of every fragment as clustering by DTW alone sees it: joint angles relative to the
/// performer's mean pose, each scaled to its spread, costs scaled to their neighbourhood
/// (align::locally_scaled); no content name is looked at. For checking a
/// corpus, and for corpora without content names.
[[nodiscard]] std::vector<int> cluster_contents(std::span<const Fragment> fragments,
                                                int group_count, int threads = 1);

/// The bytes of a model file (DESIGN 3). Same model, same bytes.
[[nodiscard]] std::string write_style_model(const StyleModel& model);

/// @param name  of the file, for messages.
/// @throws Error{kFormat} "name: ..." if it is damaged, of another kind or of a newer version.
[[nodiscard]] StyleModel read_style_model(std::string_view bytes, std::string_view name);

}  // namespace laban::transfer
