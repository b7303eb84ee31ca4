#include "laban/manifold/som.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "laban/base/error.h"
#include "laban/math/parallel.h"
#include "laban/math/pca.h"

#include "manifold/samples.h"

namespace laban::manifold {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

// Samples a matrix product: with 65 x 65 nodes its result stays in the second-level cache.
constexpr Index kBlock = 48;
// A wide, faint neighbourhood under the narrow one: with fewer samples than nodes the narrow one
// alone makes nodes between two units copies of either, and which copy is second best is chance.
// On walks of 277 and 316 frames the topographic error fell from .04 and .02 to 0 by it; stronger
// ones hold folds of the map open and raise it on dances.
constexpr double kFaintShare = 1e-4;
constexpr double kFaintRadius = 8.0;  // in radii of the narrow one
// How far a unit is drawn to another's sample, from where it comes second to where it is no nearer
// than the one that is second now: as little as will do, since its own samples lose by it.
constexpr double kFirmShare = 0.95;
// Neighbourhood weights below this are none: a product of two stays a normal number.
constexpr double kLeastWeight = 1e-150;

/// The plane of the first two principal components around the mean, which is left out: samples are
/// centred.
MatrixXd initial_codebook(const math::Pca& pca, const SomOptions& options) {
  constexpr double kReach = 2.0;  // standard deviations
  const auto place = [](int index, int count) {
    return count > 1 ? kReach * (2.0 * index / (count - 1.0) - 1.0) : 0.0;
  };
  const auto axis = [&pca](int component) -> Eigen::VectorXd {
    if (component >= pca.component_count()) return Eigen::VectorXd::Zero(pca.mean.size());
    return std::sqrt(std::max(0.0, pca.variance[component])) * pca.basis.col(component);
  };
  const Eigen::VectorXd along = axis(0);
  const Eigen::VectorXd across = axis(1);
  MatrixXd codebook(pca.mean.size(), static_cast<Index>(options.rows) * options.columns);
  for (int row = 0; row < options.rows; ++row) {
    for (int column = 0; column < options.columns; ++column) {
      codebook.col(static_cast<Index>(row) * options.columns + column) =
          place(column, options.columns) * along + place(row, options.rows) * across;
    }
  }
  return codebook;
}

/// Best-matching units in single precision. The scores are |w|^2 / 2 - w'x: least where |w - x| is.
void find_units(const MatrixXf& nodes, const MatrixXf& samples, int threads,
                std::vector<int>& units) {
  const Eigen::VectorXf half_norms = 0.5F * nodes.colwise().squaredNorm().transpose();
  const auto blocks = static_cast<int>((samples.cols() + kBlock - 1) / kBlock);
  math::parallel_for(blocks, threads, [&](int block) {
    const Index begin = block * kBlock;
    const Index count = std::min(kBlock, samples.cols() - begin);
    MatrixXf scores(nodes.cols(), count);
    scores.noalias() = nodes.transpose() * samples.middleCols(begin, count);
    for (Index n = 0; n < count; ++n) {
      // The least value first, which runs over whole vectors; then where it stands.
      const Eigen::VectorXf column = half_norms - scores.col(n);
      const float least = column.minCoeff();
      const auto* found = std::find(column.data(), column.data() + column.size(), least);
      units[static_cast<std::size_t>(begin + n)] = static_cast<int>(found - column.data());
    }
  });
}

MatrixXd neighborhood(int count, double radius) {
  MatrixXd weights(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      const double u = (i - j) / radius;
      const double wide = u / kFaintRadius;
      const double weight = std::exp(-0.5 * u * u) + kFaintShare * std::exp(-0.5 * wide * wide);
      weights(i, j) = weight < kLeastWeight ? 0.0 : weight;
    }
  }
  return weights;
}

/// Sums of samples a unit, with their number in the last row, smoothed over the lattice.
MatrixXd smoothed_sums(const Eigen::Ref<const MatrixXd>& x, const std::vector<int>& units,
                       const SomOptions& options, double radius) {
  const Index rows = x.rows() + 1;
  const Index nodes = static_cast<Index>(options.rows) * options.columns;
  MatrixXd sums = MatrixXd::Zero(rows, nodes);
  for (Index n = 0; n < x.cols(); ++n) {
    const Index unit = units[static_cast<std::size_t>(n)];
    sums.col(unit).head(x.rows()) += x.col(n);
    sums(x.rows(), unit) += 1.0;
  }
  // A row of the lattice is one contiguous block: all rows are smoothed by one product.
  const Eigen::Map<const MatrixXd> by_row(sums.data(), rows * options.columns, options.rows);
  MatrixXd result(rows, nodes);
  Eigen::Map<MatrixXd>(result.data(), rows * options.columns, options.rows).noalias() =
      by_row * neighborhood(options.rows, radius);
  const MatrixXd across = neighborhood(options.columns, radius);
  MatrixXd row_sums(rows, options.columns);
  for (int row = 0; row < options.rows; ++row) {
    auto block = result.middleCols(static_cast<Index>(row) * options.columns, options.columns);
    row_sums.noalias() = block * across;
    block = row_sums;
  }
  return result;
}

double radius_at(const SomOptions& options, int epoch) {
  const double first = options.first_radius.value_or(0.5 * std::max(options.rows, options.columns));
  if (options.epochs == 1) return options.last_radius;
  return first * std::pow(options.last_radius / first, epoch / (options.epochs - 1.0));
}

bool neighbors(const SelfOrganizingMap& map, int a, int b) {
  return (map.position(a) - map.position(b)).cwiseAbs().maxCoeff() <= 1.0;
}

/// The node beside `unit` that is not `taken` and nearest to a sample; -1 if there is none.
int nearest_neighbor(const SelfOrganizingMap& map, const std::vector<bool>& taken, int unit,
                     const Eigen::VectorXd& sample) {
  const int row = unit / map.columns;
  const int column = unit % map.columns;
  int nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  for (int r = std::max(0, row - 1); r <= std::min(map.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(map.columns - 1, column + 1); ++c) {
      const int node = r * map.columns + c;
      const double distance = (map.codebook.col(node) - sample).squaredNorm();
      if (node == unit || taken[static_cast<std::size_t>(node)] || distance >= least) continue;
      least = distance;
      nearest = node;
    }
  }
  return nearest;
}

/// Draws a node beside the unit of each sample whose second-best unit lies elsewhere to that
/// sample, in `map`: one that is no unit, or where there is none and `firm` asks for it, any.
/// @returns the number of such samples before.
int mend_once(const Eigen::Ref<const MatrixXd>& x, bool firm, SelfOrganizingMap& map) {
  const BestUnits best = best_matching_units(map, x);
  std::vector<bool> is_unit(static_cast<std::size_t>(map.codebook.cols()), false);
  for (const int unit : best.first) is_unit[static_cast<std::size_t>(unit)] = true;
  const std::vector<bool> none(is_unit.size(), false);
  int wrong = 0;
  for (std::size_t n = 0; n < best.first.size(); ++n) {
    if (neighbors(map, best.first[n], best.second[n])) continue;
    ++wrong;
    const Eigen::VectorXd sample = x.col(static_cast<Index>(n));
    int node = nearest_neighbor(map, is_unit, best.first[n], sample);
    // In a crowd the free node beside a unit is another sample's second best too, and each round
    // draws it to and fro: only what is no one's first is without cost.
    if (firm) node = nearest_neighbor(map, none, best.first[n], sample);
    if (node < 0) continue;
    const double nearer = (map.codebook.col(best.first[n]) - sample).norm();
    const double farther = (map.codebook.col(best.second[n]) - sample).norm();
    const Eigen::VectorXd away = map.codebook.col(node) - sample;
    // Between the two, so that it comes second; no further, as the map was in order here.
    const double share = firm ? kFirmShare : 0.5;
    const double wanted = nearer + share * (farther - nearer);
    if (away.norm() > wanted) map.codebook.col(node) = sample + away * (wanted / away.norm());
  }
  return wrong;
}

/// The map of fewest topographic errors among those after each round. A node drawn to one sample
/// may have been another's second best, so that errors need not fall in every round.
SelfOrganizingMap mended(const Eigen::Ref<const MatrixXd>& x, SelfOrganizingMap map, int rounds) {
  SelfOrganizingMap best = map;
  int fewest = std::numeric_limits<int>::max();
  bool firm = false;
  for (int round = 0; round <= rounds && fewest > 0 && rounds > 0; ++round) {
    SelfOrganizingMap next = map;
    const int wrong = mend_once(x, firm, next);
    if (wrong < fewest) {
      best = std::move(map);
      fewest = wrong;
    } else if (!firm) {
      // The free nodes do what they can: from the best map on, all others help.
      firm = true;
      next = best;
      static_cast<void>(mend_once(x, firm, next));
    }
    map = std::move(next);
  }
  return best;
}

}  // namespace

std::vector<std::string> SomOptions::problems() const {
  std::vector<std::string> found;
  const auto rule = [&found](bool holds, const std::string& text) {
    if (!holds) found.push_back("SomOptions::" + text);
  };
  rule(rows >= 2 && rows <= 1000, "rows = " + std::to_string(rows) + " (must be 2 .. 1000)");
  rule(columns >= 2 && columns <= 1000,
       "columns = " + std::to_string(columns) + " (must be 2 .. 1000)");
  rule(epochs >= 1, "epochs = " + std::to_string(epochs) + " (must be >= 1)");
  rule(!first_radius || (*first_radius > 0.0 && std::isfinite(*first_radius)),
       "first_radius (must be positive)");
  rule(last_radius > 0.0 && std::isfinite(last_radius), "last_radius (must be positive)");
  rule(mending_rounds >= 0,
       "mending_rounds = " + std::to_string(mending_rounds) + " (must be >= 0)");
  rule(threads >= 0, "threads = " + std::to_string(threads) + " (must be >= 0)");
  return found;
}

SelfOrganizingMap fit_som(const Eigen::Ref<const MatrixXd>& x, const SomOptions& options,
                          base::Progress* progress) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  check_samples("fit_som", x);
  const math::Pca pca = math::fit_pca(x, 2);
  const MatrixXd centered = x.colwise() - pca.mean;
  const MatrixXf samples = centered.cast<float>();
  MatrixXd codebook = initial_codebook(pca, options);
  std::vector<int> units(static_cast<std::size_t>(x.cols()));
  for (int epoch = 0; epoch < options.epochs; ++epoch) {
    find_units(codebook.cast<float>(), samples, options.threads, units);
    const MatrixXd sums = smoothed_sums(centered, units, options, radius_at(options, epoch));
    for (Index node = 0; node < codebook.cols(); ++node) {
      const double weight = sums(x.rows(), node);
      if (weight > 0.0) codebook.col(node) = sums.col(node).head(x.rows()) / weight;
    }
    base::tell(progress, (epoch + 1.0) / options.epochs);
  }
  codebook.colwise() += pca.mean;
  return mended(x, {options.rows, options.columns, std::move(codebook)}, options.mending_rounds);
}

BestUnits best_matching_units(const SelfOrganizingMap& map, const Eigen::Ref<const MatrixXd>& x) {
  if (x.rows() != map.codebook.rows()) {
    throw Error(ErrorKind::kData, "best_matching_units: samples of " + std::to_string(x.rows()) +
                                      " rows, must be " + std::to_string(map.codebook.rows()));
  }
  const Eigen::VectorXd center = map.codebook.rowwise().mean();
  const MatrixXd nodes = map.codebook.colwise() - center;
  const Eigen::VectorXd half_norms = 0.5 * nodes.colwise().squaredNorm().transpose();
  BestUnits best;
  for (Index begin = 0; begin < x.cols(); begin += kBlock) {
    const Index count = std::min(kBlock, x.cols() - begin);
    const MatrixXd block = x.middleCols(begin, count).colwise() - center;
    const MatrixXd scores = (nodes.transpose() * block * -1.0).colwise() + half_norms;
    for (Index n = 0; n < count; ++n) {
      Index first = 0;
      scores.col(n).minCoeff(&first);
      Index second = first == 0 && nodes.cols() > 1 ? 1 : 0;
      for (Index node = 0; node < nodes.cols(); ++node) {
        if (node != first && scores(node, n) < scores(second, n)) second = node;
      }
      best.first.push_back(static_cast<int>(first));
      best.second.push_back(static_cast<int>(second));
    }
  }
  return best;
}

MapErrors map_errors(const SelfOrganizingMap& map, const Eigen::Ref<const MatrixXd>& x) {
  if (x.cols() < 1) throw Error(ErrorKind::kData, "map_errors: there is no sample");
  const BestUnits best = best_matching_units(map, x);
  MapErrors errors;
  for (std::size_t n = 0; n < best.first.size(); ++n) {
    errors.quantization += (x.col(static_cast<Index>(n)) - map.codebook.col(best.first[n])).norm();
    if (!neighbors(map, best.first[n], best.second[n])) errors.topographic += 1.0;
  }
  errors.quantization /= static_cast<double>(x.cols());
  errors.topographic /= static_cast<double>(x.cols());
  return errors;
}

MatrixXd unit_distances(const SelfOrganizingMap& map) {
  MatrixXd distances(map.rows, map.columns);
  const auto node = [&map](int row, int column) {
    return map.codebook.col(static_cast<Index>(row) * map.columns + column);
  };
  for (int row = 0; row < map.rows; ++row) {
    for (int column = 0; column < map.columns; ++column) {
      double sum = 0.0;
      int count = 0;
      const auto add = [&](int r, int c) {
        if (r < 0 || c < 0 || r >= map.rows || c >= map.columns) return;
        sum += (node(row, column) - node(r, c)).norm();
        ++count;
      };
      add(row - 1, column);
      add(row + 1, column);
      add(row, column - 1);
      add(row, column + 1);
      distances(row, column) = count > 0 ? sum / count : 0.0;
    }
  }
  return distances;
}

}  // namespace laban::manifold
