#include "laban/manifold/pose_manifold.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/manifold/manifold_file.h"
#include "laban/manifold/map_path.h"
#include "laban/math/rotation.h"
#include "laban/motion/motion_quality.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/motion/root_motion.h"
#include "support/clip_measures.h"
#include "support/listener.h"

#include "samples.h"

namespace laban::manifold {
namespace {

using Eigen::Index;
using Eigen::Matrix2Xd;
using Eigen::Vector2d;

motion::Capture embedded(const std::string& name) {
  const std::string path = LABAN_SOURCE_DIR "/data/phrase/" + name + ".bvh";
  return motion::find_capture(io::read_clip(path).clip);
}

LearnOptions small() {
  LearnOptions options;
  options.som.rows = 20;
  options.som.columns = 20;
  options.som.epochs = 12;
  return options;
}

/// One manifold for all tests, as learning takes a while: of one walk twice, so that what each take
/// adds is known to be the same.
const LearnedManifold& walks() {
  static const LearnedManifold learned = [] {
    const std::vector<motion::Capture> captures = {embedded("phrase_walk_p01"),
                                                   embedded("phrase_walk_p01")};
    LearnOptions options;
    options.som.epochs = 15;
    return learn_manifold(captures, options);
  }();
  return learned;
}

TEST(PoseVector, IsFreeOfPlaceAndHeadingAndKeepsHeight) {
  motion::PoseMatrix pose = test::random_pose_matrix({.frames = 6});
  const Eigen::MatrixXd before = pose_vectors(pose);
  pose.steps.row(0).array() += 0.2;
  pose.steps.row(2).array() -= 0.4;
  EXPECT_EQ(pose_vectors(pose), before);
  pose.height.array() += 0.5;
  Eigen::MatrixXd risen = pose_vectors(pose) - before;
  for (int s = 0; s < motion::kStandardJointCount; ++s) {
    EXPECT_LT((risen.row(3 * s + 1).array() - 0.5 * motion::kStandardLegLengthM).abs().maxCoeff(),
              1e-12);
    risen.row(3 * s + 1).setZero();
  }
  EXPECT_LT(risen.cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(mean_joint_distance(before.col(0), before.col(0).array() + 1.0), std::sqrt(3.0),
              1e-12);
  EXPECT_THROW((void)mean_joint_distance(before.col(0), before.col(0).head(5)), base::Error);
}

TEST(PoseManifold, PosesOfTheTrainingTakeComeBackWithinThreeCentimetres) {
  EXPECT_LT(walks().report.reconstruction_m, 0.03);
  const motion::Capture capture = embedded("phrase_walk_p01");
  const motion::PoseMatrix pose = motion::to_pose_matrix(capture.clip, capture.humanoid);
  EXPECT_NEAR(reconstruction_error_m(walks().manifold, pose), walks().report.reconstruction_m,
              1e-9);
}

TEST(PoseManifold, APoseHasTheBonesOfTheBody) {
  const MapPose pose = pose_at(walks().manifold, {13.3, 40.7});
  const motion::Skeleton& body = *motion::standard_skeleton();
  for (int s = 1; s < motion::kStandardJointCount; ++s) {
    const double length =
        (pose.positions.col(s) -
         pose.positions.col(motion::kStandardParents[static_cast<std::size_t>(s)]))
            .norm();
    EXPECT_NEAR(length, body.joint(s).rest_offset.norm(), 1e-12);
  }
}

TEST(PoseManifold, TakesAreNotJoinedInTheChain) {
  const PoseManifold& manifold = walks().manifold;
  ASSERT_EQ(manifold.take_begins.size(), 2U);
  EXPECT_EQ(manifold.primitives.counts.sum(), static_cast<double>(manifold.points.cols() - 2));
  // The same take twice: every transition is there twice.
  EXPECT_EQ((manifold.primitives.counts * 0.5).array().floor().sum() * 2.0,
            manifold.primitives.counts.sum());
}

TEST(PoseManifold, ComparesThreeClusteringsAtTheElbow) {
  const LearnReport& report = walks().report;
  ASSERT_EQ(report.methods.size(), 3U);
  EXPECT_EQ(report.elbow_errors.size(), 30U);
  for (const ComparedClusters& one : report.methods) {
    EXPECT_GT(one.figures.separation, 0.0);
    EXPECT_GT(one.figures.within, 0.0);
  }
  EXPECT_EQ(report.methods[1].method, PrimitiveMethod::kFuzzyKMeans);
}

TEST(PoseManifold, ThePrincipalPlaneIsAMapToo) {
  LearnOptions options = small();
  options.kind = MapKind::kPca;
  options.primitives = 5;
  const std::vector<motion::Capture> captures = {embedded("phrase_walk_p02")};
  const LearnedManifold learned = learn_manifold(captures, options);
  EXPECT_EQ(learned.manifold.primitives.count(), 5);
  EXPECT_TRUE(learned.report.elbow_errors.empty());
  EXPECT_LT(learned.report.reconstruction_m, 0.10);
  // The paper's inverse by the affine part lands in the frame's half of the map: it is an
  // approximation.
  const motion::PoseMatrix pose = motion::to_pose_matrix(captures[0].clip, captures[0].humanoid);
  const Eigen::VectorXd vector = pose_vectors(pose).col(10);
  const Vector2d place = learned.manifold.place(vector);
  EXPECT_LT((place - learned.manifold.points.col(10)).norm(), 1e-9);  // sums in another order
  EXPECT_LT((learned.manifold.generator.affine_inverse(vector) - place).norm(), 10.0);
}

TEST(PoseManifold, OtherRigsAndRatesAreBroughtToTheFirst) {
  const motion::Capture first = embedded("phrase_walk_p03");
  motion::Capture other = test::random_capture({.frames = 50, .frame_rate_hz = 30.0});
  const std::vector<motion::Capture> captures = {first, other};
  const LearnedManifold learned = learn_manifold(captures, small());
  EXPECT_EQ(learned.manifold.rig.stance.joint_count(), first.clip.joint_count());
  const Eigen::Index others = learned.manifold.points.cols() - first.clip.frame_count();
  EXPECT_EQ(others, 1 + (other.clip.frame_count() - 1) * 2);  // 60 Hz
}

TEST(PoseManifold, OneFrameIsAMap) {
  motion::Capture capture = embedded("phrase_bow_p01");
  capture.clip = capture.clip.slice(0, 1);
  const LearnedManifold learned = learn_manifold({&capture, 1}, small());
  EXPECT_EQ(learned.manifold.primitives.count(), 1);
  base::Rng rng(1);
  WalkOptions walk;
  walk.seconds = 0.5;
  const MapPath path = markov_path(learned.manifold, {3.0, 4.0}, walk, rng);
  const motion::Clip clip = play(learned.manifold, path);
  EXPECT_EQ(clip.frame_count(), 31);
}

TEST(PoseManifold, RefusesWhatItCannotLearn) {
  EXPECT_THROW((void)learn_manifold({}), base::Error);
  const std::vector<motion::Capture> captures = {embedded("phrase_walk_p01")};
  LearnOptions options;
  options.primitives = 0;
  EXPECT_THROW((void)learn_manifold(captures, options), base::Error);
}

// ---- paths ----

TEST(MapPath, PassesItsPointsInTheFramesAskedFor) {
  Matrix2Xd places(2, 3);
  places << 10.0, 40.0, 20.0, 12.0, 31.0, 55.0;
  const MapPath path = path_through(walks().manifold, places, 80);
  ASSERT_EQ(path.points.cols(), 80);
  EXPECT_LT((path.points.col(0) - places.col(0)).norm(), 1e-9);
  EXPECT_LT((path.points.col(79) - places.col(2)).norm(), 1e-9);
  ASSERT_EQ(path.passed.size(), 3U);
  EXPECT_LT((path.points.col(path.passed[1]) - places.col(1)).norm(), 1.0);
  EXPECT_THROW((void)path_through(walks().manifold, places, 0), base::Error);
  EXPECT_EQ(path_through(walks().manifold, places.leftCols(1)).points.cols(), 1);
}

TEST(MapPath, PlaysWithConstantBonesAndWithoutFlips) {
  Matrix2Xd places(2, 4);
  places << 0.0, 64.0, 5.0, 60.0, 0.0, 64.0, 60.0, 5.0;
  const motion::Clip clip = play(walks().manifold, path_through(walks().manifold, places));
  EXPECT_LE(test::bone_length_spread_m(clip), 1e-6);
  EXPECT_LT(test::largest_turn(clip), 0.5);  // radians in 1/60 s
}

TEST(MapPath, TheTrainingPathGivesTheCaptureBack) {
  const PoseManifold& manifold = walks().manifold;
  const motion::Capture capture = embedded("phrase_walk_p01");
  const MapPath path = path_along(manifold, manifold.points.leftCols(capture.clip.frame_count()));
  const motion::Clip clip = play(manifold, path, {.lock_feet = false});
  const motion::Clip still = motion::in_place(clip, capture.humanoid);
  ASSERT_EQ(clip.frame_count(), capture.clip.frame_count());
  // Travel: as far as the capture goes, within a quarter.
  const auto length = [](const motion::Clip& c) {
    const Eigen::Vector3d way =
        c.root_positions().col(c.frame_count() - 1) - c.root_positions().col(0);
    return std::hypot(way.x(), way.z());
  };
  EXPECT_NEAR(length(clip), length(capture.clip), 0.25 * length(capture.clip));
  EXPECT_LE(test::bone_length_spread_m(still), 1e-6);
}

double jerk_of(const motion::Clip& clip, const motion::Capture& capture) {
  return motion::measure_quality(clip, capture.humanoid, motion::FootFloor{}).jerk_m_s3;
}

TEST(MapPath, APathThroughEveryFrameDoesNotJitterAsOneOnNodesDoes) {
  const PoseManifold& manifold = walks().manifold;
  const motion::Capture capture = embedded("phrase_walk_p01");
  const Eigen::MatrixXd vectors =
      pose_vectors(motion::to_pose_matrix(capture.clip, capture.humanoid));
  MapPath on_nodes;
  on_nodes.points = manifold.nodes(vectors);
  const double jitter = jerk_of(play(manifold, on_nodes), capture);
  const Matrix2Xd points = manifold.points.leftCols(vectors.cols());
  EXPECT_LT(jerk_of(play(manifold, path_along(manifold, points)), capture), 0.25 * jitter);
  const MapPath through = path_through(manifold, points);
  EXPECT_LT(jerk_of(play(manifold, through), capture), 0.7 * jitter);
  // As fast as the capture, within a quarter.
  EXPECT_NEAR(static_cast<double>(through.points.cols()), static_cast<double>(points.cols()),
              0.25 * static_cast<double>(points.cols()));
}

// Nodes are a node apart: frames on them would be off by up to half of one.
TEST(PoseManifold, FramesLieBetweenNodesWhereThePoseIsNearest) {
  const PoseManifold& manifold = walks().manifold;
  const motion::Capture capture = embedded("phrase_walk_p01");
  const Eigen::MatrixXd vectors =
      pose_vectors(motion::to_pose_matrix(capture.clip, capture.humanoid));
  const auto error = [&](const Matrix2Xd& points) {
    const Eigen::MatrixXd poses = manifold.generator.at_all(points, kPoseRowCount);
    return (poses - vectors).colwise().norm().mean();
  };
  const Matrix2Xd nodes = manifold.nodes(vectors);
  const Matrix2Xd places = manifold.places(vectors);
  EXPECT_LT(error(places), 0.5 * error(nodes));
  EXPECT_LE((places - nodes).cwiseAbs().maxCoeff(), 4.0);
  EXPECT_EQ(places, manifold.points.leftCols(places.cols()));
}

TEST(MapPath, AWalkTravelsAsFastAsTheCapture) {
  const PoseManifold& manifold = walks().manifold;
  const motion::Capture capture = embedded("phrase_walk_p01");
  base::Rng rng(3);
  const motion::Clip clip =
      play(manifold, markov_path(manifold, manifold.points.col(0), {.seconds = 6.0}, rng));
  EXPECT_NEAR(test::travel_speed_m_s(clip), test::travel_speed_m_s(capture.clip),
              0.25 * test::travel_speed_m_s(capture.clip));
}

TEST(MapPath, WalkingAndPlayingTellProgressAndCanBeStopped) {
  const PoseManifold& manifold = walks().manifold;
  const Eigen::Vector2d start = manifold.points.col(0);
  MapPath path;
  test::expect_told_and_stopped(3, [&](base::Progress* progress) {
    base::Rng rng(3);
    path = markov_path(manifold, start, {.seconds = 60.0}, rng, progress);
  });
  test::expect_told_and_stopped(
      static_cast<int>(path.points.cols()),
      [&](base::Progress* progress) { (void)play(manifold, path, {}, progress); });
}

TEST(MapPath, AFlipOfAFreeJointDoesNotComeThrough) {
  motion::Capture capture = embedded("phrase_walk_p01");
  const int toe = capture.clip.joint_count() - 1;
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < capture.clip.frame_count(); ++f) {
    const auto frame = capture.clip.rotations(f);
    rotations.insert(rotations.end(), frame.begin(), frame.end());
    // Any joint may flip: a half turn at every twentieth frame.
    if (f % 20 == 10) {
      rotations.back() = rotations.back() * Eigen::Quaterniond(0.0, 0.0, 1.0, 0.0);
    }
  }
  capture.clip = motion::Clip(capture.clip.shared_skeleton(), capture.clip.frame_rate_hz(),
                              capture.clip.root_positions(), std::move(rotations));
  EXPECT_GT(test::largest_turn(capture.clip), 2.0);
  const LearnedManifold learned = learn_manifold({&capture, 1}, small());
  const PoseManifold& manifold = learned.manifold;
  const motion::Clip clip = play(manifold, path_along(manifold, manifold.points));
  double largest = 0.0;
  for (int f = 1; f < clip.frame_count(); ++f) {
    largest =
        std::max(largest, math::angle_between(clip.rotation(f - 1, toe), clip.rotation(f, toe)));
  }
  EXPECT_LT(largest, 0.3);  // 12 rad/s at 60 Hz is .2
}

TEST(MapPath, AWalkOverPrimitivesFillsItsTimeAndRepeatsForASeed) {
  WalkOptions options;
  options.seconds = 6.0;
  options.perturb = 0.1;
  const Vector2d start = walks().manifold.points.col(0);
  base::Rng one(3), same(3), other(4);
  const MapPath path = markov_path(walks().manifold, start, options, one);
  EXPECT_EQ(path.points.cols(), 361);
  EXPECT_LT((path.points.col(0) - start).norm(), 1e-9);
  EXPECT_EQ(markov_path(walks().manifold, start, options, same).points, path.points);
  EXPECT_EQ(path.primitives.front(), walks().manifold.primitive_at(start));
  options.seconds = 0.0;
  EXPECT_THROW((void)markov_path(walks().manifold, start, options, other), base::Error);
}

TEST(MapPath, ContactsHoldTheFeetAndNoneStaysInPlace) {
  const PoseManifold& manifold = walks().manifold;
  base::Rng rng(1);
  WalkOptions options;
  options.seconds = 3.0;
  const MapPath path = markov_path(manifold, manifold.points.col(0), options, rng);
  const motion::Clip still = play(manifold, path, {.travel = Travel::kNone});
  EXPECT_LT(still.root_positions().row(2).cwiseAbs().maxCoeff(), 0.15);
  const motion::Clip travels = play(manifold, path);
  EXPECT_GT(travels.root_positions().row(2).maxCoeff(), 0.5);
  const motion::Clip own = play(manifold, path, {.travel = Travel::kPrimitives});
  EXPECT_GT(own.root_positions().row(2).maxCoeff(), 0.5);
}

// ---- files ----

TEST(ManifoldFile, ComesBackAsItWas) {
  const std::string bytes = write_manifold(walks().manifold);
  const PoseManifold back = read_manifold(bytes, "walk.manifold");
  EXPECT_EQ(write_manifold(back), bytes);
  EXPECT_EQ(back.points, walks().manifold.points);
  EXPECT_EQ(back.primitives.labels, walks().manifold.primitives.labels);
  const Vector2d point(20.5, 31.25);
  EXPECT_EQ(pose_at(back, point).positions, pose_at(walks().manifold, point).positions);
}

// tests/manifold/files/version_1.manifold was written when version 1 of the format was the newest.
TEST(ManifoldFile, FilesOfVersionOneAreRead) {
  const PoseManifold manifold = read_manifold(
      base::read_file(LABAN_SOURCE_DIR "/tests/manifold/files/version_1.manifold"), "version_1");
  EXPECT_EQ(manifold.som.rows, 4);
  EXPECT_EQ(manifold.points.cols(), 148);
  EXPECT_EQ(manifold.primitives.centers.cols(), 2);
}

TEST(ManifoldFile, DamageIsRefusedByName) {
  const std::string bytes = write_manifold(walks().manifold);
  EXPECT_THROW((void)read_manifold("", "x.manifold"), base::Error);
  for (std::size_t at = 9; at < bytes.size(); at += bytes.size() / 37) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x20);
    try {
      (void)read_manifold(damaged, "x.manifold");
      ADD_FAILURE() << "byte " << at;
    } catch (const base::Error& error) {
      EXPECT_EQ(error.kind(), base::ErrorKind::kFormat);
      EXPECT_THAT(error.what(), ::testing::StartsWith("x.manifold: "));
    }
    EXPECT_THROW((void)read_manifold(bytes.substr(0, at), "x.manifold"), base::Error);
  }
}

}  // namespace
}  // namespace laban::manifold
