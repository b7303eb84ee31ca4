#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/clip.h"

namespace laban::io {

/// Most bones that an ASF file may have. Far above any rig; it bounds what a damaged or hostile
/// file can ask for.
inline constexpr int kMaxAsfBones = 10'000;

/// An AMC file does not tell its frame rate. CMU's and HDM05's, nearly all there are, have this
/// one.
inline constexpr double kUsualAmcRateHz = 120.0;

/// One number of a bone's line in an AMC file, in the bone's own axes.
enum class AsfDof { kTx, kTy, kTz, kRx, kRy, kRz, kLength };

/// What an AMC file says of one joint, and how it is meant.
struct AsfJoint {
  /// Model-from-bone at rest: the bone's own axes (`axis`; for the root `orientation`).
  Eigen::Quaterniond axes = Eigen::Quaterniond::Identity();
  /// Model-space unit vector along the bone at rest; zero for the root.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  std::vector<AsfDof> dofs;  ///< in the order of the AMC's numbers; rotations apply in this order
};

/// An Acclaim skeleton.
struct AsfFile {
  /// A joint for the root, named "root", and one for each bone, of its name, where the bone begins;
  /// the bones below the root all begin at the root. Rest rotations are identities, metres.
  std::shared_ptr<const motion::Skeleton> skeleton;
  std::vector<AsfJoint> joints;  ///< in joint order
  bool degrees = true;           ///< angles of an AMC that does not say its own unit
  double unit_m = 0.0;           ///< metres per unit of the file, as used
  bool unit_guessed = false;     ///< true if neither file nor options told it
  /// What was ignored, each "name:line:column: ..."; empty for a flawless file.
  std::vector<std::string> warnings;
};

struct AsfReadOptions {
  /// Metres per unit of the file, > 0; nullopt: the file's own, else guessed (see read_asf).
  std::optional<double> unit_m = {};

  /// Broken rules, each like "AsfReadOptions::unit_m = 0 (must be > 0)"; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Reads an Acclaim skeleton (ASF 1.10), as CMU, HDM05 and Vicon BodyBuilder write it.
///
/// Lengths are in inches over `:units length`: 0.45, which all those files have, makes a unit of
/// 0.0564 m. Where it is absent or 1, which writers leave who never thought of inches, the unit is
/// guessed as read_bvh does. `axis` rotates about fixed axes, first letter first. The pre-set
/// position and orientation of the root apply after the motion; all known files have zeros.
///
/// Accepted: sections in any order, comments, CRLF, any encoding that keeps ASCII (documentation in
/// Latin-1); bones without dof, limits of any form (they are not used). A section or a line that is
/// not known is ignored with a warning.
///
/// @param text  the whole file.
/// @param name  of the file, for messages.
/// @throws Error{kUsage} if `options` has problems. Error{kFormat} "name:line:column: ..." with the
///         mend: NaN or infinity, a number beyond 1e30, a bone twice, without a name, without a
///         direction or in no line of :hierarchy, a bone with two parents or that is its own
///         ancestor, more than kMaxAsfBones.
/// Time and memory O(size).
[[nodiscard]] AsfFile read_asf(std::string_view text, std::string_view name,
                               const AsfReadOptions& options = {});

/// One frame of the skeleton at rest, at kUsualAmcRateHz.
[[nodiscard]] motion::Clip rest_clip(const AsfFile& skeleton);

struct AmcReadOptions {
  /// Frame rate, > 0, Hz; nullopt: `:SAMPLES-PER-SECOND`, else kUsualAmcRateHz.
  std::optional<double> frame_rate_hz = {};

  /// Broken rules, as AsfReadOptions::problems.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct AmcFile {
  motion::Clip clip;
  bool frame_rate_guessed = false;  ///< true if neither file nor options told it
  std::vector<std::string> warnings;
};

/// Reads the motion (AMC) of an Acclaim skeleton.
///
/// With C the axes of a bone and M the rotations of its line, composed about fixed axes in the
/// order of its dof, the joint's rotation from its parent is C M C^-1. tx, ty, tz move the bone's
/// beginning along its axes, l adds to its length. Bones may come in any order within a frame; a
/// bone without dof needs no line. Frames that do not count up from 1 by ones are read one after
/// the other, with a warning.
///
/// @throws Error{kUsage} if `options` has problems. Error{kFormat} "name:line:column: ..." for a
///         bone that the skeleton does not have, that a frame lacks or has twice, a wrong number of
///         values, a value that is no finite number, no frame at all; more than max(2^20, bytes/4)
///         rotations, most of bones without dof.
/// Time O(size), memory bounded by a multiple of the file's size.
[[nodiscard]] AmcFile read_amc(std::string_view text, std::string_view name,
                               const AsfFile& skeleton, const AmcReadOptions& options = {});

}  // namespace laban::io
