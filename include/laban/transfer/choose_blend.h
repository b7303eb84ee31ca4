#pragma once

#include "laban/effort/observer.h"
#include "laban/transfer/play_choice.h"
#include "laban/transfer/style_model.h"
#include "laban/transfer/style_search.h"

namespace laban::transfer {

/// Blends that are played and measured for one target, where not said otherwise.
inline constexpr int kTries = 5;

/// A blend that was chosen for what it measures.
struct ChosenBlend {
  BlendChoice choice;
  PlayedChoice played;
  effort::Observation measured;
};

/// (Ours.) search_blend, played, measured, and asked again: a regressor is never quite right, and
/// what it is wrong by is much the same for all blends that it predicts to hit a target. So the
/// target, and what free factors are to stay near, is moved by half of what the last blend was
/// measured to miss, and searched for anew, up to `tries` times. The blend is kept whose measured
/// Effort costs least (by the target's weights and SearchOptions::stay), the first of equals;
/// the first that misses by less than kMissedBy ends it.
///
/// With tries = 1, and by models whose labels are not measured (StyleModel::labels_measured), it is
/// the first answer of the search, as the paper has it: a rater's scale is not the observer's.
/// @param memory  of the model.
/// @param tries  >= 1.
/// @throws Error{kUsage} as search_blend.
[[nodiscard]] ChosenBlend choose_blend(PlayMemory& memory, int fragment, const EffortTarget& target,
                                       const SearchOptions& search = {}, int tries = kTries,
                                       double fastest_play = kFastestPlay);

/// A blend chosen by hand (BlendSearch::of_pair), played and measured.
/// @throws as BlendSearch::of_pair.
[[nodiscard]] ChosenBlend blend_by_hand(PlayMemory& memory, int fragment, int fragment_i,
                                        int fragment_j, double alpha, const EffortTarget& target,
                                        const SearchOptions& search = {},
                                        double fastest_play = kFastestPlay);

}  // namespace laban::transfer
