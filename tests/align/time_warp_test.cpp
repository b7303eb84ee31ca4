#include "laban/align/time_warp.h"

#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

namespace laban::align {
namespace {

using Path = std::vector<FramePair>;

/// A path of random steps that reaches (frames_i - 1, frames_j - 1); `run` makes long straight
/// runs.
Path random_path(int frames_i, int frames_j, double run, base::Rng& rng) {
  Path path = {{0, 0}};
  int kind = rng.index(3);
  while (path.back().p < frames_i - 1 || path.back().q < frames_j - 1) {
    if (rng.uniform() > run) kind = rng.index(3);
    FramePair next = path.back();
    if (next.p < frames_i - 1 && (kind != 1 || next.q == frames_j - 1)) ++next.p;
    if (next.q < frames_j - 1 && (kind != 0 || next.p == path.back().p)) ++next.q;
    path.push_back(next);
  }
  return path;
}

/// First clip i alone, then clip j alone.
Path corner_path(int frames_i, int frames_j) {
  Path path;
  for (int p = 0; p < frames_i; ++p) path.push_back({p, 0});
  for (int q = 1; q < frames_j; ++q) path.push_back({frames_i - 1, q});
  return path;
}

Path diagonal_path(int frames) {
  Path path;
  for (int n = 0; n < frames; ++n) path.push_back({n, n});
  return path;
}

Path swapped(Path path) {
  for (FramePair& cell : path) std::swap(cell.p, cell.q);
  return path;
}

Path reversed(const Path& path) {
  Path back;
  for (auto cell = path.rbegin(); cell != path.rend(); ++cell) {
    back.push_back({path.back().p - cell->p, path.back().q - cell->q});
  }
  return back;
}

std::vector<Path> awkward_paths() {
  base::Rng rng(3);
  std::vector<Path> paths = {corner_path(40, 40), corner_path(41, 11), swapped(corner_path(41, 11)),
                             diagonal_path(1),    diagonal_path(2),    corner_path(2, 5),
                             corner_path(5, 2),   diagonal_path(300)};
  for (int trial = 0; trial < 150; ++trial) {
    const int frames_i = 2 + rng.index(80);
    const int shortest = (frames_i - 1 + 3) / 4 + 1;
    const int longest = 4 * (frames_i - 1) + 1;
    const int frames_j = shortest + rng.index(longest - shortest + 1);
    paths.push_back(random_path(frames_i, frames_j, rng.uniform(), rng));
  }
  return paths;
}

TEST(TimeWarp, KeepsTheEndsAndTheSlopeLimit) {
  for (const double smoothing : {0.0, 4.0, 100.0}) {
    for (const Path& path : awkward_paths()) {
      const TimeWarp warp = warp_of_path(path, {.smoothing_frames = smoothing});
      const auto last = warp.knot_count() - 1;
      EXPECT_EQ(warp.p()(0), 0.0);
      EXPECT_EQ(warp.q()(0), 0.0);
      EXPECT_EQ(warp.p()(last), path.back().p);
      EXPECT_EQ(warp.q()(last), path.back().q);
      EXPECT_EQ(warp.frames_i(), path.back().p + 1);
      EXPECT_EQ(warp.frames_j(), path.back().q + 1);
      for (int n = 1; n <= last; ++n) {
        const double dp = warp.p()(n) - warp.p()(n - 1);
        const double dq = warp.q()(n) - warp.q()(n - 1);
        EXPECT_GE(dp, 0.2 - 1e-9);  // of a unit of p + q
        EXPECT_GE(dq, 0.2 - 1e-9);
        EXPECT_LE(dq, 4.0 * dp + 1e-9);
        EXPECT_LE(dp, 4.0 * dq + 1e-9);
      }
    }
  }
}

TEST(TimeWarp, TimeRunsStrictlyForwardForEveryAlpha) {
  for (const Path& path : awkward_paths()) {
    const TimeWarp warp = warp_of_path(path);
    for (double alpha = -0.25; alpha <= 1.25; alpha += 0.125) {
      for (int n = 1; n < warp.knot_count(); ++n) {
        const double dp = warp.p()(n) - warp.p()(n - 1);
        const double dq = warp.q()(n) - warp.q()(n - 1);
        ASSERT_GT((1.0 - alpha) * dp + alpha * dq, 0.04);  // at least 1/20 a unit of p + q
      }
      const auto points = warp.sample(alpha);
      for (std::size_t k = 1; k < points.size(); ++k) {
        ASSERT_GT(points[k].p, points[k - 1].p);
        ASSERT_GT(points[k].q, points[k - 1].q);
      }
    }
  }
}

TEST(TimeWarp, SamplesTheEndsExactlyAndTimeEvenly) {
  for (const Path& path : awkward_paths()) {
    const TimeWarp warp = warp_of_path(path);
    for (const double alpha : {-0.25, 0.0, 0.3, 1.0, 1.25}) {
      const auto points = warp.sample(alpha);
      ASSERT_EQ(static_cast<int>(points.size()), warp.frame_count(alpha));
      EXPECT_EQ(points.front().p, 0.0);
      EXPECT_EQ(points.back().p, path.back().p);
      EXPECT_EQ(points.back().q, path.back().q);
      const double length = (1.0 - alpha) * path.back().p + alpha * path.back().q;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const double tau = (1.0 - alpha) * points[k].p + alpha * points[k].q;
        const double even = points.size() == 1 ? 0.0
                                               : length * static_cast<double>(k) /
                                                     static_cast<double>(points.size() - 1);
        EXPECT_NEAR(tau, even, 1e-10);
      }
    }
  }
}

TEST(TimeWarp, AlphaZeroAndOneSampleWholeFrames) {
  for (const Path& path : awkward_paths()) {
    const TimeWarp warp = warp_of_path(path);
    const auto at_i = warp.sample(0.0);
    const auto at_j = warp.sample(1.0);
    ASSERT_EQ(static_cast<int>(at_i.size()), path.back().p + 1);
    ASSERT_EQ(static_cast<int>(at_j.size()), path.back().q + 1);
    for (std::size_t k = 0; k < at_i.size(); ++k) {
      EXPECT_NEAR(at_i[k].p, static_cast<double>(k), 1e-11);
    }
    for (std::size_t k = 0; k < at_j.size(); ++k) {
      EXPECT_NEAR(at_j[k].q, static_cast<double>(k), 1e-11);
    }
  }
}

TEST(TimeWarp, ExchangingTheClipsExchangesTheTimes) {
  for (const Path& path : awkward_paths()) {
    const TimeWarp a = warp_of_path(path);
    const TimeWarp b = warp_of_path(swapped(path)).swapped();
    EXPECT_LT((a.p() - b.p()).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_LT((a.q() - b.q()).cwiseAbs().maxCoeff(), 1e-10);
    for (const double alpha : {-0.25, 0.1, 0.5, 0.9, 1.25}) {
      EXPECT_EQ(a.frame_count(alpha), a.swapped().frame_count(1.0 - alpha));
    }
  }
}

TEST(TimeWarp, ReversingThePathReversesTheWarp) {
  for (const Path& path : awkward_paths()) {
    const TimeWarp forward = warp_of_path(path);
    const TimeWarp backward = warp_of_path(reversed(path));
    const Eigen::VectorXd mirrored = (path.back().p - backward.p().array()).reverse();
    EXPECT_LT((forward.p() - mirrored).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(TimeWarp, AClipAgainstItselfKeepsItsTime) {
  const TimeWarp warp = warp_of_path(diagonal_path(50));
  EXPECT_EQ(warp.p(), warp.q());
}

TEST(TimeWarp, ADiagonalPathStays) {
  Path path = {{0, 0}};
  for (int n = 0; n < 10; ++n) {
    const FramePair last = path.back();
    path.push_back({last.p + 1, last.q + 1});
  }
  const TimeWarp warp = warp_of_path(path, {.smoothing_frames = 0.0});
  for (const FramePair& cell : path) {
    const int u = cell.p + cell.q;
    EXPECT_EQ(warp.p()(u), cell.p);
    EXPECT_EQ(warp.q()(u), cell.q);
  }
}

// Oracle: the least-squares projection by Dykstra's alternating projections onto each bound
// |v(k + 1) - v(k)| <= 3/5 and the fixed ends, which converges to the nearest point of their
// intersection.
Eigen::VectorXd project_by_dykstra(const Eigen::VectorXd& y) {
  const auto count = y.size();
  Eigen::VectorXd v = y;
  Eigen::VectorXd corrections = Eigen::VectorXd::Zero(count - 1);
  for (int round = 0; round < 200000; ++round) {
    double moved = 0.0;
    for (Eigen::Index k = 0; k + 1 < count; ++k) {
      // Weights 0 at fixed ends: the projection moves only the free value.
      const bool left_free = k > 0;
      const bool right_free = k + 2 < count;
      const double share = (left_free ? 1.0 : 0.0) + (right_free ? 1.0 : 0.0);
      const double drift = v(k + 1) - v(k) + corrections(k) * share;
      const double change = std::clamp(drift, -0.6, 0.6) - drift;
      const double correction = share > 0.0 ? -change / share : 0.0;
      const double delta = corrections(k) - correction;
      if (left_free) v(k) -= delta;
      if (right_free) v(k + 1) += delta;
      corrections(k) = correction;
      moved = std::max(moved, std::abs(delta));
    }
    if (moved < 1e-13) break;
  }
  return v;
}

TEST(TimeWarp, IsTheLeastSquaresProjection) {
  base::Rng rng(11);
  for (int trial = 0; trial < 40; ++trial) {
    SCOPED_TRACE(trial);
    const int frames_i = 3 + rng.index(8);
    const int frames_j = std::min(3 + rng.index(8), 4 * (frames_i - 1));
    if (!blendable(frames_i, frames_j)) continue;
    const Path path = random_path(frames_i, frames_j, 0.8, rng);
    Eigen::VectorXd y = Eigen::VectorXd::Zero(frames_i + frames_j - 1);
    for (std::size_t n = 1; n < path.size(); ++n) {
      const int u = path[n].p + path[n].q;
      y(u) = path[n].q - path[n].p;
      if (u - path[n - 1].p - path[n - 1].q == 2) y(u - 1) = y(u);
    }
    const TimeWarp warp = warp_of_path(path, {.smoothing_frames = 0.0});
    const Eigen::VectorXd v = warp.q() - warp.p();
    EXPECT_LT((v - project_by_dykstra(y)).cwiseAbs().maxCoeff(), 1e-6);
  }
}

// Two slopes that are 0 but for round-off met on this path, and their quotient was not a number.
TEST(TimeWarp, SlopesThatMeetAtZeroLeaveTheTimesFinite) {
  Path path = {{0, 0}};
  for (const char step : std::string("ijddijjjiiiii")) {
    path.push_back({path.back().p + (step == 'j' ? 0 : 1), path.back().q + (step == 'i' ? 0 : 1)});
  }
  const TimeWarp warp = warp_of_path(path);
  EXPECT_EQ(warp.frames_i(), 10);
  EXPECT_EQ(warp.frames_j(), 7);
}

TEST(TimeWarp, AGentlerLimitHoldsWhereThePairAllowsIt) {
  for (const Path& path : awkward_paths()) {
    const double overall = static_cast<double>(std::max(path.back().p, path.back().q)) /
                           std::max(1, std::min(path.back().p, path.back().q));
    const double limit = std::max(2.0, overall);
    const TimeWarp warp = warp_of_path(path, {.max_slope = 2.0});
    for (int n = 1; n < warp.knot_count(); ++n) {
      const double dp = warp.p()(n) - warp.p()(n - 1);
      const double dq = warp.q()(n) - warp.q()(n - 1);
      EXPECT_LE(dq, limit * dp + 1e-9);
      EXPECT_LE(dp, limit * dq + 1e-9);
    }
  }
}

// Where a pair is almost as steep as the limit, knots of the projection gather so near to one
// another that round-off swaps them.
TEST(TimeWarp, LongPathsAlmostAsSteepAsTheLimitHaveOne) {
  constexpr double kSlope = 1.5;
  for (std::uint64_t stream = 1000; stream < 2500; ++stream) {  // six of these are such
    SCOPED_TRACE(stream);
    base::Rng rng = base::Rng::for_stream(5, stream);
    const int frames_i = 100 + rng.index(400);
    const int frames_j = 1 + static_cast<int>((frames_i - 1) * kSlope * rng.uniform(0.9, 1.0));
    const Path path = random_path(frames_i, frames_j, rng.uniform(), rng);
    EXPECT_NO_THROW(static_cast<void>(warp_of_path(path, {.max_slope = kSlope})));
  }
}

TEST(TimeWarp, OneFrameClips) {
  EXPECT_TRUE(blendable(1, 1));
  EXPECT_FALSE(blendable(1, 2));
  EXPECT_FALSE(blendable(0, 1));
  const TimeWarp warp = warp_of_path(diagonal_path(1));
  EXPECT_EQ(warp.frame_count(0.0), 1);
  EXPECT_EQ(warp.sample(0.5).size(), 1U);
  EXPECT_EQ(warp.solve(0.5, 3.0).p, 0.0);
}

TEST(TimeWarp, TheFrameCountIsTheRoundedMean) {
  const TimeWarp warp = warp_of_path(corner_path(40, 41));
  EXPECT_EQ(warp.frame_count(0.0), 40);
  EXPECT_EQ(warp.frame_count(0.5), 41);  // 40.5 rounds up
  EXPECT_EQ(warp.frame_count(0.49), 40);
  EXPECT_EQ(warp_of_path(corner_path(2, 5)).frame_count(-0.25), 2);  // mean 1.25, at least 2
}

TEST(TimeWarp, BlendableIsAFactorOfFourInDuration) {
  EXPECT_TRUE(blendable(11, 41));
  EXPECT_FALSE(blendable(11, 42));
  EXPECT_TRUE(blendable(41, 11));
  EXPECT_FALSE(blendable(42, 11));
}

template <typename Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const base::Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(TimeWarp, SaysWhatIsWrong) {
  using testing::HasSubstr;
  EXPECT_THAT(message_of([] { (void)warp_of_path(corner_path(11, 42)); }),
              HasSubstr("11 and 42 frames"));
  EXPECT_THAT(message_of([] {
                (void)warp_of_path(Path{{0, 0}, {2, 0}});
              }),
              HasSubstr("path cell 1 is (2, 0)"));
  EXPECT_THAT(message_of([] { (void)warp_of_path(Path{}); }), HasSubstr("begin at (0, 0)"));
  EXPECT_THAT(message_of([] { (void)warp_of_path(Path{{0, 0}, {-1, 0}}); }), HasSubstr("cell 1"));
  EXPECT_THAT(message_of([] { (void)warp_of_path(diagonal_path(2), {.smoothing_frames = -1.0}); }),
              HasSubstr("smoothing_frames = -1"));
  EXPECT_THAT(message_of([] { (void)warp_of_path(diagonal_path(2), {.max_slope = 5.0}); }),
              HasSubstr("max_slope = 5"));
  const TimeWarp warp = warp_of_path(diagonal_path(3));
  EXPECT_THAT(message_of([&] { (void)warp.sample(1.3); }), HasSubstr("alpha = 1.3"));
  EXPECT_THAT(message_of([&] { (void)warp.frame_count(std::numeric_limits<double>::quiet_NaN()); }),
              HasSubstr("alpha = nan"));
  const auto knots = [](double a, double b) { return Eigen::VectorXd(Eigen::Vector2d(a, b)); };
  EXPECT_THAT(message_of([&] { (void)TimeWarp(knots(0, 1), knots(0, 5)); }), HasSubstr("slope 5"));
  EXPECT_THAT(message_of([&] { (void)TimeWarp(knots(0, 1), knots(0, 0)); }), HasSubstr("knot 1"));
  EXPECT_THAT(message_of([&] { (void)TimeWarp(knots(1, 2), knots(0, 1)); }), HasSubstr("(0, 0)"));
  EXPECT_THAT(message_of([&] { (void)TimeWarp(knots(0, 1.5), knots(0, 1)); }),
              HasSubstr("whole frames"));
}

}  // namespace
}  // namespace laban::align
