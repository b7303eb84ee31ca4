#include "laban/effort/observer.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>

#include "laban/base/error.h"
#include "laban/io/bvh.h"
#include "laban/math/statistics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/retarget.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::effort {
namespace {

using ::testing::ElementsAre;

constexpr double kPi = std::numbers::pi;

/// A T-pose whose root is `height_m` above ground and has gone `forward_m` at each time, metres.
motion::PoseMatrix moving_statue(int frames, double rate_hz,
                                 const std::function<double(double)>& forward_m,
                                 const std::function<double(double)>& height_m) {
  motion::PoseMatrix pose;
  pose.frame_rate_hz = rate_hz;
  pose.leg_length_m = 0.9;
  pose.angles = Eigen::MatrixXd::Zero(motion::kAngleRowCount, frames);
  pose.height.resize(frames);
  Eigen::Matrix3Xd path = Eigen::Matrix3Xd::Zero(3, frames);
  for (int f = 0; f < frames; ++f) {
    path(1, f) = forward_m(f / rate_hz) / motion::kStandardLegLengthM;
    pose.height(f) = height_m(f / rate_hz) / motion::kStandardLegLengthM;
  }
  pose.steps = motion::planar_steps(path);
  return pose;
}

motion::PoseMatrix statue(int frames) {
  return moving_statue(
      frames, 30.0, [](double) { return 0.0; }, [](double) { return 1.0; });
}

/// Arms and trunk that swing as sines of several frequencies, the same motion at any rate.
motion::PoseMatrix swing(double rate_hz, double duration_s, double tempo = 1.0) {
  const int frames = static_cast<int>(std::lround(duration_s * rate_hz)) + 1;
  motion::PoseMatrix pose = moving_statue(
      frames, rate_hz, [&](double t) { return 0.4 * tempo * t; },
      [&](double t) { return 1.0 + 0.05 * std::sin(2.0 * kPi * 0.9 * tempo * t); });
  for (int f = 0; f < frames; ++f) {
    const double t = tempo * f / rate_hz;
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      pose.angles(3 * s, f) = 0.5 * std::sin(2.0 * kPi * (0.3 + 0.04 * s) * t + s);
      pose.angles(3 * s + 2, f) = 0.3 * std::sin(2.0 * kPi * (0.7 - 0.02 * s) * t - s);
    }
  }
  return pose;
}

// By hand: all parts slide at speed v. E = v^2; each part's mean |a| is its floor of 0.4 m/s^2;
// nothing is uneven or simultaneous, and the stillness is exp(-(v / (v / 2 + 0.03))^2), over 0.03.
TEST(Observer, ASlideAtConstantSpeedIsAsWorkedByHand) {
  const double v = 0.8;
  const auto d = describe(moving_statue(
      90, 30.0, [&](double t) { return v * t; }, [](double) { return 1.0; }));
  EXPECT_NEAR(d.weight, std::log(v * v + 1e-4), 1e-3);  // the filter leaves 1e-4 at the ends
  EXPECT_NEAR(d.time, std::log(0.4 / std::sqrt(v * v + 0.05 * 0.05)), 1e-2);
  EXPECT_NEAR(d.flow, std::exp(-std::pow(v / (0.5 * v + 0.03), 2)) / 0.03, 1e-2);
}

// By hand: height A sin(w t) with E = (A w cos(w t))^2, whose power mean of order 2 is
// (A w)^2 sqrt(3/8); and mean |a| / mean |v| = w.
TEST(Observer, ASineIsAsWorkedByHand) {
  for (const double rate : {30.0, 60.0, 120.0}) {
    SCOPED_TRACE(rate);
    const double amplitude = 0.5, w = 2.0 * kPi * 1.0;
    const auto d = describe(moving_statue(
        static_cast<int>(10.0 * rate) + 1, rate, [](double) { return 0.0; },
        [&](double t) { return 1.0 - amplitude * std::cos(w * t); }));
    EXPECT_NEAR(d.weight, std::log(std::pow(amplitude * w, 2) * std::sqrt(3.0 / 8.0)), 0.02);
    EXPECT_NEAR(d.time, std::log(w), 0.03);  // floors and what 4 Hz takes from 1 Hz at the ends
  }
}

TEST(Observer, PlayingFasterIsStrongerAndMoreSuddenByTheLawsOfScale) {
  const Descriptors slow = describe(swing(60.0, 12.0, 1.0));
  const Descriptors fast = describe(swing(60.0, 8.0, 1.5));
  EXPECT_NEAR(fast.weight - slow.weight, 2.0 * std::log(1.5), 0.05);
  EXPECT_NEAR(fast.time - slow.time, std::log(1.5), 0.12);  // floors pull towards each other
  EXPECT_NEAR(fast.flow, slow.flow, 1.0);  // tempo is no hesitation: contents differ by 5 to 15
}

TEST(Observer, TheFrameRateDoesNotShow) {
  const Descriptors at_30 = describe(swing(30.0, 5.0));
  for (const double rate : {60.0, 120.0}) {
    const Descriptors d = describe(swing(rate, 5.0));
    // A thirtieth of a usual deviation (Flow 1, Weight 0.8, Time 0.17).
    EXPECT_NEAR(d.flow, at_30.flow, 0.1) << rate;
    EXPECT_NEAR(d.weight, at_30.weight, 0.02) << rate;
    EXPECT_NEAR(d.time, at_30.time, 0.01) << rate;
  }
}

TEST(Observer, TheBodysSizeAndWhereItFacesDoNotMatter) {
  motion::PoseMatrix pose = swing(30.0, 3.0);
  const Descriptors d = describe(pose);
  pose.leg_length_m = 0.3;
  EXPECT_EQ(describe(pose), d);
  // Heading: the same root path in the character's frame, hips turned by a constant heading, is the
  // same pose matrix by construction; a turned start has no place in it.
  motion::PoseMatrix mirrored = pose;  // Left and right exchanged: as strong, as sudden, as free.
  const auto swap = [&](motion::StandardJoint left, motion::StandardJoint right) {
    const int l = 3 * motion::index_of(left), r = 3 * motion::index_of(right);
    const Eigen::MatrixXd kept = mirrored.angles.middleRows<3>(l);
    mirrored.angles.middleRows<3>(l) = mirrored.angles.middleRows<3>(r);
    mirrored.angles.middleRows<3>(r) = kept;
  };
  using enum motion::StandardJoint;
  for (int k = 0; k < 4; ++k) {
    const auto next = [&](motion::StandardJoint joint) {
      return static_cast<motion::StandardJoint>(motion::index_of(joint) + k);
    };
    swap(next(kLeftClavicle), next(kRightClavicle));
    swap(next(kLeftThigh), next(kRightThigh));
  }
  for (int s = 0; s < motion::kStandardJointCount; ++s) {
    mirrored.angles.middleRows<2>(3 * s + 1) *= -1.0;  // reflection in x = 0
  }
  mirrored.steps.row(0) *= -1.0;
  mirrored.steps.row(2) *= -1.0;
  const Descriptors m = describe(mirrored);
  EXPECT_NEAR(m.flow, d.flow, 1e-9);
  EXPECT_NEAR(m.weight, d.weight, 1e-9);
  EXPECT_NEAR(m.time, d.time, 1e-9);
}

TEST(Observer, PlayingBackwardsChangesNothing) {
  motion::PoseMatrix pose = swing(30.0, 4.0);
  const Descriptors d = describe(pose);
  pose.angles = pose.angles.rowwise().reverse().eval();
  pose.height = pose.height.reverse().eval();
  const Eigen::Matrix3Xd path = motion::planar_path(pose);
  pose.steps = motion::planar_steps(path.rowwise().reverse());
  const Descriptors backwards = describe(pose);
  EXPECT_NEAR(backwards.flow, d.flow, 1e-3);  // the filter's start-up differs at the ends
  EXPECT_NEAR(backwards.weight, d.weight, 1e-3);
  EXPECT_NEAR(backwards.time, d.time, 1e-3);
}

TEST(Observer, StopAndGoIsMoreBoundThanGoingOn) {
  const auto forward = [](double depth) {
    return describe(moving_statue(
        181, 30.0,
        [depth](double t) { return 0.6 * (t - depth * std::sin(2.0 * kPi * t) / (2.0 * kPi)); },
        [](double) { return 1.0; }));
  };
  EXPECT_GT(forward(0.5).flow, forward(0.0).flow + 0.5);
  EXPECT_GT(forward(1.0).flow, forward(0.5).flow + 0.5);
}

TEST(Observer, MovingAsOneIsMoreBoundThanMovingInSuccession) {
  // Both arms, both legs and the head go through one bump each, at once or one after another.
  const auto bumps = [](double delay_s) {
    motion::PoseMatrix pose = statue(181);
    const motion::StandardJoint joints[] = {
        motion::StandardJoint::kLeftUpperArm, motion::StandardJoint::kRightUpperArm,
        motion::StandardJoint::kLeftThigh, motion::StandardJoint::kRightThigh,
        motion::StandardJoint::kNeck};
    for (int k = 0; k < 5; ++k) {
      for (int f = 0; f < 181; ++f) {
        const double t = f / 30.0 - 1.5 - delay_s * k;
        pose.angles(3 * motion::index_of(joints[k]), f) = std::exp(-8.0 * t * t);
      }
    }
    return describe(pose);
  };
  EXPECT_GT(bumps(0.0).flow, bumps(0.6).flow + 0.5);
}

TEST(Observer, ShortAndStillClipsAreFinite) {
  for (const int frames : {1, 2, 3, 4, 5, 24}) {
    SCOPED_TRACE(frames);
    const Descriptors still = describe(statue(frames));
    EXPECT_NEAR(still.weight, std::log(1e-4), 1e-9);
    EXPECT_NEAR(still.time, std::log(8.0), 1e-9);
    EXPECT_NEAR(still.flow, 1.0 / 0.03, 1e-9);  // nothing but stillness
    const Descriptors moving =
        describe(test::random_pose_matrix({.frames = frames, .frame_rate_hz = 30.0}));
    EXPECT_TRUE(std::isfinite(moving.flow) && std::isfinite(moving.weight) &&
                std::isfinite(moving.time));
  }
  const motion::PoseMatrix slow = test::random_pose_matrix({.frames = 24, .frame_rate_hz = 5.0});
  EXPECT_TRUE(std::isfinite(describe(slow).time));  // too slow for either filter
}

void expect_error(const std::function<void()>& call, base::ErrorKind kind, const char* message) {
  try {
    call();
    ADD_FAILURE() << "nothing thrown; expected: " << message;
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), kind);
    EXPECT_STREQ(error.what(), message);
  }
}

TEST(Observer, RefusesWhatIsNoMovement) {
  using base::ErrorKind;
  motion::PoseMatrix pose = statue(5);
  pose.angles(7, 3) = std::numeric_limits<double>::quiet_NaN();
  expect_error([&] { (void)describe(pose); }, ErrorKind::kData,
               "observer: the pose matrix has values that are not finite");
  expect_error([] { (void)describe(motion::PoseMatrix{}); }, ErrorKind::kData,
               "observer: no frame (needs at least 1)");
  expect_error([] { (void)describe_over_time(statue(5), 0.0); }, ErrorKind::kUsage,
               "observer: window of 0.000000 s (must be positive and finite)");
  expect_error([] { (void)fit_observer_reference({}, {}); }, ErrorKind::kData,
               "observer reference: 0 fragments and 0 groups (must be as many, and at least one)");
  motion::PoseMatrix timeless = statue(5);
  timeless.frame_rate_hz = 0.0;
  expect_error([&] { (void)describe(timeless); }, ErrorKind::kUsage,
               "observer: frame rate of 0.000000 Hz (must be positive and finite)");
}

TEST(ObserverOverTime, AWindowOverTheWholeClipSeesTheWholeClip) {
  const motion::PoseMatrix pose = swing(30.0, 2.0);
  const Descriptors d = describe(pose);
  for (const double window : {4.2, 1e300}) {
    const Eigen::Matrix3Xd curve = describe_over_time(pose, window);
    ASSERT_EQ(curve.cols(), pose.frame_count());
    for (const int f : {0, 30, 60}) {
      EXPECT_NEAR(curve(0, f), d.flow, 1e-9);
      EXPECT_NEAR(curve(1, f), d.weight, 1e-9);
      EXPECT_NEAR(curve(2, f), d.time, 1e-9);
    }
  }
  EXPECT_TRUE(describe_over_time(statue(1)).allFinite());
  EXPECT_TRUE(describe_over_time(pose, 1e-9).allFinite());
}

TEST(ObserverOverTime, ABurstShowsWhereItIs) {
  const auto curve = describe_over_time(
      moving_statue(
          301, 30.0, [](double t) { return 0.5 / (1.0 + std::exp(-12.0 * (t - 7.0))); },
          [](double) { return 1.0; }),
      1.0);
  Eigen::Index at = 0;
  curve.row(1).maxCoeff(&at);
  EXPECT_NEAR(static_cast<double>(at) / 30.0, 7.0, 0.5);
  EXPECT_LT(curve(1, 60), curve(1, at) - 4.0);  // far from it the body rests
}

std::vector<Descriptors> on_line(const std::vector<double>& values) {
  std::vector<Descriptors> result;
  for (const double value : values) {
    Descriptors d;
    d.flow = value;
    d.weight = 10.0 * value;
    d.time = -value;
    result.push_back(d);
  }
  return result;
}

// By hand: group a has median 3 and MAD 1, b median 20 and MAD 2. All deviations inside the groups,
// -2 .. 2 and -4, -2 .. 4, have the sizes 0 0 1 1 2 2 2 2 4 4, so their MAD is 2. Pooled: the
// median lies between 5 and 16, the deviations from it
// are 5.5 5.5 6.5 7.5 7.5 8.5 9.5 9.5 11.5 13.5.
TEST(ObserverReference, CentersAndScalesAreAsWorkedByHand) {
  const auto descriptors = on_line({1, 2, 3, 4, 5, 16, 18, 20, 22, 24});
  std::vector<std::string> groups(5, "a");
  groups.resize(10, "b");
  const auto reference = fit_observer_reference(descriptors, groups);
  EXPECT_THAT(reference.groups, ElementsAre("a", "b"));
  ASSERT_EQ(reference.center.cols(), 3);
  EXPECT_EQ(reference.center(0, 0), 3.0);
  EXPECT_EQ(reference.center(1, 1), 200.0);
  EXPECT_EQ(reference.center(2, 2), -10.5);  // pooled: between 5 and 16
  // Five fragments borrow b = 4 / 8 of their squared scale.
  constexpr double kMad = 1.482602218505602;
  EXPECT_NEAR(reference.scale(0, 0), kMad * std::sqrt(0.5 * 1.0 + 0.5 * 4.0), 1e-12);
  EXPECT_NEAR(reference.scale(1, 1), 10.0 * kMad * std::sqrt(0.5 * 4.0 + 0.5 * 4.0), 1e-12);
  EXPECT_NEAR(reference.scale(0, 2), kMad * 8.0, 1e-12);
}

TEST(ObserverReference, EffortIsTheDeviationInTheGroupClipped) {
  ObserverReference reference;
  reference.groups = {"a"};
  reference.center = Eigen::Matrix3Xd::Zero(3, 2);
  reference.center.col(0) << 1.0, 2.0, 3.0;
  reference.scale = Eigen::Matrix3Xd::Ones(3, 2);
  reference.scale.col(0) << 2.0, 0.5, 1.0;
  Descriptors d;
  d.flow = 2.0;
  d.weight = 0.5;
  d.time = 3.0;
  const Observation known = observe(d, reference, "a");
  EXPECT_FALSE(known.pooled);
  EXPECT_NEAR(known.effort.flow, 1.5 * 0.5, 1e-15);
  EXPECT_NEAR(known.unclipped.weight, 1.5 * -3.0, 1e-15);
  EXPECT_EQ(known.effort.weight, -3.0);
  EXPECT_EQ(known.effort.time, 0.0);
  const Observation unknown = observe(d, reference, "b");
  EXPECT_TRUE(unknown.pooled);
  EXPECT_EQ(unknown.effort.flow, 3.0);
  EXPECT_EQ(unknown.effort.weight, 0.75);
  const motion::PoseMatrix pose = swing(30.0, 2.0);
  const Eigen::Matrix3Xd curve = observe_over_time(pose, reference, "a", 0.5);
  const Eigen::Matrix3Xd plain = describe_over_time(pose, 0.5);
  EXPECT_LE(curve.cwiseAbs().maxCoeff(), 3.0);
  EXPECT_NEAR(curve(2, 20), std::clamp(1.5 * (plain(2, 20) - 3.0), -3.0, 3.0), 1e-12);
}

TEST(ObserverReference, FewOrEqualFragmentsKeepAScale) {
  const auto one = fit_observer_reference(on_line({2}), std::vector<std::string>{"a"});
  EXPECT_GT(one.scale.minCoeff(), 0.0);
  EXPECT_EQ(observe(on_line({2})[0], one, "a").effort, Effort{});
  // A group of one takes the spread of the others.
  std::vector<std::string> groups(5, "a");
  groups.emplace_back("alone");
  const auto borrowed = fit_observer_reference(on_line({1, 2, 3, 4, 5, 9}), groups);
  EXPECT_NEAR(borrowed.scale(0, 1), 1.482602218505602, 1e-12);
  // Unnamed fragments belong to no group.
  const auto pooled = fit_observer_reference(on_line({1, 2}), std::vector<std::string>{"", ""});
  EXPECT_TRUE(pooled.groups.empty());
  EXPECT_EQ(pooled.center(0, 0), 1.5);
}

// DESIGN 6: pairwise |correlation| of the factors at most 0.5 on the shared captures, where mean
// acceleration and mean jerk correlate at 0.98.
TEST(Observer, FactorsDifferOnRealCaptures) {
  const char* root = std::getenv("LABAN_DATA");
  if (root == nullptr) GTEST_SKIP() << "LABAN_DATA is not set: no captures to measure";
  std::vector<Descriptors> descriptors;
  std::vector<std::string> contents;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(root) + "/bandai1")) {
    if (entry.path().extension() == ".bvh") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const auto& path : files) {
    std::ifstream file(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    const auto capture = motion::find_capture(io::read_bvh(text, path.string()).clip);
    descriptors.push_back(describe(motion::to_pose_matrix(capture.clip, capture.humanoid)));
    const std::string name = path.stem().string();
    const std::size_t begin = name.find('_') + 1;
    contents.push_back(name.substr(begin, name.find('_', begin) - begin));
  }
  ASSERT_EQ(descriptors.size(), 105u);
  const auto reference = fit_observer_reference(descriptors, contents);
  Eigen::MatrixXd labels(105, 3);
  for (int n = 0; n < 105; ++n) {
    const auto at = static_cast<std::size_t>(n);
    labels.row(n) = to_vector(observe(descriptors[at], reference, contents[at]).effort).transpose();
  }
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < a; ++b) {
      const Eigen::VectorXd x = labels.col(a), y = labels.col(b);
      EXPECT_LE(std::abs(math::pearson(math::as_span(x), math::as_span(y))), 0.5) << a << b;
    }
    const Eigen::VectorXd x = labels.col(a);
    EXPECT_GT(math::standard_deviation(math::as_span(x)), 1.0) << a;  // the scale is used
  }
}

}  // namespace
}  // namespace laban::effort
