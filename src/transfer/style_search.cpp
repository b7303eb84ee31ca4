#include "laban/transfer/style_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "laban/base/error.h"
#include "laban/math/golden_section.h"

namespace laban::transfer {
namespace {

using base::Error;
using base::ErrorKind;
using blend::kMaxAlpha;
using blend::kMinAlpha;

void throw_problems(const std::vector<std::string>& problems) {
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
}

struct Pair {
  int i = 0;
  int j = 0;
};

std::vector<Pair> pairs_among(const StyleModel& model, const std::vector<int>& neighbors) {
  std::vector<Pair> pairs;
  const auto frames = [&](int fragment) {
    return model.fragments[static_cast<std::size_t>(fragment)].pose.frame_count();
  };
  for (std::size_t k = 0; k < neighbors.size(); ++k) {
    for (std::size_t l = k + 1; l < neighbors.size(); ++l) {
      if (align::blendable(frames(neighbors[k]), frames(neighbors[l])))
        pairs.push_back({neighbors[k], neighbors[l]});
    }
  }
  return pairs;
}

/// z of a pair at alpha 0.
Eigen::VectorXd features_of(const StyleModel& model, const Pair& pair) {
  const auto i = static_cast<std::size_t>(pair.i);
  const auto j = static_cast<std::size_t>(pair.j);
  return effort::style_features(model.coordinates[i], model.coordinates[j],
                                effort::to_vector(*model.fragments[i].effort),
                                effort::to_vector(*model.fragments[j].effort), 0.0);
}

void extend(std::array<FactorRange, effort::kFactorCount>& ranges, const effort::EffortVector& e) {
  for (std::size_t f = 0; f < ranges.size(); ++f) {
    ranges[f].low = std::min(ranges[f].low, e[static_cast<Eigen::Index>(f)]);
    ranges[f].high = std::max(ranges[f].high, e[static_cast<Eigen::Index>(f)]);
  }
}

std::vector<double> uniform_alphas(int samples) {
  std::vector<double> alphas(static_cast<std::size_t>(samples));
  for (int m = 0; m < samples; ++m) {
    alphas[static_cast<std::size_t>(m)] = kMinAlpha + (kMaxAlpha - kMinAlpha) * m / (samples - 1);
  }
  alphas.back() = kMaxAlpha;
  return alphas;
}

}  // namespace

double EffortTarget::distance_to(const effort::EffortVector& e) const {
  double sum = 0.0;
  for (std::size_t f = 0; f < factors.size(); ++f) {
    if (!factors[f]) continue;
    const double d = *factors[f] - e[static_cast<Eigen::Index>(f)];
    sum += weights[f] * d * d;
  }
  return std::sqrt(sum);
}

std::vector<std::string> EffortTarget::problems() const {
  std::vector<std::string> found;
  for (const effort::Factor factor : effort::kFactors) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    const std::string name(effort::name_of(factor));
    if (factors[f] && !(*factors[f] >= effort::kEffortMin && *factors[f] <= effort::kEffortMax)) {
      found.push_back("target " + name + " = " + std::to_string(*factors[f]) +
                      " (must be in [-3, 3])");
    }
    if (!(weights[f] > 0.0)) found.push_back("weight of " + name + " (must be > 0)");
  }
  if (std::none_of(factors.begin(), factors.end(),
                   [](const auto& factor) { return factor.has_value(); })) {
    found.emplace_back("no target given; ask for at least one of flow, weight, time");
  }
  return found;
}

std::vector<std::string> SearchOptions::problems() const {
  std::vector<std::string> found;
  if (neighbors < 1)
    found.push_back("SearchOptions::neighbors = " + std::to_string(neighbors) + " (must be >= 1)");
  if (samples < 2)
    found.push_back("SearchOptions::samples = " + std::to_string(samples) + " (must be >= 2)");
  if (!(alpha_tolerance > 0.0)) found.emplace_back("SearchOptions::alpha_tolerance (must be > 0)");
  return found;
}

Eigen::Matrix3Xd effort_curve(const StyleModel& model, int fragment_i, int fragment_j,
                              const std::vector<double>& alphas) {
  const Eigen::VectorXd z = features_of(model, {fragment_i, fragment_j});
  effort::StyleScratch scratch;
  return model.regressor.predict_curves(z.head(z.size() - 1), alphas, scratch);
}

std::optional<effort::StylePrediction> effort_curve_with_error(const StyleModel& model,
                                                               int fragment_i, int fragment_j,
                                                               const std::vector<double>& alphas) {
  Eigen::MatrixXd z = features_of(model, {fragment_i, fragment_j})
                          .replicate(1, static_cast<Eigen::Index>(alphas.size()));
  z.bottomRows(1) =
      Eigen::Map<const Eigen::RowVectorXd>(alphas.data(), static_cast<Eigen::Index>(alphas.size()));
  return model.regressor.predict_with_error(z);
}

BlendChoice search_blend(const StyleModel& model, int fragment, const EffortTarget& target,
                         const SearchOptions& options) {
  throw_problems(target.problems());
  throw_problems(options.problems());
  if (fragment < 0 || fragment >= static_cast<int>(model.fragments.size())) {
    throw Error(ErrorKind::kUsage,
                "search_blend: there is no fragment " + std::to_string(fragment));
  }
  std::vector<int> neighbors = model.neighbors[static_cast<std::size_t>(fragment)];
  neighbors.resize(std::min(neighbors.size(), static_cast<std::size_t>(options.neighbors)));

  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  BlendChoice best;
  best.distance = kInfinity;
  best.reachable.fill({kInfinity, -kInfinity});
  for (const int k : neighbors) {
    const effort::Effort label = *model.fragments[static_cast<std::size_t>(k)].effort;
    const effort::EffortVector e = effort::to_vector(label);
    extend(best.reachable, e);
    const double distance = target.distance_to(e);
    if (distance < best.distance) best = {k, k, 0.0, label, distance, best.reachable};
  }
  const std::vector<Pair> pairs = pairs_among(model, neighbors);
  if (pairs.empty()) return best;

  const std::vector<double> alphas = uniform_alphas(options.samples);
  Eigen::MatrixXd z(model.regressor.feature_rows(), static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t p = 0; p < pairs.size(); ++p)
    z.col(static_cast<Eigen::Index>(p)) = features_of(model, pairs[p]);
  effort::StyleScratch scratch;
  const Eigen::Matrix3Xd curves =
      model.regressor.predict_curves(z.topRows(z.rows() - 1), alphas, scratch);
  Eigen::VectorXd point(z.rows());
  std::vector<double> distances(alphas.size());
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const auto predict = [&](double alpha) -> effort::EffortVector {
      point = z.col(static_cast<Eigen::Index>(p));
      point[point.size() - 1] = alpha;
      return model.regressor.predict(point, scratch).col(0);
    };
    for (Eigen::Index m = 0; m < options.samples; ++m) {
      const effort::EffortVector e = curves.col(static_cast<Eigen::Index>(p) * options.samples + m);
      extend(best.reachable, e);
      distances[static_cast<std::size_t>(m)] = target.distance_to(e);
    }
    const math::Minimum found =
        math::refine_best_sample([&](double alpha) { return target.distance_to(predict(alpha)); },
                                 alphas, distances, options.alpha_tolerance);
    if (found.value < best.distance) {
      const effort::EffortVector e = predict(found.x);
      extend(best.reachable, e);
      best = {pairs[p].i, pairs[p].j, found.x, effort::to_effort(e), found.value, best.reachable};
    }
  }
  return best;
}

}  // namespace laban::transfer
