#include "laban/effort/observer.h"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>

#include "laban/base/error.h"
#include "laban/motion/resample.h"
#include "laban/motion/standard_body.h"
#include "support/changed_motion.h"
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

/// The M-location in logs by bisection over plain sums: the oracle of typical values.
double typical_by_bisection(const std::vector<double>& values, const std::vector<double>& weights) {
  double low = -20.0, high = 20.0;
  for (int step = 0; step < 100; ++step) {
    const double middle = 0.5 * (low + high);
    double pull = 0.0;
    for (std::size_t n = 0; n < values.size(); ++n) {
      const double away = (std::log(values[n]) - middle) / 0.5;
      pull += weights[n] * away / std::sqrt(1.0 + away * away);
    }
    (pull > 0.0 ? low : high) = middle;
  }
  return std::exp(low);
}

// By hand: all parts slide at speed v. Relative to the pelvis nothing moves, which leaves the
// floors of Time, 0.01 m/s over 0.01 m; all windows have speed v, all moments are as much in
// motion.
TEST(Observer, ASlideAtConstantSpeedIsAsWorkedByHand) {
  const double v = 0.8;
  const auto d = describe(moving_statue(
      90, 30.0, [&](double t) { return v * t; }, [](double) { return 1.0; }));
  EXPECT_NEAR(d.time, 0.0, 1e-9);
  EXPECT_NEAR(d.weight, std::log(v * v + 1e-4), 1e-3);  // the filter leaves 1e-4 at the ends
  const double threshold = 0.36 * (v * v + 1e-4) + 4e-4;
  EXPECT_NEAR(d.flow, -std::log(1.0 - std::exp(-v * v / threshold) + 1e-3),
              1e-6);  // of the filter's ends
}

// Height -A cos(w t): every part moves at A w |sin| and is A |cos| from its middle, so Time is
// log w and a number, and the body's speed is the parts'.
TEST(Observer, ASineIsAsItsTypicalValuesSay) {
  const double amplitude = 0.5, w = 2.0 * kPi * 1.0;
  std::vector<double> speed, reach;
  for (int n = 0; n < 4000; ++n) {
    const double phase = 2.0 * kPi * (n + 0.5) / 4000.0;
    speed.push_back(std::hypot(amplitude * w * std::sin(phase), 0.01));
    reach.push_back(std::hypot(amplitude * std::cos(phase), 0.01));
  }
  const double pace = typical_by_bisection(speed, speed);
  const double time = std::log(pace / typical_by_bisection(reach, speed));
  for (const double rate : {30.0, 60.0, 120.0}) {
    SCOPED_TRACE(rate);
    const auto d = describe(moving_statue(
        static_cast<int>(10.0 * rate) + 1, rate, [](double) { return 0.0; },
        [&](double t) { return 1.0 - amplitude * std::cos(w * t); }));
    EXPECT_NEAR(d.time, time, 0.02);  // frames where the swing turns fall anywhere
    EXPECT_NEAR(d.weight, 2.0 * std::log(pace) - time, 0.02);
  }
}

TEST(Observer, PlayingFasterIsStrongerAndMoreSuddenByTheLawsOfScale) {
  const Descriptors slow = describe(swing(60.0, 12.0, 1.0));
  const Descriptors fast = describe(swing(60.0, 8.0, 1.5));
  EXPECT_NEAR(fast.weight - slow.weight, std::log(1.5), 0.02);
  EXPECT_NEAR(fast.time - slow.time, std::log(1.5), 0.02);
  EXPECT_NEAR(fast.flow, slow.flow, 0.02);  // tempo is no hesitation
}

TEST(Observer, TheFrameRateDoesNotShow) {
  const Descriptors at_30 = describe(swing(30.0, 5.0));
  for (const double rate : {60.0, 120.0}) {
    const Descriptors d = describe(swing(rate, 5.0));
    // A thirtieth of a usual deviation (Flow 0.2, Weight 0.8, Time 0.3).
    EXPECT_NEAR(d.flow, at_30.flow, 0.007) << rate;
    EXPECT_NEAR(d.weight, at_30.weight, 0.02) << rate;
    EXPECT_NEAR(d.time, at_30.time, 0.01) << rate;
  }
}

// A knee that flips, frames that leave a T-pose: a jump there and back in three frames moves no
// factor by more than a deviation, though the energy in it is far more than in all the rest.
TEST(Observer, AJumpOfTheCaptureHardlyShows) {
  const motion::PoseMatrix pose = swing(120.0, 4.0);
  const Descriptors d = describe(pose);
  motion::PoseMatrix jumps = pose;
  for (const int f : {240, 241, 242}) {
    jumps.angles(3 * motion::index_of(motion::StandardJoint::kRightThigh), f) += 1.5;
    jumps.angles(3 * motion::index_of(motion::StandardJoint::kLeftUpperArm) + 2, f) += 1.5;
  }
  const Descriptors j = describe(jumps);
  EXPECT_NEAR(j.flow, d.flow, 0.1);
  EXPECT_NEAR(j.weight, d.weight, 0.3);
  EXPECT_NEAR(j.time, d.time, 0.1);
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

TEST(Observer, OfJointPositionsIsThatOfTheMotionWhereverItStarts) {
  motion::PoseMatrix pose = swing(30.0, 3.0);
  pose.steps.row(0).setConstant(0.02);
  pose.steps.row(2).setConstant(0.01);
  const Descriptors d = describe(pose);
  EXPECT_EQ(describe(motion::standard_joint_positions(pose), pose.frame_rate_hz), d);
  const Descriptors turned =
      describe(motion::standard_joint_positions(pose, {3.0, -5.0, 2.0}), pose.frame_rate_hz);
  EXPECT_NEAR(turned.flow, d.flow, 1e-6);  // single precision of logs
  EXPECT_NEAR(turned.weight, d.weight, 1e-6);
  EXPECT_NEAR(turned.time, d.time, 1e-6);
  EXPECT_THROW((void)describe(Eigen::MatrixXd(63, 0), 30.0), base::Error);
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
  EXPECT_GT(forward(0.5).flow, forward(0.0).flow + 0.1);
  EXPECT_GT(forward(1.0).flow, forward(0.5).flow + 0.1);
}

// Law: rest for a share h of the time raises Flow by -log(1 - h) for the rest and by at most twice
// that for unevenness, whatever the movement, and leaves Weight and Time.
TEST(Observer, AHoldIsMoreBoundAndNeitherLighterNorMoreSustained) {
  // Two bumps of every joint, with a pause of `hold_s` between them.
  const auto held = [](double hold_s) {
    const int frames = 181 + static_cast<int>(std::lround(60.0 * hold_s));
    motion::PoseMatrix pose = moving_statue(
        frames, 60.0, [](double) { return 0.0; }, [](double) { return 1.0; });
    for (int f = 0; f < frames; ++f) {
      const double t = f / 60.0;
      const double first = t - 0.75, second = t - 2.25 - hold_s;
      for (int s = 0; s < motion::kStandardJointCount; ++s) {
        pose.angles(3 * s, f) = 0.4 * (std::exp(-16.0 * first * first) +  // rest from 0.6 s on
                                       std::exp(-16.0 * second * second));
      }
    }
    return describe(pose);
  };
  const Descriptors without = held(0.0);
  for (const double hold_s : {0.2, 0.5, 1.0, 3.0}) {
    SCOPED_TRACE(hold_s);
    const Descriptors with = held(hold_s);
    const double share = hold_s / (3.0 + hold_s);
    // Floors: 0.001 of the share in motion, and 0.01 m/s of path at rest.
    const double law = -std::log(1.0 - share);
    EXPECT_GT(with.flow - without.flow, law - 0.03);
    EXPECT_LT(with.flow - without.flow, 3.0 * law + 0.03);
    EXPECT_NEAR(with.weight, without.weight, 0.03);
    EXPECT_NEAR(with.time, without.time, 0.03);
  }
}

/// Down by 0.6 m in about a second about `middle_s`, amid sinking at `sinking` m/s.
motion::PoseMatrix one_stroke(int frames, double rate_hz, double middle_s, double sinking) {
  return moving_statue(
      frames, rate_hz, [](double) { return 0.0; },
      [&](double t) { return 1.0 - 0.3 * std::erf(2.0 * (t - middle_s)) - sinking * t; });
}

// A short hold in the midst of the only stroke: under a cutoff that follows the slow movement's
// rate (2.6 Hz here) it would slow the stroke by more than it adds rest, and Flow fall by 0.09.
TEST(Observer, AShortHoldInTheOnlyStrokeIsMoreBound) {
  for (const double rate : {30.0, 120.0}) {
    SCOPED_TRACE(rate);
    const int frames = static_cast<int>(4.0 * rate) + 1;
    const motion::PoseMatrix pose = one_stroke(frames, rate, 2.0, 0.075);
    const double plain = describe(pose).flow;
    for (const double where : {0.475, 0.5, 0.525}) {
      EXPECT_GT(describe(test::with_hold(pose, where, 0.2)).flow, plain + 0.04) << where;
    }
  }
}

// A clip that ends anywhere between two frames of the lower rate lasts there up to a frame less:
// on average over the four ends that are possible Flow is the same.
TEST(Observer, RestAtTheEndsOfAShortClipCountsAlikeAtAnyRate) {
  double change = 0.0;
  for (int frames = 241; frames < 245; ++frames) {
    const motion::PoseMatrix pose = one_stroke(frames, 120.0, 1.0, 0.0);
    change += 0.25 * (describe(motion::resample(pose, 30.0)).flow - describe(pose).flow);
  }
  EXPECT_NEAR(change, 0.0, 0.007);
}

TEST(Observer, ShortAndStillClipsAreFinite) {
  for (const int frames : {1, 2, 3, 4, 5, 24}) {
    SCOPED_TRACE(frames);
    const Descriptors still = describe(statue(frames));
    EXPECT_NEAR(still.weight, std::log(1e-4), 1e-6);
    EXPECT_NEAR(still.time, 0.0, 1e-6);
    EXPECT_NEAR(still.flow, std::log(1000.0), 1e-6);  // nothing but stillness
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

}  // namespace
}  // namespace laban::effort
