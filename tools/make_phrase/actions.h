#pragma once

#include <array>
#include <string_view>

#include "manner.h"
#include "performer.h"
#include "score.h"

namespace laban::phrase {

/// The five actions of the phrase. Each begins and ends near the performer's stance; the walk
/// begins and ends where the right foot swings past the standing left one, so that it can be
/// repeated.
enum class Action { kWalk, kBow, kWave, kReach, kKick };

inline constexpr std::array<Action, 5> kActions = {Action::kWalk, Action::kBow, Action::kWave,
                                                   Action::kReach, Action::kKick};

[[nodiscard]] std::string_view name_of(Action action);

/// The score of an action for a performer in a manner: what the body does when, as departures from
/// the performer's posture. Right arm and right leg lead.
[[nodiscard]] Score write_score(Action action, const Performer& performer, const Manner& manner);

}  // namespace laban::phrase
