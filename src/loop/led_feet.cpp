#include "loop/led_feet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "laban/math/rotation.h"
#include "laban/motion/motion_quality.h"
#include "laban/motion/place_feet.h"

#include "loop/foot_slack.h"
#include "loop/held_feet.h"

namespace laban::loop {
namespace {

// Skate and distance that nobody sees, centimetres.
constexpr double kNoSkateCm = 0.01;
constexpr double kNearCm = 0.1;
// A figure below the cross-fade's: with a margin, since what is played is held in longer pieces.
constexpr double kBetter = 0.97;
// How fast led feet go back to where they were blended: hardly, in a stride, at once.
constexpr std::array kPullsPerS = {1.0, 10.0, 20.0, 40.0};
// What is held beside a seam to judge it, seconds.
constexpr double kHeldBesideS = 0.75;
// What shows how legs bend, seconds on either side of a seam.
constexpr double kLegsBesideS = 0.5;

/// The seam with its feet brought to where they are led, the hips above them.
SewnSeam led(const SeamTask& task, const SeamCandidate& candidate, double pull_per_s) {
  const SewnSeam& seam = candidate.seam;
  const int beside = std::max(2, static_cast<int>(std::lround(kLegsBesideS * task.frame_rate_hz)));
  const FeetOverSeam feet =
      feet_over_seam(task.rows, candidate.outgoing, candidate.incoming, candidate.window,
                     candidate.blend_frames, task.frame_rate_hz, pull_per_s);
  Surrounded around = surrounded(task, seam, beside);
  std::array<Eigen::Matrix3Xd, 2> goals;
  for (Eigen::Matrix3Xd& path : goals) path.resize(3, std::ssize(around.frames));
  for (int f = 0; f < static_cast<int>(around.frames.size()); ++f) {
    BodyFrame& frame = around.frames[static_cast<std::size_t>(f)];
    const Eigen::Matrix3Xd own = positions(task.rows, frame);
    const int t = f - around.first;
    const bool inside = t >= 0 && t < seam.found.frames;
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    for (std::size_t side = 0; side < 2; ++side) {
      const Eigen::Vector3d foot = own.col(task.rows.feet[2 * side]);
      goals[side].col(f) = inside ? Eigen::Vector3d(feet.goals[side].col(t)) : foot;
      moved += 0.5 * (goals[side].col(f) - foot);
    }
    // Legs then change only by what the feet are moved apart.
    frame.hips += Eigen::Vector3d(moved.x(), 0.0, moved.z());
  }
  const motion::Clip clip = to_clip(around.frames, task.rows, task.rig.clip);
  const motion::Clip placed = motion::place_feet(clip, task.rig.humanoid, goals);
  motion::FootContacts contacts{task.frame_rate_hz, Eigen::Matrix4Xd(4, clip.frame_count())};
  for (int f = 0; f < clip.frame_count(); ++f) {
    contacts.share.col(f) = around.frames[static_cast<std::size_t>(f)].contacts;
  }
  const std::vector<BodyFrame> frames = to_body_frames(placed, task.rows, contacts);
  SewnSeam with = seam;
  // The first and the last frame are captured ones.
  for (int t = 1; t + 1 < seam.found.frames; ++t) {
    BodyFrame& frame = with.frames[static_cast<std::size_t>(t)];
    const double source_frame = frame.source_frame;
    const int in_around = around.first + t;
    frame = frames[static_cast<std::size_t>(in_around)];
    frame.source_frame = source_frame;
  }
  measure_rates(task, with);
  return with;
}

/// The seam with nothing to hold its feet by: they go where they are blended and led.
SewnSeam let_go(SewnSeam seam) {
  for (int t = 0; t < seam.found.frames; ++t)
    seam.frames[static_cast<std::size_t>(t)].contacts.setZero();
  return seam;
}

/// Standard joints as seen from the body, above the ground and in its heading, all below one
/// another.
Eigen::VectorXf from_the_body(const BodyRows& rows, const BodyFrame& frame) {
  Eigen::Matrix3Xd points = point_positions(rows, frame);
  points.colwise() -= Eigen::Vector3d(frame.hips.x(), 0.0, frame.hips.z());
  points = math::yaw_rotation(-math::heading_of(frame.rotations[0])).toRotationMatrix() * points;
  return points.reshaped().cast<float>();
}

/// A column a frame of both clips, or of the one.
Eigen::MatrixXf captured_poses(const SeamTask& task) {
  std::vector<const std::vector<BodyFrame>*> clips = {&task.outgoing};
  if (&task.incoming != &task.outgoing) clips.push_back(&task.incoming);
  Eigen::Index count = 0;
  for (const auto* frames : clips) count += std::ssize(*frames);
  Eigen::MatrixXf poses(3 * std::ssize(task.rows.points), count);
  Eigen::Index column = 0;
  for (const auto* frames : clips) {
    for (const BodyFrame& frame : *frames) poses.col(column++) = from_the_body(task.rows, frame);
  }
  return poses;
}

void note_added(const SeamTask& task, const SeamCandidate& candidate, SewnSeam& seam) {
  note_added_steps(
      task.rows, candidate.outgoing, candidate.incoming,
      step_shares(task.rows, seam.found.switch_frames, seam.found.frames, candidate.blend_frames),
      seam.frames);
}

/// The cross-fade that a seam is compared with, and how it fares.
struct PlainFade {
  SeamFigures played;  ///< as it is
  SeamFigures strict;  ///< as near as it is as it is, its feet sliding as little as when held
};

PlainFade faded_figures(const SeamTask& task, const SeamJudge& judge,
                        const SeamCandidate& candidate) {
  SewnSeam faded = candidate.seam;
  faded.frames = cross_fade(candidate.outgoing, candidate.incoming);
  const SeamFigures played = judge.figures(faded, false);
  PlainFade plain{played, played};
  if (!task.holds_feet) return plain;
  faded.join = faded.found.frames / 2;
  Eigen::VectorXd shares(std::ssize(faded.frames) - 1);
  for (Eigen::Index t = 0; t < shares.size(); ++t) {
    shares[t] = blend_weight(static_cast<double>(t) - 0.5, static_cast<double>(shares.size()));
  }
  note_added_steps(task.rows, candidate.outgoing, candidate.incoming, {shares, shares},
                   faded.frames);
  plain.strict.skate_cm = std::min(played.skate_cm, judge.figures(faded, true).skate_cm);
  return plain;
}

/// The worse of both figures, in a plain cross-fade's.
double weight_of(const SeamFigures& figures, const SeamFigures& plain) {
  return std::max((figures.skate_cm + kNoSkateCm) / (plain.skate_cm + kNoSkateCm),
                  (figures.nearest_cm + kNearCm) / (plain.nearest_cm + kNearCm));
}

/// The same overlap with a blend of another length.
void sew_again(const SeamTask& task, JoinWindowOptions options, int blend_frames,
               SeamCandidate& candidate) {
  SewnSeam& seam = candidate.seam;
  options.blend_frames = blend_frames;
  candidate.window = join_window(task.rows, candidate.outgoing, candidate.incoming, options);
  candidate.blend_frames = blend_length(seam.found.frames, blend_frames);
  seam.frames = candidate.window.frames;
  seam.found.switch_frames = candidate.window.switch_frames;
  seam.join = candidate.window.switch_frames[0];
  measure_rates(task, seam);
}

}  // namespace

SeamJudge::SeamJudge(const SeamTask& task) : task_(task), captured_(captured_poses(task)) {}

SeamFigures SeamJudge::figures(const SewnSeam& seam, bool held) const {
  const auto beside = static_cast<int>(std::lround(kHeldBesideS * task_.frame_rate_hz));
  Surrounded around = surrounded(task_, seam, beside);
  if (held && task_.floor) {
    around.frames = hold_feet(around.frames, task_.rows, task_.rig, *task_.floor,
                              {around.first + seam.join}, false)
                        .frames;
  }
  const auto begin = around.frames.begin() + around.first;
  const std::vector<BodyFrame> overlap(begin, begin + seam.found.played_frames);
  const RateRatios rates = rate_ratios(task_, around, seam.found.played_frames);
  SeamFigures found;
  found.rate_ratio = std::max(rates.speed, rates.acceleration);
  if (task_.floor) {
    const motion::Clip clip = to_clip(overlap, task_.rows, task_.rig.clip);
    found.skate_cm =
        motion::foot_skate_cm(motion::foot_paths(clip, task_.rig.humanoid), task_.floor->toe_m);
  }
  for (const BodyFrame& frame : overlap) found.nearest_cm += nearest_cm(frame);
  found.nearest_cm /= static_cast<double>(overlap.size());
  return found;
}

double SeamJudge::nearest_cm(const BodyFrame& frame) const {
  const Eigen::VectorXf pose = from_the_body(task_.rows, frame);
  const float least = (captured_.colwise() - pose).colwise().squaredNorm().minCoeff();
  const auto points = static_cast<double>(std::max<std::size_t>(1, task_.rows.points.size()));
  return 100.0 * std::sqrt(static_cast<double>(least) / points);
}

void lead_feet(const SeamTask& task, const SeamJudge& judge, const JoinWindowOptions& options,
               SeamCandidate& candidate) {
  const PlainFade plain = faded_figures(task, judge, candidate);
  std::optional<SewnSeam> best;
  double least = 0.0;
  double least_strict = 0.0;
  double quickness = 0.0;
  const auto consider = [&](SewnSeam seam) {
    note_added(task, candidate, seam);
    calm(task, seam);
    const SeamFigures figures = judge.figures(seam, task.holds_feet);
    const double quick = std::max(1.0, figures.rate_ratio);
    // Better than the fade in both is enough: then what is left is weighed against the held one.
    const double weight = std::max(kBetter, weight_of(figures, plain.played));
    const double strict = weight_of(figures, plain.strict);
    if (best && std::tie(quick, weight, strict) >= std::tie(quickness, least, least_strict)) return;
    quickness = quick;
    least = weight;
    least_strict = strict;
    best = std::move(seam);
  };
  // As long as asked for, half of it, and over the whole overlap, in which feet that stand at
  // different places drift instead of being led.
  const int longest = candidate.seam.found.frames - 2;
  int sewn = options.blend_frames;
  const auto consider_all = [&](const auto& as) {
    for (const int blend : {options.blend_frames, std::max(2, options.blend_frames / 2), longest}) {
      if (blend != sewn) sew_again(task, options, blend, candidate);
      sewn = blend;
      consider(as(candidate.seam));
      for (const double pull_per_s : kPullsPerS) consider(as(led(task, candidate, pull_per_s)));
    }
  };
  consider_all([](SewnSeam seam) { return seam; });
  if (task.holds_feet && least > kBetter) consider_all(let_go);
  candidate.seam = std::move(*best);
}

}  // namespace laban::loop
