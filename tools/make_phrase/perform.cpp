#include "perform.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "laban/base/rng.h"

#include "body.h"

namespace laban::phrase {
namespace {

/// A sum of sines of random frequency and phase.
class Drift {
 public:
  Drift(double amplitude, double lowest_hz, double highest_hz, base::Rng& rng) {
    for (Wave& wave : waves_) {
      wave.amplitude = amplitude * rng.uniform(0.4, 1.0) / std::sqrt(double(waves_.size()) / 2.0);
      wave.rate = 2.0 * std::numbers::pi * rng.uniform(lowest_hz, highest_hz);
      wave.phase = rng.uniform(0.0, 2.0 * std::numbers::pi);
    }
  }
  [[nodiscard]] double value(double time_s) const {
    double sum = 0.0;
    for (const Wave& wave : waves_)
      sum += wave.amplitude * std::sin(wave.rate * time_s + wave.phase);
    return sum;
  }

 private:
  struct Wave {
    double amplitude = 0.0, rate = 0.0, phase = 0.0;
  };
  std::array<Wave, 3> waves_;
};

bool is_length(Control control) {
  return control <= Control::kPelvisZ;
}

/// How far along the chain from the pelvis to the fingers a control lies, 0 .. 1.
double distance_from_pelvis(Control control) {
  if (control < Control::kSpinePitch || is_foot(control)) return 0.0;
  if (control < Control::kChestPitch) return 0.15;
  if (control < Control::kNeckPitch) return 0.3;
  if (control < Control::kLeftShoulderRaise) return 0.45;
  const int of_arm = (static_cast<int>(control) - static_cast<int>(Control::kLeftShoulderRaise)) %
                     kArmControlCount;
  constexpr std::array<double, kArmControlCount> kAlongArm = {0.35, 0.35, 0.5, 0.5,
                                                              0.6,  0.75, 0.8, 1.0};
  return kAlongArm[static_cast<std::size_t>(of_arm)];
}

/// Amplitude of the slow drift: degrees, or leg lengths for the pelvis' place.
double drift_amplitude(Control control) {
  if (is_foot(control)) return 0.0;
  if (is_length(control)) return control == Control::kPelvisY ? 0.0015 : 0.007;
  return control < Control::kLeftShoulderRaise ? 1.2 : 2.2;
}

/// Amplitude of a tremor of one degree in the hands.
double tremor_share(Control control) {
  return is_foot(control) || is_length(control) ? 0.0 : 0.2 + 0.8 * distance_from_pelvis(control);
}

struct Life {
  std::vector<Drift> drifts;
  std::vector<Drift> tremors;
  double breath_phase = 0.0;
};

Life draw_life(const Manner& manner, base::Rng& rng) {
  Life life;
  for (int c = 0; c < kControlCount; ++c) {
    const auto control = static_cast<Control>(c);
    // Who moves suddenly also sways quickly, and less far.
    life.drifts.emplace_back(drift_amplitude(control) / std::sqrt(manner.sway_rate),
                             0.2 * manner.sway_rate, 0.7 * manner.sway_rate, rng);
    life.tremors.emplace_back(manner.tremor_deg * tremor_share(control), 3.0, 5.0, rng);
  }
  life.breath_phase = rng.uniform(0.0, 2.0 * std::numbers::pi);
  return life;
}

void breathe(double time_s, double phase, ControlPose& pose) {
  const double breath = std::sin(2.0 * std::numbers::pi * 0.3 * time_s + phase);
  pose[Control::kChestPitch] -= 1.0 * breath;
  pose[Control::kLeftShoulderRaise] += 0.8 * breath;
  pose[Control::kRightShoulderRaise] += 0.8 * breath;
}

std::vector<Hesitation> draw_hesitations(const Manner& manner, double score_s, base::Rng& rng) {
  std::vector<Hesitation> hesitations;
  for (int i = 0; i < manner.hesitations; ++i) {
    // One in each equal part of the score's middle, away from its ends.
    const double part = 0.8 * score_s / manner.hesitations;
    hesitations.push_back({.at_s = 0.1 * score_s + part * (i + rng.uniform(0.25, 0.75)),
                           .length_s = rng.uniform(0.30, 0.46) * manner.pace,
                           .depth = manner.depth * rng.uniform(0.85, 1.0)});
  }
  return hesitations;
}

ControlPose controls_at(double score_time_s, double time_s, const ControlPose& posture,
                        const Manner& manner, const Score& score, const Life& life) {
  ControlPose pose = posture;
  for (int c = 0; c < kControlCount; ++c) {
    const auto control = static_cast<Control>(c);
    const auto i = static_cast<std::size_t>(c);
    const double late = manner.lag_s * distance_from_pelvis(control);
    pose[control] +=
        score.track(control).value(score_time_s - late,
                                   std::max(manner.fluency, score.least_fluency), manner.attack) +
        life.drifts[i].value(time_s) + life.tremors[i].value(time_s);
  }
  breathe(time_s, life.breath_phase, pose);
  return pose;
}

}  // namespace

motion::Clip perform(const Performer& performer, const Manner& manner, const Score& score,
                     std::uint64_t seed) {
  base::Rng rng(seed);
  const auto skeleton = build_skeleton(performer.build);
  const ControlPose posture = posture_of(performer.stance);
  const Life life = draw_life(manner, rng);
  const std::vector<double> times = performed_times(
      score.duration_s, kFrameRateHz, draw_hesitations(manner, score.duration_s, rng));
  Eigen::Matrix3Xd root(3, static_cast<Eigen::Index>(times.size()));
  std::vector<Eigen::Quaterniond> rotations;
  for (std::size_t frame = 0; frame < times.size(); ++frame) {
    const double time_s = static_cast<double>(frame) / kFrameRateHz;
    const BodyPose pose =
        pose_body(*skeleton, controls_at(times[frame], time_s, posture, manner, score, life));
    root.col(static_cast<Eigen::Index>(frame)) = pose.root_position;
    rotations.insert(rotations.end(), pose.rotations.begin(), pose.rotations.end());
  }
  return {skeleton, kFrameRateHz, std::move(root), std::move(rotations)};
}

}  // namespace laban::phrase
