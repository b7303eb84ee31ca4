#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "laban/base/error.h"
#include "laban/loop/endless_loop.h"
#include "laban/math/rotation.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/motion/root_motion.h"

#include "loop/held_feet.h"
#include "loop/seam_search.h"

namespace laban::loop {
namespace {

using base::Error;
using base::ErrorKind;
using Frames = std::vector<BodyFrame>;

constexpr int kFewestToClose = 8;
/// Slower net travel than this is drift, leg lengths a second.
constexpr double kTravels = 0.15;
constexpr double kEndsFadeS = 0.5;

void check(const LoopOptions& options) {
  const auto problems = options.problems();
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
}

/// @param what  "a loop needs a clip", which is said of it.
void check_length(const motion::Capture& capture, const std::string& what) {
  if (capture.clip.frame_count() < kFewestToClose) {
    throw Error(ErrorKind::kData, what + " of at least " + std::to_string(kFewestToClose) +
                                      " frames, not " + std::to_string(capture.clip.frame_count()));
  }
}

/// A capture as the seams see it.
struct Sewable {
  motion::FoundContacts contacts;
  Frames frames;
  UsualMotion usual;
};

Sewable sewable(const motion::Capture& capture, const BodyRows& rows) {
  Sewable result;
  result.contacts = motion::find_foot_contacts(capture.clip, capture.humanoid);
  result.frames = to_body_frames(capture.clip, rows, result.contacts.contacts);
  result.usual = usual_motion(rows, result.frames, capture.clip.frame_rate_hz());
  return result;
}

/// What one round of a loop moves the body by, and how much of that is to be taken back.
struct Round {
  PlanarMotion motion;
  int frames = 0;
  Eigen::Vector3d travel = Eigen::Vector3d::Zero();  // of the hips, metres
  double turn = 0.0;                                 // to the nearest whole turn, radians
};

/// Takes travel and turn back evenly, so that the frame after the last is the first.
void close_round(const Round& round, Frames& frames) {
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double share = static_cast<double>(t) / round.frames;
    BodyFrame& frame = frames[t];
    frame.rotations[0] =
        (math::yaw_rotation(-share * round.turn) * frame.rotations[0]).normalized();
    frame.hips -= share * round.travel;
    frame.added_steps.colwise() -= round.travel / round.frames;
  }
}

Frames moved(Frames frames, const PlanarMotion& motion) {
  for (BodyFrame& frame : frames) frame.move(motion);
  return frames;
}

PlanarMotion inverse(const PlanarMotion& motion) {
  return {-motion.yaw, math::yaw_rotation(-motion.yaw) * -motion.shift};
}

/// Feet of a loop held as if it had always been running: the middle one of three rounds, whose last
/// frames fade into those of the round before, after which comes its own first frame.
HeldFrames hold_round(const Frames& round, int join, const PlanarMotion& motion,
                      const BodyRows& rows, const motion::Capture& capture,
                      const motion::FootFloor& floor) {
  const int count = static_cast<int>(round.size());
  Frames rounds = moved(round, inverse(motion));
  rounds.insert(rounds.end(), round.begin(), round.end());
  const Frames after = moved(round, motion);
  rounds.insert(rounds.end(), after.begin(), after.end());
  HeldFrames held =
      hold_feet(rounds, rows, capture, floor, {join, count + join, 2 * count + join}, false);
  Frames before(held.frames.begin(), held.frames.begin() + count);
  before = moved(std::move(before), motion);
  Frames own(held.frames.begin() + count, held.frames.begin() + 2 * count);
  const int fade =
      std::min(count / 2, static_cast<int>(std::lround(kEndsFadeS * capture.clip.frame_rate_hz())));
  for (int f = 0; f < fade; ++f) {
    const int at = count - fade + f;
    const auto cell = static_cast<std::size_t>(at);
    const double x = (f + 1.0) / fade;
    own[cell] = mix(own[cell], before[cell], x * x * (3.0 - 2.0 * x));
  }
  return {std::move(own), held.stances / 3};
}

bool same_skeleton(const motion::Skeleton& a, const motion::Skeleton& b) {
  if (a.joint_count() != b.joint_count()) return false;
  for (int j = 0; j < a.joint_count(); ++j) {
    if (a.joint(j).name != b.joint(j).name || a.joint(j).parent != b.joint(j).parent ||
        (j > 0 && (a.joint(j).rest_offset - b.joint(j).rest_offset).norm() > 1e-3)) {
      return false;
    }
  }
  return true;
}

/// The second capture on the first one's skeleton, at its rate.
motion::Capture brought_to(const motion::Capture& first, const motion::Capture& second) {
  const double rate_hz = first.clip.frame_rate_hz();
  if (same_skeleton(first.clip.skeleton(), second.clip.skeleton())) {
    return {motion::resample(second.clip, rate_hz), second.humanoid};
  }
  motion::PoseMatrix pose =
      motion::resample(motion::to_pose_matrix(second.clip, second.humanoid), rate_hz);
  return {motion::from_pose_matrix(pose, first.humanoid, first.clip), first.humanoid};
}

/// Both with offsets of their own where one has them.
void give_offsets(Frames& frames, const Frames& other, const BodyRows& rows) {
  if (frames.front().offsets.cols() > 0 || other.front().offsets.cols() == 0) return;
  Eigen::Matrix3Xd rest(3, rows.count());
  for (int r = 0; r < rows.count(); ++r) {
    rest.col(r) = rows.rest_offsets[static_cast<std::size_t>(r)];
  }
  for (BodyFrame& frame : frames) frame.offsets = rest;
}

/// How far to lift a clip so that it stands where another does: by heels or toes, whichever are
/// nearer to one another, since in a clip danced on the toes heels stand nowhere.
double lift_between(const motion::FootFloor& from, const motion::FootFloor& to) {
  const double heels = to.heel_m - from.heel_m;
  const double toes = to.toe_m - from.toe_m;
  return std::abs(heels) < std::abs(toes) ? heels : toes;
}

}  // namespace

SeamlessLoop seamless_loop(const motion::Capture& given, const LoopOptions& options) {
  check(options);
  check_length(given, "a loop needs a clip");
  const int left_out = first_flowing_frame(given.clip, given.humanoid);
  const motion::Capture capture = flowing(given, left_out);
  const double rate_hz = capture.clip.frame_rate_hz();
  const BodyRows rows(capture.clip.skeleton(), capture.humanoid);
  const Sewable sewn = sewable(capture, rows);
  const SewnSeam seam = find_seams({rows, sewn.frames, sewn.frames, rate_hz, sewn.usual, capture,
                                    sewn.contacts.floor, options.hold_feet},
                                   options.seam, 1)
                            .front();
  const int in_end = seam.found.in_begin + seam.found.frames;
  Frames frames(sewn.frames.begin() + in_end, sewn.frames.begin() + seam.found.out_begin);
  const int seam_begin = static_cast<int>(frames.size());
  frames.insert(frames.end(), seam.frames.begin(), seam.frames.end());

  Round round{seam.outgoing_from_incoming, static_cast<int>(frames.size()), {}, 0.0};
  const BodyFrame& first = sewn.frames[static_cast<std::size_t>(in_end)];
  round.travel = round.motion(first.hips) - first.hips;
  round.turn = math::nearest_angle(round.motion.yaw, 0.0);
  const double duration_s = round.frames / rate_hz;
  const bool travels =
      round.travel.norm() > kTravels * capture.humanoid.leg_length_m() * duration_s;
  const bool closed = options.in_place || !travels;
  // What travels and is to stay in place stands on the ground while it travels.
  const bool closed_first = closed && !travels;
  if (closed_first) {
    close_round(round, frames);
    round.motion = {};
  }
  HeldFrames held{frames, 0};
  if (options.hold_feet && sewn.contacts.floor) {
    held = hold_round(frames, seam_begin + seam.join, round.motion, rows, capture,
                      *sewn.contacts.floor);
  }
  if (closed && !closed_first) close_round(round, held.frames);
  SeamlessLoop loop{to_clip(held.frames, rows, capture.clip),
                    {},
                    seam.found,
                    seam_begin,
                    seam_begin + seam.found.played_frames,
                    closed ? 0.0 : round.travel.norm(),
                    closed ? 0.0 : round.turn,
                    closed,
                    closed ? 0.0 : round.motion.yaw,
                    closed ? Eigen::Vector3d::Zero().eval() : round.motion.shift,
                    held.stances};
  if (options.in_place) loop.clip = motion::in_place(loop.clip, capture.humanoid);
  for (const BodyFrame& frame : held.frames) {
    loop.source_frames.push_back(frame.source_frame + left_out);
  }
  return loop;
}

JoinedClips join_clips(const motion::Capture& given, const motion::Capture& second,
                       const LoopOptions& options) {
  check(options);
  check_length(given, "a seam needs a first clip");
  check_length(second, "a seam needs a second clip");
  const motion::Capture first = flowing(given, first_flowing_frame(given.clip, given.humanoid));
  const double rate_hz = first.clip.frame_rate_hz();
  const motion::Capture other =
      brought_to(first, flowing(second, first_flowing_frame(second.clip, second.humanoid)));
  check_length(other, "a seam needs, at the first clip's rate, a second clip");
  const BodyRows rows(first.clip.skeleton(), first.humanoid);
  Sewable a = sewable(first, rows);
  Sewable b = sewable(other, rows);
  give_offsets(a.frames, b.frames, rows);
  give_offsets(b.frames, a.frames, rows);
  if (a.contacts.floor && b.contacts.floor) {
    const double lift_m = lift_between(*b.contacts.floor, *a.contacts.floor);
    for (BodyFrame& frame : b.frames) frame.hips.y() += lift_m;
  }
  UsualMotion usual = a.usual;
  usual.speed_m_s = std::max(usual.speed_m_s, b.usual.speed_m_s);
  usual.acceleration_m_s2 = std::max(usual.acceleration_m_s2, b.usual.acceleration_m_s2);
  const auto floor = a.contacts.floor ? a.contacts.floor : b.contacts.floor;
  const SewnSeam seam =
      find_seams({rows, a.frames, b.frames, rate_hz, usual, first, floor, options.hold_feet},
                 options.seam, 1)
          .front();
  Frames frames(a.frames.begin(), a.frames.begin() + seam.found.out_begin);
  frames.insert(frames.end(), seam.frames.begin(), seam.frames.end());
  const int in_end = seam.found.in_begin + seam.found.frames;
  for (auto f = b.frames.begin() + in_end; f != b.frames.end(); ++f) {
    frames.push_back(*f);
    frames.back().move(seam.outgoing_from_incoming);
    // Joints above the hips are the first clip's.
    frames.back().source_frame = seam.found.out_begin;
  }
  for (int t = seam.join; t < seam.found.played_frames; ++t) {
    const int frame = seam.found.out_begin + t;
    frames[static_cast<std::size_t>(frame)].source_frame = seam.found.out_begin;
  }
  HeldFrames held{frames, 0};
  if (options.hold_feet && floor) {
    held = hold_feet(frames, rows, first, *floor, {seam.found.out_begin + seam.join}, true);
  }
  JoinedClips joined{to_clip(held.frames, rows, first.clip), seam.found, seam.found.out_begin,
                     seam.found.out_begin + seam.found.played_frames, held.stances};
  if (options.in_place) joined.clip = motion::in_place(joined.clip, first.humanoid);
  return joined;
}

}  // namespace laban::loop
