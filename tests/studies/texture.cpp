// What a motion texture makes of takes that it has not learnt from.
//
//   texture_study FOLDER HELD,OUT,TAKES THRESHOLD|auto [FILE.texture]
//   texture_study FOLDER --one TAKE,..|all|variations THRESHOLD|auto [SEED]
//   texture_study --walk FILE.texture SEED,..
//
// Learns all takes of FOLDER but the held-out ones at 60 Hz (or reads FILE, if it is there, and
// else writes it), then prints, for the held-out takes: one-step prediction beside constant
// velocity, and gaps of 5, 15, 30 and 45 frames filled in beside linear interpolation and slerp, by
// the LaFAN1 benchmark's L2P (here metres on the standard body, not divided by its data's
// deviations) and L2Q. --one makes a minute of one take and tells how varied and faithful it is;
// --walk one of all takes and tells whether it jerks more than they do.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/motion_quality.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/motion/standard_body.h"
#include "laban/texture/gap_infill.h"
#include "laban/texture/learn_texture.h"
#include "laban/texture/texton_fit.h"
#include "laban/texture/texture_file.h"
#include "laban/texture/texture_motion.h"

#include "takes.h"

namespace {

using namespace laban;
using Eigen::Index;
using Eigen::MatrixXd;
using Clock = std::chrono::steady_clock;

constexpr double kRateHz = 60.0;
constexpr int kContext = 15;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

texture::MotionTexture learn(const std::vector<studies::Take>& takes,
                             const std::vector<std::string>& held_out,
                             const std::string& threshold) {
  std::vector<texture::TextureSource> sources;
  for (const studies::Take& take : takes) {
    if (std::find(held_out.begin(), held_out.end(), take.name) != held_out.end()) continue;
    sources.push_back({take.name, take.capture, 0});
  }
  texture::TextureLearning options;
  options.frame_rate_hz = kRateHz;
  if (threshold != "auto") options.threshold = std::stod(threshold);
  const auto begin = Clock::now();
  texture::LearntTexture learnt = texture::learn_texture(sources, options);
  std::printf(
      "%d takes, %d frames: %d textons, %d segments, %d rounds, threshold %.4f, %.1f s\n",
      static_cast<int>(sources.size()), static_cast<int>(learnt.texture.observations.cols()),
      learnt.texture.texton_count(), static_cast<int>(learnt.texture.segments.size()),
      static_cast<int>(learnt.report.rounds.size()), learnt.report.threshold, seconds_since(begin));
  return std::move(learnt.texture);
}

texture::MotionTexture learnt_or_read(const std::vector<studies::Take>& takes,
                                      const std::vector<std::string>& held_out,
                                      const std::string& threshold, const std::string& file) {
  if (!file.empty() && std::filesystem::exists(file)) {
    std::ifstream stream(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    return texture::read_texture(bytes, file);
  }
  texture::MotionTexture learnt = learn(takes, held_out, threshold);
  if (!file.empty()) std::ofstream(file, std::ios::binary) << texture::write_texture(learnt);
  return learnt;
}

/// Root mean square one-step errors of an observation row, at every fifth frame.
void one_step(const texture::GapInfill& infill, const std::string& name, const MatrixXd& y) {
  double texture_error = 0.0;
  double velocity_error = 0.0;
  int count = 0;
  for (Index t = kContext; t < y.cols(); t += 5, ++count) {
    texture_error += (infill.next(y.middleCols(t - kContext, kContext)) - y.col(t)).squaredNorm();
    velocity_error += (2.0 * y.col(t - 1) - y.col(t - 2) - y.col(t)).squaredNorm();
  }
  const double values = static_cast<double>(count) * static_cast<double>(y.rows());
  std::printf("  %-12s %.5f, constant velocity %.5f (ratio %.3f)\n", name.c_str(),
              std::sqrt(texture_error / values), std::sqrt(velocity_error / values),
              std::sqrt(texture_error / velocity_error));
}

/// Frames [begin, end) of a clip by straight lines of places and arcs of rotations.
motion::Clip interpolated(const motion::Clip& truth, int begin, int end) {
  Eigen::Matrix3Xd roots = truth.root_positions();
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < truth.frame_count(); ++f) {
    const bool inside = f >= begin && f < end;
    const double share = static_cast<double>(f - begin + 1) / (end - begin + 1);
    for (int j = 0; j < truth.joint_count(); ++j) {
      rotations.push_back(
          inside ? truth.rotation(begin - 1, j).slerp(share, truth.rotation(end, j)).normalized()
                 : truth.rotation(f, j));
    }
    if (inside) {
      roots.col(f) = (1.0 - share) * truth.root_positions().col(begin - 1) +
                     share * truth.root_positions().col(end);
    }
  }
  return {truth.shared_skeleton(), truth.frame_rate_hz(), std::move(roots), std::move(rotations)};
}

struct Errors {
  double l2p = 0.0;
  double l2q = 0.0;
  int frames = 0;

  void add(const motion::Clip& truth, const motion::Clip& filled, int begin, int end) {
    for (int f = begin; f < end; ++f, ++frames) {
      const motion::ModelPose a = motion::forward_kinematics(truth, f);
      const motion::ModelPose b = motion::forward_kinematics(filled, f);
      double q = 0.0;
      for (std::size_t j = 0; j < a.rotations.size(); ++j) {
        const Eigen::Quaterniond other = math::same_hemisphere(b.rotations[j], a.rotations[j]);
        q += (other.coeffs() - a.rotations[j].coeffs()).squaredNorm();
      }
      l2p += (a.positions - b.positions).norm();
      l2q += std::sqrt(q);
    }
  }
};

/// Fills a gap in the middle of a window of observations and adds what it is off.
void compare(const texture::MotionTexture& texture, const texture::GapInfill& infill,
             const Eigen::Ref<const MatrixXd>& y, int gap, Errors& ours, Errors& linear) {
  const int begin = kContext;
  const int end = begin + gap;
  const auto clip_of = [&](const MatrixXd& observations) {
    return motion::to_standard_clip(texture::poses_of(texture.space, observations, kRateHz, 1.0));
  };
  const motion::Clip truth = clip_of(y);
  const motion::PoseMatrix pose = texture::poses_of(texture.space, y, kRateHz, 1.0);
  const Eigen::Matrix3Xd path = motion::planar_path(pose.slice(begin - 1, end + 1));
  ours.add(truth, clip_of(infill.fill(y, begin, end, path.col(gap + 1))), begin, end);
  linear.add(truth, interpolated(truth, begin, end), begin, end);
}

using NamedObservations = std::vector<std::pair<std::string, MatrixXd>>;

void fill_gaps(const texture::MotionTexture& texture, const NamedObservations& unseen,
               const texture::GapInfillOptions& options) {
  const texture::GapInfill infill(texture, options);
  for (const int gap : {5, 15, 30, 45}) {
    Errors ours;
    Errors linear;
    std::string takes_below;
    for (const auto& [name, y] : unseen) {
      Errors one;
      Errors other;
      for (int begin = 0; begin + 2 * kContext + gap <= y.cols(); begin += 60) {
        compare(texture, infill, y.middleCols(begin, 2 * kContext + gap), gap, one, other);
      }
      char line[160];
      std::snprintf(line, sizeof line, "    %-12s L2P %.4f of %.4f, L2Q %.4f of %.4f\n",
                    name.c_str(), one.l2p / one.frames, other.l2p / other.frames,
                    one.l2q / one.frames, other.l2q / other.frames);
      takes_below += line;
      ours = {ours.l2p + one.l2p, ours.l2q + one.l2q, ours.frames + one.frames};
      linear = {linear.l2p + other.l2p, linear.l2q + other.l2q, linear.frames + other.frames};
    }
    std::printf("  %2d frames: L2P %.4f of %.4f (ratio %.3f), L2Q %.4f of %.4f (ratio %.3f)\n%s",
                gap, ours.l2p / ours.frames, linear.l2p / linear.frames, ours.l2p / linear.l2p,
                ours.l2q / ours.frames, linear.l2q / linear.frames, ours.l2q / linear.l2q,
                takes_below.c_str());
    std::fflush(stdout);
  }
}

// ---- one clip: variety and faithfulness ----

constexpr int kWindow = 30;
constexpr int kApart = 60;

/// Rotations of all windows of 30 frames, a column a window: matrices over the square root of two,
/// between two of which it is as far as the angle, if that is small. Exponential maps may tell one
/// rotation on two branches.
MatrixXd windows(const motion::PoseMatrix& pose, int step) {
  constexpr Index kRows = 9 * motion::kStandardJointCount;
  MatrixXd rotations(kRows, pose.frame_count());
  for (int f = 0; f < pose.frame_count(); ++f) {
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      rotations.block<9, 1>(9 * s, f) =
          math::exp(pose.angles.block<3, 1>(3 * s, f)).toRotationMatrix().reshaped() /
          std::sqrt(2.0);
    }
  }
  const int count = (pose.frame_count() - kWindow) / step + 1;
  MatrixXd columns(kWindow * kRows, count);
  for (int n = 0; n < count; ++n) {
    columns.col(n) = rotations.middleCols(n * step, kWindow).reshaped();
  }
  return columns;
}

/// Squared distances of every column of a (rows) to every one of b.
MatrixXd squared_distances(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd d = -2.0 * a.transpose() * b;
  d.colwise() += a.colwise().squaredNorm().transpose();
  d.rowwise() += b.colwise().squaredNorm();
  return d.cwiseMax(0.0);
}

/// The median of the distances of the input's windows to their nearest at least 60 frames away.
double usual_distance(const MatrixXd& input) {
  MatrixXd d = squared_distances(input, input);
  for (Index i = 0; i < d.rows(); ++i) {
    for (Index j = std::max<Index>(0, i - kApart + 1); j < std::min(d.cols(), i + kApart); ++j) {
      d(i, j) = std::numeric_limits<double>::infinity();
    }
  }
  std::vector<double> nearest;
  for (Index i = 0; i < d.rows(); ++i) nearest.push_back(std::sqrt(d.row(i).minCoeff()));
  std::nth_element(nearest.begin(), nearest.begin() + std::ssize(nearest) / 2, nearest.end());
  return nearest[nearest.size() / 2];
}

struct FarRotation {
  double degrees = 0.0;  ///< from the nearest of the captured rotations of the joint
  int joint = 0;
  Index frame = 0;
};

FarRotation farthest_rotation(const motion::PoseMatrix& made, const motion::PoseMatrix& input) {
  FarRotation farthest;
  for (int s = 0; s < motion::kStandardJointCount; ++s) {
    const auto quaternions = [&](const motion::PoseMatrix& pose) {
      MatrixXd q(4, pose.frame_count());
      for (int f = 0; f < pose.frame_count(); ++f) {
        q.col(f) = math::exp(pose.angles.block<3, 1>(3 * s, f)).coeffs();
      }
      return q;
    };
    const MatrixXd dots = (quaternions(input).transpose() * quaternions(made)).cwiseAbs();
    Index frame = 0;
    const Eigen::RowVectorXd nearest = dots.colwise().maxCoeff();
    const double least = nearest.minCoeff(&frame);
    const double degrees = 2.0 * std::acos(std::min(1.0, least)) * 57.29577951308232;
    if (degrees > farthest.degrees) farthest = {degrees, s, frame};
  }
  return farthest;
}

struct FastTurn {
  double ratio = 0.0;    ///< to the fastest that the joint was captured with
  double degrees = 0.0;  ///< a frame
  int joint = 0;
  int frame = 0;
};

/// The turn of a joint from a frame to the next that is fastest beside what the joint was captured
/// with.
FastTurn fastest_turn(const motion::PoseMatrix& made, const motion::PoseMatrix& input) {
  FastTurn fastest;
  for (int s = 0; s < motion::kStandardJointCount; ++s) {
    const auto turns = [&](const motion::PoseMatrix& pose) {
      Eigen::VectorXd angles(pose.frame_count() - 1);
      for (int f = 0; f + 1 < pose.frame_count(); ++f) {
        angles[f] = math::angle_between(math::exp(pose.angles.block<3, 1>(3 * s, f)),
                                        math::exp(pose.angles.block<3, 1>(3 * s, f + 1)));
      }
      return angles;
    };
    Index frame = 0;
    const double degrees = turns(made).maxCoeff(&frame) * 57.29577951308232;
    const double most = turns(input).maxCoeff() * 57.29577951308232;
    if (degrees / most > fastest.ratio) {
      fastest = {degrees / most, degrees, s, static_cast<int>(frame)};
    }
  }
  return fastest;
}

const char* name_of(int joint) {
  return motion::kStandardJointNames[static_cast<std::size_t>(joint)].data();
}

std::vector<int> joins_of(const texture::TextureClip& made) {
  std::vector<int> joins;
  for (const texture::TextonPart& part : made.parts) {
    if (part.begin > 0) joins.push_back(static_cast<int>(part.begin));
  }
  return joins;
}

/// What a minute made of one clip is like.
struct OneClip {
  double coverage = 0.0;
  double new_windows = 0.0;  ///< share farther than half the usual distance from any of the input
  FarRotation far;
  FastTurn fast;
  double percentile = 0.0;  ///< of the captures' acceleration, at the worst join
  int joins = 0;
  int jumps = 0;
  motion::MotionQuality quality;
};

OneClip make_minute(const texture::MotionTexture& texture, const motion::PoseMatrix& pose,
                    const motion::MotionQuality& captured,
                    const texture::TextureMotionOptions& options) {
  texture::TextureMotion motion(texture, options);
  const texture::TextureClip made = motion.next(3600);
  const motion::PoseMatrix played = motion::to_pose_matrix(made.clip, texture.rig.humanoid);
  OneClip found;
  for (std::size_t n = 1; n < made.parts.size(); ++n) found.jumps += made.parts[n - 1].jump;
  found.far = farthest_rotation(played, pose);
  found.fast = fastest_turn(played, pose);
  const MatrixXd own = windows(pose, 1);
  const MatrixXd d = squared_distances(own, windows(played, 3));
  const double usual = usual_distance(own);
  found.coverage = (d.rowwise().minCoeff().array().sqrt() <= usual).cast<double>().mean();
  found.new_windows = (d.colwise().minCoeff().array().sqrt() > 0.5 * usual).cast<double>().mean();
  const motion::FootFloor floor = texture.rig.floor.value_or(motion::FootFloor{});
  found.quality = motion::measure_quality(made.clip, texture.rig.humanoid, floor);
  const auto joins = joins_of(made);
  found.joins = static_cast<int>(joins.size());
  found.percentile =
      motion::join_acceleration_percentile(found.quality, joins, {&captured, 1}).value_or(0.0);
  return found;
}

void one_clip(const studies::Take& take, const std::string& threshold,
              const std::vector<double>& variations, std::uint64_t seed) {
  const texture::MotionTexture texture = learn({take}, {}, threshold);
  const motion::Clip input = motion::resample(take.capture.clip, kRateHz);
  const motion::PoseMatrix pose = motion::to_pose_matrix(input, take.capture.humanoid);
  const motion::FootFloor floor = texture.rig.floor.value_or(motion::FootFloor{});
  const motion::MotionQuality captured =
      motion::measure_quality(input, take.capture.humanoid, floor);
  std::printf("one clip, %s: %d frames; jerk %.0f m/s^3, skate %.2f cm\n", take.name.c_str(),
              input.frame_count(), captured.jerk_m_s3, captured.foot_skate_cm);
  for (const double variation : variations) {
    const OneClip made =
        make_minute(texture, pose, captured, {.seed = seed, .variation = variation});
    const OneClip free = make_minute(texture, pose, captured,
                                     {.seed = seed, .variation = variation, .hold_feet = false});
    std::printf(
        "  variation %.2f: coverage %.3f, output windows farther than half the usual distance from "
        "any input window %.3f, rotations at most %.1f deg from a captured one (%s, frame %d; %.1f "
        "without feet held), turns at most %.2f times as fast as captured (%.1f deg a frame, %s, "
        "frame %d), jerk %.0f, skate %.2f cm, worst of %d joins (%d jumps) at the "
        "captures' %.1fth percentile of acceleration (%.1f without feet held)\n",
        variation, made.coverage, made.new_windows, made.far.degrees, name_of(made.far.joint),
        static_cast<int>(made.far.frame), free.far.degrees, made.fast.ratio, made.fast.degrees,
        name_of(made.fast.joint), made.fast.frame, made.quality.jerk_m_s3,
        made.quality.foot_skate_cm, made.joins, made.jumps, made.percentile, free.percentile);
  }
  std::fflush(stdout);
}

// ---- a walk over all takes ----

/// The largest jerk that a texton was captured with, m/s^3.
double captured_jerk(const texture::MotionTexture& texture, int texton) {
  double largest = 0.0;
  for (const texture::Segment& one : texture.segments) {
    if (one.texton != texton) continue;
    const motion::Clip clip = texture::play_observations(
        texture, texture.observations.middleCols(one.begin, one.length), {.hold_feet = false});
    largest = std::max(
        largest, motion::measure_quality(clip, texture.rig.humanoid, *texture.rig.floor).jerk_m_s3);
  }
  return largest;
}

/// How much of a minute's jerk is that of the captures it walks through.
void walk(const texture::MotionTexture& texture, std::uint64_t seed) {
  texture::TextureMotion motion(texture, {.seed = seed});
  const texture::TextureClip made = motion.next(3600);
  const auto jerk_of = [&](const motion::Clip& clip) {
    return motion::measure_quality(clip, texture.rig.humanoid, *texture.rig.floor).jerk_m_s3;
  };
  double captured = 0.0;
  std::string worst;
  double worst_ratio = 0.0;
  for (const texture::TextonPart& part : made.parts) {
    const auto begin = static_cast<int>(part.begin);
    const int end = std::min(made.clip.frame_count(), static_cast<int>(part.end));
    if (end - begin < 30) continue;
    const double own = captured_jerk(texture, part.texton);
    const double here = jerk_of(made.clip.slice(begin, end));
    captured += own * own * (end - begin);
    if (here / own <= worst_ratio) continue;
    worst_ratio = here / own;
    char text[120];
    std::snprintf(text, sizeof text, "texton %d at frame %d: %.0f, captured %.0f", part.texton,
                  begin, here, own);
    worst = text;
  }
  std::printf(
      "walk, seed %d: jerk %.0f m/s^3, that of its textons as captured %.0f; most above: %s\n",
      static_cast<int>(seed), jerk_of(made.clip), std::sqrt(captured / made.clip.frame_count()),
      worst.c_str());
}

int study(const std::vector<std::string>& arguments) {
  if (arguments[0] == "--walk") {
    const texture::MotionTexture texture = learnt_or_read({}, {}, "", arguments[1]);
    for (const std::string& seed : studies::split(arguments[2])) walk(texture, std::stoull(seed));
    return 0;
  }
  const std::vector<studies::Take> takes = studies::read_takes(arguments[0], "{content}_{take}");
  if (arguments[1] == "--one") {
    const std::uint64_t seed = arguments.size() > 4 ? std::stoull(arguments[4]) : 1;
    const auto names = studies::split(arguments[2]);
    for (const studies::Take& take : takes) {
      if (arguments[2] == "variations") {
        one_clip(take, arguments[3], {0.0, 0.1, 0.3, 1.0}, seed);
      } else if (arguments[2] == "all" ||
                 std::find(names.begin(), names.end(), take.name) != names.end()) {
        one_clip(take, arguments[3], {0.1}, seed);
      }
    }
    return 0;
  }
  const std::vector<std::string> held_out = studies::split(arguments[1]);
  const texture::MotionTexture texture =
      learnt_or_read(takes, held_out, arguments[2], arguments.size() > 3 ? arguments[3] : "");
  NamedObservations unseen;
  for (const studies::Take& take : takes) {
    if (std::find(held_out.begin(), held_out.end(), take.name) == held_out.end()) continue;
    const motion::Clip clip = motion::resample(take.capture.clip, kRateHz);
    unseen.emplace_back(
        take.name,
        texture::observe(texture.space,
                         texture::standing_on_floor(
                             texture.rig, motion::to_pose_matrix(clip, take.capture.humanoid))));
  }
  std::printf("one step, rms of an observation row:\n");
  const texture::GapInfill infill(texture);
  for (const auto& [name, y] : unseen) one_step(infill, name, y);
  std::printf("gaps, all held-out takes, textons beside linear interpolation and slerp:\n");
  fill_gaps(texture, unseen, {});
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4 || argc > 6) {
    std::fprintf(stderr,
                 "usage: texture_study FOLDER HELD,OUT,TAKES THRESHOLD|auto [FILE.texture]\n");
    return 2;
  }
  try {
    return study({argv + 1, argv + argc});
  } catch (const laban::base::Error& error) {
    std::fprintf(stderr, "texture_study: %s\n", error.what());
    return 1;
  }
}
