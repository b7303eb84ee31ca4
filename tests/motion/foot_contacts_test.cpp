#include "laban/motion/foot_contacts.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::motion {
namespace {

/// A walk told by its feet alone: each foot stands for 0.6 s and swings for 0.4 s, 1 m ahead and
/// 12 cm up, by curves at rest where they meet the ground; the right foot half a second later.
/// The heel stays 17 cm behind the toe.
constexpr double kStandS = 0.6;
constexpr double kSwingS = 0.4;

FootPaths walk(double rate_hz, double floor_m = 0.0, double seconds = 4.0) {
  FootPaths paths;
  paths.frame_rate_hz = rate_hz;
  const int frames = static_cast<int>(seconds * rate_hz) + 1;
  for (auto& path : paths.points) path.resize(3, frames);
  for (int f = 0; f < frames; ++f) {
    for (std::size_t side = 0; side < 2; ++side) {
      const double t = f / rate_hz + (side == 0 ? 0.0 : 0.5);
      const double cycle = std::floor(t / (kStandS + kSwingS));
      const double x = std::max(0.0, (t - cycle * (kStandS + kSwingS) - kStandS) / kSwingS);
      const double way = cycle + x * x * (3.0 - 2.0 * x);
      const double height = 0.12 * std::pow(std::sin(std::numbers::pi * x), 2);
      paths.points[2 * side + 1].col(f) << 0.1, floor_m + height, way;
      paths.points[2 * side].col(f) << 0.1, floor_m + 0.01 + height, way - 0.17;
    }
  }
  return paths;
}

/// Whether the left foot stands at a time, by construction.
bool stands(double t) {
  return t - std::floor(t) <= kStandS;
}

double mean_contact(const FootContacts& contacts) {
  return contacts.share.mean();
}

TEST(FootContacts, AreThoseOfAWalkThatIsKnown) {
  const FoundContacts found = find_foot_contacts(walk(60.0), kStandardLegLengthM);
  for (int f = 0; f < found.contacts.frame_count(); ++f) {
    const double t = f / 60.0;
    // Where a foot lifts or lands is told to within 0.08 s: its first 3 cm and 0.4 m/s count.
    const bool sure = stands(t - 0.08) == stands(t) && stands(t + 0.08) == stands(t);
    if (!sure) continue;
    EXPECT_EQ(found.contacts.touches(FootPoint::kLeftToe, f), stands(t)) << t;
    EXPECT_EQ(found.contacts.touches(FootPoint::kLeftHeel, f), stands(t)) << t;
  }
}

TEST(FootContacts, HardlyDependOnTheFrameRate) {
  const FoundContacts fine = find_foot_contacts(walk(120.0), kStandardLegLengthM);
  for (const double rate_hz : {30.0, 60.0, 100.0}) {
    const FoundContacts found = find_foot_contacts(walk(rate_hz), kStandardLegLengthM);
    EXPECT_NEAR(mean_contact(found.contacts), mean_contact(fine.contacts), 0.03) << rate_hz;
    EXPECT_NEAR(found.floor->toe_m, fine.floor->toe_m, 0.003) << rate_hz;
  }
}

TEST(FootContacts, FindTheFloorOfTheMotionItself) {
  for (const double floor_m : {-0.3, 0.0, 0.045, 1.2}) {
    const FoundContacts found = find_foot_contacts(walk(60.0, floor_m), kStandardLegLengthM);
    ASSERT_TRUE(found.floor) << floor_m;
    EXPECT_NEAR(found.floor->toe_m, floor_m, 0.003);
    EXPECT_NEAR(found.floor->heel_m, floor_m + 0.01, 0.003);
    EXPECT_EQ(found.contacts.share,
              find_foot_contacts(walk(60.0), kStandardLegLengthM).contacts.share);
  }
}

TEST(FootContacts, AreNoneInFlight) {
  FootPaths paths = walk(60.0, 0.0, 1.0);
  for (auto& path : paths.points) {
    for (Eigen::Index f = 0; f < path.cols(); ++f) {
      path.col(f) << 0.0, 0.5, 0.1 * static_cast<double>(f);  // 6 m/s
    }
  }
  const FoundContacts found = find_foot_contacts(paths, kStandardLegLengthM);
  EXPECT_FALSE(found.contacts.any());
  EXPECT_FALSE(found.floor);
}

TEST(FootContacts, HeelsOfATiptoeWalkerStandOnNothing) {
  FootPaths paths = walk(60.0);
  paths.points[0].row(1).array() += 0.1;
  paths.points[2].row(1).array() += 0.1;
  const FootContacts contacts = find_foot_contacts(paths, kStandardLegLengthM).contacts;
  EXPECT_EQ(contacts.share.row(index_of(FootPoint::kLeftHeel)).maxCoeff(), 0.0);
  EXPECT_EQ(contacts.share.row(index_of(FootPoint::kLeftToe)).maxCoeff(), 1.0);
}

TEST(FootContacts, OfABlendBeyondItsClipsAreThoseOfTheNearerOne) {
  const FootContacts a{60.0, Eigen::Matrix4Xd::Ones(4, 3)};
  const FootContacts b{60.0, Eigen::Matrix4Xd::Zero(4, 3)};
  EXPECT_EQ(mix(a, b, -0.25).share, a.share);
  EXPECT_EQ(mix(a, b, 1.25).share, b.share);
  EXPECT_TRUE(mix(a, b, 0.4).touches(FootPoint::kLeftToe, 1));
  EXPECT_FALSE(mix(a, b, 0.6).touches(FootPoint::kLeftToe, 1));
}

TEST(FootContacts, KeepTheirTimesAtAnotherRate) {
  const FootContacts coarse = find_foot_contacts(walk(30.0), kStandardLegLengthM).contacts;
  const FootContacts fine = resample(coarse, 60.0);
  ASSERT_EQ(fine.frame_count(), 2 * coarse.frame_count() - 1);
  for (int f = 0; f < coarse.frame_count(); ++f) {
    EXPECT_EQ(fine.share.col(2 * f), coarse.share.col(f));
  }
  const FootContacts parts[] = {coarse, coarse};
  EXPECT_EQ(concatenate(parts).frame_count(), 2 * coarse.frame_count());
}

TEST(FootContacts, SayWhatIsWrong) {
  using testing::HasSubstr;
  const auto message_of = [](auto call) {
    try {
      call();
    } catch (const base::Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  FootPaths paths = walk(60.0);
  EXPECT_THAT(message_of([&] { (void)find_foot_contacts(paths, 0.0); }), HasSubstr("leg length"));
  EXPECT_THAT(message_of([&] {
                (void)find_foot_contacts(paths, 0.84,
                                         {.enter_height_m = 0.1, .leave_height_m = 0.05});
              }),
              HasSubstr("enter_height_m"));
  paths.points[3](1, 7) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of([&] { (void)find_foot_contacts(paths, 0.84); }), HasSubstr("finite"));
  const FootContacts a{60.0, Eigen::Matrix4Xd::Zero(4, 3)};
  const FootContacts b{30.0, Eigen::Matrix4Xd::Zero(4, 3)};
  EXPECT_THAT(message_of([&] { (void)mix(a, b, 0.5); }), HasSubstr("cannot be mixed"));
  EXPECT_THAT(message_of([&] { (void)concatenate(std::span<const FootContacts>{}); }),
              HasSubstr("no part"));
}

}  // namespace
}  // namespace laban::motion
