#pragma once

#include <optional>
#include <string>
#include <vector>

#include "laban/motion/clip.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/humanoid.h"

#include "json_requests.h"

namespace laban::studio {

/// A motion as the page gets it: "application/x-laban-motion".
struct MotionMessage {
  const motion::Clip& clip;
  const motion::Humanoid& humanoid;
  /// For each frame the (fractional) frame of another clip that shows the same moment; empty: none.
  std::vector<double> source_frames = {};
  Json more = Json::object();  ///< further keys of the header
};

/// The bytes: u32 n; n bytes of JSON header; arrays. All little endian; 4 + n is a multiple of 4.
///
/// The header has frames, rate_hz, floor_m (null: the feet never touch it), leg_length_m, joints
/// (name, parent, offset, end, side, part), arrays (by name: offset behind the header, type,
/// shape): "root" float32 F x 3, metres; "rotations" float32 F x J x 4, (x, y, z, w),
/// parent-from-joint; "translations" float32 F x J x 3, metres, where the clip animates offsets;
/// "contacts" uint8 F x 2, left and right foot; "source_frames" float32 F, where given.
[[nodiscard]] std::string motion_bytes(const MotionMessage& message);

}  // namespace laban::studio
