#include "performer.h"

namespace laban::phrase {
namespace {

void place_left_arm(LeftArm left_arm, ControlPose& pose) {
  const auto set = [&pose](double flex, double abduct, double twist, double elbow) {
    // Held in the place it has on an upright body, as far as a bent one allows.
    pose[Control::kLeftArmFlex] = flex + 0.8 * chest_pitch(pose);
    pose[Control::kLeftArmAbduct] = abduct;
    pose[Control::kLeftArmTwist] = twist;
    pose[Control::kLeftElbow] = elbow;
  };
  switch (left_arm) {
    case LeftArm::kHangs:
      break;
    case LeftArm::kOnHip:
      set(-15.0, 48.0, 60.0, 100.0);
      break;
    case LeftArm::kBehindBack:
      set(-36.0, 14.0, 95.0, 62.0);
      break;
    case LeftArm::kBeforeBelly:
      set(18.0, 12.0, 45.0, 95.0);
      break;
    case LeftArm::kHeldOut:
      set(10.0, 34.0, -10.0, 36.0);
      break;
  }
}

}  // namespace

double chest_pitch(const ControlPose& posture) {
  return posture[Control::kPelvisPitch] + posture[Control::kSpinePitch] +
         posture[Control::kChestPitch];
}

double left_arm_freedom(LeftArm left_arm) {
  switch (left_arm) {
    case LeftArm::kHangs:
      return 1.0;
    case LeftArm::kHeldOut:
      return 0.5;
    case LeftArm::kOnHip:
    case LeftArm::kBehindBack:
    case LeftArm::kBeforeBelly:
      return 0.25;
  }
  return 1.0;
}

ControlPose posture_of(const Stance& s) {
  ControlPose pose;
  pose[Control::kPelvisY] = -s.crouch;
  pose[Control::kPelvisPitch] = s.lean - 0.15 * s.stoop;
  // Leaning moves the hips back so that the weight stays over the feet.
  pose[Control::kPelvisZ] = -0.005 * s.lean - 0.001 * s.stoop;
  pose[Control::kSpinePitch] = 0.5 * s.stoop;
  pose[Control::kChestPitch] = 0.6 * s.stoop;
  pose[Control::kNeckPitch] = 0.4 * s.stoop + 0.4 * s.head_down;
  pose[Control::kHeadPitch] = -0.9 * s.stoop - 0.6 * s.lean + 0.6 * s.head_down;
  pose[Control::kSpineRoll] = -0.5 * s.side_bend;
  pose[Control::kChestRoll] = -0.5 * s.side_bend;
  pose[Control::kPelvisX] = -0.003 * s.side_bend;
  pose[Control::kHeadRoll] = -s.head_tilt + 0.6 * s.side_bend;
  for (const bool left : {true, false}) {
    const auto side = [left](Control c) { return left ? c : right_of(c); };
    const double sign = left ? 1.0 : -1.0;
    pose[side(Control::kLeftShoulderRaise)] = s.shoulders_up + 0.5 * sign * s.shoulder_drop;
    pose[side(Control::kLeftShoulderForward)] = s.shoulders_round;
    pose[side(Control::kLeftArmFlex)] = 0.6 * s.stoop + 0.4 * s.elbows - 6.0;
    pose[side(Control::kLeftArmAbduct)] = s.arms_out + sign * s.side_bend;
    pose[side(Control::kLeftArmTwist)] = s.palms_back;
    pose[side(Control::kLeftElbow)] = s.elbows;
    pose[side(Control::kLeftWrist)] = 5.0;
    pose[side(Control::kLeftFootX)] = sign * s.width;
    pose[side(Control::kLeftFootZ)] = sign * s.split;
    pose[side(Control::kLeftFootYaw)] = s.toes_out;
  }
  place_left_arm(s.left_arm, pose);
  return pose;
}

std::vector<Performer> make_performers() {
  std::vector<Performer> all;
  // Even build, upright, plain: the measure of the others.
  all.push_back({.name = "p01"});
  // Old: small, stooped, knees bent, one hand on the back, short steps.
  all.push_back({.name = "p02",
                 .build = {.height = 0.91, .legs = 0.96, .trunk = 1.02, .arms = 1.03},
                 .stance = {.stoop = 34.0,
                            .lean = 10.0,
                            .head_down = 4.0,
                            .shoulders_round = 14.0,
                            .elbows = 28.0,
                            .crouch = 0.05,
                            .toes_out = 14.0,
                            .left_arm = LeftArm::kBehindBack},
                 .execution = {.step_length = 0.58,
                               .arm_swing = 0.7,
                               .knee_lift = 0.06,
                               .bow_depth = 0.75,
                               .bow_hands_front = true,
                               .wave_raise = 62.0,
                               .wave_forward = 35.0,
                               .reach_raise = 92.0,
                               .kick_height = 0.36,
                               .kick_knee = 0.6}});
  // Proud: tall, chest out, chin up, hand on the hip.
  all.push_back({.name = "p03",
                 .build = {.height = 1.06, .legs = 1.03, .shoulders = 1.08},
                 .stance = {.stoop = -14.0,
                            .head_down = -8.0,
                            .shoulders_round = -10.0,
                            .arms_out = 14.0,
                            .elbows = 20.0,
                            .crouch = 0.004,
                            .toes_out = 14.0,
                            .left_arm = LeftArm::kOnHip},
                 .execution = {.step_length = 0.86,
                               .bow_depth = 0.85,
                               .bow_from_hips = 0.75,
                               .wave_raise = 98.0,
                               .reach_raise = 118.0,
                               .kick_height = 0.66,
                               .kick_knee = 0.95}});
  // Broad: heavy shoulders, arms far out, feet wide, palms to the back.
  all.push_back(
      {.name = "p04",
       .build = {.height = 1.07, .trunk = 1.05, .arms = 1.04, .shoulders = 1.16, .hips = 1.08},
       .stance = {.stoop = 10.0,
                  .shoulders_up = 6.0,
                  .shoulders_round = 10.0,
                  .arms_out = 28.0,
                  .elbows = 38.0,
                  .palms_back = 40.0,
                  .crouch = 0.03,
                  .width = 0.22,
                  .toes_out = 20.0},
       .execution = {.step_length = 0.78,
                     .arm_swing = 0.8,
                     .bow_from_hips = 0.6,
                     .wave_forward = 28.0,
                     .wave_width = 1.2,
                     .reach_aside = 26.0,
                     .kick_knee = 0.7}});
  // Shy: head down and aside, shoulders round, arms close, a hand before the belly, toes in.
  all.push_back({.name = "p05",
                 .build = {.height = 0.95, .arms = 0.97, .shoulders = 0.92},
                 .stance = {.stoop = 16.0,
                            .head_down = 24.0,
                            .side_bend = 4.0,
                            .head_tilt = 8.0,
                            .shoulders_up = 7.0,
                            .shoulders_round = 16.0,
                            .arms_out = 2.0,
                            .elbows = 45.0,
                            .palms_back = 20.0,
                            .crouch = 0.015,
                            .width = 0.09,
                            .toes_out = -5.0,
                            .left_arm = LeftArm::kBeforeBelly},
                 .execution = {.step_length = 0.62,
                               .arm_swing = 0.5,
                               .bow_hands_front = true,
                               .wave_raise = 55.0,
                               .wave_forward = 45.0,
                               .wave_width = 0.75,
                               .reach_raise = 88.0,
                               .kick_height = 0.40,
                               .kick_knee = 0.6}});
  // Dancer: long limbs, upright, arms carried outward, toes out, leg high.
  all.push_back({.name = "p06",
                 .build = {.height = 1.01,
                           .legs = 1.06,
                           .trunk = 0.97,
                           .arms = 1.05,
                           .shoulders = 0.96,
                           .hips = 0.95},
                 .stance = {.stoop = -6.0,
                            .head_down = -4.0,
                            .head_tilt = -6.0,
                            .shoulders_round = -6.0,
                            .arms_out = 24.0,
                            .elbows = 24.0,
                            .palms_back = -15.0,
                            .crouch = 0.004,
                            .width = 0.10,
                            .toes_out = 26.0,
                            .left_arm = LeftArm::kHeldOut},
                 .execution = {.step_length = 0.84,
                               .arm_swing = 1.2,
                               .bow_from_hips = 0.35,
                               .wave_raise = 105.0,
                               .wave_width = 1.25,
                               .reach_raise = 135.0,
                               .reach_aside = 24.0,
                               .kick_height = 0.80,
                               .kick_knee = 1.0}});
  // Fighter: crouched, left foot before the right, elbows bent, shoulders up.
  all.push_back({.name = "p07",
                 .build = {.height = 0.99, .shoulders = 1.08},
                 .stance = {.stoop = 14.0,
                            .lean = 6.0,
                            .head_down = 8.0,
                            .shoulders_up = 8.0,
                            .shoulders_round = 8.0,
                            .arms_out = 16.0,
                            .elbows = 72.0,
                            .palms_back = 15.0,
                            .crouch = 0.07,
                            .width = 0.18,
                            .toes_out = 10.0,
                            .split = 0.10},
                 .execution = {.step_length = 0.74,
                               .arm_swing = 0.8,
                               .knee_lift = 0.13,
                               .wave_forward = 35.0,
                               .reach_raise = 98.0,
                               .kick_height = 0.72}});
  // Lopsided: bent to the right, right shoulder low, head to the other side.
  all.push_back({.name = "p08",
                 .build = {.height = 1.02, .legs = 0.98, .trunk = 1.04},
                 .stance = {.stoop = 8.0,
                            .side_bend = -11.0,
                            .head_tilt = 9.0,
                            .shoulder_drop = 16.0,
                            .arms_out = 14.0,
                            .elbows = 12.0,
                            .crouch = 0.018,
                            .width = 0.15},
                 .execution = {.step_length = 0.72,
                               .bow_depth = 1.1,
                               .wave_raise = 72.0,
                               .wave_width = 1.1,
                               .reach_raise = 110.0,
                               .reach_aside = 4.0,
                               .kick_height = 0.48}});
  // Child: small, large steps for its size, arms flung, leans forward.
  all.push_back({.name = "p09",
                 .build = {.height = 0.78,
                           .legs = 0.94,
                           .trunk = 1.0,
                           .arms = 0.94,
                           .shoulders = 0.92,
                           .hips = 0.95},
                 .stance = {.stoop = -2.0,
                            .lean = 5.0,
                            .head_down = -12.0,
                            .arms_out = 22.0,
                            .elbows = 30.0,
                            .palms_back = 20.0,
                            .width = 0.14,
                            .toes_out = 4.0},
                 .execution = {.step_length = 0.82,
                               .arm_swing = 1.15,
                               .knee_lift = 0.14,
                               .bow_depth = 1.15,
                               .wave_raise = 110.0,
                               .wave_width = 1.3,
                               .reach_raise = 125.0,
                               .kick_height = 0.60,
                               .kick_knee = 0.75}});
  // Tired: hangs from the shoulders, head down, arms loose, feet drag.
  all.push_back({.name = "p10",
                 .build = {.height = 1.03, .arms = 1.03},
                 .stance = {.stoop = 26.0,
                            .lean = 2.0,
                            .head_down = 30.0,
                            .side_bend = 3.0,
                            .shoulders_up = -8.0,
                            .shoulders_round = 12.0,
                            .arms_out = 5.0,
                            .elbows = 6.0,
                            .palms_back = 15.0,
                            .crouch = 0.035,
                            .width = 0.15,
                            .toes_out = 18.0},
                 .execution = {.step_length = 0.64,
                               .arm_swing = 0.6,
                               .knee_lift = 0.05,
                               .bow_depth = 1.1,
                               .bow_from_hips = 0.3,
                               .wave_raise = 60.0,
                               .wave_width = 0.85,
                               .reach_raise = 95.0,
                               .kick_height = 0.42,
                               .kick_knee = 0.65}});
  // Butler: stiff and straight, left arm before the belly, feet together.
  all.push_back({.name = "p11",
                 .build = {.height = 1.05, .legs = 1.02, .shoulders = 0.98},
                 .stance = {.stoop = -9.0,
                            .lean = -1.0,
                            .head_down = 3.0,
                            .arms_out = 4.0,
                            .elbows = 10.0,
                            .palms_back = -5.0,
                            .crouch = 0.004,
                            .width = 0.085,
                            .toes_out = 6.0,
                            .left_arm = LeftArm::kBeforeBelly},
                 .execution = {.step_length = 0.70,
                               .arm_swing = 0.5,
                               .bow_depth = 0.9,
                               .bow_from_hips = 0.85,
                               .wave_raise = 75.0,
                               .wave_forward = 30.0,
                               .wave_width = 0.8,
                               .reach_raise = 100.0,
                               .kick_height = 0.50,
                               .kick_knee = 0.95}});
  // Swaggerer: hips forward, trunk back, wide, elbows out, hand on the hip.
  all.push_back({.name = "p12",
                 .build = {.height = 1.0, .trunk = 1.03, .shoulders = 1.05, .hips = 1.03},
                 .stance = {.stoop = 6.0,
                            .lean = -9.0,
                            .head_down = 6.0,
                            .side_bend = 6.0,
                            .head_tilt = -7.0,
                            .shoulder_drop = -9.0,
                            .arms_out = 24.0,
                            .elbows = 32.0,
                            .palms_back = 30.0,
                            .crouch = 0.018,
                            .width = 0.20,
                            .toes_out = 24.0,
                            .left_arm = LeftArm::kOnHip},
                 .execution = {.step_length = 0.76,
                               .arm_swing = 1.15,
                               .bow_depth = 0.8,
                               .wave_raise = 90.0,
                               .wave_forward = 25.0,
                               .wave_width = 1.15,
                               .reach_aside = 32.0,
                               .kick_height = 0.58}});
  return all;
}

}  // namespace laban::phrase
