#include "loop/body_track.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"

namespace laban::loop {
namespace {

constexpr double kLeastReachShare = 0.05;

std::vector<double> chain_lengths(const motion::Skeleton& skeleton) {
  std::vector<double> below(skeleton.joints().size(), 0.0);
  for (std::size_t j = skeleton.joints().size(); j-- > 0;) {
    const motion::Joint& joint = skeleton.joints()[j];
    if (joint.end_site) below[j] = std::max(below[j], joint.end_site->norm());
    if (joint.parent < 0) continue;
    double& above = below[static_cast<std::size_t>(joint.parent)];
    above = std::max(above, below[j] + joint.rest_offset.norm());
  }
  return below;
}

/// Transforms of the joints above the hips (and of others beside them) at a frame of the source.
struct Above {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // model from the hips' parent
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

Above above_hips(const motion::Clip& source, int frame, int hips) {
  Above above;
  std::vector<int> chain;
  for (int j = source.skeleton().joint(hips).parent; j >= 0;
       j = source.skeleton().joint(j).parent) {
    chain.push_back(j);
  }
  for (auto j = chain.rbegin(); j != chain.rend(); ++j) {
    above.position += above.rotation * source.translation(frame, *j);
    above.rotation = (above.rotation * source.rotation(frame, *j)).normalized();
  }
  return above;
}

}  // namespace

Eigen::Vector3d PlanarMotion::operator()(const Eigen::Vector3d& point) const {
  return math::yaw_rotation(yaw) * point + shift;
}

PlanarMotion PlanarMotion::after(const PlanarMotion& other) const {
  return {yaw + other.yaw, (*this)(other.shift)};
}

void BodyFrame::move(const PlanarMotion& motion) {
  hips = motion(hips);
  rotations[0] = (math::yaw_rotation(motion.yaw) * rotations[0]).normalized();
  added_steps = math::yaw_rotation(motion.yaw).toRotationMatrix() * added_steps;
}

BodyRows::BodyRows(const motion::Skeleton& skeleton, const motion::Humanoid& humanoid) {
  if (humanoid.rig_joint_count() != skeleton.joint_count()) {
    throw base::Error(base::ErrorKind::kUsage, "the humanoid was made for a skeleton of " +
                                                   std::to_string(humanoid.rig_joint_count()) +
                                                   " joints, not " +
                                                   std::to_string(skeleton.joint_count()));
  }
  const int hips = humanoid.mapped(motion::StandardJoint::kHips).value().joint;
  leg_length_m = humanoid.leg_length_m();
  std::vector<int> row_of(skeleton.joints().size(), -1);
  const std::vector<double> below = chain_lengths(skeleton);
  std::vector<double> reach;
  for (int j = hips; j < skeleton.joint_count(); ++j) {
    const int parent = skeleton.joint(j).parent;
    if (j != hips && (parent < 0 || row_of[static_cast<std::size_t>(parent)] < 0)) continue;
    row_of[static_cast<std::size_t>(j)] = count();
    parents.push_back(j == hips ? -1 : row_of[static_cast<std::size_t>(parent)]);
    joints.push_back(j);
    rest_offsets.push_back(skeleton.joint(j).rest_offset);
    reach.push_back(below[static_cast<std::size_t>(j)] +
                    kLeastReachShare * humanoid.leg_length_m());
    if (humanoid.played_by(j)) points.push_back(count() - 1);
  }
  reach_m = Eigen::Map<Eigen::VectorXd>(reach.data(), std::ssize(reach));
  for (int p = 0; p < motion::kFootPointCount; ++p) {
    const auto foot = p < 2 ? motion::StandardJoint::kLeftFoot : motion::StandardJoint::kRightFoot;
    const int joint = humanoid.mapped(foot).value().joint;
    feet[static_cast<std::size_t>(p)] = std::max(0, row_of[static_cast<std::size_t>(joint)]);
  }
  for (std::size_t side = 0; side < toes.size(); ++side) {
    const auto& toe = humanoid.mapped(side == 0 ? motion::StandardJoint::kLeftToe
                                                : motion::StandardJoint::kRightToe);
    const int row = toe ? row_of[static_cast<std::size_t>(toe->joint)] : -1;
    toes[side] = row >= 0 ? row : feet[2 * side];
  }
}

Eigen::Matrix3Xd positions(const BodyRows& rows, const BodyFrame& frame) {
  Eigen::Matrix3Xd model(3, rows.count());
  std::vector<Eigen::Quaterniond> turned(rows.joints.size());
  model.col(0) = frame.hips;
  turned[0] = frame.rotations[0];
  for (std::size_t r = 1; r < rows.joints.size(); ++r) {
    const auto above = static_cast<std::size_t>(rows.parents[r]);
    const auto row = static_cast<Eigen::Index>(r);
    const Eigen::Vector3d offset =
        frame.offsets.cols() > 0 ? Eigen::Vector3d(frame.offsets.col(row)) : rows.rest_offsets[r];
    model.col(row) = model.col(rows.parents[r]) + turned[above] * offset;
    turned[r] = turned[above] * frame.rotations[r];
  }
  return model;
}

std::vector<BodyFrame> to_body_frames(const motion::Clip& clip, const BodyRows& rows,
                                      const motion::FootContacts& contacts) {
  LABAN_CHECK(contacts.frame_count() == clip.frame_count());
  std::vector<BodyFrame> frames(static_cast<std::size_t>(clip.frame_count()));
  for (int f = 0; f < clip.frame_count(); ++f) {
    BodyFrame& frame = frames[static_cast<std::size_t>(f)];
    const Above above = above_hips(clip, f, rows.joints[0]);
    frame.hips = above.position + above.rotation * clip.translation(f, rows.joints[0]);
    if (clip.has_translations()) frame.offsets.resize(3, rows.count());
    for (int r = 0; r < rows.count(); ++r) {
      const int joint = rows.joints[static_cast<std::size_t>(r)];
      frame.rotations.push_back(clip.rotation(f, joint));
      if (clip.has_translations()) frame.offsets.col(r) = clip.translation(f, joint);
    }
    frame.rotations[0] = (above.rotation * frame.rotations[0]).normalized();
    frame.contacts = contacts.share.col(f);
    frame.source_frame = f;
  }
  return frames;
}

motion::Clip to_clip(const std::vector<BodyFrame>& frames, const BodyRows& rows,
                     const motion::Clip& source) {
  const int joint_count = source.joint_count();
  const int hips = rows.joints[0];
  const bool translates = source.has_translations() || hips != 0;
  const auto frame_count = std::ssize(frames);
  Eigen::Matrix3Xd roots(3, frame_count);
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(frames.size() * static_cast<std::size_t>(joint_count));
  Eigen::Matrix3Xd translations(3, translates ? frame_count * joint_count : 0);
  for (std::ptrdiff_t f = 0; f < frame_count; ++f) {
    const BodyFrame& frame = frames[static_cast<std::size_t>(f)];
    const int at =
        std::clamp(static_cast<int>(std::lround(frame.source_frame)), 0, source.frame_count() - 1);
    const Above above = above_hips(source, at, hips);
    const auto place = source.rotations(at);
    const auto first = std::ssize(rotations);
    rotations.insert(rotations.end(), place.begin(), place.end());
    for (int j = 0; j < joint_count && translates; ++j) {
      translations.col(first + j) = source.translation(at, j);
    }
    for (std::size_t r = 0; r < rows.joints.size(); ++r) {
      const auto row = static_cast<Eigen::Index>(r);
      rotations[static_cast<std::size_t>(first + rows.joints[r])] = frame.rotations[r];
      if (translates && frame.offsets.cols() > 0) {
        translations.col(first + rows.joints[r]) = frame.offsets.col(row);
      }
    }
    auto& turned = rotations[static_cast<std::size_t>(first + hips)];
    turned = (above.rotation.conjugate() * frame.rotations[0]).normalized();
    const Eigen::Vector3d own = above.rotation.conjugate() * (frame.hips - above.position);
    if (translates) translations.col(first + hips) = own;
    roots.col(f) = hips == 0 ? own : source.translation(at, 0);
  }
  return {source.shared_skeleton(), source.frame_rate_hz(), std::move(roots), std::move(rotations),
          std::move(translations)};
}

BodyFrame mix(const BodyFrame& a, const BodyFrame& b, double share) {
  BodyFrame mixed;
  mixed.hips = (1.0 - share) * a.hips + share * b.hips;
  mixed.rotations.reserve(a.rotations.size());
  for (std::size_t r = 0; r < a.rotations.size(); ++r) {
    mixed.rotations.push_back(a.rotations[r].slerp(share, b.rotations[r]).normalized());
  }
  if (a.offsets.cols() > 0) mixed.offsets = (1.0 - share) * a.offsets + share * b.offsets;
  mixed.contacts = (1.0 - share) * a.contacts + share * b.contacts;
  mixed.added_steps = (1.0 - share) * a.added_steps + share * b.added_steps;
  mixed.source_frame = share < 0.5 ? a.source_frame : b.source_frame;
  return mixed;
}

BodyFrame sample(const std::vector<BodyFrame>& frames, double place) {
  const double last = static_cast<double>(frames.size() - 1);
  const double at = std::clamp(place, 0.0, last);
  const double whole = std::floor(at);
  const auto before = static_cast<std::size_t>(whole);
  if (at == whole) return frames[before];
  const double x = at - whole;
  const BodyFrame& b = frames[before];
  const BodyFrame& c = frames[before + 1];
  BodyFrame between = mix(b, c, x);
  between.source_frame = b.source_frame + x * (c.source_frame - b.source_frame);
  // At a leap from one frame of the source to another there is none between.
  if (std::abs(c.source_frame - b.source_frame) > 2.0) between.source_frame = c.source_frame;
  if (before == 0 || before + 2 >= frames.size()) return between;
  const BodyFrame& a = frames[before - 1];
  const BodyFrame& d = frames[before + 2];
  // Weights of a Catmull-Rom spline.
  const double wa = x * (-0.5 + x * (1.0 - 0.5 * x));
  const double wb = 1.0 + x * x * (-2.5 + 1.5 * x);
  const double wc = x * (0.5 + x * (2.0 - 1.5 * x));
  const double wd = x * x * (-0.5 + 0.5 * x);
  between.hips = wa * a.hips + wb * b.hips + wc * c.hips + wd * d.hips;
  if (b.offsets.cols() > 0) {
    between.offsets = wa * a.offsets + wb * b.offsets + wc * c.offsets + wd * d.offsets;
  }
  for (std::size_t r = 0; r < b.rotations.size(); ++r) {
    const Eigen::Quaterniond& q = b.rotations[r];
    const auto to = [&](const BodyFrame& other) {
      return math::log(q.conjugate() * math::same_hemisphere(other.rotations[r], q));
    };
    between.rotations[r] = (q * math::exp(wa * to(a) + wc * to(c) + wd * to(d))).normalized();
  }
  return between;
}

}  // namespace laban::loop
