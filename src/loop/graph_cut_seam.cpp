#include "laban/loop/graph_cut_seam.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "laban/base/error.h"
#include "laban/math/constants.h"

namespace laban::loop {
namespace {

using base::Error;
using base::ErrorKind;

// Of the gradients' sum, radians: keeps M / G finite where nothing moves.
constexpr double kLeastGradient = 1e-4;

void check(bool good, const char* what) {
  if (!good) throw Error(ErrorKind::kData, std::string("seam: ") + what);
}

void check_costs(const SeamCosts& costs) {
  const Eigen::Index rows = std::ssize(costs.parents);
  const Eigen::Index frames = costs.to_parent.cols();
  check(rows >= 1 && frames >= 2, "an overlap needs a joint and two frames");
  check(costs.along_time.rows() == rows && costs.to_parent.rows() == rows &&
            costs.along_time.cols() == frames - 1,
        "costs of R joints and N frames are R x (N - 1) and R x N");
  check(costs.parents[0] == -1, "row 0 is the root");
  for (Eigen::Index r = 1; r < rows; ++r) {
    const int parent = costs.parents[static_cast<std::size_t>(r)];
    check(parent >= 0 && parent < r, "parents come before their children");
  }
  check((costs.along_time.array() >= 0.0).all(), "a cost along time is negative or no number");
  check(rows == 1 || ((costs.to_parent.bottomRows(rows - 1).array() >= 0.0).all() &&
                      costs.to_parent.bottomRows(rows - 1).allFinite()),
        "a cost between joints is negative, infinite or no number");
}

/// Running sums V of a row's edges to its parent: V(t) is the cost of frames before t.
Eigen::VectorXd running_sum(const Eigen::Ref<const Eigen::RowVectorXd>& edges) {
  Eigen::VectorXd sum(edges.size());
  double total = 0.0;
  for (Eigen::Index t = 0; t < edges.size(); ++t) {
    sum[t] = total;
    total += edges[t];
  }
  return sum;
}

/// For every frame p of the parent the least own(s) + |V(s) - V(p)|, and the s it is at.
struct BestChild {
  std::vector<double> cost;
  std::vector<int> frame;
};

BestChild distance_transform(const std::vector<double>& own, const Eigen::VectorXd& V) {
  BestChild best{own, std::vector<int>(own.size())};
  for (std::size_t t = 0; t < own.size(); ++t) best.frame[t] = static_cast<int>(t);
  const auto relax = [&](std::size_t to, std::size_t from) {
    const double cost = best.cost[from] + std::abs(V[static_cast<Eigen::Index>(to)] -
                                                   V[static_cast<Eigen::Index>(from)]);
    // Earlier frames win ties, which forwards means <= and backwards <.
    if (cost < best.cost[to] || (cost == best.cost[to] && best.frame[from] < best.frame[to])) {
      best.cost[to] = cost;
      best.frame[to] = best.frame[from];
    }
  };
  for (std::size_t t = 2; t < own.size(); ++t) relax(t, t - 1);
  for (std::size_t t = own.size() - 1; t-- > 1;) relax(t, t + 1);
  return best;
}

}  // namespace

Seam minimum_seam(const SeamCosts& costs) {
  check_costs(costs);
  const auto rows = costs.parents.size();
  const auto frames = static_cast<std::size_t>(costs.to_parent.cols());
  // own[r][t]: the cost of row r and all below it if r switches at t; frame 0 is out of the
  // question.
  std::vector<std::vector<double>> own(rows, std::vector<double>(frames, math::kInfinity));
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t t = 1; t < frames; ++t) {
      own[r][t] = costs.along_time(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(t) - 1);
    }
  }
  std::vector<BestChild> best(rows);
  for (std::size_t r = rows; r-- > 1;) {
    best[r] =
        distance_transform(own[r], running_sum(costs.to_parent.row(static_cast<Eigen::Index>(r))));
    auto& above = own[static_cast<std::size_t>(costs.parents[r])];
    for (std::size_t t = 1; t < frames; ++t) above[t] += best[r].cost[t];
  }
  Seam seam;
  seam.switch_frames.resize(rows);
  const auto least = std::min_element(own[0].begin() + 1, own[0].end());
  check(std::isfinite(*least), "a joint may switch nowhere in the overlap");
  seam.switch_frames[0] = static_cast<int>(least - own[0].begin());
  for (std::size_t r = 1; r < rows; ++r) {
    const int parent_frame = seam.switch_frames[static_cast<std::size_t>(costs.parents[r])];
    seam.switch_frames[r] = best[r].frame[static_cast<std::size_t>(parent_frame)];
  }
  seam.cost = *least;
  return seam;
}

double seam_cost(const SeamCosts& costs, const std::vector<int>& switch_frames) {
  check_costs(costs);
  check(switch_frames.size() == costs.parents.size(), "a switch frame for each joint");
  double cost = 0.0;
  for (std::size_t r = 0; r < switch_frames.size(); ++r) {
    const int t = switch_frames[r];
    check(t >= 1 && t < costs.to_parent.cols(), "a joint switches at frames 1 .. N - 1");
    cost += costs.along_time(static_cast<Eigen::Index>(r), t - 1);
    if (r == 0) continue;
    const int other = switch_frames[static_cast<std::size_t>(costs.parents[r])];
    for (int u = std::min(t, other); u < std::max(t, other); ++u) {
      cost += costs.to_parent(static_cast<Eigen::Index>(r), u);
    }
  }
  return cost;
}

SeamCosts seam_costs(const std::vector<Eigen::MatrixXd>& outgoing,
                     const std::vector<Eigen::MatrixXd>& incoming, const std::vector<int>& parents,
                     const Eigen::VectorXd& weights, SeamMetric metric, int keep_columns) {
  const std::size_t rows = parents.size();
  check(rows >= 1 && outgoing.size() == rows && incoming.size() == rows &&
            weights.size() == std::ssize(parents),
        "both clips need every joint, and a weight for each");
  const Eigen::Index frames = outgoing[0].cols();
  check(keep_columns >= 0 && frames - 1 - 2 * static_cast<Eigen::Index>(keep_columns) >= 1,
        "the overlap is too short for the blend");
  const auto joints = static_cast<Eigen::Index>(rows);
  SeamCosts costs{parents, Eigen::MatrixXd(joints, frames - 1),
                  Eigen::MatrixXd::Zero(joints, frames)};
  const auto charge = [metric](double M, double G) {
    return metric == SeamMetric::kDifference ? M : 1.0 - std::exp(-M / (G + kLeastGradient));
  };
  Eigen::MatrixXd D(joints, frames);  // ||A - B||
  for (std::size_t r = 0; r < rows; ++r) {
    check(outgoing[r].cols() == frames && incoming[r].cols() == frames &&
              outgoing[r].rows() == incoming[r].rows(),
          "both clips need the same frames of a joint");
    D.row(static_cast<Eigen::Index>(r)) = (outgoing[r] - incoming[r]).colwise().norm();
  }
  // |G(t)| + |G(t+1)| along time; the last frame's gradient is that before it.
  const auto along = [frames](const Eigen::MatrixXd& x, Eigen::Index t) {
    const Eigen::Index next = std::min(t + 1, frames - 2);
    return (x.col(t + 1) - x.col(t)).norm() + (x.col(next + 1) - x.col(next)).norm();
  };
  for (std::size_t r = 0; r < rows; ++r) {
    const auto row = static_cast<Eigen::Index>(r);
    const Eigen::MatrixXd& A = outgoing[r];
    const Eigen::MatrixXd& B = incoming[r];
    for (Eigen::Index t = 0; t + 1 < frames; ++t) {
      const bool kept = t < keep_columns || t + 1 >= frames - keep_columns;
      costs.along_time(row, t) =
          kept ? math::kInfinity
               : weights[row] * charge(D(row, t) + D(row, t + 1), along(A, t) + along(B, t));
    }
    if (r == 0) continue;
    const auto above = static_cast<std::size_t>(parents[r]);
    const Eigen::Index shared = std::min(A.rows(), outgoing[above].rows());
    const auto across = [shared](const Eigen::MatrixXd& child, const Eigen::MatrixXd& parent,
                                 Eigen::Index t) {
      return (child.col(t).head(shared) - parent.col(t).head(shared)).norm();
    };
    for (Eigen::Index t = 0; t < frames; ++t) {
      const double G = 2.0 * (across(A, outgoing[above], t) + across(B, incoming[above], t));
      costs.to_parent(row, t) = weights[row] * charge(D(row, t) + D(parents[r], t), G);
    }
  }
  return costs;
}

double blend_weight(double p, double k) {
  if (p <= -1.0) return 1.0;
  const double x = (p + 1.0) / k;
  if (x >= 1.0) return 0.0;
  return (2.0 * x - 3.0) * x * x + 1.0;
}

}  // namespace laban::loop
