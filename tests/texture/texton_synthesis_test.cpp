#include "laban/texture/texton_synthesis.h"

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "known_dynamics.h"

namespace laban::texture {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A texton of m states in d observed numbers.
Texton known_texton(int d, int m, base::Rng& rng) {
  Texton texton;
  texton.mean = draw_noise(d, 1, 1.0, rng);
  texton.basis = MatrixXd(draw_noise(d, d, 1.0, rng).householderQr().householderQ()).leftCols(m);
  texton.dynamics = test::known_dynamics(m, rng);
  texton.residual_variance = 1e-4;
  return texton;
}

MatrixXd drawn_motion(const Texton& texton, int length, base::Rng& rng) {
  const int m = texton.dimension();
  const MatrixXd start = MatrixXd::Zero(m, length);
  const MatrixXd states = ConstrainedStates(texton.dynamics, length, {0, 1})
                              .solve(start, draw_noise(m, length - 2, 1.0, rng));
  const auto d = static_cast<int>(texton.mean.size());
  const MatrixXd rest = draw_noise(d, length, 0.01, rng);
  return ((texton.basis * states).colwise() + texton.mean) + rest -
         texton.basis * (texton.basis.transpose() * rest);
}

std::vector<PinnedFrame> pins_at(const MatrixXd& motion, const std::vector<int>& frames) {
  std::vector<PinnedFrame> pins;
  for (const int f : frames) pins.push_back({f, motion.col(f)});
  return pins;
}

TEST(TextonSynthesizer, MeetsItsEndsWhateverLiesOutsideTheBasis) {
  base::Rng rng(1);
  const std::vector<Texton> textons{known_texton(20, 6, rng)};
  const MatrixXd ends = draw_noise(20, 68, 0.5, rng);
  TextonSynthesizer synthesizer(textons);
  const MatrixXd y =
      synthesizer.synthesize(0, 68, pins_at(ends, {0, 1, 66, 67}), draw_noise(6, 66, 1.0, rng));
  for (const int f : {0, 1, 66, 67}) EXPECT_LE((y.col(f) - ends.col(f)).norm(), 1e-6);
  EXPECT_TRUE(y.allFinite());
  const MatrixXd middle = y.middleCols(33, 2);
  EXPECT_LE((reproject(textons[0], middle) - middle).norm(), 0.4)
      << "what the texton cannot show has gone by half way";
}

TEST(TextonSynthesizer, SolvesTheSameWithAFactorFoundAgain) {
  base::Rng rng(2);
  const std::vector<Texton> textons{known_texton(9, 3, rng), known_texton(9, 4, rng)};
  const MatrixXd ends = draw_noise(9, 30, 0.5, rng);
  const auto pins = pins_at(ends, {0, 1, 28, 29});
  const MatrixXd noise = draw_noise(3, 28, 1.0, rng);
  TextonSynthesizer synthesizer(textons);
  const MatrixXd first = synthesizer.synthesize(0, 30, pins, noise);
  static_cast<void>(synthesizer.synthesize(1, 30, pins, draw_noise(4, 28, 1.0, rng)));
  EXPECT_EQ(synthesizer.synthesize(0, 30, pins, noise), first);
  EXPECT_THROW(static_cast<void>(synthesizer.synthesize(2, 30, pins, noise)), base::Error);
}

/// How far the states move in all: what slow motion leaves as it is.
double way(const Texton& texton, const MatrixXd& y) {
  const MatrixXd x = texton.basis.transpose() * y;
  return (x.rightCols(x.cols() - 1) - x.leftCols(x.cols() - 1)).colwise().norm().sum();
}

// [Li02, Fig. 10]: a texton of 127 frames made 188 long moves on instead of slowing down.
TEST(TextonSynthesizer, AddsMotionWhereATextonLastsLonger) {
  base::Rng rng(7);
  const std::vector<Texton> textons{known_texton(20, 6, rng)};
  TextonSynthesizer synthesizer(textons);
  double drawn = 0.0;
  double longer = 0.0;
  for (int n = 0; n < 10; ++n) {
    const MatrixXd motion = drawn_motion(textons[0], 127, rng);
    std::vector<PinnedFrame> ends = pins_at(motion, {0, 1, 125, 126});
    ends[2].frame = 186;
    ends[3].frame = 187;
    drawn += way(textons[0], motion);
    longer += way(textons[0], synthesizer.synthesize(0, 188, ends, draw_noise(6, 186, 1.0, rng)));
  }
  EXPECT_NEAR(longer / drawn, 188.0 / 127.0, 0.2);
}

TEST(RampBetween, PassesItsValuesAndIsSmoothAndZeroElsewhere) {
  MatrixXd values(1, 5);
  values << 1.0, 1.2, -2.0, 0.5, 0.4;
  const std::vector<int> frames{0, 1, 100, 198, 199};
  const MatrixXd curve = ramp_between(200, frames, values, 30);
  for (std::size_t n = 0; n < frames.size(); ++n) {
    EXPECT_DOUBLE_EQ(curve(0, frames[n]), values(0, static_cast<Eigen::Index>(n)));
  }
  EXPECT_EQ(curve(0, 50), 0.0);
  EXPECT_EQ(curve(0, 140), 0.0);
  for (int f = 1; f + 1 < 200; ++f) {
    // The steepest cubic bends by 6 * 2 / 30^2 a frame^2 and 4 * 0.2 / 30 for its slope.
    EXPECT_LE(std::abs(curve(0, f + 1) - 2.0 * curve(0, f) + curve(0, f - 1)), 0.045) << f;
  }
}

TEST(RampBetween, JoinsRunsThatAreNearerThanTwoRamps) {
  MatrixXd values(1, 2);
  values << 1.0, 1.0;
  const MatrixXd curve = ramp_between(21, {0, 20}, values, 30);
  for (int f = 0; f <= 20; ++f) EXPECT_NEAR(curve(0, f), 1.0, 1e-12);
}

TEST(EditTexton, ChangesNothingWhereAFrameIsPinnedToItself) {
  base::Rng rng(3);
  const Texton texton = known_texton(20, 6, rng);
  const MatrixXd motion = drawn_motion(texton, 68, rng);
  const EditedTexton edited = edit_texton(texton, motion, pins_at(motion, {40}));
  EXPECT_LE((edited.observations - motion).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(edited.state_deviations, 0.0, 1e-6);
  EXPECT_EQ(edited.residual_deviations, 0.0);
}

TEST(EditTexton, HitsItsPinsKeepsItsEndsAndSaysHowFarOffTheyAre) {
  base::Rng rng(4);
  const Texton texton = known_texton(20, 6, rng);
  const MatrixXd motion = drawn_motion(texton, 68, rng);
  MatrixXd pinned = motion;
  pinned.col(40) += 0.02 * draw_noise(20, 1, 1.0, rng);
  const EditedTexton near = edit_texton(texton, motion, pins_at(pinned, {40}));
  EXPECT_LE((near.observations.col(40) - pinned.col(40)).norm(), 1e-9);
  for (const int f : {0, 1, 66, 67}) {
    EXPECT_LE((near.observations.col(f) - motion.col(f)).norm(), 1e-9);
  }
  EXPECT_FALSE(near.is_far_off());
  pinned.col(40).array() += 20.0;
  const EditedTexton far = edit_texton(texton, motion, pins_at(pinned, {40}));
  EXPECT_LE((far.observations.col(40) - pinned.col(40)).norm(), 1e-9);
  EXPECT_TRUE(far.is_far_off());
}

// What the deviations mean: pins drawn from the texton itself, given the rest, have one.
TEST(EditTexton, CallsAnOrdinaryVariationOneDeviation) {
  base::Rng rng(5);
  const Texton texton = known_texton(12, 5, rng);
  const int length = 40;
  double sum = 0.0;
  constexpr int kDraws = 300;
  const MatrixXd motion = drawn_motion(texton, length, rng);
  const std::vector<int> ends{0, 1, length - 2, length - 1};
  const MatrixXd states = texton.basis.transpose() * (motion.colwise() - texton.mean);
  const ConstrainedStates system(texton.dynamics, length, ends);
  const MatrixXd own = innovations(texton.dynamics, states);
  for (int n = 0; n < kDraws; ++n) {
    const MatrixXd other =
        system.solve(states, own + draw_noise(texton.dimension(), length - 2, 1.0, rng));
    MatrixXd goal = motion;
    goal.col(20) += texton.basis * (other.col(20) - states.col(20));
    sum += std::pow(edit_texton(texton, motion, pins_at(goal, {20})).state_deviations, 2);
  }
  EXPECT_NEAR(std::sqrt(sum / kDraws), 1.0, 0.1);
}

TEST(EditTexton, RefusesPinsOutsideAndMotionsTooShort) {
  base::Rng rng(6);
  const Texton texton = known_texton(8, 3, rng);
  const MatrixXd motion = drawn_motion(texton, 20, rng);
  const std::vector<PinnedFrame> outside{{20, motion.col(0)}};
  EXPECT_THROW(static_cast<void>(edit_texton(texton, motion, outside)), base::Error);
  const std::vector<PinnedFrame> small{{3, VectorXd::Zero(2)}};
  EXPECT_THROW(static_cast<void>(edit_texton(texton, motion, small)), base::Error);
  EXPECT_THROW(static_cast<void>(edit_texton(texton, motion.leftCols(4), {})), base::Error);
}

}  // namespace
}  // namespace laban::texture
