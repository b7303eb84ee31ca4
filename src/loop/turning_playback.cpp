#include "laban/loop/turning_playback.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

constexpr double kMostFactor = 2.0;

void check_plan(const PlaybackPlan& plan) {
  using base::Error;
  using base::ErrorKind;
  if (plan.frame_count < 2) {
    throw Error(ErrorKind::kData, "playback needs a clip of at least 2 frames, not " +
                                      std::to_string(plan.frame_count));
  }
  if (!(plan.probability_step >= 0.0)) {
    throw Error(ErrorKind::kUsage, "PlaybackPlan::probability_step must be >= 0");
  }
  const auto inside = [&](int frame) { return frame >= 0 && frame < plan.frame_count; };
  for (const PlaybackTurn& turn : plan.turns) {
    if (!inside(turn.frame) || turn.ease < 1 || !(turn.most_probability >= 0.0)) {
      throw Error(ErrorKind::kData, "a turning point lies outside the clip or has no easing");
    }
  }
  for (const PlaybackLeap& leap : plan.leaps) {
    if (!inside(leap.out_begin) || !inside(leap.in_end)) {
      throw Error(ErrorKind::kData, "a seam lies outside the clip");
    }
  }
}

}  // namespace

TurningPlayback::TurningPlayback(PlaybackPlan plan, base::Rng rng)
    : plan_(std::move(plan)), rng_(rng) {
  check_plan(plan_);
  const int longest = std::max(1, (plan_.frame_count - 1) / 2);
  plan_.first.frame = 0;
  plan_.last.frame = plan_.frame_count - 1;
  plan_.first.ease = std::clamp(plan_.first.ease, 1, longest);
  plan_.last.ease = std::clamp(plan_.last.ease, 1, longest);
  for (const PlaybackTurn& turn : plan_.turns)
    turn_chances_.push_back({turn.most_probability, 1.0});
  leap_chances_.resize(plan_.leaps.size());
  shown_.assign(static_cast<std::size_t>(plan_.frame_count), 0.0);
}

double TurningPlayback::favour(int frame, int direction) const {
  // What would be shown next: up to a quarter of the clip.
  const int reach = std::max(1, plan_.frame_count / 4);
  double sum = 0.0;
  int count = 0;
  for (int f = frame; f >= 0 && f < plan_.frame_count && count < reach; f += direction, ++count) {
    sum += shown_[static_cast<std::size_t>(f)];
  }
  const double theirs = count > 0 ? sum / count : 0.0;
  return (1.0 + shown_sum_ / plan_.frame_count) / (1.0 + theirs);
}

bool TurningPlayback::takes(Chance& chance, int next_frame, int direction) {
  const double probability = chance.k * chance.most * favour(next_frame, direction);
  const bool taken = rng_.uniform() < probability;
  const double step = taken ? -plan_.probability_step : plan_.probability_step;
  chance.k = std::clamp(chance.k + step, 0.0, kMostFactor);
  return taken;
}

void TurningPlayback::show(int from, int to) {
  const int step = from <= to ? 1 : -1;
  for (int f = from; f != to + step; f += step) {
    shown_[static_cast<std::size_t>(f)] += 1.0;
    shown_sum_ += 1.0;
  }
}

PlaybackLeg TurningPlayback::end_leg(const PlaybackTurn& turn) {
  const PlaybackLeg leg{at_, turn.frame, ease_, turn.ease, std::nullopt};
  show(at_, turn.frame);
  at_ = turn.frame;
  ease_ = turn.ease;
  direction_ = -direction_;
  return leg;
}

PlaybackLeg TurningPlayback::end_leg_by_leap(int leap) {
  const PlaybackLeap& taken = plan_.leaps[static_cast<std::size_t>(leap)];
  const PlaybackLeg leg{at_, taken.out_begin, ease_, 0, leap};
  show(at_, taken.out_begin);
  at_ = taken.in_end;
  ease_ = 0;
  return leg;
}

PlaybackLeg TurningPlayback::forwards() {
  const int end = plan_.frame_count - 1;
  // The easing of the turn at the last frame must fit too.
  const bool end_fits = at_ + ease_ + plan_.last.ease <= end;
  std::vector<int> order;
  for (int n = 0; n < static_cast<int>(plan_.leaps.size()); ++n) {
    if (plan_.leaps[static_cast<std::size_t>(n)].out_begin > at_ + ease_) order.push_back(n);
  }
  const auto out = [&](int n) { return plan_.leaps[static_cast<std::size_t>(n)].out_begin; };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return out(a) < out(b); });
  std::size_t leap = 0;
  std::size_t turn = 0;
  while (leap < order.size() || turn < plan_.turns.size()) {
    const int turn_frame = turn < plan_.turns.size() ? plan_.turns[turn].frame : plan_.frame_count;
    if (leap < order.size() && out(order[leap]) <= turn_frame) {
      const int n = order[leap++];
      const bool must = leap == order.size() && (!plan_.last_turns || !end_fits);
      const int in = plan_.leaps[static_cast<std::size_t>(n)].in_end;
      const bool taken = takes(leap_chances_[static_cast<std::size_t>(n)], in, 1);
      if (taken || must) return end_leg_by_leap(n);
      continue;
    }
    const PlaybackTurn& point = plan_.turns[turn++];
    const bool fits = point.frame >= at_ + ease_ + point.ease && point.frame > point.ease;
    if (fits && takes(turn_chances_[turn - 1], point.frame - 1, -1)) return end_leg(point);
  }
  PlaybackTurn last = plan_.last;
  last.ease = std::clamp(end - at_ - ease_, 1, plan_.last.ease);
  return end_leg(last);
}

PlaybackLeg TurningPlayback::backwards() {
  for (std::size_t n = plan_.turns.size(); n-- > 0;) {
    const PlaybackTurn& point = plan_.turns[n];
    const bool fits =
        point.frame <= at_ - ease_ - point.ease && point.frame + point.ease < plan_.frame_count - 1;
    if (fits && takes(turn_chances_[n], point.frame + 1, 1)) return end_leg(point);
  }
  PlaybackTurn first = plan_.first;
  first.ease = std::clamp(at_ - ease_, 1, plan_.first.ease);
  return end_leg(first);
}

PlaybackLeg TurningPlayback::next() {
  return direction_ > 0 ? forwards() : backwards();
}

}  // namespace laban::loop
