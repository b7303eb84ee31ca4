#include "laban/texture/choreography.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/texture/constrained_synthesis.h"
#include "laban/texture/texton_fit.h"

#include "texture/at.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::VectorXd;

constexpr int kMostFrames = 36000;
// A length off by this log ratio costs half a nat.
constexpr double kLengthDeviation = 0.1;
constexpr double kLengthReach = 0.25;
constexpr double kJumpNats = 20.0;

/// What the lengths of a texton cost, from `shortest` on.
struct LengthCosts {
  int shortest = 0;
  std::vector<double> costs;
};

LengthCosts length_costs(const MotionTexture& texture, int texton, bool may_be_cut) {
  std::vector<int> known;
  for (const int s : segments_of(texture, texton)) known.push_back(texture.segments[at(s)].length);
  LengthCosts lengths;
  if (known.empty()) return lengths;
  const auto [least, most] = std::minmax_element(known.begin(), known.end());
  const double low = may_be_cut ? 0.5 : 1.0 - kLengthReach;
  lengths.shortest = std::max(kFewestConstrained, static_cast<int>(low * *least));
  const int longest = std::max(kFewestConstrained, static_cast<int>((1.0 + kLengthReach) * *most));
  for (int length = lengths.shortest; length <= longest; ++length) {
    double nearest = math::kInfinity;
    for (const int one : known) {
      nearest = std::min(nearest, std::abs(std::log(static_cast<double>(length) / one)));
    }
    if (may_be_cut && length <= *most) nearest = 0.0;
    lengths.costs.push_back(0.5 * std::pow(nearest / kLengthDeviation, 2));
  }
  return lengths;
}

/// How much less likely each texton is to show two frames than the likeliest one.
VectorXd pose_costs(const MotionTexture& texture, const Ref<const MatrixXd>& frames) {
  VectorXd costs(texture.texton_count());
  for (Index j = 0; j < costs.size(); ++j) {
    costs[j] = -TextonLikelihood(texture.textons[at(j)]).start_terms(frames)[0];
  }
  return costs.array() - costs.minCoeff();
}

MatrixXd known_costs(const MotionTexture& texture) {
  return transition_matrix(texture).unaryExpr(
      [](double p) { return p > 0.0 ? std::max(0.0, -std::log(p)) : math::kInfinity; });
}

/// Costs of changes that were never made, by the distance of their nearest poses.
MatrixXd with_jumps(const MotionTexture& texture, MatrixXd costs) {
  MatrixXd distances = MatrixXd::Constant(costs.rows(), costs.cols(), math::kInfinity);
  for (const Segment& out : texture.segments) {
    const auto end = texture.observations.middleCols(out.begin + out.length - 2, 2);
    for (const Segment& in : texture.segments) {
      double& distance = distances(out.texton, in.texton);
      distance = std::min(distance, pose_distance(texture, in, end));
    }
  }
  VectorXd nearest = distances.rowwise().minCoeff();
  std::nth_element(nearest.begin(), nearest.begin() + nearest.size() / 2, nearest.end());
  const double usual = std::max(1e-9, nearest[nearest.size() / 2]);
  for (Index i = 0; i < costs.rows(); ++i) {
    for (Index j = 0; j < costs.cols(); ++j) {
      if (costs(i, j) < math::kInfinity || !(distances(i, j) < math::kInfinity)) continue;
      costs(i, j) = kJumpNats * (1.0 + distances(i, j) / usual);
    }
  }
  return costs;
}

/// Cheapest ways to have ended texton j after t frames.
class FrameTable {
 public:
  FrameTable(const MotionTexture& texture, const MatrixXd& changes, const VectorXd& start,
             int frames)
      : changes_(changes), frames_(frames), textons_(texture.texton_count()) {
    for (int j = 0; j < textons_; ++j) {
      whole_.push_back(length_costs(texture, j, false));
      cut_.push_back(length_costs(texture, j, true));
    }
    cost_.setConstant(textons_, frames + 1, math::kInfinity);
    enter_.setConstant(textons_, frames + 1, math::kInfinity);
    length_.setZero(textons_, frames + 1);
    before_.setConstant(textons_, frames + 1, -1);
    enter_.col(0) = start;
    for (int t = 1; t <= frames; ++t) fill(t);
  }

  [[nodiscard]] double cost(int texton) const { return cost_(texton, frames_); }
  [[nodiscard]] std::vector<PlannedTexton> path(int texton) const {
    std::vector<PlannedTexton> path;
    for (int t = frames_; t > 0;) {
      path.push_back({texton, length_(texton, t)});
      const int begin = t - length_(texton, t);
      texton = before_(texton, begin);
      t = begin;
    }
    std::reverse(path.begin(), path.end());
    return path;
  }

 private:
  void fill(int t) {
    for (int j = 0; j < textons_; ++j) {
      const bool ends = t == frames_;
      try_lengths(whole_[at(j)], t, j, false);
      try_lengths(cut_[at(j)], t, j, !ends);
    }
    if (t == frames_) return;
    for (int j = 0; j < textons_; ++j) {
      Index best = 0;
      enter_(j, t) = (cost_.col(t) + changes_.col(j)).minCoeff(&best);
      before_(j, t) = static_cast<int>(best);
    }
  }

  void try_lengths(const LengthCosts& lengths, int t, int j, bool only_first) {
    for (std::size_t n = 0; n < lengths.costs.size(); ++n) {
      const int length = lengths.shortest + static_cast<int>(n);
      if (length > t) break;
      if (only_first && length != t) continue;
      const double through = enter_(j, t - length) + lengths.costs[n];
      if (through < cost_(j, t)) {
        cost_(j, t) = through;
        length_(j, t) = length;
      }
    }
  }

  const MatrixXd& changes_;
  int frames_;
  int textons_;
  std::vector<LengthCosts> whole_;
  std::vector<LengthCosts> cut_;
  MatrixXd cost_;   // Nt x (frames + 1): texton j ends before frame t
  MatrixXd enter_;  // texton j begins at frame t
  Eigen::MatrixXi length_;
  Eigen::MatrixXi before_;
};

void check_ends(const MotionTexture& texture, const Ref<const MatrixXd>& from,
                const Ref<const MatrixXd>& to, int frames) {
  const Index rows = texture.observations.rows();
  if (from.rows() != rows || to.rows() != rows || from.cols() != 2 || to.cols() != 2) {
    throw Error(ErrorKind::kUsage, "a choreography goes from two frames of " +
                                       std::to_string(rows) + " numbers to two frames");
  }
  if (frames < kFewestConstrained || frames > kMostFrames) {
    throw Error(ErrorKind::kUsage, "a choreography of " + std::to_string(frames) +
                                       " frames (must be from " +
                                       std::to_string(kFewestConstrained) + " to " +
                                       std::to_string(kMostFrames) + ")");
  }
}

}  // namespace

Choreography plan_choreography(const MotionTexture& texture, const Ref<const MatrixXd>& from,
                               const Ref<const MatrixXd>& to, int frames) {
  check_ends(texture, from, to, frames);
  const VectorXd start = pose_costs(texture, from);
  const VectorXd end = pose_costs(texture, to);
  const MatrixXd known = known_costs(texture);
  for (const bool jumps : {false, true}) {
    const MatrixXd changes = jumps ? with_jumps(texture, known) : known;
    const FrameTable table(texture, changes, start, frames);
    Choreography best;
    best.cost = math::kInfinity;
    for (int j = 0; j < texture.texton_count(); ++j) {
      const double cost = table.cost(j) + end[j];
      if (cost < best.cost) best = {table.path(j), cost, 0};
    }
    if (best.cost == math::kInfinity) continue;
    for (std::size_t n = 1; n < best.path.size(); ++n) {
      if (known(best.path[n - 1].texton, best.path[n].texton) == math::kInfinity) ++best.jumps;
    }
    return best;
  }
  throw Error(ErrorKind::kData, "no textons' lengths sum to " + std::to_string(frames) +
                                    " frames; ask for more frames");
}

}  // namespace laban::texture
