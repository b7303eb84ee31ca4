#include "laban/texture/texture_motion.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "laban/base/error.h"
#include "laban/motion/foot_lock_stream.h"
#include "laban/motion/retarget.h"
#include "laban/texture/texton_path.h"
#include "laban/texture/texton_synthesis.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::MatrixXd;

constexpr double kRampS = 0.5;
// Two poses far apart are joined over this time.
constexpr double kJumpFadeS = 0.75;

void check(const TextureMotionOptions& options) {
  const auto problems = options.problems();
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
}

const Texton& texton_at(const MotionTexture& texture, int texton) {
  return texture.textons[static_cast<std::size_t>(texton)];
}

const Segment& segment_at(const MotionTexture& texture, int segment) {
  return texture.segments[static_cast<std::size_t>(segment)];
}

MatrixXd start_of(const MotionTexture& texture, int segment) {
  return texture.observations.middleCols(segment_at(texture, segment).begin, 2);
}

MatrixXd end_of(const MotionTexture& texture, int segment) {
  const Segment& s = segment_at(texture, segment);
  return texture.observations.middleCols(s.begin + s.length - 2, 2);
}

/// A segment, and the two frames after it where its take goes on: over them the next texton takes
/// over.
MatrixXd frames_with_next(const MotionTexture& texture, int segment) {
  const Segment& s = segment_at(texture, segment);
  int length = s.length;
  for (const Take& take : texture.takes) {
    if (s.begin >= take.begin && s.begin < take.begin + take.length) {
      length = std::min(s.length + 2, take.begin + take.length - s.begin);
    }
  }
  return texture.observations.middleCols(s.begin, length);
}

/// `count` columns read evenly from first to last, each as it is: innovations averaged would be
/// weaker.
MatrixXd spread(const MatrixXd& columns, int count) {
  if (columns.cols() == count || columns.cols() == 0) return columns;
  MatrixXd read(columns.rows(), count);
  for (int n = 0; n < count; ++n) {
    const double share = count > 1 ? static_cast<double>(n) / (count - 1) : 0.0;
    read.col(n) = columns.col(std::lround(share * static_cast<double>(columns.cols() - 1)));
  }
  return read;
}

/// As `spread`, in straight lines.
MatrixXd spread_smoothly(const MatrixXd& columns, int count) {
  if (columns.cols() == count) return columns;
  MatrixXd read(columns.rows(), count);
  for (int n = 0; n < count; ++n) {
    const double at =
        count > 1 ? static_cast<double>(n) / (count - 1) * static_cast<double>(columns.cols() - 1)
                  : 0.0;
    const auto from = std::min(static_cast<Eigen::Index>(at), columns.cols() - 2);
    const double share = at - static_cast<double>(from);
    read.col(n) = (1.0 - share) * columns.col(from) + share * columns.col(from + 1);
  }
  return read;
}

/// Motion of one texton after the other, each beginning where the one before ends.
class TextonSequence {
 public:
  TextonSequence(const MotionTexture& texture, const TextureMotionOptions& options, MatrixXd start)
      : texture_(texture),
        noise_level_(options.noise_level),
        variation_(options.variation),
        synthesizer_(texture.textons,
                     std::max(2, static_cast<int>(std::lround(kRampS * texture.frame_rate_hz)))),
        rng_(base::Rng::for_stream(options.seed, 1)),
        start_(std::move(start)) {}

  /// `length` frames from where the one before ended, driven by what drove a segment of the texton;
  /// after them comes `next`, d x 2.
  MatrixXd until(int segment, int length, const MatrixXd& next) {
    const MatrixXd end =
        on_branches_near(texture_.space, next, end_of(texture_, segment).rightCols<1>());
    const MatrixXd y = draw(segment, std::max(length, kFewestConstrained) + 2, end);
    start_ = next;
    return y.leftCols(y.cols() - 2);
  }
  /// The same where `next` was never seen to follow and may be far away: the texton ends as its
  /// segment does, and what there is between it and `next` fades over the beginning of that. Drawn
  /// to an end so far from its own, a texton would rush there in its last frames.
  MatrixXd until_jump(int segment, int length, const MatrixXd& next) {
    const MatrixXd y =
        draw(segment, std::max(length, kFewestConstrained), end_of(texture_, segment));
    const MatrixXd ends = on_branches_near(texture_.space, y.rightCols(2), next.col(0));
    const Eigen::VectorXd last = ends.col(1);
    const Eigen::VectorXd velocity = last - ends.col(0);
    start_ = next;
    offset_.resize(y.rows(), 2);
    offset_ << last + velocity, last + 2.0 * velocity;
    offset_ -= next;
    return y;
  }
  /// The last texton: its last two frames are `end`.
  MatrixXd last(int segment, int length, const MatrixXd& end) {
    return draw(segment, std::max(length, kFewestConstrained), end);
  }

 private:
  MatrixXd draw(int segment, int length, const MatrixXd& end) {
    MatrixXd y = between_ends(segment, length, end);
    if (offset_.cols() > 0) {
      const double fade = kJumpFadeS * texture_.frame_rate_hz;
      y += ramp_between(length, {0, 1}, offset_,
                        std::clamp(static_cast<int>(std::lround(fade)), 1, length - 4));
      offset_.resize(0, 0);
    }
    return y;
  }

  MatrixXd between_ends(int segment, int length, const MatrixXd& end) {
    const std::vector<PinnedFrame> pins{
        {0, start_.col(0)}, {1, start_.col(1)}, {length - 2, end.col(0)}, {length - 1, end.col(1)}};
    const int texton = segment_at(texture_, segment).texton;
    const Texton& model = texton_at(texture_, texton);
    MatrixXd noise = draw_noise(model.dimension(), length - 2, noise_level_ * variation_, rng_);
    const double own = noise_level_ * std::sqrt(1.0 - variation_ * variation_);
    if (own == 0.0) return synthesizer_.synthesize(texton, length, pins, noise);
    const MatrixXd captured = frames_with_next(texture_, segment);
    const MatrixXd centered = captured.colwise() - model.mean;
    const MatrixXd states = model.basis.transpose() * centered;
    noise += own * spread(innovations(model.dynamics, states), length - 2);
    const MatrixXd residual = std::min(1.0, own) * (centered - model.basis * states);
    return synthesizer_.synthesize(texton, length, pins, noise, spread_smoothly(residual, length));
  }

  const MotionTexture& texture_;
  double noise_level_;
  double variation_;
  TextonSynthesizer synthesizer_;
  base::Rng rng_;
  MatrixXd start_;
  MatrixXd offset_;  // after a jump, d x 2: how far the motion is from start_ as it goes on
};

/// Observations that come in pieces, on the rig: each piece's root goes on from the last.
class RigPlayer {
 public:
  explicit RigPlayer(const MotionTexture& texture) : texture_(texture) {}

  motion::Clip play(const Eigen::Ref<const MatrixXd>& observations) {
    const motion::PoseMatrix pose =
        poses_of(texture_.space, observations, texture_.frame_rate_hz, texture_.leg_length_m);
    motion::RetargetOptions options;
    if (begun_) step(pose.steps.col(0));
    begun_ = true;
    options.start = place_;
    const Eigen::Matrix3Xd path = motion::planar_path(pose, place_);
    const Eigen::Index last = path.cols() - 1;
    place_ = {path(0, last), path(1, last), path(2, last)};
    return motion::from_pose_matrix(pose, texture_.rig.humanoid, texture_.rig.stance, options);
  }

 private:
  void step(const Eigen::Vector3d& step) {
    const double c = std::cos(place_.yaw);
    const double s = std::sin(place_.yaw);
    place_.x += c * step[0] + s * step[1];
    place_.z += -s * step[0] + c * step[1];
    place_.yaw += step[2];
  }

  const MotionTexture& texture_;
  motion::PlanarPose place_;
  bool begun_ = false;
};

}  // namespace

std::vector<std::string> TextureMotionOptions::problems() const {
  std::vector<std::string> found;
  if (!(noise_level >= 0.0 && noise_level <= 10.0)) {
    found.push_back("TextureMotionOptions::noise_level = " + std::to_string(noise_level) +
                    " (must be from 0 to 10)");
  }
  if (!(variation >= 0.0 && variation <= 1.0)) {
    found.push_back("TextureMotionOptions::variation = " + std::to_string(variation) +
                    " (must be from 0 to 1)");
  }
  return found;
}

class TextureMotion::Impl {
 public:
  Impl(const MotionTexture& texture, const TextureMotionOptions& options)
      : texture_(texture),
        walk_((check(options), texture), options.first, base::Rng::for_stream(options.seed, 0)),
        sequence_(texture, options, start_of(texture, walk_.any_segment())),
        player_(texture) {
    const auto& rig = texture.rig;
    if (options.hold_feet && rig.floor) feet_.emplace(rig.humanoid, *rig.floor);
  }

  TextureClip next(int frame_count) {
    if (frame_count < 1) throw Error(ErrorKind::kUsage, "ask for at least one frame");
    while (ready() < frame_count) make_texton();
    TextureClip made{take(frame_count), {}};
    given_ += frame_count;
    for (const TextonPart& part : parts_) {
      if (part.begin < given_) made.parts.push_back(part);
    }
    while (!parts_.empty() && parts_.front().end <= given_) parts_.pop_front();
    return made;
  }

 private:
  [[nodiscard]] int ready() const {
    if (feet_) return feet_->ready();
    return plain_ ? plain_->frame_count() : 0;
  }

  void make_texton() {
    const int texton = walk_.texton();
    const TextonChange change = walk_.next();
    const int length = segment_at(texture_, change.leaving).length;
    const MatrixXd next = start_of(texture_, change.entering);
    const MatrixXd y = change.jump ? sequence_.until_jump(change.leaving, length, next)
                                   : sequence_.until(change.leaving, length, next);
    parts_.push_back({texton, made_, made_ + y.cols(), change.jump});
    made_ += y.cols();
    motion::Clip clip = player_.play(y);
    if (feet_) {
      feet_->push(clip);
    } else {
      plain_ = plain_ ? appended(*plain_, clip) : std::move(clip);
    }
  }

  motion::Clip take(int count) {
    if (feet_) return feet_->take(count);
    motion::Clip taken = plain_->slice(0, count);
    if (count == plain_->frame_count()) {
      plain_.reset();
    } else {
      plain_ = plain_->slice(count, plain_->frame_count());
    }
    return taken;
  }

  static motion::Clip appended(const motion::Clip& a, const motion::Clip& b) {
    const Eigen::Index frames = a.frame_count() + b.frame_count();
    Eigen::Matrix3Xd roots(3, frames);
    roots << a.root_positions(), b.root_positions();
    std::vector<Eigen::Quaterniond> rotations;
    Eigen::Matrix3Xd translations;
    if (a.has_translations()) translations.resize(3, frames * a.joint_count());
    Eigen::Index column = 0;
    for (const motion::Clip* clip : {&a, &b}) {
      for (int f = 0; f < clip->frame_count(); ++f) {
        const auto one = clip->rotations(f);
        rotations.insert(rotations.end(), one.begin(), one.end());
        for (int j = 0; a.has_translations() && j < clip->joint_count(); ++j) {
          translations.col(column++) = clip->translation(f, j);
        }
      }
    }
    return {a.shared_skeleton(), a.frame_rate_hz(), std::move(roots), std::move(rotations),
            std::move(translations)};
  }

  const MotionTexture& texture_;
  TextonWalk walk_;
  TextonSequence sequence_;
  RigPlayer player_;
  std::optional<motion::FootLockStream> feet_;
  std::optional<motion::Clip> plain_;  // frames made and not given, if no feet are held
  std::deque<TextonPart> parts_;
  std::int64_t made_ = 0;
  std::int64_t given_ = 0;
};

TextureMotion::TextureMotion(const MotionTexture& texture, const TextureMotionOptions& options)
    : impl_(std::make_unique<Impl>(texture, options)) {}
TextureMotion::TextureMotion(TextureMotion&&) noexcept = default;
TextureMotion& TextureMotion::operator=(TextureMotion&&) noexcept = default;
TextureMotion::~TextureMotion() = default;

TextureClip TextureMotion::next(int frame_count) {
  return impl_->next(frame_count);
}

PathMotion synthesize_path(const MotionTexture& texture, std::span<const PlannedTexton> path,
                           const PathEnds& ends, const TextureMotionOptions& options) {
  check(options);
  if (path.empty()) throw Error(ErrorKind::kUsage, "a path needs at least one texton");
  for (const PlannedTexton& planned : path) {
    if (planned.length && *planned.length < kFewestConstrained) {
      throw Error(ErrorKind::kUsage,
                  "a texton of " + std::to_string(*planned.length) +
                      " frames (must be >= " + std::to_string(kFewestConstrained) + ")");
    }
  }
  for (const auto* end : {&ends.from, &ends.to}) {
    if (*end && ((*end)->rows() != texture.observations.rows() || (*end)->cols() != 2)) {
      throw Error(ErrorKind::kUsage, "an end of a path is two frames of " +
                                         std::to_string(texture.observations.rows()) + " numbers");
    }
  }
  TextonWalk walk(texture, path.front().texton, base::Rng::for_stream(options.seed, 0));
  const int first = walk.any_segment();
  TextonSequence sequence(texture, options, ends.from ? *ends.from : start_of(texture, first));
  PathMotion made;
  std::vector<MatrixXd> pieces;
  std::int64_t frames = 0;
  for (std::size_t n = 0; n < path.size(); ++n) {
    const int texton = path[n].texton;
    bool jump = false;
    if (n + 1 < path.size()) {
      const TextonChange change = walk.go_to(path[n + 1].texton);
      jump = change.jump;
      const int length = path[n].length.value_or(segment_at(texture, change.leaving).length);
      const MatrixXd next = start_of(texture, change.entering);
      pieces.push_back(jump ? sequence.until_jump(change.leaving, length, next)
                            : sequence.until(change.leaving, length, next));
    } else {
      const int last = walk.any_segment();
      pieces.push_back(sequence.last(last,
                                     path[n].length.value_or(segment_at(texture, last).length),
                                     ends.to ? *ends.to : end_of(texture, last)));
    }
    made.parts.push_back({texton, frames, frames + pieces.back().cols(), jump});
    frames = made.parts.back().end;
  }
  made.observations.resize(texture.observations.rows(), frames);
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    made.observations.middleCols(made.parts[n].begin, pieces[n].cols()) = pieces[n];
  }
  return made;
}

motion::Clip play_observations(const MotionTexture& texture,
                               const Eigen::Ref<const MatrixXd>& observations, bool hold_feet) {
  if (observations.cols() < 1 || observations.rows() != texture.observations.rows()) {
    throw Error(ErrorKind::kUsage, "observations to play must be at least one frame of " +
                                       std::to_string(texture.observations.rows()) + " numbers");
  }
  motion::Clip clip = RigPlayer(texture).play(observations);
  if (!hold_feet || !texture.rig.floor) return clip;
  motion::FootLockStream feet(texture.rig.humanoid, *texture.rig.floor);
  feet.push(clip);
  feet.finish();
  return feet.take(feet.ready());
}

}  // namespace laban::texture
