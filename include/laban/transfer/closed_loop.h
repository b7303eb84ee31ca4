#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "laban/transfer/choose_blend.h"
#include "laban/transfer/style_model.h"
#include "laban/transfer/style_search.h"

namespace laban::transfer {

/// One trip around the loop: a target was asked for, the search chose a blend for a fragment, the
/// blend was synthesised, and the kinematic observer, which no regressor ever sees, measured it.
struct ClosedLoopTrial {
  int fragment = 0;          ///< what was to be restyled
  EffortTarget target;       ///< factors left free are not set
  effort::Effort predicted;  ///< of the search's first answer
  effort::Effort measured;   ///< of the blend that is played in the end
};

/// Asked against predicted and measured, for one factor over the trials that asked for it.
struct ClosedLoopScore {
  int trials = 0;
  double asked_predicted_error = 0.0;  ///< mean |asked - predicted|
  double asked_measured_error = 0.0;   ///< mean |asked - measured|
  double rank_correlation = 0.0;       ///< Spearman's, of asked with measured
};

struct ClosedLoopOptions {
  int targets = 100;  ///< of single-factor targets: for each factor
  std::uint64_t seed = 1;
  SearchOptions search;
  int tries = kTries;  ///< see choose_blend
  int threads = 1;
};

/// Single-factor targets, the other factors free: a random fragment, and a value uniform between
/// the 5th and 95th percentile of that factor's predictions over all blends that the search may
/// choose for that fragment's content.
/// @returns targets trials for flow, then for weight, then for time.
[[nodiscard]] std::vector<ClosedLoopTrial> single_factor_trials(
    const StyleModel& model, const ClosedLoopOptions& options = {});

/// Three-factor targets, each the label of a random fragment that is left out: another fragment of
/// its content is restyled to that label by a model whose regressor and candidates know neither the
/// fragment nor a blend of it. (A box of three ranges cannot be hit by blends of two clips: these
/// figures have no bar.)
/// @param corpus  that the model was trained on.
[[nodiscard]] std::vector<ClosedLoopTrial> left_out_trials(const StyleModel& model,
                                                           const StyleCorpus& corpus,
                                                           const ClosedLoopOptions& options = {});

/// Scores of flow, weight and time.
[[nodiscard]] std::array<ClosedLoopScore, effort::kFactorCount> closed_loop_scores(
    const std::vector<ClosedLoopTrial>& trials);

}  // namespace laban::transfer
