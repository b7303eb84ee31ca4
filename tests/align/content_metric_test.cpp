#include "laban/align/content_metric.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "support/clips.h"

#include "align/content_rows.h"

namespace laban::align {
namespace {

using laban::test::random_pose_matrix;
using motion::PoseMatrix;

// Two contents by three performers: a smooth motion a content, smaller manners a performer.
struct Corpus {
  std::vector<PoseMatrix> poses;
  std::vector<int> groups;
  std::vector<int> performers;
};

// `second_take`: performer 0 does content 0 once more, in another manner.
Corpus small_corpus(bool second_take = false) {
  Corpus corpus;
  for (int group = 0; group < 2; ++group) {
    for (int performer = 0; performer < 3; ++performer) {
      const int frames = 30 + 4 * performer;
      PoseMatrix pose = random_pose_matrix(
          {.frames = frames, .seed = static_cast<unsigned>(group + 1), .amplitude_rad = 0.5});
      const auto manner = static_cast<unsigned>(10 + group * 3 + performer);
      pose.angles += 0.3 * random_pose_matrix({.frames = frames, .seed = manner}).angles;
      corpus.poses.push_back(pose);
      corpus.groups.push_back(group);
      corpus.performers.push_back(performer);
    }
  }
  if (second_take) {
    corpus.poses.push_back(corpus.poses[0]);
    corpus.poses.back().angles += 0.3 * random_pose_matrix({.frames = 30, .seed = 99}).angles;
    corpus.groups.push_back(0);
    corpus.performers.push_back(0);
  }
  return corpus;
}

TEST(OnBranchOf, UndoesAWholeTurnForAllFrames) {
  const PoseMatrix pose = random_pose_matrix({.frames = 30, .amplitude_rad = 0.4});
  Eigen::MatrixXd base = pose.angles;
  base.row(3).array() += 2.5;  // joint 1 swings about a pose 2.5 rad away
  Eigen::MatrixXd other = base;
  for (int t = 0; t < 30; ++t) {
    const Eigen::Vector3d r = base.col(t).segment<3>(3);
    other.col(t).segment<3>(3) = r - 2.0 * std::numbers::pi * r.normalized();
  }
  const Eigen::VectorXd reference = base.rowwise().mean();
  EXPECT_TRUE(on_branch_of(other, reference).isApprox(base, 1e-9));
  EXPECT_EQ(on_branch_of(base, reference), base);
}

TEST(OnBranchOf, AlsoTurnsAway) {
  Eigen::MatrixXd angles = Eigen::MatrixXd::Zero(63, 5);
  angles.row(6).setConstant(0.5);
  Eigen::VectorXd reference = Eigen::VectorXd::Zero(63);
  reference(6) = 0.4 + 2.0 * std::numbers::pi;
  EXPECT_NEAR(on_branch_of(angles, reference)(6, 3), 0.5 + 2.0 * std::numbers::pi, 1e-12);
}

TEST(OnBranchOf, KeepsTheRotationsAndTheContinuity) {
  PoseMatrix pose = random_pose_matrix({.frames = 40});
  pose.angles.row(30).array() += 4.0;  // beyond pi: the reference is nearer the other way round
  const Eigen::MatrixXd moved = on_branch_of(pose.angles, Eigen::VectorXd::Zero(63));
  for (int t = 0; t < 40; ++t) {
    for (int row = 0; row < 63; row += 3) {
      EXPECT_NEAR(math::angle_between(math::exp(moved.col(t).segment<3>(row)),
                                      math::exp(pose.angles.col(t).segment<3>(row))),
                  0.0, 1e-7);
      if (t > 0) {
        EXPECT_LT((moved.col(t) - moved.col(t - 1)).segment<3>(row).norm(), 1.0);
      }
    }
  }
  EXPECT_LT(moved.squaredNorm(), pose.angles.squaredNorm());
}

TEST(ContentMetric, RawFeaturesAreTheAngles) {
  const PoseMatrix pose = random_pose_matrix();
  EXPECT_EQ(ContentMetric::raw().features(pose, Eigen::VectorXd::Ones(63)), pose.angles);
}

// The scatter matrices by their definitions, with loops.
struct Scatter {
  Eigen::MatrixXd within = Eigen::MatrixXd::Zero(kContentRowCount, kContentRowCount);
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(kContentRowCount, kContentRowCount);
};

Eigen::MatrixXd rows_of(const PoseMatrix& pose) {
  Eigen::MatrixXd rows(kContentRowCount, pose.frame_count());
  rows << pose.angles, pose.height, joint_places(pose), travel(pose);
  return rows;
}

double frames_of(const Corpus& corpus, int group, int performer) {
  double frames = 0.0;
  for (std::size_t i = 0; i < corpus.poses.size(); ++i) {
    if (corpus.groups[i] == group && (performer < 0 || corpus.performers[i] == performer))
      frames += corpus.poses[i].frame_count();
  }
  return frames;
}

// Poses less their performer's mean, to which each of his two contents gives half.
std::vector<Eigen::MatrixXd> plain_rows(const Corpus& corpus) {
  std::vector<Eigen::MatrixXd> rows;
  for (std::size_t i = 0; i < corpus.poses.size(); ++i) {
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(kContentRowCount);
    for (std::size_t j = 0; j < corpus.poses.size(); ++j) {
      if (corpus.performers[j] != corpus.performers[i]) continue;
      mean += rows_of(corpus.poses[j]).rowwise().sum() /
              (2.0 * frames_of(corpus, corpus.groups[j], corpus.performers[j]));
    }
    rows.push_back(rows_of(corpus.poses[i]).colwise() - mean);
  }
  return rows;
}

Scatter plain_scatter(const Corpus& corpus) {
  const std::vector<Eigen::MatrixXd> rows = plain_rows(corpus);
  Scatter scatter;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(kContentRowCount);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double share = 0.5 / frames_of(corpus, corpus.groups[i], -1);
    mean += share * rows[i].rowwise().sum();
    scatter.total += share * rows[i] * rows[i].transpose();
  }
  scatter.total -= mean * mean.transpose();
  for (int group = 0; group < 2; ++group) {
    Eigen::MatrixXd within = Eigen::MatrixXd::Zero(kContentRowCount, kContentRowCount);
    double pairs = 0.0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = i + 1; j < rows.size(); ++j) {
        if (corpus.groups[i] != group || corpus.groups[j] != group ||
            corpus.performers[i] == corpus.performers[j])
          continue;
        const auto path = dtw(rows[i].topRows(63), rows[j].topRows(63)).path;
        for (const FramePair& pair : path) {
          const Eigen::VectorXd d = rows[i].col(pair.p) - rows[j].col(pair.q);
          within += d * d.transpose() / static_cast<double>(path.size());
        }
        pairs += 1.0;
      }
    }
    scatter.within += 0.5 * within / pairs;
  }
  return scatter;
}

TEST(FitContentMetric, IsTheLikelihoodRatioOfItsScatterMatrices) {
  const Corpus corpus = small_corpus(true);  // one performer's pair of takes does not count
  const double shrinkage = 0.2;
  const Scatter scatter = plain_scatter(corpus);
  Eigen::VectorXd ridge(kContentRowCount);
  ridge.head(63).setConstant(shrinkage * scatter.within.diagonal().head(63).mean());
  ridge[63] = shrinkage * scatter.within(63, 63) + 4e-4;
  ridge.segment(64, 60).setConstant(shrinkage * scatter.within.diagonal().segment(64, 60).mean());
  ridge.tail(2).setConstant(shrinkage * scatter.within.diagonal().tail(2).mean() + 2.5e-3);
  Eigen::MatrixXd within = (1.0 - shrinkage) * scatter.within;
  within.diagonal() += ridge;
  // By whitening S_w and clipping the eigenvalues of the whitened S_t, instead of the generalised
  // eigenproblem.
  const Eigen::LLT<Eigen::MatrixXd> llt(within);
  const Eigen::MatrixXd root = llt.matrixL();
  const Eigen::MatrixXd inverse_root = root.inverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> whitened(inverse_root * scatter.total *
                                                                inverse_root.transpose());
  const Eigen::VectorXd weight = (1.0 - 0.5 / whitened.eigenvalues().array().max(0.5)).matrix();
  const Eigen::MatrixXd expected = inverse_root.transpose() * whitened.eigenvectors() *
                                   weight.asDiagonal() * whitened.eigenvectors().transpose() *
                                   inverse_root;
  const ContentMetric metric =
      fit_content_metric(corpus.poses, corpus.groups, corpus.performers,
                         {.shrinkage = shrinkage, .dimensions = kContentRowCount});
  EXPECT_GT(weight.maxCoeff(), 0.5);  // there is something to find
  EXPECT_TRUE((metric.map().transpose() * metric.map()).isApprox(expected, 1e-6));
}

TEST(FitContentMetric, LeadingDimensionsAreThoseOfTheWholeMap) {
  const Corpus corpus = small_corpus();
  const ContentMetric all =
      fit_content_metric(corpus.poses, corpus.groups, corpus.performers, {.dimensions = 63});
  const ContentMetric few =
      fit_content_metric(corpus.poses, corpus.groups, corpus.performers, {.dimensions = 7});
  EXPECT_EQ(few.dimension_count(), 7);
  EXPECT_EQ(few.map(), all.map().topRows(7));
}

TEST(FitContentMetric, TellsContentsApartByHeightAlone) {
  Corpus corpus = small_corpus();
  for (std::size_t i = 0; i < corpus.poses.size(); ++i) {
    PoseMatrix& pose = corpus.poses[i];
    pose.angles = random_pose_matrix({.frames = pose.frame_count()}).angles;  // one pose for all
    if (corpus.groups[i] == 0) continue;
    for (int t = 0; t < pose.frame_count(); ++t)  // a squat
      pose.height[t] -= 0.3 * std::sin(std::numbers::pi * t / (pose.frame_count() - 1));
  }
  const ContentMetric metric = fit_content_metric(corpus.poses, corpus.groups, corpus.performers);
  EXPECT_GT(metric.map().col(63).norm(), 1.0);
}

TEST(FitContentMetric, GoesOnAfterACutWithTheNearestBranch) {
  PoseMatrix pose = random_pose_matrix({.frames = 40, .amplitude_rad = 0.3});
  pose.angles.row(3).array() += 2.5;
  const std::vector<PoseMatrix> poses = {pose};
  const ContentMetric metric = fit_content_metric(poses, {}, {});
  const Eigen::VectorXd mean = metric.mean_pose(poses);
  const Eigen::MatrixXd expected = metric.features(pose, mean);
  PoseMatrix cut = pose;  // what unwrapping makes of a cut: frame 20 stands elsewhere,
  cut.angles.col(20).segment<3>(3) = Eigen::Vector3d(0.0, -2.0, 0.0);
  for (int t = 21; t < 40; ++t) {  // and all after it is a whole turn away
    const Eigen::Vector3d r = pose.angles.col(t).segment<3>(3);
    cut.angles.col(t).segment<3>(3) = r - 2.0 * std::numbers::pi * r.normalized();
  }
  const Eigen::MatrixXd features = metric.features(cut, mean);
  EXPECT_TRUE(features.rightCols(19).isApprox(expected.rightCols(19), 1e-6));
}

TEST(FitContentMetric, ForgetsAPerformersConstantPosture) {
  const Corpus corpus = small_corpus();
  Corpus stooped = corpus;
  for (std::size_t i = 0; i < stooped.poses.size(); ++i) {
    if (stooped.performers[i] == 1) stooped.poses[i].angles.row(4).array() += 0.4;
  }
  const auto features = [](const Corpus& c) {
    const ContentMetric metric = fit_content_metric(c.poses, c.groups, c.performers);
    const std::vector<PoseMatrix> own = {c.poses[1], c.poses[4]};  // performer 1
    return metric.features(c.poses[1], metric.mean_pose(own));
  };
  // What is left: a posture moves where the limbs go by a little more than a constant.
  EXPECT_TRUE(features(stooped).isApprox(features(corpus), 0.1));
}

TEST(FitContentMetric, BringsContentsApartBetterThanRawAngles) {
  Corpus corpus = small_corpus();
  for (std::size_t i = 0; i < corpus.poses.size(); ++i) {
    corpus.poses[i].angles.row(10).array() += 1.0 * corpus.performers[i];  // posture confounds
  }
  const auto ratio = [&](const ContentMetric& metric) {
    double inside = 0.0;
    double between = 0.0;
    for (std::size_t i = 0; i < corpus.poses.size(); ++i) {
      for (std::size_t j = i + 1; j < corpus.poses.size(); ++j) {
        const double cost =
            dtw_cost(metric.features(corpus.poses[i], metric.mean_pose({&corpus.poses[i], 1})),
                     metric.features(corpus.poses[j], metric.mean_pose({&corpus.poses[j], 1})))
                .mean_cost();
        (corpus.groups[i] == corpus.groups[j] ? inside : between) += cost;
      }
    }
    return inside / between;
  };
  const ContentMetric learnt = fit_content_metric(corpus.poses, corpus.groups, corpus.performers);
  EXPECT_LT(ratio(learnt), 0.5 * ratio(ContentMetric::raw()));
}

TEST(FitContentMetric, IsTheSameForAnyNumberOfThreads) {
  const Corpus corpus = small_corpus();
  const auto map = [&](int threads) {
    return fit_content_metric(corpus.poses, corpus.groups, corpus.performers, {.threads = threads})
        .map();
  };
  EXPECT_EQ(map(1), map(4));
}

TEST(FitContentMetric, WithoutGroupsScalesEveryJointToItsSpread) {
  std::vector<PoseMatrix> poses = {random_pose_matrix({.frames = 200})};
  poses[0].angles.middleRows(0, 3) *= 5.0;
  poses[0].angles.bottomRows(3).setZero();  // a joint that the rig does not have
  const ContentMetric metric =
      fit_content_metric(poses, {}, {}, {.shrinkage = 0.0, .dimensions = 63});
  const Eigen::MatrixXd features = metric.features(poses[0], metric.mean_pose(poses));
  for (int row = 0; row < 60; row += 3) {
    EXPECT_NEAR(features.middleRows(row, 3).squaredNorm() / (3 * 200), 1.0, 1e-6) << row;
  }
  EXPECT_EQ(features.bottomRows(3).squaredNorm(), 0.0);
}

TEST(FitContentMetric, SurvivesFragmentsThatDoNotMove) {
  PoseMatrix still = random_pose_matrix({.frames = 4});
  still.angles.colwise() = still.angles.col(0).eval();
  const std::vector<PoseMatrix> poses(3, still);
  const ContentMetric metric =
      fit_content_metric(poses, std::vector<int>{0, 0, 1}, std::vector<int>{0, 1, 2});
  EXPECT_TRUE(metric.features(still, metric.mean_pose(poses)).allFinite());
}

template <typename Call>
std::string message_of(base::ErrorKind kind, const Call& call) {
  try {
    call();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), kind);
    return error.what();
  }
  return "nothing was thrown";
}

TEST(FitContentMetric, RefusesWhatItCannotLearnFrom) {
  const std::vector<PoseMatrix> poses(2, random_pose_matrix());
  const std::vector<int> three(3, 0);
  using base::ErrorKind;
  EXPECT_EQ(message_of(ErrorKind::kData, [] { (void)fit_content_metric({}, {}, {}); }),
            "fit_content_metric: no fragment");
  EXPECT_EQ(message_of(ErrorKind::kUsage, [&] { (void)fit_content_metric(poses, three, {}); }),
            "fit_content_metric: 3 groups for 2 fragments");
  EXPECT_THAT(message_of(ErrorKind::kUsage,
                         [&] { (void)fit_content_metric(poses, {}, {}, {.shrinkage = 2.0}); }),
              testing::StartsWith("ContentMetricOptions::shrinkage = 2"));
  EXPECT_EQ(message_of(ErrorKind::kUsage,
                       [&] { (void)fit_content_metric(poses, {}, {}, {.dimensions = 127}); }),
            "ContentMetricOptions::dimensions = 127 (must be 1 to 126)");
  EXPECT_THAT(
      message_of(ErrorKind::kData,
                 [] { ContentMetric(Eigen::MatrixXd::Zero(2, 60), Eigen::VectorXd::Zero(63)); }),
      testing::StartsWith("ContentMetric: map 2 x 60"));
}

}  // namespace
}  // namespace laban::align
