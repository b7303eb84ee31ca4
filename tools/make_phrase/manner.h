#pragma once

#include <cstdint>
#include <vector>

#include "control.h"

namespace laban::phrase {

/// How one performer does one action, after Laban's Effort factors (DESIGN 6): each level lies in
/// [-1, 1], -1 the indulging pole, +1 the condensing one.
struct Effort {
  double weight = 0.0;  ///< light .. strong
  double time = 0.0;    ///< sustained .. sudden
  double flow = 0.0;    ///< free .. bound
};

/// What an Effort does to a score.
struct Manner {
  double size = 1.0;       ///< factor of an action's excursions
  double trunk = 1.0;      ///< factor of what the trunk adds to what a limb does
  double bounce = 1.0;     ///< factor of the rise and fall of the walk
  double pace = 1.0;       ///< factor of the length of its strokes
  double drive = 1.0;      ///< the same for strokes that carry a limb all the way to a place
  double strike = 1.0;     ///< the same for the stroke in which an action's force lies
  double linger = 1.0;     ///< factor of the length of its rests between strokes
  double fluency = 0.5;    ///< Track: does the motion pass through its keys or stop at them
  double attack = 0.0;     ///< Track: early or late peak of the speed
  double lag_s = 0.0;      ///< how late a hand follows the pelvis
  double overshoot = 0.0;  ///< share of a stroke by which a limb swings past its end
  int hesitations = 0;     ///< near-stops
  double depth = 0.0;      ///< of a hesitation, share of the speed lost
  double sway_rate = 1.0;  ///< factor of the frequency at which a resting body drifts and sways
  double tremor_deg = 0.0;
};

/// Strong is large and moves the whole body, sudden is quick, bound stops and stays. Kinetic energy
/// grows with speed too, so a sudden mover is made smaller and a sustained one larger: measured on
/// the result, the three factors are then nearly independent.
[[nodiscard]] Manner manner_of(const Effort& effort);

/// The Effort of each performer in each action: for an action and a factor the performers take
/// evenly spread levels (a Latin hypercube); part of each order is the performer's temperament, the
/// rest is drawn for the action. Of many draws the one whose factors correlate least is taken.
///
/// @returns [action][performer].
[[nodiscard]] std::vector<std::vector<Effort>> draw_efforts(int action_count, int performer_count,
                                                            std::uint64_t seed);

}  // namespace laban::phrase
