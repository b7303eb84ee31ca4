#include "laban/transfer/play_choice.h"

#include <algorithm>
#include <span>
#include <utility>

#include "laban/blend/space_time_interpolation.h"
#include "laban/motion/calm.h"
#include "laban/motion/standard_body.h"

#include "transfer/frame_times.h"

namespace laban::transfer {
namespace {

/// Time warps for a blend at `alpha` in which no clip plays faster than `fastest` times: with
/// s = dq/dp and b beyond [0, 1], clip i plays at 1 / ((1 + b) s - b) where alpha = 1 + b, so
/// s >= (1 / fastest + b) / (1 + b); the same of clip j where alpha = -b.
align::TimeWarpOptions calm_warp(double alpha, double fastest) {
  const double beyond = std::max({0.0, -alpha, alpha - 1.0});
  align::TimeWarpOptions warp;
  warp.max_slope = std::min((1.0 + beyond) / (1.0 / fastest + beyond), align::kMaxWarpSlope);
  return warp;
}

const motion::PoseMatrix& pose_of(const StyleModel& model, int fragment) {
  return model.fragments[static_cast<std::size_t>(fragment)].pose;
}

/// A fragment as it is.
PlayedChoice play_fragment(PlayMemory& memory, int fragment) {
  const motion::PoseMatrix& pose = pose_of(memory.model(), fragment);
  return {pose, memory.of(fragment).contacts, {{fragment, counted(pose.frame_count())}}, {}};
}

/// What was blended so far with a further fragment; `pair` holds the two.
PlayedChoice blend_in(PlayMemory& memory, const PlayedChoice& so_far, const BlendStep& step,
                      const blend::BlendPair& pair) {
  blend::Blend made = blend::blend(pair, step.alpha);
  PlayedChoice played{
      {},
      blend::blend_contacts(made, step.alpha, so_far.contacts, memory.of(step.fragment).contacts),
      {},
      {}};
  for (const PlayedPart& part : so_far.parts)
    played.parts.push_back({part.fragment, read_at(part.frames, made.times_i)});
  played.parts.push_back({step.fragment, std::move(made.times_j)});
  played.pose = std::move(made.pose);
  return played;
}

/// The same of a blend with a further fragment, which no memory holds.
PlayedChoice blend_further_in(PlayMemory& memory, const PlayedChoice& so_far, const BlendStep& step,
                              double fastest_play) {
  const motion::PoseMatrix& next = pose_of(memory.model(), step.fragment);
  const align::TimeWarp warp =
      align::warp_of_path(path_between(so_far.pose, next), calm_warp(step.alpha, fastest_play));
  return blend_in(memory, so_far, step, {so_far.pose, next, warp});
}

/// The most jerk that a blend of some fragments may have: quick play and extrapolation make it of
/// the fragments' trembling. Where a time warp changes pace a blend may jerk for a moment: there it
/// is held to what its fragments do at most.
motion::Jerk most_jerk(PlayMemory& memory, std::span<const PlayedPart> parts) {
  constexpr double kMostUsual = 1.2;           // times the fragments'
  constexpr double kMostLargest = 1.0 + 1e-9;  // the same, and round-off is no jerk
  motion::Jerk all;
  for (const PlayedPart& part : parts) {
    const motion::Jerk& own = memory.of(part.fragment).jerk;
    all.usual_m_s3 += own.usual_m_s3 / static_cast<double>(parts.size());
    all.largest_m_s3 = std::max(all.largest_m_s3, own.largest_m_s3);
  }
  return {kMostUsual * all.usual_m_s3, kMostLargest * all.largest_m_s3};
}

}  // namespace

PlayMemory::PlayMemory(const StyleModel& model) : model_(&model), known_(model.fragments.size()) {}

const PlayMemory::Known& PlayMemory::of(int fragment) {
  std::optional<Known>& known = known_[static_cast<std::size_t>(fragment)];
  if (!known) {
    const motion::PoseMatrix& pose = pose_of(*model_, fragment);
    known = Known{motion::find_foot_contacts(pose).contacts, motion::jerk_of(pose)};
  }
  return *known;
}

const std::vector<align::FramePair>& PlayMemory::path(int fragment_i, int fragment_j) {
  auto& path = paths_[{fragment_i, fragment_j}];
  if (path.empty()) path = path_between(pose_of(*model_, fragment_i), pose_of(*model_, fragment_j));
  return path;
}

const blend::BlendPair& PlayMemory::pair(int fragment_i, int fragment_j, double alpha,
                                         double fastest_play) {
  const align::TimeWarpOptions warp = calm_warp(alpha, fastest_play);
  const auto kept = std::find_if(pairs_.begin(), pairs_.end(), [&](const KeptPair& known) {
    return known.i == fragment_i && known.j == fragment_j && known.max_slope == warp.max_slope;
  });
  if (kept != pairs_.end()) {
    pairs_.splice(pairs_.begin(), pairs_, kept);
    return kept->pair;
  }
  blend::BlendPair made(pose_of(*model_, fragment_i), pose_of(*model_, fragment_j),
                        align::warp_of_path(path(fragment_i, fragment_j), warp));
  pairs_.push_front({fragment_i, fragment_j, warp.max_slope, std::move(made)});
  if (pairs_.size() > kKeptPairs) pairs_.pop_back();
  return pairs_.front().pair;
}

const BlendSearch& PlayMemory::search(int fragment, const SearchOptions& options) {
  if (!searches_.empty() && searches_.begin()->second.options() != options) searches_.clear();
  const auto found = searches_.find(fragment);
  if (found != searches_.end()) return found->second;
  return searches_.emplace(fragment, BlendSearch(*model_, fragment, options)).first->second;
}

PlayedChoice play_choice(PlayMemory& memory, const BlendChoice& choice, double fastest_play) {
  PlayedChoice played = play_fragment(memory, choice.fragment_i);
  if (choice.is_seed()) {
    played.joint_positions = motion::standard_joint_positions(played.pose);
    return played;
  }
  played = blend_in(memory, played, {choice.fragment_j, choice.alpha},
                    memory.pair(choice.fragment_i, choice.fragment_j, choice.alpha, fastest_play));
  for (const BlendStep& step : choice.further)
    played = blend_further_in(memory, played, step, fastest_play);
  motion::PosedMotion calm = motion::calm(std::move(played.pose), most_jerk(memory, played.parts));
  played.pose = std::move(calm.pose);
  played.joint_positions = std::move(calm.joint_positions);
  return played;
}

PlayedChoice play_choice(const StyleModel& model, const BlendChoice& choice, double fastest_play) {
  PlayMemory memory(model);
  return play_choice(memory, choice, fastest_play);
}

}  // namespace laban::transfer
