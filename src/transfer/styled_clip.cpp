#include "laban/transfer/styled_clip.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "laban/align/dtw.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"

namespace laban::transfer {
namespace {

/// Times over which the input's own time is smoothed, seconds.
constexpr double kWarpS = 0.2;

/// Frames [k - reach, k + reach] averaged, the ends reflected about themselves (2 x_0 - x_k): what
/// rises goes on rising, and a steady rise stays as it is.
std::vector<double> averaged(const std::vector<double>& values, int reach) {
  const int last = static_cast<int>(values.size()) - 1;
  const auto at = [&](int k) { return values[static_cast<std::size_t>(std::clamp(k, 0, last))]; };
  const auto beyond = [&](int k) {
    if (k < 0) return 2.0 * values.front() - at(-k);
    return k <= last ? at(k) : 2.0 * values.back() - at(2 * last - k);
  };
  std::vector<double> means;
  double sum = 0.0;
  for (int k = -reach; k <= reach; ++k) sum += beyond(k);
  for (int k = 0; k <= last; ++k) {
    means.push_back(sum / (2 * reach + 1));
    sum += beyond(k + reach + 1) - beyond(k - reach);
  }
  return means;
}

/// For each frame at the input's rate, the input frame that shows the same moment of the action.
/// A time warp's slope jumps from cell to cell; joints that play the input by it would tremble, so
/// it is smoothed over kWarpS, three times.
std::vector<double> source_frames(const AppliedStyle& applied, double rate_hz, int frame_count) {
  // The source frames count at the model's rate; what is asked for counts at the input's.
  const double per_frame = rate_hz / applied.pose.frame_rate_hz;
  std::vector<double> frames;
  for (int k = 0; k < frame_count; ++k) {
    const double at =
        std::min(k / per_frame, static_cast<double>(applied.source_frames.size() - 1));
    const auto before = static_cast<std::size_t>(at);
    const auto after = std::min(before + 1, applied.source_frames.size() - 1);
    const double share = at - static_cast<double>(before);
    frames.push_back(
        ((1.0 - share) * applied.source_frames[before] + share * applied.source_frames[after]) *
        per_frame);
  }
  const int reach = static_cast<int>(std::lround(0.5 * kWarpS * rate_hz));
  for (int pass = 0; pass < 3; ++pass) frames = averaged(frames, reach);
  return frames;
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
    if (snippet.kept) {
      const int last = input.clip.frame_count();
      const int begin =
          std::clamp(static_cast<int>(std::lround(snippet.begin * per_frame)), 0, last - 1);
      const int end =
          std::clamp(static_cast<int>(std::lround(snippet.end * per_frame)), begin + 1, last);
      sources.push_back(input.clip.slice(begin, end));
      continue;
    }
    for (const int fragment : {snippet.choice.fragment_i, snippet.choice.fragment_j}) {
      if (!seen.insert(fragment).second) continue;
      sources.push_back(
          play_fragment(model.fragments[static_cast<std::size_t>(fragment)].pose, input));
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
  const motion::PoseMatrix pose = motion::resample(applied.pose, rate_hz);
  const std::vector<double> frames = source_frames(applied, rate_hz, pose.frame_count());
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
  motion::LockedFeet locked = motion::lock_feet(styled.clip, input.humanoid,
                                                motion::resample(applied.contacts, rate_hz), lock);
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
