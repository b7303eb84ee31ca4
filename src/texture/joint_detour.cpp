#include "texture/joint_detour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "laban/math/constants.h"
#include "laban/math/rotation.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Matrix4f;
using Eigen::MatrixX4f;
using Eigen::MatrixXf;
using Eigen::Quaterniond;
using Eigen::VectorXf;

constexpr int kNetSize = 256;
constexpr double kNodeS = 0.1;
constexpr double kSmoothS = 0.08;  // deviation of the Gaussian
constexpr double kEaseS = 0.15;
constexpr double kShortestS = 0.4;
// Smoothing takes some of what leads back to captured rotations.
// What is left is mostly short, where the capture itself jerks: later rounds are quicker.
constexpr std::array kDrawNearS{0.08, 0.08, 0.05, 0.03, 0.02};
// Between two poses with none captured between them a joint shows the fewer that were not, the
// quicker it gets over there: more rounds as quick as the last, while it bends little sharper than
// joints were captured to.
constexpr int kMostMoreRounds = 30;
constexpr double kSharper = 1.25;
constexpr double kOverdrawn = 1.5;
// To be so much too far from what was seen for a node costs as much as to turn by 26 degrees.
constexpr double kFarUnit = 4.0 * math::kDegree;
constexpr double kFarCost = 0.05;

/// The matrix of q -> p^-1 q on coefficients (x, y, z, w).
Matrix4f conjugate_product(const Quaterniond& p) {
  const auto x = static_cast<float>(p.x());
  const auto y = static_cast<float>(p.y());
  const auto z = static_cast<float>(p.z());
  const auto w = static_cast<float>(p.w());
  Matrix4f m;
  m << w, z, -y, -x,  //
      -z, w, x, -y,   //
      y, -x, w, -z,   //
      x, y, z, w;
  return m;
}

/// The cheapest way through states of nodes, from the last state of the first node to the last of
/// the last. A step costs 1 - cos^2 of half the angle between what two states add to their nodes'
/// rotations.
class CheapestWay {
 public:
  CheapestWay(const MatrixX4f& net, const std::vector<Quaterniond>& nodes,
              const std::vector<double>& own_costs)
      : net_(net), nodes_(nodes), own_costs_(own_costs) {}

  /// A state a node: a row of the net, or its number of rows: the node's own rotation.
  [[nodiscard]] std::vector<int> find() const {
    const Index own = net_.rows();
    const auto count = static_cast<Index>(nodes_.size());
    MatrixXf costs = MatrixXf::Constant(own + 1, count, kForbidden);  // of all ways to each state
    costs(own, 0) = 0.0F;
    MatrixX4f here = added(0);
    for (Index n = 1; n < count; ++n) {
      const MatrixX4f next = added(n);
      MatrixXf ways = 1.0F - (here * next.transpose()).array().square();
      ways.colwise() += costs.col(n - 1);
      costs.col(n) = ways.colwise().minCoeff().transpose();
      costs(own, n) += static_cast<float>(own_costs_[static_cast<std::size_t>(n)]);
      here = next;
    }
    // The best state before another is found again: cheaper than to note it for all of them.
    std::vector<int> states(nodes_.size(), static_cast<int>(own));
    for (Index n = count - 1; n > 0; --n) {
      const MatrixX4f before = added(n - 1);
      const Eigen::RowVector4f there = added(n).row(states[static_cast<std::size_t>(n)]);
      Index best = 0;
      (costs.col(n - 1).array() + 1.0F - (before * there.transpose()).array().square())
          .minCoeff(&best);
      states[static_cast<std::size_t>(n - 1)] = static_cast<int>(best);
    }
    return states;
  }

 private:
  static constexpr float kForbidden = 1e6F;

  [[nodiscard]] MatrixX4f added(Index node) const {
    MatrixX4f turns(net_.rows() + 1, 4);
    turns.topRows(net_.rows()) =
        net_ * conjugate_product(nodes_[static_cast<std::size_t>(node)]).transpose();
    turns.row(net_.rows()) << 0.0F, 0.0F, 0.0F, 1.0F;
    return turns;
  }

  const MatrixX4f& net_;
  const std::vector<Quaterniond>& nodes_;
  const std::vector<double>& own_costs_;
};

Matrix3Xd smoothed(const Matrix3Xd& turns, double deviation) {
  const auto reach = static_cast<Index>(std::ceil(3.0 * deviation));
  Matrix3Xd smooth = Matrix3Xd::Zero(3, turns.cols());
  double sum = 0.0;
  for (Index d = -reach; d <= reach; ++d) {
    const double weight = std::exp(-0.5 * static_cast<double>(d * d) / (deviation * deviation));
    sum += weight;
    const Index from = std::max<Index>(0, -d);
    const Index to = std::min<Index>(turns.cols(), turns.cols() - d);
    if (from < to) {
      smooth.middleCols(from, to - from) += weight * turns.middleCols(from + d, to - from);
    }
  }
  return smooth / sum;
}

/// To the nearest of some rotations.
double angle_to(const MatrixX4f& rotations, const Quaterniond& rotation) {
  const float nearest = (rotations * rotation.coeffs().cast<float>()).cwiseAbs().maxCoeff();
  return 2.0 * std::acos(std::min(1.0, static_cast<double>(nearest)));
}

/// How much the turn from a frame to the next changes at most, radians. `rotation(f)` is that of a
/// frame.
template <typename Rotation>
double sharpest_bend(Index frames, const Rotation& rotation) {
  double sharpest = 0.0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (Index f = 1; f < frames; ++f) {
    const Eigen::Vector3d turn = math::log(rotation(f - 1).conjugate() * rotation(f));
    if (f > 1) sharpest = std::max(sharpest, (turn - before).norm());
    before = turn;
  }
  return sharpest;
}

void ease_ends(Matrix3Xd& turns, double over) {
  const Index last = turns.cols() - 1;
  for (Index f = 0; f <= last; ++f) {
    const double x = std::min(1.0, static_cast<double>(std::min(f, last - f)) / over);
    turns.col(f) *= x * x * (3.0 - 2.0 * x);
  }
}

}  // namespace

// Each further rotation is the one farthest from all before it.
const MatrixX4f& JointDetours::net(int joint) {
  auto& net = nets_[static_cast<std::size_t>(joint)];
  if (net) return *net;
  const MatrixX4f& all = range_.captured(joint);
  MatrixX4f chosen(std::min<Index>(kNetSize, all.rows()), 4);
  VectorXf nearest = VectorXf::Zero(all.rows());  // cosines of half angles
  Index next = 0;
  for (Index n = 0; n < chosen.rows(); ++n) {
    chosen.row(n) = all.row(next);
    nearest = nearest.cwiseMax((all * chosen.row(n).transpose()).cwiseAbs());
    nearest.minCoeff(&next);
  }
  return net.emplace(std::move(chosen));
}

std::optional<Matrix3Xd> JointDetours::around(int joint, std::span<const Quaterniond> rotations,
                                              double free_turn) {
  const double last_s = static_cast<double>(rotations.size() - 1) / texture_.frame_rate_hz;
  if (rotations.empty() || last_s < kShortestS) return std::nullopt;
  Matrix3Xd turns = cheapest(joint, rotations, free_turn);
  if (turns.cols() == 0) return std::nullopt;
  turns = smoothed(turns, kSmoothS * texture_.frame_rate_hz);
  ease_ends(turns, kEaseS * texture_.frame_rate_hz);
  for (const double deviation_s : kDrawNearS) {
    draw_near(joint, rotations, free_turn, deviation_s * texture_.frame_rate_hz, turns);
  }
  for (int round = 0; round < kMostMoreRounds; ++round) {
    Matrix3Xd nearer = turns;
    if (!draw_near(joint, rotations, free_turn, kDrawNearS.back() * texture_.frame_rate_hz, nearer))
      break;
    const double bend = sharpest_bend(nearer.cols(), [&](Index f) {
      return rotations[static_cast<std::size_t>(f)] * math::exp(nearer.col(f));
    });
    if (bend > kSharper * captured_bend()) break;
    turns = std::move(nearer);
  }
  return turns;
}

double JointDetours::captured_bend() {
  if (bend_) return *bend_;
  bend_ = 0.0;
  for (int joint = 0; joint < motion::kStandardJointCount; ++joint) {
    for (const Take& take : texture_.takes) {
      const double one = sharpest_bend(take.length, [&](Index f) {
        return captured_rotation(texture_, joint, take.begin + static_cast<int>(f));
      });
      bend_ = std::max(*bend_, one);
    }
  }
  return *bend_;
}

Matrix3Xd JointDetours::cheapest(int joint, std::span<const Quaterniond> rotations,
                                 double free_turn) {
  const auto frames = static_cast<Index>(rotations.size());
  const auto steps = static_cast<Index>(
      std::lround(static_cast<double>(frames - 1) / texture_.frame_rate_hz / kNodeS));
  const auto frame_of = [&](Index n) { return n * (frames - 1) / steps; };
  std::vector<Quaterniond> nodes;
  std::vector<double> own_costs;
  for (Index n = 0; n <= steps; ++n) {
    const Quaterniond& own = rotations[static_cast<std::size_t>(frame_of(n))];
    const double beyond = std::max(0.0, range_.distance(joint, own) - free_turn) / kFarUnit;
    nodes.push_back(own);
    own_costs.push_back(kFarCost * beyond * beyond);
  }
  const MatrixX4f& seen = net(joint);
  const std::vector<int> states = CheapestWay(seen, nodes, own_costs).find();
  Matrix3Xd turns = Matrix3Xd::Zero(3, frames);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (Index n = 1; n <= steps; ++n) {
    const auto at = static_cast<std::size_t>(n);
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    if (states[at] < seen.rows()) {
      const Quaterniond there(Eigen::Vector4d(seen.row(states[at]).transpose().cast<double>()));
      turn = math::log((nodes[at].conjugate() * there).normalized());
    }
    turn = math::nearest_branch(turn, before);
    for (Index f = frame_of(n - 1) + 1; f <= frame_of(n); ++f) {
      const double share = static_cast<double>(f - frame_of(n - 1)) /
                           static_cast<double>(frame_of(n) - frame_of(n - 1));
      turns.col(f) = (1.0 - share) * before + share * turn;
    }
    before = turn;
  }
  if (before.norm() > 1e-6) return {};
  return turns;
}

bool JointDetours::draw_near(int joint, std::span<const Quaterniond> rotations, double free_turn,
                             double deviation, Matrix3Xd& turns) {
  const MatrixX4f& seen = net(joint);
  Matrix3Xd back = Matrix3Xd::Zero(3, turns.cols());
  for (Index f = 0; f < turns.cols(); ++f) {
    const Quaterniond rotation = rotations[static_cast<std::size_t>(f)] * math::exp(turns.col(f));
    // Some of the captured rotations are quicker to look through than all.
    if (angle_to(seen, rotation) <= free_turn) continue;
    const double distance = range_.distance(joint, rotation);
    if (distance <= free_turn) continue;
    const Eigen::Vector3d whole = math::log(rotation.conjugate() * range_.nearest(joint, rotation));
    back.col(f) = (kOverdrawn * (distance - free_turn) / distance) * whole;
  }
  if (back.isZero()) return false;
  back = smoothed(back, deviation);
  ease_ends(back, kEaseS * texture_.frame_rate_hz);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (Index f = 0; f < turns.cols(); ++f) {
    before =
        math::nearest_branch(math::log(math::exp(turns.col(f)) * math::exp(back.col(f))), before);
    turns.col(f) = before;
  }
  return true;
}

}  // namespace laban::texture
