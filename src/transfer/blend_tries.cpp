#include "transfer/blend_tries.h"

#include <algorithm>
#include <utility>

namespace laban::transfer {
namespace {

/// The best blend that is not known yet; nullopt if what is known is best.
std::optional<BlendChoice> next_choice(const BlendSearch& search, const EffortTarget& target,
                                       MeasuredMisses& misses) {
  for (;;) {
    BlendChoice next = search.best(target, misses);
    if (!misses.has(next)) return next;
    if (next.is_seed()) return std::nullopt;
    misses.settle({next.fragment_i, next.fragment_j});
  }
}

double on_scale(double effort) {
  return std::clamp(effort, effort::kEffortMin, effort::kEffortMax);
}

}  // namespace

ChosenBlend played(PlayMemory& memory, int fragment, BlendChoice choice, double fastest_play) {
  const StyleModel& model = memory.model();
  PlayedChoice motion = play_choice(memory, choice, fastest_play);
  const effort::Observation measured =
      effort::observe(effort::describe(motion.joint_positions, motion.pose.frame_rate_hz),
                      model.observer, model.fragments[static_cast<std::size_t>(fragment)].content);
  return {std::move(choice), std::move(motion), measured};
}

BlendTries::BlendTries(PlayMemory& memory, int fragment, const EffortTarget& target,
                       const SearchOptions& search, double fastest_play)
    : memory_(&memory),
      fragment_(fragment),
      target_(target),
      options_(search),
      fastest_play_(fastest_play),
      cost_(target, search, effort::kFactorCount) {
  play(memory.search(fragment, search).best(target));
}

void BlendTries::play(BlendChoice choice) {
  ChosenBlend blend = played(*memory_, fragment_, std::move(choice), fastest_play_);
  effort::EffortVector miss = effort::EffortVector::Zero(memory_->model().regressor.factor_count());
  for (const effort::Factor factor : effort::kFactors)  // Space is not measured
    miss[effort::index_of(factor)] = blend.measured.effort[factor] - blend.choice.predicted[factor];
  misses_.add(blend.choice, miss);
  const std::size_t number = tried_.size();
  tried_.push_back({blend.choice, blend.measured.effort, std::nullopt});
  if (best_number() != number) return;
  best_ = std::move(blend);
  best_is_ = number;
}

bool BlendTries::try_next() {
  if (!memory_->model().labels_measured) return false;
  if (cost_of(tried_[best_number()]) < kMissedBy) return false;
  std::optional<BlendChoice> next =
      next_choice(memory_->search(fragment_, options_), before_joining(), misses_);
  if (!next) return false;
  play(std::move(*next));
  return true;
}

void BlendTries::joined_as(const effort::Effort& measured) {
  Tried& tried = tried_[best_number()];
  tried.joined = measured;
  for (const effort::Factor factor : effort::kFactors)
    change_[factor] = measured[factor] - tried.measured[factor];
  const std::size_t number = best_number();
  if (number == best_is_) return;
  best_ = played(*memory_, fragment_, tried_[number].choice, fastest_play_);
  best_is_ = number;
}

std::size_t BlendTries::best_number() const {
  const auto best =
      std::min_element(tried_.begin(), tried_.end(),
                       [&](const Tried& a, const Tried& b) { return cost_of(a) < cost_of(b); });
  return static_cast<std::size_t>(best - tried_.begin());
}

double BlendTries::cost_of(const effort::Effort& measured) const {
  return cost_(effort::to_vector(measured), effort::EffortVector::Zero(effort::kFactorCount));
}

effort::Effort BlendTries::as_joined(const Tried& tried) const {
  if (tried.joined) return *tried.joined;
  effort::Effort expected = tried.measured;
  for (const effort::Factor factor : effort::kFactors)
    expected[factor] = on_scale(expected[factor] + change_[factor]);
  return expected;
}

EffortTarget BlendTries::before_joining() const {
  EffortTarget moved = target_;
  for (const effort::Factor factor : effort::kFactors) {
    auto& asked = moved.factors[static_cast<std::size_t>(effort::index_of(factor))];
    if (asked) asked = on_scale(*asked - change_[factor]);
    if (moved.stay_near) {
      double& near = (*moved.stay_near)[factor];
      near = on_scale(near - change_[factor]);
    }
  }
  return moved;
}

}  // namespace laban::transfer
