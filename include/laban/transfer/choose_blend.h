#pragma once

#include "laban/effort/observer.h"
#include "laban/transfer/play_choice.h"
#include "laban/transfer/style_model.h"
#include "laban/transfer/style_search.h"

namespace laban::transfer {

/// Blends that are played and measured for one target, where not said otherwise.
inline constexpr int kTries = 3;

/// A blend that was chosen for what it measures.
struct ChosenBlend {
  BlendChoice choice;
  PlayedChoice played;
  effort::Observation measured;
};

/// (Ours.) search_blend, played, measured, and searched again knowing what was measured: what the
/// regressor is wrong by at one blend it is partly wrong by at others (MeasuredMisses). The blend
/// is kept whose measured Effort costs least (by the target's weights and SearchOptions::stay), the
/// first of equals. It ends after `tries` blends, with the first that misses by less than
/// kMissedBy, or when none is expected to be better than one that is known.
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
