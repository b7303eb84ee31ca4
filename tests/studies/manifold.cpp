// What a map of poses keeps of a take and of one it has not seen, and what is played from it.
//
//   manifold_study TRAIN UNSEEN [POSES.csv POINTS.csv]
//
// With two files more it writes the pose vectors and their principal coordinates, a frame a row,
// for tests/studies/manifold.py, which puts MiniSom's algorithm and scikit-learn beside.
#include <chrono>
#include <cstdio>
#include <fstream>

#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/manifold/map_path.h"
#include "laban/motion/motion_quality.h"
#include "laban/motion/retarget.h"
#include "support/clip_measures.h"

namespace {

using namespace laban;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

void write_rows(const std::string& path, const Eigen::MatrixXd& columns) {
  std::ofstream file(path);
  file.precision(17);
  for (Eigen::Index n = 0; n < columns.cols(); ++n) {
    for (Eigen::Index d = 0; d < columns.rows(); ++d) file << (d > 0 ? "," : "") << columns(d, n);
    file << '\n';
  }
}

void tell_clip(const char* name, const motion::Clip& clip, const motion::Humanoid& humanoid,
               const std::optional<motion::FootFloor>& floor) {
  const motion::MotionQuality quality =
      motion::measure_quality(clip, humanoid, floor.value_or(motion::FootFloor{}));
  std::printf(
      "%-22s %5.2f s, bones change %.1e m, fastest turn %5.0f deg/s, jerk %6.1f m/s^3, skate %.2f "
      "cm, %.2f m/s over the ground\n",
      name, clip.duration_s(), test::bone_length_spread_m(clip),
      test::largest_turn(clip) * clip.frame_rate_hz() * 57.29577951308232, quality.jerk_m_s3,
      quality.foot_skate_cm, test::travel_speed_m_s(clip));
}

void play_all(const manifold::PoseManifold& manifold, const motion::Capture& capture) {
  const auto& floor = manifold.rig.floor;
  tell_clip("capture", capture.clip, capture.humanoid, floor);
  tell_clip("its own path",
            manifold::play(manifold, manifold::path_along(manifold, manifold.points)),
            capture.humanoid, floor);
  tell_clip("keys at each frame",
            manifold::play(manifold, manifold::path_through(manifold, manifold.points)),
            capture.humanoid, floor);
  Eigen::Matrix2Xd keys(2, 6);
  for (int k = 0; k < 6; ++k)
    keys.col(k) = manifold.points.col(k * (manifold.points.cols() - 1) / 5);
  tell_clip("six key poses", manifold::play(manifold, manifold::path_through(manifold, keys)),
            capture.humanoid, floor);
  for (const double perturb : {0.0, 0.1, 0.5}) {
    base::Rng rng(3);
    manifold::WalkOptions walk;
    walk.perturb = perturb;
    const manifold::MapPath path =
        manifold::markov_path(manifold, manifold.points.col(0), walk, rng);
    tell_clip(("walk, perturbed by " + std::to_string(perturb).substr(0, 3)).c_str(),
              manifold::play(manifold, path), capture.humanoid, floor);
  }
}

void time_poses(const manifold::PoseManifold& manifold) {
  const auto begin = Clock::now();
  double sum = 0.0;
  constexpr int kPoses = 2000;
  for (int n = 0; n < kPoses; ++n) {
    sum += manifold::pose_at(manifold, {n % 64 + 0.5, n % 63 + 0.25}).positions(1, 4);
  }
  std::printf("a pose from a map point: %.4f ms (mean height of a head %.2f m)\n",
              1e3 * seconds_since(begin) / kPoses, sum / kPoses);
}

/// Objectives of the clusterings, which alone are random, for several seeds.
void tell_seeds(const motion::Capture& train, int clusters) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U, 6U}) {
    manifold::LearnOptions options;
    options.kind = manifold::MapKind::kPca;
    options.seed = seed;
    options.primitives = clusters;
    const manifold::LearnReport report = manifold::learn_manifold({&train, 1}, options).report;
    std::printf("seed %d:", static_cast<int>(seed));
    for (const manifold::ComparedClusters& one : report.methods) {
      std::printf("  %s %.4f", std::string(manifold::name_of(one.method)).c_str(), one.objective);
    }
    std::printf("\n");
  }
}

int study(const std::vector<std::string>& arguments) {
  const motion::Capture train = motion::find_capture(io::read_clip(arguments[0]).clip);
  const motion::Capture unseen = motion::find_capture(io::read_clip(arguments[1]).clip);
  int clusters = 0;
  for (const manifold::MapKind kind : {manifold::MapKind::kSom, manifold::MapKind::kPca}) {
    manifold::LearnOptions options;
    options.kind = kind;
    const auto begin = Clock::now();
    const manifold::LearnedManifold learned = manifold::learn_manifold({&train, 1}, options);
    const manifold::LearnReport& report = learned.report;
    std::printf(
        "%s map of %d frames, learnt in %.2f s: quantization %.5f m, topographic %.4f, "
        "poses back within %.2f cm, unseen %.2f cm; %d primitives\n",
        kind == manifold::MapKind::kSom ? "SOM" : "PCA",
        static_cast<int>(learned.manifold.points.cols()), seconds_since(begin),
        report.map.quantization, report.map.topographic, 100.0 * report.reconstruction_m,
        100.0 * manifold::reconstruction_error_m(
                    learned.manifold, motion::to_pose_matrix(unseen.clip, unseen.humanoid)),
        learned.manifold.primitives.count());
    for (const manifold::ComparedClusters& one : report.methods) {
      std::printf("  %-8s objective %12.4f within %.3f apart %.3f Davies-Bouldin %.3f\n",
                  std::string(manifold::name_of(one.method)).c_str(), one.objective,
                  one.figures.within, one.figures.separation, one.figures.davies_bouldin);
    }
    clusters = learned.manifold.primitives.count();
    play_all(learned.manifold, train);
    time_poses(learned.manifold);
    if (kind == manifold::MapKind::kSom && arguments.size() == 4) {
      const Eigen::MatrixXd poses =
          manifold::pose_vectors(motion::to_pose_matrix(train.clip, train.humanoid));
      write_rows(arguments[2], poses);
      write_rows(arguments[3], learned.manifold.pca.transform(poses));
    }
  }
  tell_seeds(train, clusters);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 5) {
    std::fprintf(stderr, "usage: manifold_study TRAIN UNSEEN [POSES.csv POINTS.csv]\n");
    return 2;
  }
  try {
    return study({argv + 1, argv + argc});
  } catch (const laban::base::Error& error) {
    std::fprintf(stderr, "manifold_study: %s\n", error.what());
    return 1;
  }
}
