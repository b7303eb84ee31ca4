#include "laban/motion/foot_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "laban/base/error.h"
#include "laban/math/low_pass.h"
#include "laban/math/statistics.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"

namespace laban::motion {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::Vector3d;

/// Of the foot's length (foot joint to toe joint, over ground), how far the heel lies behind the
/// foot joint: adults have about 5 cm of heel to 17 from ankle to ball.
constexpr double kHeelShare = 0.3;
/// Heels and toes that stand farther apart in height than this are not on one floor, metres.
constexpr double kMostLevelGap = 0.08;
constexpr double kFloorPercentile = 10.0;

/// Heel and toe in the space of the rig's foot joint.
struct FootShape {
  int foot = 0;
  std::optional<int> toe_joint;
  Vector3d heel = Vector3d::Zero();
  Vector3d toe = Vector3d::Zero();  ///< if there is no toe joint
};

FootShape shape_of(const ModelPose& pose, const Humanoid& humanoid, bool left) {
  const MappedJoint& foot =
      *humanoid.mapped(left ? StandardJoint::kLeftFoot : StandardJoint::kRightFoot);
  const auto& toe = humanoid.mapped(left ? StandardJoint::kLeftToe : StandardJoint::kRightToe);
  FootShape shape;
  shape.foot = foot.joint;
  // From the foot joint to the toe while the foot stands flat and points to +Z.
  Vector3d flat = humanoid.leg_length_m() / kStandardLegLengthM * Vector3d(0.0, -0.06, 0.13);
  if (toe) {
    shape.toe_joint = toe->joint;
    flat = foot.reference * (pose.rotations[static_cast<std::size_t>(foot.joint)].conjugate() *
                             (pose.positions.col(toe->joint) - pose.positions.col(foot.joint)));
  }
  const double length = std::hypot(flat.x(), flat.z());
  shape.heel = foot.reference.conjugate() * Vector3d(0.0, flat.y(), -kHeelShare * length);
  shape.toe = foot.reference.conjugate() * flat;
  return shape;
}

void write_foot(const ModelPose& pose, const FootShape& shape, Index frame, Eigen::Matrix3Xd& heel,
                Eigen::Matrix3Xd& toe) {
  const Vector3d foot = pose.positions.col(shape.foot);
  const Eigen::Quaterniond& rotation = pose.rotations[static_cast<std::size_t>(shape.foot)];
  heel.col(frame) = foot + rotation * shape.heel;
  if (shape.toe_joint) {
    toe.col(frame) = pose.positions.col(*shape.toe_joint);
  } else {
    toe.col(frame) = foot + rotation * shape.toe;
  }
}

/// Speed in m/s of every frame: central differences of smoothed paths, one-sided at the ends.
Eigen::RowVectorXd speeds(const Eigen::Matrix3Xd& path, double rate_hz, double cutoff_hz) {
  const Index frames = path.cols();
  const Eigen::MatrixXd smooth = math::low_pass(path, rate_hz, cutoff_hz);
  Eigen::RowVectorXd speed = Eigen::RowVectorXd::Zero(frames);
  for (Index f = 0; f < frames; ++f) {
    const Index before = std::max<Index>(f - 1, 0);
    const Index after = std::min<Index>(f + 1, frames - 1);
    if (after == before) continue;
    speed(f) = (smooth.col(after) - smooth.col(before)).norm() * rate_hz /
               static_cast<double>(after - before);
  }
  return speed;
}

/// Height and speed of one point over time.
struct PointMotion {
  Eigen::RowVectorXd height;
  Eigen::RowVectorXd speed;
};

/// The lowest level at which two points are slow; nullopt if they never are long enough.
std::optional<double> lowest_level(const PointMotion& left, const PointMotion& right,
                                   double slow_m_s, double shortest_frames) {
  std::vector<double> heights;
  for (const PointMotion* point : {&left, &right}) {
    for (Index f = 0; f < point->height.size(); ++f) {
      if (point->speed(f) <= slow_m_s) heights.push_back(point->height(f));
    }
  }
  if (heights.empty() || static_cast<double>(heights.size()) < shortest_frames) return std::nullopt;
  return math::percentile(heights, kFloorPercentile);
}

/// Flips runs of `value` that are shorter than `shortest` frames; runs at the clip's ends may go on
/// beyond it and stay.
void drop_short_runs(std::vector<bool>& on, bool value, double shortest) {
  const std::size_t count = on.size();
  for (std::size_t begin = 0; begin < count;) {
    std::size_t end = begin;
    while (end < count && on[end] == on[begin]) ++end;
    const bool inside = begin > 0 && end < count;
    if (on[begin] == value && inside && static_cast<double>(end - begin) < shortest) {
      std::fill(on.begin() + static_cast<std::ptrdiff_t>(begin),
                on.begin() + static_cast<std::ptrdiff_t>(end), !value);
    }
    begin = end;
  }
}

/// Contacts of one point above a floor at `level`.
std::vector<bool> contacts_of(const PointMotion& point, double level, double scale,
                              const FootContactOptions& options, double shortest_frames) {
  std::vector<bool> on;
  bool down = false;
  for (Index f = 0; f < point.height.size(); ++f) {
    const double height = point.height(f) - level;
    const double speed = point.speed(f);
    if (down) {
      down = height <= scale * options.leave_height_m && speed <= scale * options.leave_speed_m_s;
    } else {
      down = height <= scale * options.enter_height_m && speed <= scale * options.enter_speed_m_s;
    }
    on.push_back(down);
  }
  drop_short_runs(on, false, shortest_frames);
  drop_short_runs(on, true, shortest_frames);
  return on;
}

void require_sound(const FootPaths& paths, double leg_length_m) {
  if (!(paths.frame_rate_hz > 0.0 && std::isfinite(paths.frame_rate_hz))) {
    throw Error(ErrorKind::kUsage, "foot contacts: frame rate of " +
                                       std::to_string(paths.frame_rate_hz) +
                                       " Hz (must be positive and finite)");
  }
  if (!(leg_length_m > 0.0 && std::isfinite(leg_length_m))) {
    throw Error(ErrorKind::kUsage, "foot contacts: leg length of " + std::to_string(leg_length_m) +
                                       " m (must be positive and finite)");
  }
  for (const Eigen::Matrix3Xd& path : paths.points) {
    if (path.cols() < 1 || path.cols() != paths.points[0].cols() || !path.allFinite()) {
      throw Error(
          ErrorKind::kData,
          "foot contacts: the four paths must be finite and have the same frames, 1 or more");
    }
  }
}

/// Median height of the heels (or toes) in contact.
std::optional<double> standing_height(const std::array<PointMotion, kFootPointCount>& points,
                                      const FootContacts& contacts, bool toes) {
  std::vector<double> heights;
  for (int p = 0; p < kFootPointCount; ++p) {
    const auto point = static_cast<FootPoint>(p);
    if (is_toe(point) != toes) continue;
    for (int f = 0; f < contacts.frame_count(); ++f) {
      if (contacts.touches(point, f)) {
        heights.push_back(points[static_cast<std::size_t>(p)].height(f));
      }
    }
  }
  if (heights.empty()) return std::nullopt;
  return math::median(heights);
}

}  // namespace

std::vector<std::string> FootContactOptions::problems() const {
  std::vector<std::string> list;
  const auto require = [&](bool good, const std::string& text) {
    if (!good) list.push_back("FootContactOptions::" + text);
  };
  require(enter_height_m > 0.0 && std::isfinite(leave_height_m) && enter_height_m <= leave_height_m,
          "enter_height_m must be > 0 and at most leave_height_m");
  require(
      enter_speed_m_s > 0.0 && std::isfinite(leave_speed_m_s) && enter_speed_m_s <= leave_speed_m_s,
      "enter_speed_m_s must be > 0 and at most leave_speed_m_s");
  require(shortest_s >= 0.0 && std::isfinite(shortest_s), "shortest_s must be >= 0");
  require(cutoff_hz > 0.0 && std::isfinite(cutoff_hz), "cutoff_hz must be > 0");
  return list;
}

FootPaths foot_paths(const Clip& clip, const Humanoid& humanoid) {
  if (clip.joint_count() != humanoid.rig_joint_count()) {
    throw Error(ErrorKind::kUsage, "foot_paths: the clip has " +
                                       std::to_string(clip.joint_count()) +
                                       " joints, the humanoid was made for " +
                                       std::to_string(humanoid.rig_joint_count()));
  }
  FootPaths paths;
  paths.frame_rate_hz = clip.frame_rate_hz();
  for (Eigen::Matrix3Xd& path : paths.points) path.resize(3, clip.frame_count());
  const ModelPose first = forward_kinematics(clip, 0);
  const FootShape left = shape_of(first, humanoid, true);
  const FootShape right = shape_of(first, humanoid, false);
  for (int f = 0; f < clip.frame_count(); ++f) {
    const ModelPose pose = forward_kinematics(clip, f);
    write_foot(pose, left, f, paths.points[0], paths.points[1]);
    write_foot(pose, right, f, paths.points[2], paths.points[3]);
  }
  return paths;
}

FoundContacts find_foot_contacts(const FootPaths& paths, double leg_length_m,
                                 const FootContactOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  require_sound(paths, leg_length_m);
  const double scale = leg_length_m / kStandardLegLengthM;
  const double shortest_frames = options.shortest_s * paths.frame_rate_hz;
  std::array<PointMotion, kFootPointCount> points;
  for (std::size_t p = 0; p < points.size(); ++p) {
    points[p] = {paths.points[p].row(1),
                 speeds(paths.points[p], paths.frame_rate_hz, options.cutoff_hz)};
  }
  const double slow = scale * options.enter_speed_m_s;
  std::array<std::optional<double>, 2> levels = {
      lowest_level(points[0], points[2], slow, shortest_frames),
      lowest_level(points[1], points[3], slow, shortest_frames)};
  if (levels[0] && levels[1]) {
    const double gap = *levels[0] - *levels[1];
    if (gap > scale * kMostLevelGap) levels[0].reset();
    if (gap < -scale * kMostLevelGap) levels[1].reset();
  }
  FoundContacts found;
  found.contacts = {paths.frame_rate_hz, Eigen::Matrix4Xd::Zero(4, paths.frame_count())};
  for (int p = 0; p < kFootPointCount; ++p) {
    const auto& level = levels[is_toe(static_cast<FootPoint>(p)) ? 1 : 0];
    if (!level) continue;
    const std::vector<bool> on =
        contacts_of(points[static_cast<std::size_t>(p)], *level, scale, options, shortest_frames);
    for (std::size_t f = 0; f < on.size(); ++f) {
      found.contacts.share(p, static_cast<Index>(f)) = on[f] ? 1.0 : 0.0;
    }
  }
  const std::optional<double> heel = standing_height(points, found.contacts, false);
  const std::optional<double> toe = standing_height(points, found.contacts, true);
  if (heel || toe)
    found.floor = FootFloor{heel.value_or(toe.value_or(0.0)), toe.value_or(heel.value_or(0.0))};
  return found;
}

FoundContacts find_foot_contacts(const Clip& clip, const Humanoid& humanoid,
                                 const FootContactOptions& options) {
  return find_foot_contacts(foot_paths(clip, humanoid), humanoid.leg_length_m(), options);
}

FoundContacts find_foot_contacts(const PoseMatrix& pose, const FootContactOptions& options) {
  const Clip clip = to_standard_clip(pose);
  static const Humanoid humanoid = find_humanoid(clip);  // of the one standard skeleton
  return find_foot_contacts(clip, humanoid, options);
}

FootContacts sample(const FootContacts& contacts, std::span<const double> frames,
                    double frame_rate_hz) {
  if (contacts.frame_count() < 1)
    throw Error(ErrorKind::kData, "foot contacts: no frame to sample");
  FootContacts result{frame_rate_hz, Eigen::Matrix4Xd(4, static_cast<Index>(frames.size()))};
  const Index last = contacts.frame_count() - 1;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (!std::isfinite(frames[k])) {
      throw Error(ErrorKind::kUsage,
                  "foot contacts: frame " + std::to_string(k) + " to sample at is not finite");
    }
    const double at = std::clamp(frames[k], 0.0, static_cast<double>(last));
    const auto before = static_cast<Index>(at);
    const double share = at - static_cast<double>(before);
    result.share.col(static_cast<Index>(k)) =
        (1.0 - share) * contacts.share.col(before) +
        share * contacts.share.col(std::min(before + 1, last));
  }
  return result;
}

FootContacts resample(const FootContacts& contacts, double frame_rate_hz) {
  if (!(frame_rate_hz > 0.0 && std::isfinite(frame_rate_hz))) {
    throw Error(ErrorKind::kUsage, "foot contacts: frame rate of " + std::to_string(frame_rate_hz) +
                                       " Hz (must be positive and finite)");
  }
  const double step = contacts.frame_rate_hz / frame_rate_hz;
  // As many frames as motion::resample gives a clip.
  const int count = static_cast<int>(std::floor((contacts.frame_count() - 1) / step + 1e-6)) + 1;
  std::vector<double> frames;
  for (int k = 0; k < count; ++k) frames.push_back(k * step);
  return sample(contacts, frames, frame_rate_hz);
}

FootContacts mix(const FootContacts& a, const FootContacts& b, double alpha) {
  if (a.frame_count() != b.frame_count() || a.frame_rate_hz != b.frame_rate_hz) {
    throw Error(ErrorKind::kData, "foot contacts: " + std::to_string(a.frame_count()) + " and " +
                                      std::to_string(b.frame_count()) +
                                      " frames cannot be mixed (rates and counts must agree)");
  }
  const double weight = std::clamp(alpha, 0.0, 1.0);
  return {a.frame_rate_hz, (1.0 - weight) * a.share + weight * b.share};
}

FootContacts concatenate(std::span<const FootContacts> parts) {
  if (parts.empty()) throw Error(ErrorKind::kUsage, "foot contacts: no part to concatenate");
  Index count = 0;
  for (const FootContacts& part : parts) {
    if (part.frame_rate_hz != parts[0].frame_rate_hz) {
      throw Error(ErrorKind::kData, "foot contacts: parts of " +
                                        std::to_string(parts[0].frame_rate_hz) + " and " +
                                        std::to_string(part.frame_rate_hz) + " Hz");
    }
    count += part.frame_count();
  }
  FootContacts all{parts[0].frame_rate_hz, Eigen::Matrix4Xd(4, count)};
  Index begin = 0;
  for (const FootContacts& part : parts) {
    all.share.middleCols(begin, part.frame_count()) = part.share;
    begin += part.frame_count();
  }
  return all;
}

}  // namespace laban::motion
