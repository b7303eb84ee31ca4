#pragma once

#include <array>
#include <cstddef>

namespace laban::phrase {

/// What a pose of a performer is made of: few numbers with an anatomical meaning, from which body.h
/// computes joint rotations. Angles are degrees, lengths are leg lengths; every control is 0 in a
/// neutral stance with the arms hanging.
enum class Control {
  // Pelvis, over the point between the feet where the performer began.
  kPelvisX,      ///< to the left
  kPelvisY,      ///< up, from the height of a stance with straight legs
  kPelvisZ,      ///< forward
  kPelvisYaw,    ///< turn to the left
  kPelvisPitch,  ///< bend forward
  kPelvisRoll,   ///< right side up
  // Trunk and head.
  kSpinePitch,
  kSpineYaw,
  kSpineRoll,
  kChestPitch,
  kChestYaw,
  kChestRoll,
  kNeckPitch,
  kHeadPitch,
  kHeadYaw,
  kHeadRoll,
  // Arms; those of the right side follow in the same order.
  kLeftShoulderRaise,
  kLeftShoulderForward,
  kLeftArmFlex,    ///< forward and up in the sagittal plane
  kLeftArmAbduct,  ///< away from the body
  kLeftArmTwist,   ///< inward about the upper arm
  kLeftElbow,      ///< flexion
  kLeftPronation,  ///< of the forearm, thumb inward
  kLeftWrist,      ///< flexion towards the palm
  kRightShoulderRaise,
  kRightShoulderForward,
  kRightArmFlex,
  kRightArmAbduct,
  kRightArmTwist,
  kRightElbow,
  kRightPronation,
  kRightWrist,
  // Feet: where the flat sole stands, and how the foot is tilted there.
  kLeftFootX,
  kLeftFootY,
  kLeftFootZ,
  kLeftFootYaw,    ///< toes to the left
  kLeftFootPitch,  ///< > 0: heel up, about the ball; < 0: toes up, about the heel
  kLeftKneeOut,    ///< swivel of the knee away from the toes' direction
  kRightFootX,
  kRightFootY,
  kRightFootZ,
  kRightFootYaw,
  kRightFootPitch,
  kRightKneeOut,
  kCount,
};

inline constexpr int kControlCount = static_cast<int>(Control::kCount);

/// Controls of one arm, and of one foot: the distance between the left control and the right one.
inline constexpr int kArmControlCount = 8;
inline constexpr int kFootControlCount = 6;

[[nodiscard]] constexpr std::size_t index_of(Control control) {
  return static_cast<std::size_t>(control);
}

/// The control of the right side that plays the part of `left`, an arm's or a foot's.
[[nodiscard]] constexpr Control right_of(Control left) {
  const int shift = left < Control::kLeftFootX ? kArmControlCount : kFootControlCount;
  return static_cast<Control>(static_cast<int>(left) + shift);
}

/// Feet stand where they were put: no noise, lag or tremor may touch their controls.
[[nodiscard]] constexpr bool is_foot(Control control) {
  return control >= Control::kLeftFootX;
}

/// One value a control.
class ControlPose {
 public:
  double& operator[](Control control) { return values_[index_of(control)]; }
  double operator[](Control control) const { return values_[index_of(control)]; }

 private:
  std::array<double, kControlCount> values_{};
};

}  // namespace laban::phrase
