#include "laban/loop/turning_playback.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

constexpr double kMostFactor = 2.0;
// Of the clip, beyond the last leap, never shown: playback then goes to the end once.
constexpr double kMostShare = 1.5;
constexpr double kMuchUnshown = 0.1;

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
  plan_.last.frame = plan_.frame_count - 1;
  plan_.first.ease = std::clamp(plan_.first.ease, 1, longest);
  plan_.last.ease = std::clamp(plan_.last.ease, 1, longest);
  for (const PlaybackTurn& turn : plan_.turns)
    turn_chances_.push_back({turn.most_probability, 1.0});
  leap_chances_.resize(plan_.leaps.size());
  shown_.assign(static_cast<std::size_t>(plan_.frame_count), 0.0);
}

double TurningPlayback::shown_along(const Way& way) const {
  // Up to a quarter of the clip.
  const int reach = std::max(1, plan_.frame_count / 4);
  double sum = 0.0;
  int count = 0;
  for (int f = way.frame; f >= 0 && f < plan_.frame_count && count < reach; f += way.direction) {
    sum += shown_[static_cast<std::size_t>(f)];
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

bool TurningPlayback::leaves_much_unshown(int frame) const {
  const auto unshown = std::count(shown_.begin() + frame, shown_.end(), 0.0);
  return static_cast<double>(unshown) > kMuchUnshown * plan_.frame_count;
}

double TurningPlayback::most_shown_along(const Way& way) const {
  const int reach = std::max(1, plan_.frame_count / 4);
  double most = 0.0;
  for (int n = 0, f = way.frame; n < reach && f >= 0 && f < plan_.frame_count; ++n) {
    most = std::max(most, shown_[static_cast<std::size_t>(f)]);
    f += way.direction;
  }
  return most;
}

double TurningPlayback::mean_shown() const {
  return std::accumulate(shown_.begin(), shown_.end(), 0.0) / plan_.frame_count;
}

bool TurningPlayback::takes(Chance& chance, const Way& taken, const Way& passed) {
  const double favour = (1.0 + shown_along(passed)) / (1.0 + shown_along(taken));
  // Frames that have had more than their share wait.
  const bool too_often = most_shown_along(taken) > kMostShare * mean_shown() + 1.0;
  const double probability = too_often ? 0.0 : chance.k * chance.most * favour * favour * favour;
  const bool takes_it = rng_.uniform() < probability;
  const double step = takes_it ? -plan_.probability_step : plan_.probability_step;
  chance.k = std::clamp(chance.k + step, 0.0, kMostFactor);
  return takes_it;
}

void TurningPlayback::show(const PlaybackLeg& leg) {
  const int from = leg.from;
  const int to = leg.to;
  const int step = from <= to ? 1 : -1;
  for (int f = from; f != to + step; f += step) {
    // At half speed a frame is shown twice.
    const bool eased = std::abs(f - from) < leg.ease_from || std::abs(f - to) < leg.ease_to;
    shown_[static_cast<std::size_t>(f)] += eased ? 2.0 : 1.0;
  }
}

PlaybackLeg TurningPlayback::end_leg(const PlaybackTurn& turn) {
  const PlaybackLeg leg{at_, turn.frame, ease_, turn.ease, std::nullopt};
  show(leg);
  at_ = turn.frame;
  ease_ = turn.ease;
  direction_ = -direction_;
  return leg;
}

PlaybackLeg TurningPlayback::end_leg_by_leap(int leap) {
  const PlaybackLeap& taken = plan_.leaps[static_cast<std::size_t>(leap)];
  const PlaybackLeg leg{at_, taken.out_begin, ease_, 0, leap};
  show(leg);
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
      const bool is_last = leap == order.size();
      const bool end_is_needed = plan_.turns_at_all && leaves_much_unshown(out(n));
      const bool must = is_last && (!end_fits || !(plan_.last_turns || end_is_needed));
      const int in = plan_.leaps[static_cast<std::size_t>(n)].in_end;
      const bool taken = takes(leap_chances_[static_cast<std::size_t>(n)], {in, 1}, {out(n), 1});
      if (taken || must) return end_leg_by_leap(n);
      continue;
    }
    const PlaybackTurn& point = plan_.turns[turn++];
    const bool fits =
        point.frame >= at_ + ease_ + point.ease && point.frame - point.ease > plan_.first.frame;
    if (fits && takes(turn_chances_[turn - 1], {point.frame - 1, -1}, {point.frame + 1, 1})) {
      return end_leg(point);
    }
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
    if (fits && takes(turn_chances_[n], {point.frame + 1, 1}, {point.frame - 1, -1})) {
      return end_leg(point);
    }
  }
  PlaybackTurn first = plan_.first;
  first.ease = std::clamp(at_ - first.frame - ease_, 1, plan_.first.ease);
  return end_leg(first);
}

PlaybackLeg TurningPlayback::next() {
  return direction_ > 0 ? forwards() : backwards();
}

}  // namespace laban::loop
