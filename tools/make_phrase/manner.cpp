#include "manner.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "laban/base/rng.h"

namespace laban::phrase {
namespace {

/// A factor's level for each performer.
using Levels = std::vector<double>;

/// Values replaced by their rank, spread evenly over [-1, 1].
Levels spread_by_rank(const Levels& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&values](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  Levels levels(values.size());
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    levels[order[rank]] =
        2.0 * static_cast<double>(rank) / static_cast<double>(order.size() - 1) - 1.0;
  }
  return levels;
}

Levels random_levels(int count, base::Rng& rng) {
  Levels levels(static_cast<std::size_t>(count));
  for (double& level : levels) level = rng.uniform(-1.0, 1.0);
  return levels;
}

/// Both have the same even spread around 0, so their correlation is a ratio of dot products.
double correlation(const Levels& a, const Levels& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0) /
         std::inner_product(a.begin(), a.end(), a.begin(), 0.0);
}

struct FactorLevels {
  Levels weight, time, flow;
};

double worst_correlation(const FactorLevels& levels) {
  return std::max({std::abs(correlation(levels.weight, levels.time)),
                   std::abs(correlation(levels.weight, levels.flow)),
                   std::abs(correlation(levels.time, levels.flow))});
}

/// Levels that lean towards a performer's temperament.
Levels coloured(const Levels& temperament, base::Rng& rng) {
  constexpr double kTemperamentShare = 0.5;
  Levels mixed = random_levels(static_cast<int>(temperament.size()), rng);
  for (std::size_t p = 0; p < mixed.size(); ++p) {
    mixed[p] = kTemperamentShare * temperament[p] + (1.0 - kTemperamentShare) * mixed[p];
  }
  return spread_by_rank(mixed);
}

template <typename Draw>
FactorLevels least_correlated(const Draw& draw) {
  constexpr int kDraws = 300;
  FactorLevels best = draw();
  for (int i = 1; i < kDraws; ++i) {
    FactorLevels candidate = draw();
    if (worst_correlation(candidate) < worst_correlation(best)) best = std::move(candidate);
  }
  return best;
}

}  // namespace

namespace {

/// A factor above 1 kept within what a body can do: stays below 2.5, and 1 is 1.
double eased(double factor) {
  return factor / (0.6 + 0.4 * factor);
}

}  // namespace

Manner manner_of(const Effort& effort) {
  const double bound = 0.5 * (effort.flow + 1.0);  // 0 free .. 1 bound
  Manner manner;
  manner.size = eased(std::exp(0.66 * effort.weight - 0.58 * effort.time));
  manner.trunk = eased(std::exp(0.85 * effort.weight - 0.60 * effort.time));
  manner.bounce = std::exp(0.30 * effort.weight + 0.50 * effort.time);
  manner.pace = 0.94 * std::exp(0.10 * effort.weight - 0.50 * effort.time);
  manner.drive = 0.94 * std::exp(-0.16 * effort.weight - 0.30 * effort.time);
  manner.strike = 0.94 * std::exp(-0.34 * effort.weight - 0.02 * effort.time);
  manner.linger = manner.pace * (0.3 + 1.6 * bound);
  manner.fluency = 1.0 - bound;
  manner.attack = 0.25 * effort.time;
  manner.lag_s = 0.11 * (1.0 - bound) * manner.pace;
  manner.overshoot = 0.12 * (1.0 - bound);
  manner.hesitations = static_cast<int>(std::lround(2.5 * bound));
  manner.depth = 0.4 + 0.55 * bound;
  manner.sway_rate = std::exp(1.0 * effort.time);
  manner.tremor_deg = 0.5 * bound * bound;
  return manner;
}

std::vector<std::vector<Effort>> draw_efforts(int action_count, int performer_count,
                                              std::uint64_t seed) {
  base::Rng rng(seed);
  const FactorLevels temperament = least_correlated([&]() -> FactorLevels {
    return {spread_by_rank(random_levels(performer_count, rng)),
            spread_by_rank(random_levels(performer_count, rng)),
            spread_by_rank(random_levels(performer_count, rng))};
  });
  std::vector<std::vector<Effort>> efforts;
  for (int action = 0; action < action_count; ++action) {
    const FactorLevels levels = least_correlated([&]() -> FactorLevels {
      return {coloured(temperament.weight, rng), coloured(temperament.time, rng),
              coloured(temperament.flow, rng)};
    });
    std::vector<Effort> of_action;
    for (std::size_t p = 0; p < levels.weight.size(); ++p) {
      of_action.push_back(Effort{levels.weight[p], levels.time[p], levels.flow[p]});
    }
    efforts.push_back(std::move(of_action));
  }
  return efforts;
}

}  // namespace laban::phrase
