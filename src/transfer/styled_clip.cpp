#include "laban/transfer/styled_clip.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "laban/align/dtw.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"

#include "transfer/frame_times.h"

namespace laban::transfer {
namespace {

/// Times over which the input's own time is smoothed, seconds.
constexpr double kWarpS = 0.2;

/// The frames of a styled motion, (fractional) at the model's rate, that are played at the input's:
/// its own duration, or the input's frame count if it keeps the timing.
std::vector<double> played_frames(const AppliedStyle& applied, const motion::Clip& input) {
  const double step = applied.pose.frame_rate_hz / input.frame_rate_hz();
  const double last = applied.pose.frame_count() - 1;
  const int count = applied.keeps_timing ? input.frame_count()
                                         : static_cast<int>(std::floor(last / step + 1e-6)) + 1;
  std::vector<double> frames = counted(count);
  for (double& frame : frames) frame *= step;
  return frames;
}

/// For each frame that is played, the frame of the input's clip that shows the same moment. A time
/// warp's slope jumps from cell to cell; joints that play the input by it would tremble, so it is
/// smoothed over kWarpS, three times, unless the input's own timing is kept.
std::vector<double> source_frames(const AppliedStyle& applied, const std::vector<double>& played,
                                  double rate_hz) {
  std::vector<double> frames = read_at(applied.source_frames, played);
  // They count at the model's rate; what is asked for counts at the input's.
  for (double& frame : frames) frame *= rate_hz / applied.pose.frame_rate_hz;
  if (applied.keeps_timing) return frames;
  return smoothed_times(std::move(frames), static_cast<int>(std::lround(0.5 * kWarpS * rate_hz)));
}

/// A fragment on the input's body: travel scales to its legs.
motion::Clip play_fragment(motion::PoseMatrix pose, const motion::Capture& input) {
  pose.leg_length_m = input.humanoid.leg_length_m();
  return motion::from_pose_matrix(motion::resample(pose, input.clip.frame_rate_hz()),
                                  input.humanoid, input.clip);
}

std::vector<motion::Clip> play_sources(const StyleModel& model, const AppliedStyle& applied,
                                       const motion::Capture& input) {
  std::vector<motion::Clip> sources;
  std::set<int> seen;
  const double per_frame = input.clip.frame_rate_hz() / applied.pose.frame_rate_hz;
  for (const AppliedSnippet& snippet : applied.snippets) {
    if (snippet.own_share > 0.0) {
      const int last = input.clip.frame_count();
      const int begin =
          std::clamp(static_cast<int>(std::lround(snippet.begin * per_frame)), 0, last - 1);
      const int end =
          std::clamp(static_cast<int>(std::lround(snippet.end * per_frame)), begin + 1, last);
      sources.push_back(input.clip.slice(begin, end));
    }
    if (snippet.kept) continue;
    for (const BlendShare& share : snippet.choice.shares()) {
      if (!seen.insert(share.fragment).second) continue;
      sources.push_back(
          play_fragment(model.fragments[static_cast<std::size_t>(share.fragment)].pose, input));
    }
  }
  return sources;
}

std::optional<motion::FootFloor> mean_floor(const std::vector<motion::Clip>& clips,
                                            const motion::Humanoid& humanoid) {
  motion::FootFloor mean;
  int count = 0;
  for (const motion::Clip& clip : clips) {
    const auto floor = motion::find_foot_contacts(clip, humanoid).floor;
    if (!floor) continue;
    mean.heel_m += floor->heel_m;
    mean.toe_m += floor->toe_m;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return motion::FootFloor{mean.heel_m / count, mean.toe_m / count};
}

std::vector<int> joins_of(const AppliedStyle& applied, double rate_hz, int frame_count) {
  std::vector<int> joins;
  for (std::size_t n = 1; n < applied.snippets.size(); ++n) {
    const int join = static_cast<int>(
        std::lround(applied.snippets[n].output_begin * rate_hz / applied.pose.frame_rate_hz));
    if (join > (joins.empty() ? 0 : joins.back()) && join < frame_count) joins.push_back(join);
  }
  return joins;
}

}  // namespace

StyledClip play_style(const StyleModel& model, const AppliedStyle& applied,
                      const motion::Capture& input, const StyledClipOptions& options) {
  const double rate_hz = input.clip.frame_rate_hz();
  const std::vector<double> played = played_frames(applied, input.clip);
  const bool every_frame =
      rate_hz == applied.pose.frame_rate_hz && std::ssize(played) == applied.pose.frame_count();
  const motion::PoseMatrix pose =
      every_frame ? applied.pose : motion::sample(applied.pose, played, rate_hz);
  const std::vector<double> frames = source_frames(applied, played, rate_hz);
  StyledClip styled{
      motion::from_pose_matrix(pose, input.humanoid, input.clip, {frames, std::nullopt}),
      frames,
      joins_of(applied, rate_hz, pose.frame_count()),
      std::nullopt,
      std::nullopt,
      play_sources(model, applied, input),
      0,
      0,
      0.0};
  styled.source_floor = mean_floor(styled.sources, input.humanoid);
  styled.floor = styled.source_floor;
  if (!options.hold_feet || !styled.floor) return styled;
  const auto own = motion::find_foot_contacts(input.clip, input.humanoid).floor;
  if (own) styled.floor = own;
  motion::FootLockOptions lock;
  lock.floor = styled.floor;
  lock.joins = styled.joins;
  motion::LockedFeet locked = motion::lock_feet(
      styled.clip, input.humanoid, motion::sample(applied.contacts, played, rate_hz), lock);
  styled.clip = std::move(locked.clip);
  styled.foot_stances = locked.stances;
  styled.foot_steps = locked.steps;
  styled.farthest_foot_m = locked.farthest_m;
  return styled;
}

std::optional<double> content_ratio(const StyleModel& model, const AppliedStyle& applied,
                                    const motion::PoseMatrix& input) {
  const align::ContentMetric& metric = model.database.metric();
  const auto features = [&](const motion::PoseMatrix& pose) {
    return metric.features(pose, metric.mean_pose(std::span(&pose, 1)));
  };
  double sum = 0.0;
  double frames = 0.0;
  for (const AppliedSnippet& snippet : applied.snippets) {
    const auto group = static_cast<std::size_t>(
        model.contents.numbers[static_cast<std::size_t>(snippet.fragment)]);
    const double usual = model.match_costs[group].median;
    if (snippet.kept || usual <= 0.0) continue;
    const double cost =
        align::dtw_cost(features(applied.pose.slice(snippet.output_begin, snippet.output_end)),
                        features(input.slice(snippet.begin, snippet.end)))
            .mean_cost();
    const double count = snippet.output_end - snippet.output_begin;
    sum += count * cost / usual;
    frames += count;
  }
  return frames > 0.0 ? std::optional(sum / frames) : std::nullopt;
}

StyledQuality measure_styled(const StyledClip& styled, const motion::Humanoid& humanoid) {
  const motion::FootFloor floor = styled.floor.value_or(motion::FootFloor{});
  StyledQuality quality;
  quality.output = motion::measure_quality(styled.clip, humanoid, floor);
  std::vector<motion::MotionQuality> sources;
  for (const motion::Clip& clip : styled.sources) {
    const auto own = motion::find_foot_contacts(clip, humanoid).floor;
    sources.push_back(motion::measure_quality(clip, humanoid, own.value_or(floor)));
    const double share = 1.0 / static_cast<double>(styled.sources.size());
    quality.source_skate_cm += share * sources.back().foot_skate_cm;
    quality.source_toe_height_m += share * sources.back().toe_height_m;
    quality.source_spectral_arc_length += share * sources.back().spectral_arc_length;
    quality.source_jerk_m_s3 += share * sources.back().jerk_m_s3;
  }
  quality.join_percentile =
      motion::join_acceleration_percentile(quality.output, styled.joins, sources);
  return quality;
}

}  // namespace laban::transfer
