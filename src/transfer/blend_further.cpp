#include <algorithm>
#include <limits>

#include "laban/math/golden_section.h"

#include "transfer/blend_search.h"

namespace laban::transfer {
namespace {

/// A further fragment is blended to, never away from: what extrapolates an extrapolation is unlike
/// anything that was learnt from.
constexpr AlphaRange kFurther = {0.0, 1.0};

/// A blend that counts as a fragment: what its next blend and the regressor need of it.
struct Made {
  motion::PoseMatrix pose;
  Eigen::VectorXd coordinates;
  effort::EffortVector effort;
};

/// Fragments in the order of blending: the first two at alphas[0], then fragments[n + 1] into what
/// there is at alphas[n].
struct Nest {
  std::vector<int> fragments;
  std::vector<double> alphas;
};

class NestedBlends {
 public:
  NestedBlends(const StyleModel& model, const EffortTarget& target)
      : model_(model), target_(target), mean_pose_(mean_pose(model.fragments)) {}

  [[nodiscard]] Made fragment(int index) const {
    const Fragment& known = model_.fragments[static_cast<std::size_t>(index)];
    return {known.pose, model_.coordinates[static_cast<std::size_t>(index)],
            effort::to_vector(*known.effort, model_.regressor.factor_count())};
  }

  [[nodiscard]] static Eigen::VectorXd features(const Made& i, const Made& j, double alpha) {
    return effort::style_features(i.coordinates, j.coordinates, i.effort, j.effort, alpha);
  }

  [[nodiscard]] effort::EffortVector predict(const Made& i, const Made& j, double alpha) const {
    return model_.regressor.predict(features(i, j, alpha)).col(0);
  }

  /// Blends a pair at alpha; `pair` is its alignment.
  [[nodiscard]] Made make(const blend::BlendPair& pair, const Made& i, const Made& j,
                          double alpha) const {
    motion::PoseMatrix pose = blend::blend(pair, alpha).pose;
    Eigen::VectorXd coordinates = content_coordinates(pose, mean_pose_, model_.content_map);
    return {std::move(pose), std::move(coordinates), predict(i, j, alpha)};
  }

  /// The first `blends` blends of a nest, made.
  [[nodiscard]] Made make(const Nest& nest, std::size_t blends) const {
    Made made = fragment(nest.fragments.front());
    for (std::size_t n = 0; n < blends; ++n) {
      const Made next = fragment(nest.fragments[n + 1]);
      made = make(align_pair(made.pose, next.pose), made, next, nest.alphas[n]);
    }
    return made;
  }

  /// Distance to the target of what blending the rest of a nest into `made`, its first `blends`
  /// blends, is predicted to be; infinite if lengths differ too much for it.
  [[nodiscard]] double distance(Made made, const Nest& nest, std::size_t blends) const {
    for (std::size_t n = blends; n < nest.alphas.size(); ++n) {
      const Made next = fragment(nest.fragments[n + 1]);
      if (!align::blendable(made.pose.frame_count(), next.pose.frame_count()))
        return std::numeric_limits<double>::infinity();
      if (n + 1 == nest.alphas.size())  // no need to make the last one
        return target_.distance_to(predict(made, next, nest.alphas[n]));
      made = make(align_pair(made.pose, next.pose), made, next, nest.alphas[n]);
    }
    return target_.distance_to(made.effort);
  }

  /// The fragment and its alpha that bring a nest nearest to the target, of those not in it yet.
  [[nodiscard]] std::optional<BlendStep> best_step(const Nest& nest, std::span<const int> neighbors,
                                                   const SearchOptions& options,
                                                   Reachable& reachable) const {
    const Made made = make(nest, nest.alphas.size());
    std::vector<int> others;
    for (const int k : neighbors) {
      const int frames = model_.fragments[static_cast<std::size_t>(k)].pose.frame_count();
      if (std::find(nest.fragments.begin(), nest.fragments.end(), k) == nest.fragments.end() &&
          align::blendable(made.pose.frame_count(), frames))
        others.push_back(k);
    }
    Eigen::MatrixXd z(model_.regressor.feature_rows(), std::ssize(others));
    for (std::size_t n = 0; n < others.size(); ++n)
      z.col(static_cast<Eigen::Index>(n)) = features(made, fragment(others[n]), 0.0);
    const auto found =
        find_blend(model_, sample_blends(model_, std::move(z), options.samples, kFurther), {},
                   target_, options, reachable);
    if (!found) return std::nullopt;
    return BlendStep{others[static_cast<std::size_t>(found->candidate)], found->alpha};
  }

  /// Moves each alpha in turn to where the distance is least nearby, for some rounds.
  void improve(Nest& nest, const SearchOptions& options) const {
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds; ++round) {
      for (std::size_t n = 0; n < nest.alphas.size(); ++n) improve(nest, n, options);
    }
  }

 private:
  void improve(Nest& nest, std::size_t n, const SearchOptions& options) const {
    const Made before = make(nest, n);
    const Made next = fragment(nest.fragments[n + 1]);
    if (!align::blendable(before.pose.frame_count(), next.pose.frame_count())) return;
    const bool last = n + 1 == nest.alphas.size();
    std::optional<blend::BlendPair> pair;  // of the last blend the prediction is enough
    if (!last) pair = align_pair(before.pose, next.pose);
    const auto distance_at = [&](double alpha) {
      if (last) return target_.distance_to(predict(before, next, alpha));
      return distance(make(*pair, before, next, alpha), nest, n + 1);
    };
    const AlphaRange range = n == 0 ? AlphaRange{} : kFurther;
    std::vector<double> alphas;
    std::vector<double> distances;
    for (const double away : {-0.25, -0.125, 0.0, 0.125, 0.25}) {
      const double alpha = std::clamp(nest.alphas[n] + away, range.low, range.high);
      if (!alphas.empty() && alpha <= alphas.back()) continue;
      alphas.push_back(alpha);
      distances.push_back(distance_at(alpha));
    }
    nest.alphas[n] =
        math::refine_best_sample(distance_at, alphas, distances, options.alpha_tolerance).x;
  }

  const StyleModel& model_;
  const EffortTarget& target_;
  Eigen::VectorXd mean_pose_;
};

/// A nest of at least two blends as a choice; its reach is told elsewhere.
BlendChoice choice_of(const NestedBlends& blends, const Nest& nest, const EffortTarget& target) {
  const std::size_t last = nest.alphas.size() - 1;
  const Made before = blends.make(nest, last);
  const Made next = blends.fragment(nest.fragments.back());
  const effort::EffortVector e = blends.predict(before, next, nest.alphas.back());
  BlendChoice choice;
  choice.fragment_i = nest.fragments[0];
  choice.fragment_j = nest.fragments[1];
  choice.alpha = nest.alphas[0];
  choice.predicted = effort::to_effort(e);
  choice.distance = target.distance_to(e);
  for (std::size_t n = 1; n < nest.alphas.size(); ++n)
    choice.further.push_back({nest.fragments[n + 1], nest.alphas[n]});
  choice.features = NestedBlends::features(before, next, nest.alphas.back());
  return choice;
}

}  // namespace

BlendChoice blend_further(const StyleModel& model, std::span<const int> neighbors,
                          const BlendChoice& pair, const EffortTarget& target,
                          const SearchOptions& options, Reachable& reachable) {
  const NestedBlends blends(model, target);
  BlendChoice best = pair;
  Nest nest{{pair.fragment_i, pair.fragment_j}, {pair.alpha}};
  for (int way = 3; way <= options.way && best.distance > kMissedBy; ++way) {
    const auto step = blends.best_step(nest, neighbors, options, reachable);
    if (!step) break;
    nest.fragments.push_back(step->fragment);
    nest.alphas.push_back(step->alpha);
    blends.improve(nest, options);
    BlendChoice more = choice_of(blends, nest, target);
    extend(reachable, effort::to_vector(more.predicted, model.regressor.factor_count()));
    if (!(more.distance < best.distance - kLeastGain)) break;
    best = std::move(more);
  }
  return best;
}

}  // namespace laban::transfer
