#pragma once

#include <cstdint>

#include "laban/motion/clip.h"

#include "manner.h"
#include "performer.h"
#include "score.h"

namespace laban::phrase {

/// Frame rate of the corpus.
inline constexpr double kFrameRateHz = 60.0;

/// Plays a score: posture, the score's excursions with the manner's timing, and what no living body
/// is without: breath, sway, slow drift of every joint, tremor of a bound one. The far ends of the
/// limbs follow the trunk by the manner's lag. Feet do only what the score says.
///
/// @param seed  of the drift, the tremor and the places of the hesitations.
[[nodiscard]] motion::Clip perform(const Performer& performer, const Manner& manner,
                                   const Score& score, std::uint64_t seed);

}  // namespace laban::phrase
