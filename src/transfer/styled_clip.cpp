#include "laban/transfer/styled_clip.h"

#include <algorithm>
#include <cmath>
#include <map>
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

/// The input's own frames that a snippet shows.
motion::Clip own_frames(const AppliedSnippet& snippet, const motion::Clip& input,
                        double model_rate_hz) {
  const double per_frame = input.frame_rate_hz() / model_rate_hz;
  const int last = input.frame_count();
  const int begin =
      std::clamp(static_cast<int>(std::lround(snippet.begin * per_frame)), 0, last - 1);
  const int end =
      std::clamp(static_cast<int>(std::lround(snippet.end * per_frame)), begin + 1, last);
  return input.slice(begin, end);
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

StyledSources play_sources(const StyleModel& model, const AppliedStyle& applied,
                           const motion::Capture& input) {
  StyledSources sources;
  std::map<int, std::size_t> place_of;  // of fragments
  for (const AppliedSnippet& snippet : applied.snippets) {
    std::vector<std::size_t> places;
    if (snippet.own_share > 0.0) {
      places.push_back(sources.clips.size());
      sources.clips.push_back(own_frames(snippet, input.clip, applied.pose.frame_rate_hz));
    }
    if (!snippet.kept) {
      for (const BlendShare& share : snippet.choice.shares()) {
        const auto [place, is_new] = place_of.emplace(share.fragment, sources.clips.size());
        places.push_back(place->second);
        if (!is_new) continue;
        sources.clips.push_back(
            play_fragment(model.fragments[static_cast<std::size_t>(share.fragment)].pose, input));
      }
    }
    sources.shares.resize(sources.clips.size(), 0.0);
    const double frames = snippet.output_end - snippet.output_begin;
    for (const std::size_t place : places) {
      sources.shares[place] +=
          frames / (static_cast<double>(places.size()) * applied.pose.frame_count());
    }
  }
  sources.floor = mean_floor(sources.clips, input.humanoid);
  return sources;
}

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
      0,
      0,
      0.0};
  if (options.hold_feet)
    styled.floor = motion::find_foot_contacts(input.clip, input.humanoid).floor;
  if (!styled.floor) styled.floor = play_sources(model, applied, input).floor;
  if (!options.hold_feet || !styled.floor) return styled;
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

std::optional<double> content_ratio(const StyleModel& model, const motion::PoseMatrix& pose,
                                    const motion::PoseMatrix& other, const std::string& content) {
  const auto& names = model.contents.names;
  const auto group = std::find(names.begin(), names.end(), content) - names.begin();
  if (group == std::ssize(names)) return std::nullopt;
  const double usual = model.match_costs[static_cast<std::size_t>(group)].median;
  if (usual <= 0.0) return std::nullopt;
  const align::ContentMetric& metric = model.database.metric();
  const auto features = [&](const motion::PoseMatrix& of) {
    return metric.features(of, metric.mean_pose(std::span(&of, 1)));
  };
  return align::dtw_cost(features(pose), features(other)).mean_cost() / usual;
}

std::optional<double> content_ratio(const StyleModel& model, const AppliedStyle& applied,
                                    const motion::PoseMatrix& input) {
  double sum = 0.0;
  double frames = 0.0;
  for (const AppliedSnippet& snippet : applied.snippets) {
    if (snippet.kept) continue;
    const auto ratio =
        content_ratio(model, applied.pose.slice(snippet.output_begin, snippet.output_end),
                      input.slice(snippet.begin, snippet.end), snippet.content);
    if (!ratio) continue;
    const double count = snippet.output_end - snippet.output_begin;
    sum += count * *ratio;
    frames += count;
  }
  return frames > 0.0 ? std::optional(sum / frames) : std::nullopt;
}

StyledQuality measure_styled(const StyledClip& styled, const StyledSources& sources,
                             const motion::Humanoid& humanoid) {
  const motion::FootFloor floor = styled.floor.value_or(motion::FootFloor{});
  StyledQuality quality;
  quality.output = motion::measure_quality(styled.clip, humanoid, floor);
  std::vector<motion::MotionQuality> measured;
  for (std::size_t n = 0; n < sources.clips.size(); ++n) {
    const motion::Clip& clip = sources.clips[n];
    const auto own = motion::find_foot_contacts(clip, humanoid).floor;
    measured.push_back(motion::measure_quality(clip, humanoid, own.value_or(floor)));
    const double share = sources.shares[n];
    quality.source_skate_cm += share * measured.back().foot_skate_cm;
    quality.source_toe_height_m += share * measured.back().toe_height_m;
    quality.source_spectral_arc_length += share * measured.back().spectral_arc_length;
    quality.source_jerk_m_s3 += share * std::pow(measured.back().jerk_m_s3, 2);
  }
  quality.source_jerk_m_s3 = std::sqrt(quality.source_jerk_m_s3);
  quality.join_percentile =
      motion::join_acceleration_percentile(quality.output, styled.joins, measured);
  return quality;
}

}  // namespace laban::transfer
