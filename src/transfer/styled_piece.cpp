#include "transfer/styled_piece.h"

#include <algorithm>
#include <cmath>

#include "laban/align/content_metric.h"
#include "laban/math/low_pass.h"
#include "laban/motion/resample.h"

#include "transfer/calmed.h"
#include "transfer/frame_times.h"

namespace laban::transfer {
namespace {

/// In fragment and input the same action goes by; neither shall rush where the other lingers.
constexpr double kSteepestOwnWarp = 2.0;

/// Warps change their rate from cell to cell, and two of them multiply; over so many seconds they
/// are averaged.
constexpr double kTimingS = 0.2;

/// What two takes differ in beyond this is their trembling, not their style: the observer looks at
/// what is below 4 Hz.
constexpr double kStyleCutoffHz = 6.0;

/// For each frame of `pose` the frame of `other` that shows the same moment: along the warp between
/// the two, or evenly where their lengths are too different for one.
std::vector<double> frames_beside(const motion::PoseMatrix& pose, const motion::PoseMatrix& other,
                                  const align::TimeWarpOptions& options = {}) {
  if (!align::blendable(pose.frame_count(), other.frame_count()))
    return evenly(pose.frame_count(), other.frame_count() - 1);
  std::vector<double> frames;
  for (const align::WarpPoint& point : align_pair(pose, other, options).warp().sample(0.0))
    frames.push_back(point.q);
  return frames;
}

/// Frames of a piece whose last one falls on time `last`, in frames.
int frames_until(double last) {
  return std::max(1, static_cast<int>(std::lround(last)) + 1);
}

/// Exponential maps of b on the branches nearest to those of a.
Eigen::MatrixXd beside(const Eigen::MatrixXd& b, const Eigen::MatrixXd& a) {
  return align::on_branch_of(b, a.rowwise().mean());
}

/// b - a, frame by frame, without what is too quick to be style.
motion::PoseMatrix style_difference(const motion::PoseMatrix& a, const motion::PoseMatrix& b) {
  const auto smooth = [&](const Eigen::MatrixXd& rows) {
    return math::low_pass(rows, a.frame_rate_hz, kStyleCutoffHz);
  };
  return {a.frame_rate_hz, b.leg_length_m - a.leg_length_m,
          smooth(beside(b.angles, a.angles) - a.angles), smooth(b.height - a.height),
          smooth(b.steps - a.steps)};
}

}  // namespace

StyledPiece as_captured(const InputSnippet& own) {
  return {own.pose, own.contacts, counted(own.pose.frame_count())};
}

StyledPiece replaced(const InputSnippet& own, PlayedChoice played) {
  std::vector<double> frames = frames_beside(played.pose, own.pose);
  return {std::move(played.pose), std::move(played.contacts), std::move(frames)};
}

// Notation                              here
//   u(t), t = 0 .. U - 1   the snippet      own.pose
//   x(n)                   nearest fragment nearest
//   b(k), k = 0 .. B - 1   the blend        played.pose
//   n(k), t(n)             the same moment  in_nearest, in_own (as t(n(k)))
//
// While b goes from k to k + 1, x goes from n(k) to n(k + 1) and u from t(n(k)) to t(n(k + 1)): the
// style plays x 1 / (n(k + 1) - n(k)) times as slowly, so u shall take
// tau(k + 1) - tau(k) = (t(n(k + 1)) - t(n(k))) / (n(k + 1) - n(k)) frames for that.
// Output frame m at tau_m lies at some k: u(t(n(k))) + [b(k) - x(n(k))], of angles as space-time
// interpolation adds them (exponential maps on one branch: a tilt keeps no heading, a hinge stays
// one), and of root steps.
StyledPiece restyled_in_detail(const InputSnippet& own, PlayMemory& memory,
                               const PlayedChoice& played) {
  const motion::PoseMatrix& nearest =
      memory.model().fragments[static_cast<std::size_t>(own.fragment)].pose;
  align::TimeWarpOptions calm;
  calm.max_slope = kSteepestOwnWarp;
  const auto part = std::find_if(played.parts.begin(), played.parts.end(),
                                 [&](const auto& known) { return known.fragment == own.fragment; });
  const std::vector<double> in_nearest =
      part != played.parts.end() ? part->frames : frames_beside(played.pose, nearest, calm);
  const std::vector<double> in_own = read_at(frames_beside(nearest, own.pose, calm), in_nearest);
  std::vector<double> tau = {0.0};
  for (std::size_t k = 0; k + 1 < in_own.size(); ++k) {
    const double step = in_nearest[k + 1] - in_nearest[k];
    tau.push_back(tau.back() + (step > 0.0 ? (in_own[k + 1] - in_own[k]) / step : 0.0));
  }
  const double rate_hz = own.pose.frame_rate_hz;
  const int reach = static_cast<int>(std::lround(0.5 * kTimingS * rate_hz));
  const std::vector<double> at = where(tau, evenly(frames_until(tau.back()), tau.back()));
  const std::vector<double> in_blend = smoothed_times(at, reach);
  StyledPiece piece;
  piece.own_frames = smoothed_times(read_at(in_own, at), reach);
  const motion::PoseMatrix difference = style_difference(
      motion::sample(nearest, smoothed_times(read_at(in_nearest, at), reach), rate_hz),
      motion::sample(played.pose, in_blend, rate_hz));
  piece.pose = motion::sample(own.pose, piece.own_frames, rate_hz);
  piece.pose.angles += difference.angles;
  piece.pose.height += difference.height;
  piece.pose.steps += difference.steps;
  piece.pose.steps.col(0) =
      piece.pose.steps.col(std::min<Eigen::Index>(1, difference.steps.cols() - 1));
  // Played faster, the performer's own trembling is a multiple of what it was.
  const Jerk performers = jerk_of(own.pose);
  const Jerk sources = jerk_of(memory, played.parts);
  piece.pose = calmed(piece.pose, {std::max(performers.usual_m_s3, sources.usual_m_s3),
                                   std::max(performers.largest_m_s3, sources.largest_m_s3)});
  piece.contacts = motion::sample(own.contacts, piece.own_frames, rate_hz);
  return piece;
}

StyledPiece mixed(const InputSnippet& own, const StyledPiece& piece, double strength) {
  const double rate_hz = own.pose.frame_rate_hz;
  std::vector<double> tau = piece.own_frames;
  for (std::size_t k = 0; k < tau.size(); ++k)
    tau[k] = (1.0 - strength) * tau[k] + strength * static_cast<double>(k);
  const std::vector<double> in_piece = where(tau, evenly(frames_until(tau.back()), tau.back()));
  StyledPiece mix;
  mix.own_frames = read_at(piece.own_frames, in_piece);
  mix.pose = motion::sample(own.pose, mix.own_frames, rate_hz);
  const motion::PoseMatrix styled = motion::sample(piece.pose, in_piece, rate_hz);
  const auto towards = [&](auto& rows, const Eigen::MatrixXd& end) {
    rows = (1.0 - strength) * rows + strength * end;
  };
  towards(mix.pose.angles, beside(styled.angles, mix.pose.angles));
  towards(mix.pose.height, styled.height);
  towards(mix.pose.steps, styled.steps);
  mix.contacts = motion::mix(motion::sample(own.contacts, mix.own_frames, rate_hz),
                             motion::sample(piece.contacts, in_piece, rate_hz), strength);
  return mix;
}

StyledPiece with_own_timing(const InputSnippet& own, const StyledPiece& piece) {
  const double rate_hz = own.pose.frame_rate_hz;
  std::vector<double> frames = counted(own.pose.frame_count());
  const std::vector<double> in_piece = where(piece.own_frames, frames);
  return {motion::sample(piece.pose, in_piece, rate_hz),
          motion::sample(piece.contacts, in_piece, rate_hz), std::move(frames)};
}

}  // namespace laban::transfer
