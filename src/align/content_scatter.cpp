#include "align/content_scatter.h"

#include <array>
#include <cmath>
#include <utility>

#include "laban/align/content_metric.h"
#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/math/parallel.h"
#include "laban/math/rotation.h"
#include "laban/math/statistics.h"

#include "align/content_rows.h"

namespace laban::align {
namespace {

using base::Error;
using base::ErrorKind;
using motion::kAngleRowCount;
using motion::PoseMatrix;

constexpr int kHeightRow = kAngleRowCount;
constexpr int kFirstPlaceRow = kHeightRow + 1;
constexpr int kFirstTravelRow = kFirstPlaceRow + kPlaceRowCount;
static_assert(kFirstTravelRow + kTravelRowCount == kContentRowCount);

// How much a frame of each sequence counts: the same; or, with groups, so that every group counts
// the same.
std::vector<double> frame_weights(std::span<const Eigen::MatrixXd> sequences,
                                  std::span<const int> groups) {
  std::vector<double> weights(sequences.size(), 1.0);
  if (groups.empty()) return weights;
  std::map<int, double> frames_of;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    frames_of[groups[i]] += static_cast<double>(sequences[i].cols());
  }
  for (std::size_t i = 0; i < sequences.size(); ++i) weights[i] = 1.0 / frames_of[groups[i]];
  return weights;
}

// The angles of one joint on the branches nearest to `reference`: one branch for each stretch
// without a cut. Across a cut (of an edited capture) unwrapping would go on from another pose and
// may leave all that follows a whole turn away.
Eigen::Matrix3Xd on_branches_between_cuts(const Eigen::Ref<const Eigen::Matrix3Xd>& curve,
                                          const Eigen::Vector3d& reference) {
  constexpr double kCut = 1.0;  // radians from one frame to the next
  const auto is_cut = [&](Eigen::Index t) {
    // Rotations are never farther apart than their vectors: most frames need no quaternions.
    if ((curve.col(t) - curve.col(t - 1)).norm() <= kCut) return false;
    return math::angle_between(math::exp(curve.col(t - 1)), math::exp(curve.col(t))) > kCut;
  };
  Eigen::Matrix3Xd result(3, curve.cols());
  Eigen::Index begin = 0;
  for (Eigen::Index t = 1; t <= curve.cols(); ++t) {
    if (t < curve.cols() && !is_cut(t)) continue;
    result.middleCols(begin, t - begin) =
        on_branch_of(curve.middleCols(begin, t - begin), reference);
    begin = t;
  }
  return result;
}

// Mean over a pair's path, found by the angles, of the outer product of frame differences.
Eigen::MatrixXd path_scatter(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  const std::vector<FramePair> path =
      dtw(x.topRows<kAngleRowCount>(), y.topRows<kAngleRowCount>()).path;
  Eigen::MatrixXd difference(x.rows(), static_cast<Eigen::Index>(path.size()));
  for (std::size_t n = 0; n < path.size(); ++n) {
    difference.col(static_cast<Eigen::Index>(n)) = x.col(path[n].p) - y.col(path[n].q);
  }
  return difference * difference.transpose() / static_cast<double>(path.size());
}

// Part of S_w's own spread replaced by the same everywhere in each of its blocks.
Eigen::MatrixXd shrunk(const Eigen::MatrixXd& within, double shrinkage) {
  struct Block {
    int first;
    int count;
    double floor;  // what says nothing; motionless fragments still give a metric
  };
  constexpr std::array<Block, 4> kBlocks = {{
      {0, kAngleRowCount, 1e-12},                  // radians^2
      {kHeightRow, 1, 4e-4},                       // leg lengths^2: 2 % of a leg, about 2 cm
      {kFirstPlaceRow, kPlaceRowCount, 1e-12},     // leg lengths^2
      {kFirstTravelRow, kTravelRowCount, 2.5e-3},  // (5 % of a leg a second)^2: swaying in place
  }};
  Eigen::MatrixXd result = (1.0 - shrinkage) * within;
  for (const Block& block : kBlocks) {
    const double spread = within.diagonal().segment(block.first, block.count).mean();
    result.diagonal().segment(block.first, block.count).array() += shrinkage * spread + block.floor;
  }
  return result;
}

template <typename Sum>
void add(Sum& sum, const Eigen::MatrixXd& addend) {
  if (sum.size() == 0) {
    sum = addend;
  } else {
    sum += addend;
  }
}

}  // namespace

void require_sizes(std::size_t fragments, std::size_t given, const std::string& what,
                   const std::string& place) {
  if (given != 0 && given != fragments) {
    throw Error(ErrorKind::kUsage, place + ": " + std::to_string(given) + " " + what + " for " +
                                       std::to_string(fragments) + " fragments");
  }
}

Eigen::MatrixXd content_rows(const PoseMatrix& pose, const Eigen::VectorXd& reference) {
  Eigen::MatrixXd rows(kContentRowCount, pose.angles.cols());
  for (Eigen::Index row = 0; row < kAngleRowCount; row += 3) {
    rows.middleRows<3>(row) =
        on_branches_between_cuts(pose.angles.middleRows<3>(row), reference.segment<3>(row));
  }
  rows.row(kHeightRow) = pose.height;
  rows.middleRows<kPlaceRowCount>(kFirstPlaceRow) = joint_places(pose);
  rows.middleRows<kTravelRowCount>(kFirstTravelRow) = travel(pose);
  return rows;
}

Eigen::VectorXd common_reference(std::span<const PoseMatrix> clips) {
  const auto count = static_cast<Eigen::Index>(clips.size());
  Eigen::MatrixXd means(kAngleRowCount, count);
  for (Eigen::Index c = 0; c < count; ++c) {
    means.col(c) = clips[static_cast<std::size_t>(c)].angles.rowwise().mean();
  }
  Eigen::VectorXd reference(kAngleRowCount);
  for (int row = 0; row < kAngleRowCount; ++row) {
    const Eigen::VectorXd values = means.row(row).transpose();
    reference(row) = math::median(math::as_span(values));
  }
  std::vector<Eigen::MatrixXd> angles;
  for (const PoseMatrix& clip : clips) angles.push_back(on_branch_of(clip.angles, reference));
  return row_mean(angles);
}

Eigen::VectorXd row_mean(std::span<const Eigen::MatrixXd> sequences, std::span<const int> groups) {
  const std::vector<double> weights = frame_weights(sequences, groups);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(sequences[0].rows());
  double total = 0.0;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    sum += weights[i] * sequences[i].rowwise().sum();
    total += weights[i] * static_cast<double>(sequences[i].cols());
  }
  return sum / total;
}

std::vector<Eigen::MatrixXd> centered_rows(std::span<const PoseMatrix> fragments,
                                           std::span<const int> groups,
                                           std::span<const int> performers,
                                           const Eigen::VectorXd& reference) {
  std::vector<Eigen::MatrixXd> rows;
  std::map<int, std::vector<std::size_t>> fragments_of;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    rows.push_back(content_rows(fragments[i], reference));
    fragments_of[performers.empty() ? static_cast<int>(i) : performers[i]].push_back(i);
  }
  for (const auto& [performer, members] : fragments_of) {
    std::vector<Eigen::MatrixXd> own;
    std::vector<int> own_groups;
    for (const std::size_t i : members) {
      own.push_back(rows[i]);
      if (!groups.empty()) own_groups.push_back(groups[i]);
    }
    const Eigen::VectorXd mean = row_mean(own, own_groups);
    for (const std::size_t i : members) rows[i].colwise() -= mean;
  }
  return rows;
}

ContentScatter::ContentScatter(std::span<const Eigen::MatrixXd> rows, std::span<const int> groups,
                               std::span<const int> performers, int threads) {
  std::map<int, std::vector<std::size_t>> members_of;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const int group = groups.empty() ? 0 : groups[i];
    Moments& moments = contents_[group].moments[performer_of(performers, i)];
    add(moments.outer, rows[i] * rows[i].transpose());
    add(moments.sum, rows[i].rowwise().sum());
    moments.frames += static_cast<double>(rows[i].cols());
    if (!groups.empty()) members_of[group].push_back(i);
  }
  std::vector<std::pair<const std::vector<std::size_t>*, Content*>> work;
  for (const auto& [group, members] : members_of) work.emplace_back(&members, &contents_.at(group));
  math::parallel_for(static_cast<int>(work.size()), threads, [&](int n) {
    const auto& [members, content] = work[static_cast<std::size_t>(n)];
    add_pairs(rows, performers, *members, *content);
  });
}

// Pairs of one content: by two performers where there are such, else all. Sums go by index, so that
// they are the same for any number of threads.
void ContentScatter::add_pairs(std::span<const Eigen::MatrixXd> rows,
                               std::span<const int> performers,
                               const std::vector<std::size_t>& members, Content& content) {
  const bool by_two = content.moments.size() > 1;
  const auto include = [](Pairs& pairs, const Eigen::MatrixXd& scatter) {
    add(pairs.scatter, scatter);
    pairs.count += 1.0;
  };
  for (std::size_t a = 0; a < members.size(); ++a) {
    for (std::size_t b = a + 1; b < members.size(); ++b) {
      const int i = performer_of(performers, members[a]);
      const int j = performer_of(performers, members[b]);
      if (by_two && i == j) continue;
      const Eigen::MatrixXd scatter = path_scatter(rows[members[a]], rows[members[b]]);
      include(content.pairs, scatter);
      include(content.pairs_of[i], scatter);
      if (i != j) include(content.pairs_of[j], scatter);
    }
  }
}

Eigen::MatrixXd ContentScatter::total(std::optional<int> without) const {
  Eigen::MatrixXd outer = Eigen::MatrixXd::Zero(kContentRowCount, kContentRowCount);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(kContentRowCount);
  double contents = 0.0;
  for (const auto& [group, content] : contents_) {
    Moments own{outer, sum, 0.0};
    own.outer.setZero();
    own.sum.setZero();
    for (const auto& [performer, moments] : content.moments) {
      if (performer == without) continue;
      own.outer += moments.outer;
      own.sum += moments.sum;
      own.frames += moments.frames;
    }
    if (own.frames == 0.0) continue;
    outer += own.outer / own.frames;
    sum += own.sum / own.frames;
    contents += 1.0;
  }
  const Eigen::VectorXd mean = sum / contents;
  return outer / contents - mean * mean.transpose();
}

std::optional<Eigen::MatrixXd> ContentScatter::within(std::optional<int> without) const {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(kContentRowCount, kContentRowCount);
  double contents = 0.0;
  for (const auto& [group, content] : contents_) {
    Pairs left = content.pairs;
    const auto own = without ? content.pairs_of.find(*without) : content.pairs_of.end();
    if (own != content.pairs_of.end()) left.count -= own->second.count;
    if (left.count == 0.0) continue;
    if (own != content.pairs_of.end()) left.scatter -= own->second.scatter;
    sum += left.scatter / left.count;
    contents += 1.0;
  }
  if (contents == 0.0) return std::nullopt;
  return sum / contents;
}

// Two frames of one content differ by N(0, S_w), two unrelated ones by N(0, 2 S_t). The quadratic
// part of the log-likelihood ratio is the metric M = S_w^-1 - (2 S_t)^-1 [Koestinger12]. With
// S_t v = lambda S_w v, v' S_w v = 1 it is sum (1 - 1 / (2 lambda)) v v': what tells contents apart
// counts about 1 whatever its size, what does not counts nothing (lambda <= 1/2: dropped).
Eigen::MatrixXd likelihood_ratio_map(const Eigen::MatrixXd& total, const Eigen::MatrixXd& within,
                                     double shrinkage, int dimensions) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(total,
                                                                         shrunk(within, shrinkage));
  if (solver.info() != Eigen::Success) {
    throw Error(ErrorKind::kNumeric,
                "fit_content_metric: the scatter within contents has no square root; raise "
                "ContentMetricOptions::shrinkage");
  }
  const Eigen::VectorXd lambda = solver.eigenvalues().cwiseMax(0.5);
  const Eigen::VectorXd scale = (1.0 - 0.5 * lambda.array().inverse()).sqrt();
  const Eigen::MatrixXd rows = scale.asDiagonal() * solver.eigenvectors().transpose();
  return rows.colwise().reverse().topRows(dimensions);
}

}  // namespace laban::align
