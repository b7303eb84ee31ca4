#include "laban/texture/texture_motion.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/rotation.h"
#include "laban/motion/retarget.h"
#include "laban/texture/texton_synthesis.h"
#include "laban/texture/texton_walk.h"

#include "texture/held_feet.h"
#include "texture/pose_join.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::MatrixXd;

constexpr double kRampS = 0.5;
// What is drawn anew may turn a joint so far from where it was in the captures.
constexpr double kMostDrawnTurn = 4.0 * math::kDegree;
// Beside a frame that is kept, feet are let go of over this time.
constexpr double kLetGoS = 0.3;
// A texton of a path is made of a source that lasts so much longer or shorter than it, where there
// is one, and twice as long counts as two poses three radians apart.
constexpr double kStretch = 1.25;
constexpr double kStretchCost = 4.0;
// Segments of nearly the same distance are drawn from.
constexpr double kTieCost = 0.25;

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

/// Frames [begin, end) of the corpus, of one segment and the two frames after it where its take
/// goes on: what a part of the motion is made of.
struct Source {
  int texton = 0;
  int begin = 0;
  int end = 0;

  [[nodiscard]] int length() const noexcept { return end - begin; }
};

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

/// The largest angle between a joint's rotations in two motions of as many frames.
double largest_turn(const ObservationSpace& space, const MatrixXd& a, const MatrixXd& b) {
  double largest = 0.0;
  for (Eigen::Index row = 0; row < motion::kAngleRowCount; row += 3) {
    const Eigen::Vector3d scale = space.scale.segment<3>(row);
    for (Eigen::Index f = 0; f < a.cols(); ++f) {
      largest = std::max(
          largest, math::angle_between(math::exp(a.block<3, 1>(row, f).cwiseQuotient(scale)),
                                       math::exp(b.block<3, 1>(row, f).cwiseQuotient(scale))));
    }
  }
  return largest;
}

/// Motion of one texton after the other, each beginning where the one before ends.
///
/// A texton is drawn between the ends that its source had. What there is between them and the ends
/// asked for comes and goes as rotations on top (offset_curve): drawn to ends far from its own, a
/// texton would rush there in its last frames.
class TextonSequence {
 public:
  TextonSequence(const MotionTexture& texture, const TextureMotionOptions& options)
      : texture_(texture),
        noise_level_(options.noise_level),
        variation_(options.variation),
        synthesizer_(texture.textons,
                     std::max(2, static_cast<int>(std::lround(kRampS * texture.frame_rate_hz)))),
        rng_(base::Rng::for_stream(options.seed, 1)),
        first_(MatrixXd::Zero(texture.observations.rows(), 2)) {}

  /// The first texton begins with these two frames, not with its source's.
  void begin_with(const Source& source, const MatrixXd& frames) {
    first_ = offsets_between(texture_.space, two_frames(source.begin), frames);
  }
  /// `length` frames. The two after them are `meeting`, and there the next texton begins, which
  /// goes on with frame `enter` of the corpus.
  MatrixXd until(const Source& source, int length, int enter, const MatrixXd& meeting,
                 const std::vector<JointDetour>& detours = {}) {
    MatrixXd y = draw(source, std::max(length + 2, kFewestConstrained),
                      offsets_between(texture_.space, two_frames(source.end - 2), meeting));
    if (!detours_.empty() || !detours.empty()) {
      y = with_offsets(texture_.space, y, detour_curve(y.cols(), detours));
    }
    first_ = offsets_between(texture_.space, two_frames(enter), meeting);
    detours_ = detours;
    return y.leftCols(y.cols() - 2);
  }
  /// The last texton; its last two frames are `end`, if that is given.
  MatrixXd last(const Source& source, int length, const std::optional<MatrixXd>& end) {
    const MatrixXd own = two_frames(source.end - 2);
    return draw(source, std::max(length, kFewestConstrained),
                end ? offsets_between(texture_.space, own, *end) : MatrixXd(0.0 * own));
  }

 private:
  [[nodiscard]] MatrixXd two_frames(int begin) const {
    return texture_.observations.middleCols(begin, 2);
  }

  MatrixXd draw(const Source& source, int length, const MatrixXd& last) {
    const MatrixXd y = between_own_ends(source, length);
    return with_offsets(texture_.space, y, offset_curve(texture_, length, first_, last));
  }

  /// Of the joints that come from a detour, and of those that go on one.
  [[nodiscard]] MatrixXd detour_curve(Eigen::Index length,
                                      const std::vector<JointDetour>& leaving) const {
    MatrixXd curve = MatrixXd::Zero(first_.rows(), length);
    const auto scaled = [&](const JointDetour& detour, const auto& turns) -> MatrixXd {
      return texture_.space.scale.segment<3>(3 * detour.joint).asDiagonal() * turns;
    };
    for (const JointDetour& detour : detours_) {
      const auto count = std::min(length, detour.entering.cols());
      curve.block(3 * detour.joint, 0, 3, count) = scaled(detour, detour.entering.leftCols(count));
    }
    for (const JointDetour& detour : leaving) {
      const auto count = std::min(length, detour.leaving.cols());
      curve.block(3 * detour.joint, length - count, 3, count) +=
          scaled(detour, detour.leaving.rightCols(count));
    }
    return curve;
  }

  MatrixXd between_own_ends(const Source& source, int length) {
    const Texton& model = texton_at(texture_, source.texton);
    const MatrixXd captured = texture_.observations.middleCols(source.begin, source.length());
    const std::vector<PinnedFrame> pins{{0, captured.col(0)},
                                        {1, captured.col(1)},
                                        {length - 2, captured.col(captured.cols() - 2)},
                                        {length - 1, captured.col(captured.cols() - 1)}};
    const MatrixXd drawn =
        draw_noise(model.dimension(), length - 2, noise_level_ * variation_, rng_);
    const double own = noise_level_ * std::sqrt(1.0 - variation_ * variation_);
    if (own == 0.0) return synthesizer_.synthesize(source.texton, length, pins, drawn);
    const MatrixXd centered = captured.colwise() - model.mean;
    const MatrixXd states = model.basis.transpose() * centered;
    const MatrixXd driving = own * spread(innovations(model.dynamics, states), length - 2);
    const MatrixXd residual =
        spread_smoothly(std::min(1.0, own) * (centered - model.basis * states), length);
    const auto driven_by = [&](const MatrixXd& noise) {
      return synthesizer_.synthesize(source.texton, length, pins, noise, residual);
    };
    MatrixXd y = driven_by(driving + drawn);
    if (variation_ == 0.0) return y;
    // The system is linear: so much less noise turns joints so much less.
    const double turn = largest_turn(texture_.space, driven_by(driving), y);
    return turn <= kMostDrawnTurn ? y : driven_by(driving + (kMostDrawnTurn / turn) * drawn);
  }

  const MotionTexture& texture_;
  double noise_level_;
  double variation_;
  TextonSynthesizer synthesizer_;
  base::Rng rng_;
  MatrixXd first_;                    // d x 2: offsets of the next texton's first two frames
  std::vector<JointDetour> detours_;  // on which joints come into the next texton
};

/// Observations that come in pieces, on the rig: each piece's root goes on from the last.
class RigPlayer {
 public:
  explicit RigPlayer(const MotionTexture& texture, const motion::PlanarPose& start = {})
      : texture_(texture), place_(start) {}

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

void check_path(const MotionTexture& texture, std::span<const PlannedTexton> path,
                const PathEnds& ends) {
  if (path.empty()) throw Error(ErrorKind::kUsage, "a path needs at least one texton");
  for (const PlannedTexton& planned : path) {
    if (planned.length && *planned.length < kFewestConstrained) {
      throw Error(ErrorKind::kUsage,
                  "a texton of " + std::to_string(*planned.length) +
                      " frames (must be >= " + std::to_string(kFewestConstrained) + ")");
    }
    const auto is_its = [&](const Segment& s) { return s.texton == planned.texton; };
    if (std::none_of(texture.segments.begin(), texture.segments.end(), is_its)) {
      throw Error(ErrorKind::kUsage,
                  "there is no texton " + std::to_string(planned.texton) + " with a segment");
    }
  }
  for (const auto* end : {&ends.from, &ends.to}) {
    if (*end && ((*end)->rows() != texture.observations.rows() || (*end)->cols() != 2)) {
      throw Error(ErrorKind::kUsage, "an end of a path is two frames of " +
                                         std::to_string(texture.observations.rows()) + " numbers");
    }
  }
}

/// Which segments the textons of a path are made of: those whose poses meet best, from texton to
/// texton and at the ends, by dynamic programming.
class PathSources {
 public:
  PathSources(const MotionTexture& texture, std::span<const PlannedTexton> path,
              const PathEnds& ends)
      : texture_(texture), path_(path), ends_(ends) {}

  std::vector<Source> choose(base::Rng& rng) {
    std::vector<std::vector<Choice>> table;
    for (std::size_t n = 0; n < path_.size(); ++n) {
      std::vector<Choice> choices;
      for (const int s : segments_of(texture_, path_[n].texton)) {
        Choice choice = whole(s, n + 1 == path_.size());
        if (n == 0 && ends_.from) cut_begin(choice, *ends_.from, path_[n].length);
        if (n + 1 == path_.size() && ends_.to) cut_end(choice, *ends_.to, path_[n].length);
        choice.cost += kTieCost * rng.uniform() + stretching_cost(choice, path_[n].length);
        if (n > 0) come_from(table.back(), choice);
        choices.push_back(choice);
      }
      table.push_back(std::move(choices));
    }
    std::vector<Source> sources;
    std::size_t best = 0;
    for (std::size_t c = 1; c < table.back().size(); ++c) {
      if (table.back()[c].cost < table.back()[best].cost) best = c;
    }
    for (auto choices = table.rbegin(); choices != table.rend(); ++choices) {
      const Choice& choice = (*choices)[best];
      sources.push_back(choice.source);
      best = choice.before;
    }
    std::reverse(sources.begin(), sources.end());
    return sources;
  }

 private:
  struct Choice {
    Source source;
    double cost = 0.0;       ///< of the path so far
    std::size_t before = 0;  ///< the choice of the texton before
  };

  [[nodiscard]] MatrixXd two_frames(int begin) const {
    return texture_.observations.middleCols(begin, 2);
  }
  [[nodiscard]] double distance(int begin, const MatrixXd& frames) const {
    return offsets_between(texture_.space, two_frames(begin), frames).norm();
  }
  [[nodiscard]] Choice whole(int segment, bool is_last) const {
    const Segment& s = segment_at(texture_, segment);
    int end = s.begin + s.length;
    for (const Take& take : texture_.takes) {
      if (!is_last && s.begin >= take.begin && s.begin < take.begin + take.length) {
        end = std::min(end + 2, take.begin + take.length);
      }
    }
    return {{s.texton, s.begin, end}, 0.0, 0};
  }
  /// How far a texton may be stretched or sped up to last as long as it is planned to, of what its
  /// source lasts: what drove it is read over more or fewer frames then, and further off it would
  /// no longer drive it where it went.
  [[nodiscard]] static std::pair<int, int> lengths(const Choice& choice,
                                                   const std::optional<int>& planned) {
    const int whole = choice.source.length();
    if (!planned) return {whole / 2 + kFewestConstrained, whole};
    const double length = *planned + 2;
    const int most = std::min(whole, static_cast<int>(kStretch * length));
    return {std::clamp(static_cast<int>(length / kStretch), kFewestConstrained,
                       std::max(kFewestConstrained, most)),
            most};
  }
  /// The pose that a path begins with may be one from within its texton.
  void cut_begin(Choice& choice, const MatrixXd& from, const std::optional<int>& planned) const {
    const auto [fewest, most] = lengths(choice, planned);
    double least = math::kInfinity;
    const int end = choice.source.end;
    for (int begin = end - most; begin <= std::max(end - most, end - fewest); ++begin) {
      const double one = distance(begin, from);
      if (one >= least) continue;
      least = one;
      choice.source.begin = begin;
    }
    choice.cost += least;
  }
  void cut_end(Choice& choice, const MatrixXd& to, const std::optional<int>& planned) const {
    const auto [fewest, most] = lengths(choice, planned);
    double least = math::kInfinity;
    const int begin = choice.source.begin;
    for (int end = begin + most; end >= std::min(begin + most, begin + fewest); --end) {
      const double one = distance(end - 2, to);
      if (one >= least) continue;
      least = one;
      choice.source.end = end;
    }
    choice.cost += least;
  }
  /// What it costs that a source lasts longer or shorter than it is to.
  [[nodiscard]] static double stretching_cost(const Choice& choice,
                                              const std::optional<int>& planned) {
    if (!planned) return 0.0;
    return kStretchCost * std::abs(std::log((*planned + 2.0) / choice.source.length()));
  }
  void come_from(const std::vector<Choice>& choices, Choice& to) const {
    double least = math::kInfinity;
    for (std::size_t c = 0; c < choices.size(); ++c) {
      const int leave = choices[c].source.end - 2;
      const double one =
          choices[c].cost +
          (leave == to.source.begin ? 0.0 : distance(leave, two_frames(to.source.begin)));
      if (one >= least) continue;
      least = one;
      to.before = c;
    }
    to.cost += least;
  }

  const MotionTexture& texture_;
  std::span<const PlannedTexton> path_;
  const PathEnds& ends_;
};

/// How far feet are held in each frame beside some that are kept as they are.
std::vector<double> shares_beside(const std::vector<int>& kept, int frame_count, double rate_hz) {
  std::vector<double> shares;
  for (int f = 0; f < frame_count; ++f) {
    double apart = 1.0;
    for (const int frame : kept) apart = std::min(apart, std::abs(f - frame) / (kLetGoS * rate_hz));
    shares.push_back(apart * apart * (3.0 - 2.0 * apart));
  }
  return shares;
}

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
      : walk_((check(options), texture), options.first, base::Rng::for_stream(options.seed, 0)),
        sequence_(texture, options),
        player_(texture) {
    const auto& rig = texture.rig;
    if (options.hold_feet && rig.floor) feet_.emplace(rig.humanoid, *rig.floor);
  }

  TextureClip next(int frame_count, base::Progress* progress) {
    if (frame_count < 1) throw Error(ErrorKind::kUsage, "ask for at least one frame");
    while (ready() < frame_count) {
      base::tell(progress, static_cast<double>(ready()) / frame_count);
      make_texton();
    }
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
    const int entered = walk_.entered();
    const TextonChange change = walk_.next();
    const MatrixXd y = sequence_.until({texton, entered, change.leave + 2}, change.leave - entered,
                                       change.enter, change.meeting, change.detours);
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

  TextonWalk walk_;
  TextonSequence sequence_;
  RigPlayer player_;
  std::optional<HeldFeet> feet_;
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

TextureClip TextureMotion::next(int frame_count, base::Progress* progress) {
  return impl_->next(frame_count, progress);
}

PathMotion synthesize_path(const MotionTexture& texture, std::span<const PlannedTexton> path,
                           const PathEnds& ends, const TextureMotionOptions& options,
                           base::Progress* progress) {
  check(options);
  check_path(texture, path, ends);
  base::Rng rng = base::Rng::for_stream(options.seed, 0);
  const std::vector<Source> sources = PathSources(texture, path, ends).choose(rng);
  TextonSequence sequence(texture, options);
  if (ends.from) sequence.begin_with(sources.front(), *ends.from);
  PathMotion made;
  std::vector<MatrixXd> pieces;
  std::int64_t frames = 0;
  for (std::size_t n = 0; n < path.size(); ++n) {
    base::tell(progress, static_cast<double>(n) / static_cast<double>(path.size()));
    const bool is_last = n + 1 == path.size();
    const int length = path[n].length.value_or(sources[n].length() - (is_last ? 0 : 2));
    if (is_last) {
      pieces.push_back(sequence.last(sources[n], length, ends.to));
    } else {
      const int enter = sources[n + 1].begin;
      const MatrixXd meeting =
          halfway(texture.space, texture.observations.middleCols(sources[n].end - 2, 2),
                  texture.observations.middleCols(enter, 2));
      pieces.push_back(sequence.until(sources[n], length, enter, meeting));
    }
    const bool jump =
        !is_last && texture.transition_counts(path[n].texton, path[n + 1].texton) == 0.0;
    made.parts.push_back({path[n].texton, frames, frames + pieces.back().cols(), jump});
    frames = made.parts.back().end;
  }
  made.observations.resize(texture.observations.rows(), frames);
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    made.observations.middleCols(made.parts[n].begin, pieces[n].cols()) = pieces[n];
  }
  return made;
}

motion::Clip play_observations(const MotionTexture& texture,
                               const Eigen::Ref<const MatrixXd>& observations,
                               const PlayOptions& options, base::Progress* progress) {
  if (observations.cols() < 1 || observations.rows() != texture.observations.rows()) {
    throw Error(ErrorKind::kUsage, "observations to play must be at least one frame of " +
                                       std::to_string(texture.observations.rows()) + " numbers");
  }
  base::tell(progress, 0.0);
  motion::Clip clip = RigPlayer(texture, options.start).play(observations);
  if (!options.hold_feet || !texture.rig.floor) return clip;
  base::tell(progress, 0.5);
  HeldFeet feet(texture.rig.humanoid, *texture.rig.floor);
  feet.push(clip);
  feet.finish();
  motion::Clip held = feet.take(feet.ready());
  if (options.kept_frames.empty()) return held;
  return mixed(clip, held,
               shares_beside(options.kept_frames, clip.frame_count(), clip.frame_rate_hz()));
}

}  // namespace laban::texture
