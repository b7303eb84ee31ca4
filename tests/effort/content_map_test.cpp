#include "laban/effort/content_map.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

namespace laban::effort {
namespace {

/// D = 2: a ramp and a wave of `cycles`, over `frames` frames.
Eigen::MatrixXd fragment(int frames, double cycles) {
  Eigen::MatrixXd x(2, frames);
  for (int t = 0; t < frames; ++t) {
    const double phase = static_cast<double>(t) / (frames - 1);
    x.col(t) << phase, std::sin(2.0 * 3.14159265358979 * cycles * phase);
  }
  return x;
}

TEST(Stretch, KeepsBothEndsAndAFragmentOfTheSetLength) {
  const Eigen::MatrixXd x = fragment(7, 1.0);
  EXPECT_EQ(stretch(x, 7), x);
  const Eigen::MatrixXd longer = stretch(x, 20);
  EXPECT_EQ(longer.cols(), 20);
  EXPECT_EQ(longer.col(0), x.col(0));
  EXPECT_EQ(longer.col(19), x.col(6));
  EXPECT_NEAR(longer(0, 10), 10.0 / 19.0, 1e-12);  // a ramp stays a ramp
}

TEST(Stretch, RepeatsASingleFrame) {
  const Eigen::MatrixXd x = Eigen::Vector2d(3.0, -1.0);
  EXPECT_EQ(stretch(x, 4), x.replicate(1, 4));
}

TEST(ContentMap, GivesOneActionAtTwoSpeedsTheSameCoordinates) {
  const std::vector<Eigen::MatrixXd> database = {fragment(40, 1.0), fragment(90, 1.0),
                                                 fragment(40, 2.0), fragment(70, 2.0),
                                                 fragment(55, 3.0)};
  const ContentMap map = fit_content_map(database, {.frames = 32, .components = 2});
  const auto distance = [&](int a, int b) {
    return (map.coordinates(database[static_cast<std::size_t>(a)]) -
            map.coordinates(database[static_cast<std::size_t>(b)]))
        .norm();
  };
  EXPECT_EQ(map.coordinates(database[0]).size(), 2);
  EXPECT_LT(distance(0, 1), 0.02 * distance(0, 2));
  EXPECT_LT(distance(2, 3), 0.02 * distance(2, 4));
}

TEST(ContentMap, SurvivesItsModelFile) {
  const std::vector<Eigen::MatrixXd> database = {fragment(40, 1.0), fragment(50, 2.0),
                                                 fragment(60, 3.0)};
  const ContentMap map = fit_content_map(database, {.frames = 8, .components = 2});
  base::Container container;
  map.save(container, "content");
  const ContentMap loaded = ContentMap::load(container, "content");
  EXPECT_EQ(loaded.coordinates(database[1]), map.coordinates(database[1]));
  EXPECT_EQ(loaded.pca.explained_share(), map.pca.explained_share());

  container.arrays["content.basis"].rows = 15;
  container.arrays["content.basis"].values.resize(30);
  EXPECT_THROW((void)ContentMap::load(container, "content"), base::Error);
  container.arrays.erase("content.basis");
  EXPECT_THROW((void)ContentMap::load(container, "content"), base::Error);
}

TEST(ContentMap, NamesWhatItRefuses) {
  const auto message = [](std::vector<Eigen::MatrixXd> database, const ContentMapOptions& options) {
    try {
      (void)fit_content_map(database, options);
    } catch (const base::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const Eigen::MatrixXd x = fragment(10, 1.0);
  EXPECT_THAT(message({x}, {.frames = 1}), testing::HasSubstr("frames = 1 (must be >= 2)"));
  EXPECT_THAT(message({x}, {.components = 0}), testing::HasSubstr("components = 0"));
  EXPECT_THAT(message({}, {}), testing::HasSubstr("no fragment"));
  EXPECT_THAT(message({x, x.topRows(1)}, {}), testing::HasSubstr("must have 2 rows"));
  Eigen::MatrixXd broken = x;
  broken(1, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message({x, broken}, {}), testing::HasSubstr("not finite"));
}

}  // namespace
}  // namespace laban::effort
