#include "actions.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "laban/base/error.h"

namespace laban::phrase {
namespace {

/// What the writers of scores share: who performs, how, and where the pen is in time.
struct Writer {
  const Performer& performer;
  const Manner& manner;
  ControlPose posture;
  Score score;
  double now_s = 0.0;

  /// Moves on by a stroke (a movement) of that neutral length.
  double stroke(double seconds) { return now_s += seconds * manner.pace; }
  /// Moves on by a stroke that carries a limb to its place.
  double drive(double seconds) { return now_s += seconds * manner.drive; }
  /// Moves on by the stroke in which the action's force lies.
  double strike(double seconds) { return now_s += seconds * manner.strike; }
  /// Moves on by a rest (a hold between movements) of that neutral length.
  double rest(double seconds) { return now_s += seconds * manner.linger; }
  /// Brings controls to values of their own, all but a tenth whatever the posture.
  [[nodiscard]] ControlValue to(Control control, double value) const {
    return {control, 0.9 * (value - posture[control])};
  }
};

/// Walk: two cycles. Foot k (even: left) lands at k T, k steps ahead of foot 0, and leaves the
/// ground a seventh of a step after foot k + 1 has landed.
void write_walk(Writer& w) {
  const Execution& how = w.performer.execution;
  const double size = w.manner.size;
  // Cadence varies less than the pace of single strokes, or a slow walk would fall to pieces.
  const double step_s = 0.58 * std::pow(w.manner.pace, 0.7);
  const double step = how.step_length * (0.52 + 0.40 * size);
  const double width = 0.07 + 0.3 * w.performer.stance.width;
  // Low enough while both feet are down for both legs to reach the ground.
  const double reach_drop = 1.0 - std::sqrt(0.99 - 0.19 * step * step);
  const double drop = std::max(0.030 * w.manner.bounce, reach_drop - w.performer.stance.crouch);
  const double right_swing = how.arm_swing * (0.4 + 0.6 * size);
  const double left_swing = right_swing * left_arm_freedom(w.performer.stance.left_arm);
  const auto landing = [&](int k) { return (k - 0.5) * step_s; };  // the clip begins at mid-stance
  w.score.duration_s = 4.0 * step_s;
  w.score.least_fluency = 0.8;  // travel goes on: even a bound walker does not stop at every key
  for (int k = -2; k <= 7; ++k) {
    const bool left = k % 2 == 0;
    const double sign = left ? 1.0 : -1.0;
    const auto own = [left](Control c) { return left ? c : right_of(c); };
    const double lands = landing(k);
    const double leaves = landing(k + 1) + 0.14 * step_s;
    const double passes = landing(k + 1) + 0.55 * step_s;  // the middle of its flight
    const double middle = landing(k) + 0.5 * step_s;       // it carries all the weight
    const double z = k * step;
    const ControlValue stand_x{own(Control::kLeftFootX), sign * (width - w.performer.stance.width)};
    const double z_home = w.posture[own(Control::kLeftFootZ)];
    w.score.at(lands, {{own(Control::kLeftFootZ), z - z_home},
                       stand_x,
                       {own(Control::kLeftFootY), 0.0},
                       {own(Control::kLeftFootPitch), -16.0}});
    w.score.at(lands + 0.22 * step_s, {{own(Control::kLeftFootPitch), 0.0}});
    w.score.at(lands + 0.55 * step_s, {{own(Control::kLeftFootPitch), 0.0}});
    w.score.at(leaves, {{own(Control::kLeftFootZ), z - z_home},
                        stand_x,
                        {own(Control::kLeftFootY), 0.0},
                        {own(Control::kLeftFootPitch), 26.0 + 22.0 * step}});
    w.score.at(passes, {{own(Control::kLeftFootY), how.knee_lift * (0.5 + 0.5 * size)},
                        {own(Control::kLeftFootPitch), 16.0}});
    // The pelvis rides midway between the feet, lowest and fastest as a foot lands.
    w.score.at(lands, {{Control::kPelvisZ, z - 0.48 * step}, {Control::kPelvisY, -drop}});
    w.score.at(leaves, {{Control::kPelvisY, -drop}});
    w.score.at(middle, {{Control::kPelvisZ, z + 0.02 * step},
                        {Control::kPelvisY, 0.0},
                        {Control::kPelvisX, 0.55 * sign * width},
                        {Control::kPelvisRoll, 3.0 * sign * size}});
    // The hip goes with the leg that lands, the chest and the arms against it.
    w.score.at(lands, {{Control::kPelvisYaw, -7.0 * sign * size},
                       {Control::kSpineYaw, 5.0 * sign * size},
                       {Control::kChestYaw, 8.0 * sign * size * how.arm_swing},
                       {Control::kHeadYaw, -5.0 * sign * size},
                       {Control::kSpineRoll, -1.5 * sign * size},
                       {Control::kChestPitch, 2.0 * size}});
    w.score.at(middle, {{Control::kChestPitch, 0.0}});
    const double ahead = left ? -1.0 : 1.0;  // of the left arm
    w.score.at(lands, {{Control::kLeftArmFlex, (2.0 + 22.0 * ahead) * left_swing},
                       {Control::kLeftElbow, (6.0 + 10.0 * ahead) * left_swing},
                       {Control::kRightArmFlex, (2.0 - 22.0 * ahead) * right_swing},
                       {Control::kRightElbow, (6.0 - 10.0 * ahead) * right_swing}});
  }
}

/// Bow: breathe in and rise, the head leads the trunk down, a rest at the bottom, up again from the
/// hips with the head last.
void write_bow(Writer& w) {
  const Execution& how = w.performer.execution;
  const double depth = how.bow_depth * (0.25 + 0.75 * w.manner.size);
  const double hips = 56.0 * depth * how.bow_from_hips;
  const double curl = 56.0 * depth * (1.0 - how.bow_from_hips);
  const auto trunk = [&](double time, double share, double head) {
    w.score.at(time, {{Control::kPelvisPitch, hips * share},
                      {Control::kPelvisZ, -0.0028 * hips * share},
                      {Control::kPelvisY, -0.02 * depth * share},
                      {Control::kSpinePitch, 0.55 * curl * share},
                      {Control::kChestPitch, 0.65 * curl * share},
                      {Control::kNeckPitch, 9.0 * depth * head},
                      {Control::kHeadPitch, 11.0 * depth * head}});
  };
  const auto arms = [&](double time, double share) {
    for (const bool left : {true, false}) {
      const auto side = [left](Control c) { return left ? c : right_of(c); };
      const auto partly = [&](Control c, double value) {
        return ControlValue{side(c), share * w.to(side(c), value).value};
      };
      if (how.bow_hands_front) {
        w.score.at(time, {partly(Control::kLeftArmFlex, 40.0), partly(Control::kLeftArmAbduct, 4.0),
                          partly(Control::kLeftArmTwist, 32.0), partly(Control::kLeftElbow, 40.0)});
      } else {
        w.score.at(time, {{side(Control::kLeftArmFlex), 0.42 * (hips + curl) * share},
                          {side(Control::kLeftShoulderForward), 6.0 * depth * share}});
      }
    }
  };
  trunk(0.0, 0.0, 0.0);
  arms(0.0, 0.0);
  trunk(w.stroke(0.28), -0.07, -0.5);  // in breath
  arms(w.now_s, 0.0);
  w.score.at(w.now_s + 0.25 * w.manner.pace,
             {{Control::kNeckPitch, 6.0 * depth}, {Control::kHeadPitch, 8.0 * depth}});
  trunk(w.drive(0.38), 0.50, 0.95);
  trunk(w.drive(0.40), 1.0, 1.0);
  arms(w.now_s, 1.0);
  trunk(w.rest(0.22), 1.03, 1.05);
  arms(w.now_s, 1.03);
  trunk(w.drive(0.42), 0.45, 0.9);
  trunk(w.drive(0.40), -0.4 * w.manner.overshoot, 0.1);
  arms(w.now_s, 0.0);
  trunk(w.stroke(0.25), 0.0, 0.0);
  w.score.all_home(w.stroke(0.05));
  w.score.duration_s = w.now_s;
}

/// Wave: the weight goes to the left leg, the right arm rises elbow first, the forearm swings three
/// times from side to side, the arm sinks.
void write_wave(Writer& w) {
  const Execution& how = w.performer.execution;
  const double size = 0.15 + 0.85 * w.manner.size;
  const double trunk = w.manner.trunk;
  const double swing = 27.0 * how.wave_width * size;
  const double raise = how.wave_raise * (0.88 + 0.12 * w.manner.size);
  const auto body = [&](double time, double share) {
    w.score.at(time, {{Control::kPelvisX, 0.045 * share * trunk},
                      {Control::kPelvisRoll, 2.5 * share * trunk},
                      {Control::kSpineRoll, 3.0 * share * trunk},
                      {Control::kChestRoll, 3.0 * share * trunk},
                      {Control::kChestYaw, -6.0 * share * trunk},
                      {Control::kHeadYaw, 5.0 * share},
                      {Control::kHeadRoll, -5.0 * share * size},
                      {Control::kLeftArmAbduct, 4.0 * share * size},
                      {Control::kLeftElbow, 6.0 * share * size}});
  };
  const auto forearm = [&](double time, double way) {
    w.score.at(time, {w.to(Control::kRightElbow, 90.0 - swing * way),
                      w.to(Control::kRightArmTwist, -75.0 + 6.0 * way * size),
                      w.to(Control::kRightArmAbduct, raise + 5.0 * way * size),
                      {Control::kRightWrist, -9.0 * way * size},
                      {Control::kChestRoll, (3.0 - 2.5 * way) * trunk},
                      {Control::kPelvisX, (0.045 - 0.015 * way) * trunk}});
  };
  body(0.0, 0.0);
  w.score.home(0.0, {Control::kRightElbow, Control::kRightArmTwist, Control::kRightArmAbduct,
                     Control::kRightArmFlex, Control::kRightShoulderRaise, Control::kRightWrist});
  w.stroke(0.14);
  w.score.at(w.now_s,
             {{Control::kRightArmAbduct, -3.0 * size}, {Control::kPelvisX, -0.012 * size}});
  w.strike(0.30);
  w.score.at(w.now_s, {w.to(Control::kRightElbow, 100.0), w.to(Control::kRightArmTwist, -35.0)});
  w.strike(0.22);
  body(w.now_s, 1.0);
  forearm(w.now_s, -0.8);
  w.score.at(w.now_s, {w.to(Control::kRightArmFlex, how.wave_forward),
                       {Control::kRightShoulderRaise, 9.0 * size}});
  for (const double way : {1.0, -1.0, 1.0, -1.0, 0.9}) forearm(w.stroke(0.23), way);
  body(w.now_s, 1.0);
  w.score.at(w.now_s, {w.to(Control::kRightArmFlex, how.wave_forward),
                       {Control::kRightShoulderRaise, 9.0 * size}});
  w.rest(0.12);
  forearm(w.now_s, 0.6);
  w.strike(0.30);
  w.score.at(w.now_s, {w.to(Control::kRightElbow, 70.0), w.to(Control::kRightArmTwist, -25.0)});
  body(w.strike(0.30), 0.0);
  w.score.at(w.now_s, {{Control::kRightArmAbduct, -40.0 * w.manner.overshoot}});
  w.score.all_home(w.stroke(0.22));
  w.score.duration_s = w.now_s;
}

/// Reach: draw back, then legs, trunk, shoulder and arm go out one after another to a high thing
/// before the body, the left heel lifting; take it, and come back elbow first.
void write_reach(Writer& w) {
  const Execution& how = w.performer.execution;
  const double size = 0.35 + 0.65 * w.manner.size;
  const double trunk = w.manner.trunk;
  const double left = size * left_arm_freedom(w.performer.stance.left_arm);
  const double high = (how.reach_raise - 90.0) / 60.0;  // 0 forward .. 1 up
  const auto body = [&](double time, double share) {
    w.score.at(time, {{Control::kPelvisZ, 0.085 * share * trunk},
                      {Control::kPelvisX, -0.04 * share * trunk},
                      {Control::kPelvisYaw, 9.0 * share * trunk},
                      {Control::kPelvisPitch, 7.0 * share * trunk},
                      {Control::kSpineYaw, 8.0 * share * trunk},
                      {Control::kChestYaw, 12.0 * share * trunk},
                      {Control::kSpinePitch, (9.0 - 12.0 * high) * share * trunk},
                      {Control::kChestPitch, (7.0 - 14.0 * high) * share * trunk},
                      {Control::kSpineRoll, -4.0 * high * share * trunk},
                      {Control::kHeadPitch, (-10.0 - 12.0 * high) * share},
                      {Control::kHeadYaw, -16.0 * share * trunk},
                      {Control::kLeftFootPitch, std::max(0.0, 26.0 * share * size)},
                      {Control::kLeftArmFlex, -16.0 * share * left},
                      {Control::kLeftArmAbduct, 7.0 * share * left},
                      {Control::kLeftElbow, 8.0 * share * left}});
  };
  const auto arm = [&](double time, double raise, double elbow, double shoulder) {
    w.score.at(time, {w.to(Control::kRightArmFlex, raise),
                      w.to(Control::kRightElbow, elbow),
                      w.to(Control::kRightArmAbduct, how.reach_aside),
                      w.to(Control::kRightArmTwist, 10.0),
                      {Control::kRightShoulderForward, 14.0 * shoulder * size},
                      {Control::kRightShoulderRaise, 12.0 * shoulder * high * size},
                      {Control::kRightWrist, -12.0 * shoulder}});
  };
  // A bent trunk would point the arm at the ground.
  const double bend = 0.8 * chest_pitch(w.posture) + 20.0 * (1.0 - high) * size;
  const double raise = how.reach_raise * (0.86 + 0.14 * w.manner.size) + bend;
  const double straight = 10.0 + 16.0 * std::max(0.0, 1.0 - w.manner.size);
  body(0.0, 0.0);
  w.score.all_home(0.0);
  w.score.home(0.0, {Control::kRightArmFlex, Control::kRightElbow, Control::kRightArmAbduct,
                     Control::kRightArmTwist, Control::kRightShoulderForward,
                     Control::kRightShoulderRaise, Control::kRightWrist});
  body(w.stroke(0.30), -0.25);
  w.score.at(w.now_s, {{Control::kRightArmFlex, -16.0 * size},
                       {Control::kRightElbow, 30.0 * size},
                       {Control::kRightShoulderForward, -5.0 * size}});
  arm(w.drive(0.34), 0.55 * raise, 78.0, 0.3);
  body(w.drive(0.22), 0.9);
  arm(w.drive(0.16), raise, straight, 1.0);
  body(w.rest(0.16), 1.0 + 0.3 * w.manner.overshoot);
  w.score.at(w.now_s, {{Control::kRightWrist, 22.0}});  // the hand closes
  arm(w.rest(0.14), raise, straight, 0.9);
  arm(w.drive(0.40), 0.55 * raise, 85.0, 0.1);
  body(w.drive(0.22), -0.5 * w.manner.overshoot);
  w.drive(0.16);
  w.score.at(w.now_s, {{Control::kRightArmFlex, -60.0 * w.manner.overshoot}});
  w.score.all_home(w.stroke(0.24));
  w.score.duration_s = w.now_s;
}

/// Kick: the weight goes over the left foot, the right leg swings back, the knee comes up, the leg
/// shoots out and snaps back, the foot returns under the body; the arms swing against the leg.
void write_kick(Writer& w) {
  const Execution& how = w.performer.execution;
  const double size = 0.4 + 0.6 * w.manner.size;
  const double trunk = 0.25 + 0.75 * w.manner.trunk;
  const double height = how.kick_height * (0.5 + 0.5 * w.manner.size);
  const double left_x = w.posture[Control::kLeftFootX];
  const double left_z = w.posture[Control::kLeftFootZ];
  const double left = size * left_arm_freedom(w.performer.stance.left_arm);
  const auto foot = [&](double time, double x, double y, double z, double pitch) {
    w.score.at(time, {{Control::kRightFootX, x},
                      {Control::kRightFootY, y},
                      {Control::kRightFootZ, z - w.posture[Control::kRightFootZ]},
                      {Control::kRightFootPitch, pitch}});
  };
  const auto weight_over_left = [&](double time, double share) {
    w.score.at(time, {{Control::kPelvisX, 0.80 * left_x * share},
                      {Control::kPelvisZ, left_z * share},
                      {Control::kPelvisY, -0.012 * share},
                      {Control::kPelvisRoll, -3.0 * share},
                      {Control::kSpineRoll, 3.0 * share}});
  };
  const auto body = [&](double time, double share) {  // < 0: leg behind; > 0: leg before
    w.score.at(time, {{Control::kPelvisPitch, -13.0 * share * trunk},
                      {Control::kPelvisYaw, 13.0 * share * trunk},
                      {Control::kSpinePitch, (share > 0 ? 5.0 : -6.0) * share * trunk},
                      {Control::kChestPitch, (share > 0 ? 8.0 : -4.0) * share * trunk},
                      {Control::kSpineYaw, -9.0 * share * trunk},
                      {Control::kChestYaw, -13.0 * share * trunk},
                      {Control::kHeadPitch, 4.0 * share * trunk},
                      {Control::kHeadYaw, 8.0 * share * trunk},
                      {Control::kLeftArmFlex, 38.0 * share * left},
                      {Control::kLeftElbow, 14.0 * left},
                      {Control::kLeftArmAbduct, 16.0 * left},
                      {Control::kRightArmFlex, -30.0 * share * size},
                      {Control::kRightElbow, 10.0 * size},
                      {Control::kRightArmAbduct, 22.0 * size}});
  };
  foot(0.0, 0.0, 0.0, w.posture[Control::kRightFootZ], 0.0);
  weight_over_left(0.0, 0.0);
  body(0.0, 0.0);
  w.score.all_home(0.0);
  w.stroke(0.26);
  foot(w.now_s, 0.0, 0.0, w.posture[Control::kRightFootZ], 0.0);
  weight_over_left(w.stroke(0.14), 1.0);
  foot(w.stroke(0.22), 0.03, 0.13 * size, -0.34 * size, 50.0);
  body(w.now_s, -1.0);
  foot(w.strike(0.24), 0.05, 0.30 + 0.35 * height, 0.10, 30.0);
  body(w.now_s, 0.4);
  // The foot's distance before the body that leaves the knee as straight as asked.
  const double leg = 0.82 + 0.17 * how.kick_knee;
  const double out = std::sqrt(std::max(leg * leg - (0.97 - height) * (0.97 - height), 0.1));
  foot(w.strike(0.20), 0.06, height, out, 15.0 - 60.0 * height);
  body(w.now_s, 1.0);
  foot(w.rest(0.06), 0.06, height, out, 15.0 - 60.0 * height);
  foot(w.drive(0.24), 0.05, 0.28 + 0.20 * height, 0.12, 25.0);
  weight_over_left(w.now_s, 1.0);
  body(w.drive(0.16), 0.1);
  foot(w.drive(0.18), 0.0, 0.0, w.posture[Control::kRightFootZ], 0.0);
  body(w.now_s, -1.2 * w.manner.overshoot);
  w.score.all_home(w.stroke(0.34));
  w.score.duration_s = w.now_s;
}

}  // namespace

std::string_view name_of(Action action) {
  switch (action) {
    case Action::kWalk:
      return "walk";
    case Action::kBow:
      return "bow";
    case Action::kWave:
      return "wave";
    case Action::kReach:
      return "reach";
    case Action::kKick:
      return "kick";
  }
  throw base::Error(base::ErrorKind::kInternal, "name_of: unknown action");
}

Score write_score(Action action, const Performer& performer, const Manner& manner) {
  Writer writer{performer, manner, posture_of(performer.stance), {}, 0.0};
  switch (action) {
    case Action::kWalk:
      write_walk(writer);
      break;
    case Action::kBow:
      write_bow(writer);
      break;
    case Action::kWave:
      write_wave(writer);
      break;
    case Action::kReach:
      write_reach(writer);
      break;
    case Action::kKick:
      write_kick(writer);
      break;
  }
  return std::move(writer.score);
}

}  // namespace laban::phrase
