#pragma once

#include <string>
#include <vector>

#include "body.h"
#include "control.h"

namespace laban::phrase {

/// What a performer's left arm does while it has nothing to do.
enum class LeftArm { kHangs, kOnHip, kBehindBack, kBeforeBelly, kHeldOut };

/// How a performer stands: departures from an upright neutral stance, degrees unless said.
struct Stance {
  double stoop = 0.0;         ///< forward curl of the whole trunk; < 0: chest out
  double lean = 0.0;          ///< of the whole body from the hips, forward
  double head_down = 0.0;     ///< < 0: chin up
  double side_bend = 0.0;     ///< of the trunk, to the left
  double head_tilt = 0.0;     ///< to the left
  double shoulders_up = 0.0;  ///< both
  double shoulders_round = 0.0;
  double shoulder_drop = 0.0;  ///< of the right below the left
  double arms_out = 8.0;       ///< from the sides
  double elbows = 15.0;
  double palms_back = 0.0;  ///< inward turn of the arms
  double crouch = 0.008;    ///< leg lengths
  double width = 0.13;      ///< of each foot from the middle, leg lengths
  double toes_out = 8.0;
  double split = 0.0;  ///< left foot before, right foot behind the middle, leg lengths
  LeftArm left_arm = LeftArm::kHangs;
};

/// How a performer does each action, whatever the Effort.
struct Execution {
  double step_length = 0.80;     ///< walk: leg lengths
  double arm_swing = 1.0;        ///< walk: factor
  double knee_lift = 0.10;       ///< walk: of the swinging foot, leg lengths
  double bow_depth = 1.0;        ///< factor
  bool bow_hands_front = false;  ///< hands slide down the thighs, else stay at the sides
  double bow_from_hips = 0.5;    ///< share of the bow in the hips, the rest curls the spine
  double wave_raise = 85.0;      ///< abduction of the upper arm
  double wave_forward = 15.0;    ///< flexion of the upper arm
  double wave_width = 1.0;       ///< factor of the forearm's swing
  double reach_raise = 105.0;    ///< flexion of the arm: 90 forward, 150 up
  double reach_aside = 18.0;     ///< to the right
  double kick_height = 0.55;     ///< of the foot, leg lengths
  double kick_knee = 0.8;        ///< how far the leg is straightened, 0 .. 1
};

/// One of the invented performers.
struct Performer {
  std::string name;
  Proportions build = {};
  Stance stance = {};
  Execution execution = {};
};

/// The twelve performers of the corpus, p01 to p12.
[[nodiscard]] std::vector<Performer> make_performers();

/// Forward bend of the chest in a posture, pelvis and trunk together, degrees: what an arm must be
/// raised by to point where it would point from an upright chest.
[[nodiscard]] double chest_pitch(const ControlPose& posture);

/// Share of an action's swing that the left arm takes part in: little while it is held somewhere.
[[nodiscard]] double left_arm_freedom(LeftArm left_arm);

/// The stance as controls, to which scores add.
[[nodiscard]] ControlPose posture_of(const Stance& stance);

}  // namespace laban::phrase
