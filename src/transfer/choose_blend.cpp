#include "laban/transfer/choose_blend.h"

#include <algorithm>

#include "transfer/blend_search.h"

namespace laban::transfer {
namespace {

/// Half: what the regressor is wrong by at the next blend is not quite the same.
constexpr double kGain = 0.5;

bool same_blend(const BlendChoice& a, const BlendChoice& b) {
  return a.fragment_i == b.fragment_i && a.fragment_j == b.fragment_j && a.alpha == b.alpha &&
         a.further.empty() && b.further.empty();
}

/// What to ask for, so that `target` is measured where `measured` was when `moved` was asked for.
void move(EffortTarget& moved, const EffortTarget& target, const effort::Effort& measured) {
  for (const effort::Factor factor : effort::kFactors) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    if (target.factors[f]) {
      const double next = *moved.factors[f] + kGain * (*target.factors[f] - measured[factor]);
      moved.factors[f] = std::clamp(next, effort::kEffortMin, effort::kEffortMax);
    } else if (target.stay_near) {
      (*moved.stay_near)[factor] += kGain * ((*target.stay_near)[factor] - measured[factor]);
    }
  }
}

ChosenBlend played(PlayMemory& memory, int fragment, BlendChoice choice, double fastest_play) {
  const StyleModel& model = memory.model();
  PlayedChoice motion = play_choice(memory, choice, fastest_play);
  const effort::Observation measured =
      effort::observe(effort::describe(motion.joint_positions, motion.pose.frame_rate_hz),
                      model.observer, model.fragments[static_cast<std::size_t>(fragment)].content);
  return {std::move(choice), std::move(motion), measured};
}

}  // namespace

ChosenBlend choose_blend(PlayMemory& memory, int fragment, const EffortTarget& target,
                         const SearchOptions& options, int tries, double fastest_play) {
  const StyleModel& model = memory.model();
  const BlendSearch& search = memory.search(fragment, options);
  const auto play = [&](BlendChoice choice) {
    return played(memory, fragment, std::move(choice), fastest_play);
  };
  ChosenBlend best = play(search.best(target));
  if (!model.labels_measured) return best;

  const BlendCost cost(target, options, effort::kFactorCount);
  const auto cost_of = [&](const effort::Observation& measured) {
    return cost(effort::to_vector(measured.effort),
                effort::EffortVector::Zero(effort::kFactorCount));
  };
  double least = cost_of(best.measured);
  EffortTarget moved = target;
  BlendChoice last = best.choice;
  effort::Effort measured = best.measured.effort;
  for (int n = 1; n < tries && least >= kMissedBy; ++n) {
    move(moved, target, measured);
    BlendChoice next = search.best(moved);
    if (same_blend(next, last)) continue;
    last = next;
    ChosenBlend tried = play(std::move(next));
    measured = tried.measured.effort;
    const double own = cost_of(tried.measured);
    if (own >= least) continue;
    least = own;
    best = std::move(tried);
  }
  best.choice.distance =
      target.distance_to(effort::to_vector(best.choice.predicted, model.regressor.factor_count()));
  return best;
}

ChosenBlend blend_by_hand(PlayMemory& memory, int fragment, int fragment_i, int fragment_j,
                          double alpha, const EffortTarget& target, const SearchOptions& options,
                          double fastest_play) {
  const BlendSearch& search = memory.search(fragment, options);
  return played(memory, fragment, search.of_pair(fragment_i, fragment_j, alpha, target),
                fastest_play);
}

}  // namespace laban::transfer
