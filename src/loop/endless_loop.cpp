#include "laban/loop/endless_loop.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "laban/base/error.h"
#include "laban/loop/turning_playback.h"
#include "laban/math/rotation.h"
#include "laban/motion/foot_lock.h"
#include "laban/motion/retarget.h"
#include "laban/motion/root_motion.h"

#include "loop/held_feet.h"
#include "loop/seam_search.h"

namespace laban::loop {
namespace {

using base::Error;
using base::ErrorKind;

constexpr int kFewestFrames = 8;
// A turn lasts twice this at most: slower looks like a pause.
constexpr double kLongestEaseS = 0.3;
constexpr int kShortestEase = 2;
// Slower than this, leg lengths a second, a body shifts its weight.
constexpr double kWalks = 0.5;

void check(const std::vector<std::string>& problems) {
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
}

void check_length(const motion::Clip& clip) {
  if (clip.frame_count() < kFewestFrames) {
    throw Error(ErrorKind::kData, "a loop needs a clip of at least " +
                                      std::to_string(kFewestFrames) + " frames, not " +
                                      std::to_string(clip.frame_count()));
  }
}

std::vector<FoundSeam> found_of(const std::vector<SewnSeam>& seams) {
  std::vector<FoundSeam> found;
  for (const SewnSeam& seam : seams) found.push_back(seam.found);
  return found;
}

struct Ease {
  int frames = kShortestEase;
  bool suffices = true;  ///< false: the motion is too fast to turn within kLongestEaseS
};

/// Frames over which to slow down before a turn: playback at falling speed adds v / (2 e) frames^-1
/// to the acceleration, which shall be no more than is lively in the capture.
Ease ease_at(int frame, const UsualMotion& usual, double frame_rate_hz) {
  const int longest =
      std::max(kShortestEase, static_cast<int>(std::lround(kLongestEaseS * frame_rate_hz)));
  const int last = static_cast<int>(usual.speeds_m_s.size()) - 1;
  double speed = 0.0;
  for (int f = std::max(0, frame - longest / 2); f <= std::min(last, frame + longest / 2); ++f) {
    speed = std::max(speed, usual.speeds_m_s[static_cast<std::size_t>(f)]);
  }
  const double wanted =
      speed * frame_rate_hz / (2.0 * std::max(1e-6, usual.lively_acceleration_m_s2));
  const int shortest = static_cast<int>(std::ceil(std::min(wanted, 1e6)));
  return {std::clamp(shortest, kShortestEase, longest), shortest <= longest};
}

/// Whether the hips move over the ground at walking speed in the last half second.
bool travels_at_end(const std::vector<BodyFrame>& frames, double frame_rate_hz,
                    double leg_length_m) {
  const auto count = static_cast<int>(frames.size());
  const int begin = std::max(0, count - 1 - static_cast<int>(std::lround(0.5 * frame_rate_hz)));
  Eigen::Vector3d way = frames.back().hips - frames[static_cast<std::size_t>(begin)].hips;
  way.y() = 0.0;
  return way.norm() * frame_rate_hz > kWalks * leg_length_m * (count - 1 - begin);
}

PlaybackPlan plan_of(int frame_count, const Turning& turning, const std::vector<SewnSeam>& seams,
                     const UsualMotion& usual, double frame_rate_hz, bool travels,
                     const LoopOptions& options) {
  PlaybackPlan plan;
  plan.frame_count = frame_count;
  plan.probability_step = options.probability_step;
  if (options.turns) {
    for (const TurningPoint& point : turning.points) {
      const Ease ease = ease_at(point.frame, usual, frame_rate_hz);
      if (ease.suffices) {
        plan.turns.push_back({point.frame, point.most_probability(), ease.frames});
      }
    }
  }
  const Ease first = ease_at(0, usual, frame_rate_hz);
  plan.first = {0, 1.0, first.frames};
  // Rather the first place where it can turn than a beginning that is too fast for it.
  if (!first.suffices && !plan.turns.empty()) {
    plan.first = plan.turns.front();
    plan.turns.erase(plan.turns.begin());
  }
  plan.last = {frame_count - 1, 1.0, ease_at(frame_count - 1, usual, frame_rate_hz).frames};
  for (const SewnSeam& seam : seams) {
    plan.leaps.push_back({seam.found.out_begin, seam.found.in_begin + seam.found.frames});
  }
  plan.turns_at_all = options.turns;
  // Where the body walks on, turning looks like a film run backwards: leap, if possible.
  plan.last_turns =
      plan.leaps.empty() ||
      (options.turns && (turning.last_symmetry >= options.turning.threshold || !travels));
  return plan;
}

}  // namespace

std::vector<std::string> SeamOptions::problems() const {
  std::vector<std::string> found;
  const auto check_number = [&](bool good, const char* name, auto value, const char* rule) {
    if (!good) {
      found.push_back(std::string("SeamOptions::") + name + " = " + std::to_string(value) +
                      " (must be " + rule + ")");
    }
  };
  check_number(texton_frames >= 8 && texton_frames <= 2000, "texton_frames", texton_frames,
               "from 8 to 2000");
  check_number(texton_s >= 0.0 && texton_s <= 60.0, "texton_s", texton_s, "from 0 to 60");
  check_number(overlap_frames >= 4 && overlap_frames <= texton_frames, "overlap_frames",
               overlap_frames, "from 4 to texton_frames");
  check_number(blend_frames >= 1 && blend_frames <= overlap_frames, "blend_frames", blend_frames,
               "from 1 to overlap_frames");
  check_number(joint_weight >= 0.0 && joint_weight <= 1e6, "joint_weight", joint_weight,
               "from 0 to 1e6");
  check_number(screening >= 0.0 && screening <= 1e6, "screening", screening, "from 0 to 1e6");
  return found;
}

std::vector<std::string> LoopOptions::problems() const {
  std::vector<std::string> found = seam.problems();
  for (std::string& problem : turning.problems()) found.push_back(std::move(problem));
  if (seam_count < 1) {
    found.push_back("LoopOptions::seam_count = " + std::to_string(seam_count) + " (must be >= 1)");
  }
  if (!(probability_step >= 0.0 && probability_step <= 2.0)) {
    found.push_back("LoopOptions::probability_step = " + std::to_string(probability_step) +
                    " (must be from 0 to 2)");
  }
  return found;
}

/// Produces frames leg by leg, and hands them on with their feet held.
class EndlessLoop::Impl {
 public:
  Impl(const motion::Capture& capture, const LoopOptions& options)
      : left_out_((check(options.problems()), check_length(capture.clip),
                   first_flowing_frame(capture.clip, capture.humanoid))),
        capture_(flowing(capture, left_out_)),
        options_(options),
        found_contacts_(motion::find_foot_contacts(capture_.clip, capture_.humanoid)),
        rows_(capture_.clip.skeleton(), capture_.humanoid),
        frames_(to_body_frames(capture_.clip, rows_, found_contacts_.contacts)),
        usual_(usual_motion(rows_, frames_, rate_hz())),
        turning_(
            find_turning_points(motion::to_pose_matrix(capture_.clip, capture_.humanoid).angles,
                                rate_hz(), options.turning)),
        seams_(options.leaps ? find_seams({rows_, frames_, frames_, rate_hz(), usual_, capture_,
                                           found_contacts_.floor, options.hold_feet},
                                          options.seam, options.seam_count)
                             : std::vector<SewnSeam>()),
        found_seams_(found_of(seams_)),
        playback_(
            plan_of(capture_.clip.frame_count(), turning_, seams_, usual_, rate_hz(),
                    travels_at_end(frames_, rate_hz(), capture_.humanoid.leg_length_m()), options),
            base::Rng(options.seed)),
        held_(rows_, capture_, options.hold_feet ? found_contacts_.floor : std::nullopt) {
    emit(frames_.front());
  }

  [[nodiscard]] const Turning& turning() const noexcept { return turning_; }
  [[nodiscard]] const std::vector<FoundSeam>& seams() const noexcept { return found_seams_; }

  LoopedClip next(int frame_count, base::Progress* progress) {
    if (frame_count < 1) throw Error(ErrorKind::kUsage, "ask for at least one frame");
    while (held_.ready() < frame_count) {
      base::tell(progress, static_cast<double>(held_.ready()) / frame_count);
      play(playback_.next());
    }
    HeldFrames frames = held_.take(frame_count);
    LoopedClip looped{to_clip(frames.frames, rows_, capture_.clip), {}, {}, frames.stances};
    if (options_.in_place) looped.clip = motion::in_place(looped.clip, capture_.humanoid);
    for (const BodyFrame& frame : frames.frames) {
      looped.source_frames.push_back(frame.source_frame + left_out_);
    }
    given_ += frame_count;
    for (const LoopPart& part : parts_) {
      if (part.begin < given_) looped.parts.push_back(part);
    }
    while (!parts_.empty() && parts_.front().end <= given_) parts_.pop_front();
    return looped;
  }

 private:
  [[nodiscard]] double rate_hz() const { return capture_.clip.frame_rate_hz(); }

  void emit(BodyFrame frame) {
    frame.move(place_);
    held_.push(std::move(frame));
    ++made_;
  }

  /// The frame at a fractional place of the clip is next.
  void show(double place) { emit(sample(frames_, place)); }

  /// Turns at `frame`: out on s = c - e (1 - 2 t / W)^2, W = 4 e, which meets the clip's own speed
  /// at both ends and all whole frames there.
  void play(const PlaybackLeg& leg) {
    const int direction = leg.to >= leg.from ? 1 : -1;
    const std::int64_t begin = made_;
    // The first half of the easing belongs to the leg before: this one begins at the turn itself.
    for (int t = 1; t <= 2 * leg.ease_from; ++t) {
      const double x = static_cast<double>(t) / (2 * leg.ease_from);
      show(leg.from + direction * leg.ease_from * x * x);
    }
    const int from = leg.from + direction * leg.ease_from;
    const int to = leg.to - direction * leg.ease_to;
    // A leap's overlap begins with the clip's own frame.
    const int stop = leg.leap ? to : to + direction;
    for (int f = from + direction; direction * f < direction * stop; f += direction) show(f);
    for (int t = 1; t <= 2 * leg.ease_to; ++t) {
      const double x = 1.0 - static_cast<double>(t) / (2 * leg.ease_to);
      show(leg.to - direction * leg.ease_to * x * x);
    }
    if (made_ > begin) {
      parts_.push_back(
          {direction > 0 ? LoopStep::kForwards : LoopStep::kBackwards, begin, made_, -1});
    }
    if (leg.leap) leap(*leg.leap);
  }

  void leap(int index) {
    const SewnSeam& seam = seams_[static_cast<std::size_t>(index)];
    const std::int64_t begin = made_;
    held_.mark_join(seam.join);
    for (const BodyFrame& frame : seam.frames) emit(frame);
    place_ = place_.after(seam.outgoing_from_incoming);
    // in_end, at which playback goes on, is the frame after the overlap.
    const int next = seam.found.in_begin + seam.found.frames;
    if (next < static_cast<int>(frames_.size())) show(next);
    parts_.push_back({LoopStep::kSeam, begin, made_, index});
  }

  int left_out_;  // frames before the motion
  motion::Capture capture_;
  LoopOptions options_;
  motion::FoundContacts found_contacts_;
  BodyRows rows_;
  std::vector<BodyFrame> frames_;
  UsualMotion usual_;
  Turning turning_;
  std::vector<SewnSeam> seams_;
  std::vector<FoundSeam> found_seams_;
  TurningPlayback playback_;
  HeldFeet held_;
  PlanarMotion place_;
  std::int64_t made_ = 0;
  std::int64_t given_ = 0;
  std::deque<LoopPart> parts_;
};

EndlessLoop::EndlessLoop(const motion::Capture& capture, const LoopOptions& options)
    : impl_(std::make_unique<Impl>(capture, options)) {}
EndlessLoop::EndlessLoop(EndlessLoop&&) noexcept = default;
EndlessLoop& EndlessLoop::operator=(EndlessLoop&&) noexcept = default;
EndlessLoop::~EndlessLoop() = default;

LoopedClip EndlessLoop::next(int frame_count, base::Progress* progress) {
  return impl_->next(frame_count, progress);
}
const Turning& EndlessLoop::turning() const noexcept {
  return impl_->turning();
}
const std::vector<FoundSeam>& EndlessLoop::seams() const noexcept {
  return impl_->seams();
}

}  // namespace laban::loop
