// Laws that the kinematic observer promises of any clip, held on the embedded corpus and, where
// LABAN_DATA names them, on real captures.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "laban/effort/observer.h"
#include "laban/io/clip_file.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "support/changed_motion.h"

namespace laban::effort {
namespace {

struct Take {
  std::string name;
  std::string content;
  motion::Capture capture;
  motion::PoseMatrix pose;
};

/// Every `step`-th motion file of a folder whose name begins with `prefix`; its content is the
/// field-th part of the name between underscores.
std::vector<Take> read_takes(const std::filesystem::path& folder, const std::string& prefix,
                             int field, std::size_t step) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(prefix) && io::is_motion_file(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Take> takes;
  for (std::size_t n = 0; n < files.size(); n += step) {
    motion::Capture capture = motion::find_capture(io::read_clip(files[n]).clip);
    motion::PoseMatrix pose = motion::to_pose_matrix(capture.clip, capture.humanoid);
    const std::string name = files[n].stem().string();
    std::size_t begin = 0;
    for (int k = 0; k < field; ++k) begin = name.find('_', begin) + 1;
    std::string content = name.substr(begin, name.find('_', begin) - begin);
    takes.push_back({name, std::move(content), std::move(capture), std::move(pose)});
  }
  return takes;
}

std::vector<Take> embedded() {
  return read_takes(std::filesystem::path(LABAN_SOURCE_DIR) / "data" / "phrase", "phrase_", 1, 1);
}

std::optional<std::filesystem::path> captures_root() {
  const char* root = std::getenv("LABAN_DATA");
  if (root == nullptr) return std::nullopt;
  return std::filesystem::path(root);
}

constexpr const char* kNoCaptures = "LABAN_DATA is not set: the law is not measured on captures";

std::vector<Take> bandai(const std::filesystem::path& root, std::size_t step = 1) {
  return read_takes(root / "bandai1", "dataset-1_", 1, step);
}

std::vector<Take> hdm05(const std::filesystem::path& root, std::size_t step = 1) {
  return read_takes(root / "hdm05", "HDM_", 2, step);
}

using Change = std::function<motion::PoseMatrix(const Take&)>;

std::vector<Descriptors> describe_all(const std::vector<Take>& takes, const Change& change) {
  std::vector<Descriptors> descriptors(takes.size());
  math::parallel_for(static_cast<int>(takes.size()), 2, [&](int n) {
    const auto at = static_cast<std::size_t>(n);
    descriptors[at] = describe(change(takes[at]));
  });
  return descriptors;
}

std::vector<Descriptors> describe_all(const std::vector<Take>& takes) {
  return describe_all(takes, [](const Take& take) { return take.pose; });
}

/// Played faster, by fewer frames or by the same at a higher rate, Time and Weight rise at every
/// step. Descriptors, not labels: at the ends of the scale labels could only stay.
void expect_rise_with_tempo(const std::vector<Take>& takes) {
  ASSERT_FALSE(takes.empty());
  for (const bool same_frames : {false, true}) {
    std::vector<Descriptors> before = describe_all(takes);
    for (const double tempo : {1.1, 1.25, 1.5, 2.0}) {
      const auto now = describe_all(takes, [&](const Take& take) {
        motion::PoseMatrix pose = take.pose;
        if (!same_frames) return test::faster(pose, tempo);
        pose.frame_rate_hz *= tempo;
        return pose;
      });
      for (std::size_t n = 0; n < takes.size(); ++n) {
        EXPECT_GT(now[n].time, before[n].time) << takes[n].name << " at " << tempo;
        EXPECT_GT(now[n].weight, before[n].weight) << takes[n].name << " at " << tempo;
      }
      before = now;
    }
  }
}

/// A hold anywhere raises Flow; two holds raise it more.
void expect_rise_with_holds(const std::vector<Take>& takes, const std::vector<double>& holds_s) {
  ASSERT_FALSE(takes.empty());
  const std::vector<Descriptors> plain = describe_all(takes);
  for (const double where : {0.1, 0.25, 0.5, 0.75, 0.9}) {
    std::vector<Descriptors> before = plain;
    for (const double hold_s : holds_s) {
      const auto now = describe_all(
          takes, [&](const Take& take) { return test::with_hold(take.pose, where, hold_s); });
      for (std::size_t n = 0; n < takes.size(); ++n) {
        EXPECT_GT(now[n].flow, before[n].flow)
            << takes[n].name << ", " << hold_s << " s at " << where;
      }
      before = now;
    }
  }
}

TEST(ObserverLaws, FasterPlayIsStrongerAndMoreSuddenInTheEmbeddedCorpus) {
  expect_rise_with_tempo(embedded());
}

TEST(ObserverLaws, HoldsAreMoreBoundInTheEmbeddedCorpus) {
  expect_rise_with_holds(embedded(), {0.2, 0.5, 1.0});
}

TEST(ObserverLaws, FasterPlayIsStrongerAndMoreSuddenInCaptures) {
  const auto root = captures_root();
  if (!root) GTEST_SKIP() << kNoCaptures;
  expect_rise_with_tempo(bandai(*root));
  expect_rise_with_tempo(hdm05(*root, 4));
  expect_rise_with_tempo(read_takes(*root / "cmu_dance", "m", 0, 8));
}

TEST(ObserverLaws, HoldsAreMoreBoundInCaptures) {
  const auto root = captures_root();
  if (!root) GTEST_SKIP() << kNoCaptures;
  expect_rise_with_holds(bandai(*root), {0.2, 0.5, 1.0});
  expect_rise_with_holds(hdm05(*root), {0.2, 0.5, 1.0});
}

/// Labels before clipping, 3 x N.
Eigen::Matrix3Xd labels_of(const std::vector<Descriptors>& descriptors,
                           const ObserverReference& reference, const std::vector<Take>& takes) {
  Eigen::Matrix3Xd labels(3, static_cast<Eigen::Index>(takes.size()));
  for (std::size_t n = 0; n < takes.size(); ++n) {
    labels.col(static_cast<Eigen::Index>(n)) =
        to_vector(observe(descriptors[n], reference, takes[n].content).unclipped);
  }
  return labels;
}

ObserverReference reference_of(const std::vector<Take>& takes,
                               const std::vector<Descriptors>& descriptors) {
  std::vector<std::string> groups;
  for (const Take& take : takes) groups.push_back(take.content);
  return fit_observer_reference(descriptors, groups);
}

/// Median and 95th percentile of a factor's change, in label units, at most the issue's.
void expect_small(const Eigen::Matrix3Xd& change, double median, double high, const char* what) {
  for (const Factor factor : kFactors) {
    const Eigen::VectorXd values = change.row(index_of(factor)).cwiseAbs().transpose();
    std::cout << what << ", " << name_of(factor) << ": median "
              << math::median(math::as_span(values)) << ", 95th percentile "
              << math::percentile(math::as_span(values), 95.0) << "\n";
    EXPECT_LE(math::median(math::as_span(values)), median) << what << name_of(factor);
    EXPECT_LE(math::percentile(math::as_span(values), 95.0), high) << what << name_of(factor);
  }
}

void expect_stable(const std::vector<Take>& takes) {
  const auto plain = describe_all(takes);
  const ObserverReference reference = reference_of(takes, plain);
  const Eigen::Matrix3Xd labels = labels_of(plain, reference, takes);
  const auto expect_unchanged = [&](const char* what, const Change& change) {
    expect_small(labels_of(describe_all(takes, change), reference, takes) - labels, 0.1, 0.3, what);
  };
  const auto changed_clip = [](const std::function<motion::Clip(const motion::Clip&)>& change) {
    return [change](const Take& take) {
      return motion::to_pose_matrix(change(take.capture.clip), take.capture.humanoid);
    };
  };
  for (const double rate : {30.0, 60.0, 120.0}) {
    expect_unchanged(
        (std::to_string(std::lround(rate)) + " Hz").c_str(),
        changed_clip([rate](const motion::Clip& clip) { return motion::resample(clip, rate); }));
  }
  expect_unchanged("elsewhere", changed_clip([](const motion::Clip& clip) {
                     return test::elsewhere(clip, 2.0, {3.0, 0.0, -5.0});
                   }));
  expect_unchanged("1 mm of noise",
                   [](const Take& take) { return test::with_noise(take.pose, 0.001); });
}

TEST(ObserverStability, RateHeadingPlaceAndNoiseHardlyMatterOnCaptures) {
  const auto root = captures_root();
  if (!root) GTEST_SKIP() << kNoCaptures;
  expect_stable(bandai(*root));
  expect_stable(hdm05(*root));  // takes of a second, at a quarter of their 120 Hz
}

TEST(ObserverStability, RateHeadingPlaceAndNoiseHardlyMatterInTheEmbeddedCorpus) {
  expect_stable(embedded());
}

// The same take in two public conversions: 31 joints or ASF/AMC, and 43 joints.
TEST(ObserverStability, AnotherRigHardlyMatters) {
  const auto root = captures_root();
  if (!root) GTEST_SKIP() << kNoCaptures;
  const std::vector<Take> corpus = bandai(*root);
  const ObserverReference reference = reference_of(corpus, describe_all(corpus));
  const Eigen::Index groups = reference.scale.cols() - 1;
  Eigen::Vector3d unit;  // of a usual group, as dances and kicks belong to none
  for (int f = 0; f < kFactorCount; ++f) {
    const Eigen::VectorXd scales = reference.scale.row(f).head(groups).transpose();
    unit[f] = math::median(math::as_span(scales)) / kEffortPerDeviation;
  }
  const auto measured = [&](const std::string& file) -> Eigen::Vector3d {
    const motion::Capture capture = motion::find_capture(io::read_clip(*root / file).clip);
    const Descriptors d = describe(motion::to_pose_matrix(capture.clip, capture.humanoid));
    return Eigen::Vector3d(d.flow, d.weight, d.time).cwiseQuotient(unit);
  };
  const std::array<std::array<const char*, 2>, 4> pairs = {{
      {"cmu_clips/ballet_05_02_expressive_arms_pirouette.bvh", "cmu_dance/modern_02.bvh"},
      {"cmu_clips/ballet_05_06_pirouettes_jete.bvh", "cmu_dance/modern_06.bvh"},
      {"cmu_clips/135_04.amc", "cmu_dance/martial_04.bvh"},
      {"cmu_clips/135_07.amc", "cmu_dance/martial_07.bvh"},
  }};
  std::vector<double> changes;
  for (const auto& pair : pairs) {
    const Eigen::Vector3d change = (measured(pair[1]) - measured(pair[0])).cwiseAbs();
    std::cout << pair[0] << ": " << change.transpose() << "\n";
    changes.insert(changes.end(), change.begin(), change.end());
  }
  EXPECT_LE(math::median(changes), 0.3);
  EXPECT_LE(math::percentile(changes, 95.0), 0.6);
}

// DESIGN 6: pairwise |rank correlation| of the factors at most 0.5, where mean acceleration and
// mean jerk correlate at 0.98; and the scale is used.
void expect_factors_differ(const std::vector<Take>& takes) {
  const auto plain = describe_all(takes);
  const Eigen::Matrix3Xd labels =
      labels_of(plain, reference_of(takes, plain), takes).cwiseMax(kEffortMin).cwiseMin(kEffortMax);
  for (int a = 0; a < kFactorCount; ++a) {
    const Eigen::VectorXd x = labels.row(a).transpose();
    EXPECT_GT(math::standard_deviation(math::as_span(x)), 1.0) << a;
    for (int b = 0; b < a; ++b) {
      const Eigen::VectorXd y = labels.row(b).transpose();
      EXPECT_LE(std::abs(math::spearman(math::as_span(x), math::as_span(y))), 0.5) << a << b;
    }
  }
}

TEST(Observer, FactorsDifferInTheEmbeddedCorpus) {
  expect_factors_differ(embedded());
}

TEST(Observer, FactorsDifferOnRealCaptures) {
  const auto root = captures_root();
  if (!root) GTEST_SKIP() << kNoCaptures;
  expect_factors_differ(bandai(*root));
  expect_factors_differ(hdm05(*root));
}

}  // namespace
}  // namespace laban::effort
