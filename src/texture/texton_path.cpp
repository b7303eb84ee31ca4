#include "laban/texture/texton_path.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "laban/base/error.h"
#include "laban/math/constants.h"

#include "texture/at.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::MatrixXd;

// A self-transition of nearly 1 would repeat a texton for hours.
constexpr int kMostRepeats = 1000;

bool contains(const std::vector<int>& list, int value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

void check_request(const MatrixXd& transitions, int from, int to, const PathRules& rules) {
  const auto count = static_cast<int>(transitions.rows());
  const auto check = [&](int texton) {
    if (texton < 0 || texton >= count) {
      throw Error(ErrorKind::kUsage, "there is no texton " + std::to_string(texton) +
                                         "; there are 0 to " + std::to_string(count - 1));
    }
  };
  std::vector<int> passed{from, to};
  passed.insert(passed.end(), rules.via.begin(), rules.via.end());
  for (const int texton : passed) {
    check(texton);
    if (contains(rules.avoid, texton)) {
      throw Error(ErrorKind::kUsage,
                  "texton " + std::to_string(texton) + " cannot be both passed and avoided");
    }
  }
  for (const int texton : rules.avoid) check(texton);
}

/// -log M, infinite to and from textons that are avoided.
MatrixXd costs_of(const MatrixXd& transitions, const PathRules& rules) {
  MatrixXd costs = transitions.unaryExpr(
      [](double p) { return p > 0.0 ? std::max(0.0, -std::log(p)) : math::kInfinity; });
  for (const int texton : rules.avoid) {
    costs.row(texton).setConstant(math::kInfinity);
    costs.col(texton).setConstant(math::kInfinity);
  }
  return costs;
}

/// Dijkstra; the plain form, for the graph is a matrix.
std::optional<std::vector<int>> cheapest_leg(const MatrixXd& costs, int from, int to) {
  const auto count = static_cast<int>(costs.rows());
  std::vector<double> cost(at(count), math::kInfinity);
  std::vector<int> before(at(count), -1);
  std::vector<bool> done(at(count), false);
  cost[at(from)] = 0.0;
  for (int round = 0; round < count; ++round) {
    int nearest = -1;
    for (int i = 0; i < count; ++i) {
      if (!done[at(i)] && cost[at(i)] < (nearest < 0 ? math::kInfinity : cost[at(nearest)]))
        nearest = i;
    }
    if (nearest < 0 || nearest == to) break;
    done[at(nearest)] = true;
    for (int j = 0; j < count; ++j) {
      const double through = cost[at(nearest)] + costs(nearest, j);
      if (through < cost[at(j)]) {
        cost[at(j)] = through;
        before[at(j)] = nearest;
      }
    }
  }
  if (cost[at(to)] == math::kInfinity) return std::nullopt;
  std::vector<int> path{to};
  while (path.back() != from) path.push_back(before[at(path.back())]);
  std::reverse(path.begin(), path.end());
  return path;
}

}  // namespace

double path_cost(const MatrixXd& transitions, const std::vector<int>& path) {
  double cost = 0.0;
  for (std::size_t n = 1; n < path.size(); ++n) {
    const double p = transitions(path[n - 1], path[n]);
    cost += p > 0.0 ? -std::log(p) : math::kInfinity;
  }
  return cost;
}

std::optional<std::vector<int>> cheapest_path(const MatrixXd& transitions, int from, int to,
                                              const PathRules& rules) {
  check_request(transitions, from, to, rules);
  const MatrixXd costs = costs_of(transitions, rules);
  std::vector<int> stops = rules.via;
  stops.push_back(to);
  std::vector<int> path{from};
  for (const int stop : stops) {
    const auto leg = cheapest_leg(costs, path.back(), stop);
    if (!leg) return std::nullopt;
    path.insert(path.end(), leg->begin() + 1, leg->end());
  }
  return path;
}

std::optional<std::vector<int>> path_of_length(const MatrixXd& transitions, int from, int to,
                                               int count, const PathRules& rules) {
  check_request(transitions, from, to, rules);
  if (count < 1) {
    throw Error(ErrorKind::kUsage, "a path of " + std::to_string(count) + " textons (at least 1)");
  }
  const MatrixXd costs = costs_of(transitions, rules);
  const auto textons = static_cast<int>(transitions.rows());
  const auto vias = static_cast<int>(rules.via.size());
  // State v * textons + i: at texton i with the first v of `via` passed.
  const auto after = [&](int v, int i) { return v < vias && rules.via[at(v)] == i ? v + 1 : v; };
  const int states = textons * (vias + 1);
  std::vector<double> cost(at(states), math::kInfinity);
  cost[at(after(0, from) * textons + from)] = 0.0;
  std::vector<std::vector<int>> before;
  for (int place = 1; place < count; ++place) {
    std::vector<double> next(at(states), math::kInfinity);
    std::vector<int>& came = before.emplace_back(at(states), -1);
    for (int s = 0; s < states; ++s) {
      if (cost[at(s)] == math::kInfinity) continue;
      for (int j = 0; j < textons; ++j) {
        const double through = cost[at(s)] + costs(s % textons, j);
        const int reached = after(s / textons, j) * textons + j;
        if (through < next[at(reached)]) {
          next[at(reached)] = through;
          came[at(reached)] = s;
        }
      }
    }
    cost = std::move(next);
  }
  int state = vias * textons + to;
  if (cost[at(state)] == math::kInfinity) return std::nullopt;
  std::vector<int> path{to};
  for (auto came = before.rbegin(); came != before.rend(); ++came) {
    state = (*came)[at(state)];
    path.push_back(state % textons);
  }
  std::reverse(path.begin(), path.end());
  return path;
}

std::vector<int> repeat_textons(const MatrixXd& transitions, const std::vector<int>& path,
                                base::Rng& rng) {
  std::vector<int> repeated;
  for (const int texton : path) {
    repeated.push_back(texton);
    const double again = transitions(texton, texton);
    for (int n = 0; again < 1.0 && n < kMostRepeats && rng.uniform() < again; ++n) {
      repeated.push_back(texton);
    }
  }
  return repeated;
}

}  // namespace laban::texture
