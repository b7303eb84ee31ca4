#include "laban/transfer/choose_blend.h"

#include <optional>
#include <utility>

#include "laban/transfer/measured_misses.h"

#include "transfer/blend_search.h"

namespace laban::transfer {
namespace {

/// The best blend that is not known yet; nullopt if what is known is best.
std::optional<BlendChoice> next_try(const BlendSearch& search, const EffortTarget& target,
                                    MeasuredMisses& misses) {
  for (;;) {
    BlendChoice next = search.best(target, misses);
    if (!misses.has(next)) return next;
    if (next.is_seed()) return std::nullopt;
    misses.settle({next.fragment_i, next.fragment_j});
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
  MeasuredMisses misses;
  const auto learn_from = [&](const ChosenBlend& tried) {
    effort::EffortVector miss = effort::EffortVector::Zero(model.regressor.factor_count());
    for (const effort::Factor factor : effort::kFactors)  // Space is not measured
      miss[effort::index_of(factor)] =
          tried.measured.effort[factor] - tried.choice.predicted[factor];
    misses.add(tried.choice, miss);
  };
  learn_from(best);
  double least = cost_of(best.measured);
  for (int n = 1; n < tries && least >= kMissedBy; ++n) {
    std::optional<BlendChoice> next = next_try(search, target, misses);
    if (!next) break;
    ChosenBlend tried = play(std::move(*next));
    learn_from(tried);
    const double own = cost_of(tried.measured);
    if (own >= least) continue;
    least = own;
    best = std::move(tried);
  }
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
