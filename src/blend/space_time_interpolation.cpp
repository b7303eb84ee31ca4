#include "laban/blend/space_time_interpolation.h"

#include <cmath>
#include <numbers>
#include <span>

#include "laban/base/error.h"
#include "laban/math/branch.h"
#include "laban/math/cubic_interpolation.h"

namespace laban::blend {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using motion::PoseMatrix;

constexpr Index kHeightRow = motion::kAngleRowCount;
constexpr Index kPathRow = kHeightRow + 1;  // x, z, yaw
constexpr Index kRowCount = kPathRow + 3;

/// A joint may move to another branch only if no step between frames becomes a quarter turn or
/// more: where |r| nears 2 pi neighbouring rotations lie far apart on the shifted branch, and
/// half-way poses would be unlike both.
constexpr double kLargestStep = 0.5 * std::numbers::pi;

/// No clip is unwrapped farther than this from another one of the same content.
constexpr int kMostTurns = 2;

BlendPair::Source make_source(const PoseMatrix& clip, const char* name) {
  const Index count = clip.angles.cols();
  if (clip.angles.rows() != motion::kAngleRowCount || count < 1 || clip.height.size() != count ||
      clip.steps.cols() != count) {
    throw Error(ErrorKind::kData, std::string("blend: clip ") + name + " has " +
                                      std::to_string(clip.angles.rows()) + " x " +
                                      std::to_string(count) + " angles, " +
                                      std::to_string(clip.height.size()) + " heights and " +
                                      std::to_string(clip.steps.cols()) +
                                      " steps (must be 63 rows and as many of each)");
  }
  BlendPair::Source source;
  source.rows.resize(kRowCount, count);
  source.rows.topRows(kHeightRow) = clip.angles;
  source.rows.row(kHeightRow) = clip.height;
  source.rows.bottomRows(3) = planar_path(clip);
  source.leg_length_m = clip.leg_length_m;
  return source;
}

/// Frames that lie beside each other along a warp, to the nearest whole frame.
struct Alignment {
  std::vector<Index> i;
  std::vector<Index> j;
};

Alignment whole_frames(const align::TimeWarp& warp) {
  Alignment alignment;
  for (Index n = 0; n < warp.knot_count(); ++n) {
    alignment.i.push_back(std::lround(warp.p()(n)));
    alignment.j.push_back(std::lround(warp.q()(n)));
  }
  return alignment;
}

double squared_distance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b,
                        const Alignment& alignment) {
  double sum = 0.0;
  for (std::size_t n = 0; n < alignment.i.size(); ++n) {
    sum += (a.col(alignment.i[n]) - b.col(alignment.j[n])).squaredNorm();
  }
  return sum;
}

bool is_continuous(const Eigen::Matrix3Xd& curve) {
  for (Index f = 1; f < curve.cols(); ++f) {
    if ((curve.col(f) - curve.col(f - 1)).norm() >= kLargestStep) return false;
  }
  return true;
}

/// Moves joint rows `row` .. `row` + 2 of one source to another branch if that brings the two
/// nearer along the warp. Either may be moved, so that exchanging the clips changes nothing.
void choose_branch(std::array<BlendPair::Source, 2>& sources, Index row,
                   const Alignment& alignment) {
  const std::array<Eigen::Matrix3Xd, 2> curves = {sources[0].rows.middleRows<3>(row),
                                                  sources[1].rows.middleRows<3>(row)};
  // On another branch |r| is at least 2 pi - |r|: no gain if the two lengths sum to less than pi.
  if (std::sqrt(curves[0].colwise().squaredNorm().maxCoeff()) +
          std::sqrt(curves[1].colwise().squaredNorm().maxCoeff()) <
      std::numbers::pi) {
    return;
  }
  // A shift has to gain more than round-off.
  double least = (1.0 - 1e-9) * squared_distance(curves[0], curves[1], alignment);
  std::array<Eigen::Matrix3Xd, 2> best = curves;
  for (const std::size_t moved : {1U, 0U}) {
    for (int turns = -kMostTurns; turns <= kMostTurns; ++turns) {
      if (turns == 0) continue;
      std::array<Eigen::Matrix3Xd, 2> candidate = curves;
      candidate[moved] = math::shift_branch(curves[moved], turns);
      const double distance = squared_distance(candidate[0], candidate[1], alignment);
      if (distance >= least || !is_continuous(candidate[moved])) continue;
      least = (1.0 - 1e-9) * distance;
      best = std::move(candidate);
    }
  }
  sources[0].rows.middleRows<3>(row) = best[0];
  sources[1].rows.middleRows<3>(row) = best[1];
}

/// A source's rows at the given frames; of the path rows, the steps between them.
Eigen::MatrixXd sample(const BlendPair::Source& source, std::span<const double> frames) {
  Eigen::MatrixXd rows = math::interpolate(source.rows, frames);
  rows.bottomRows<3>() = motion::planar_steps(rows.bottomRows<3>());
  return rows;
}

}  // namespace

BlendPair::BlendPair(const PoseMatrix& clip_i, const PoseMatrix& clip_j, align::TimeWarp warp)
    : warp_(std::move(warp)),
      frame_rate_hz_(clip_i.frame_rate_hz),
      sources_{make_source(clip_i, "i"), make_source(clip_j, "j")} {
  if (clip_i.frame_rate_hz != clip_j.frame_rate_hz) {
    throw Error(ErrorKind::kData, "blend: clips at " + std::to_string(clip_i.frame_rate_hz) +
                                      " and " + std::to_string(clip_j.frame_rate_hz) +
                                      " Hz (resample one first)");
  }
  if (warp_.frames_i() != clip_i.frame_count() || warp_.frames_j() != clip_j.frame_count()) {
    throw Error(ErrorKind::kData, "blend: the time warp joins " + std::to_string(warp_.frames_i()) +
                                      " and " + std::to_string(warp_.frames_j()) +
                                      " frames, the clips have " +
                                      std::to_string(clip_i.frame_count()) + " and " +
                                      std::to_string(clip_j.frame_count()));
  }
  const Alignment alignment = whole_frames(warp_);
  for (Index row = 0; row < kHeightRow; row += 3) choose_branch(sources_, row, alignment);
}

Blend blend(const BlendPair& pair, double alpha) {
  const std::vector<align::WarpPoint> points = pair.warp().sample(alpha);
  Blend result;
  for (const align::WarpPoint& point : points) {
    result.times_i.push_back(point.p);
    result.times_j.push_back(point.q);
  }
  const auto& [i, j] = pair.sources();
  const Eigen::MatrixXd rows =
      (1.0 - alpha) * sample(i, result.times_i) + alpha * sample(j, result.times_j);
  result.pose.frame_rate_hz = pair.frame_rate_hz();
  result.pose.leg_length_m = (1.0 - alpha) * i.leg_length_m + alpha * j.leg_length_m;
  result.pose.angles = rows.topRows<kHeightRow>();
  result.pose.height = rows.row(kHeightRow);
  result.pose.steps = rows.bottomRows<3>();
  return result;
}

motion::FootContacts blend_contacts(const Blend& blend, double alpha,
                                    const motion::FootContacts& contacts_i,
                                    const motion::FootContacts& contacts_j) {
  const double rate_hz = blend.pose.frame_rate_hz;
  return motion::mix(motion::sample(contacts_i, blend.times_i, rate_hz),
                     motion::sample(contacts_j, blend.times_j, rate_hz), alpha);
}

}  // namespace laban::blend
