#include "laban/math/golden_section.h"

#include <cmath>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/parallel.h"

namespace laban::math {
namespace {

TEST(GoldenSection, FindsTheOnlyMinimumWithinTheTolerance) {
  for (const double centre : {-0.25, 0.1, 0.777, 1.25}) {
    const auto found =
        golden_section([&](double x) { return (x - centre) * (x - centre); }, -0.25, 1.25, 1e-6);
    EXPECT_NEAR(found.x, centre, 1e-6);
  }
}

TEST(GoldenSection, EvaluatesLittle) {
  int calls = 0;
  (void)golden_section([&](double x) { return ++calls, x * x; }, -1.0, 1.0, 1e-3);
  EXPECT_LE(calls, 2 + 16);  // 2 / 1e-3 = 0.618^-15.8
}

TEST(RefineBestSample, IsNeverWorseThanTheBestSample) {
  const auto f = [](double x) { return std::sin(40.0 * x) + 0.1 * x; };
  std::vector<double> x;
  std::vector<double> values;
  for (int i = 0; i < 31; ++i) {
    x.push_back(-0.25 + 0.05 * i);
    values.push_back(f(x.back()));
  }
  const auto found = refine_best_sample(f, x, values, 1e-4);
  for (const double value : values) EXPECT_LE(found.value, value);
}

TEST(RefineBestSample, StaysInTheRange) {
  const std::vector<double> x = {-0.25, 0.5, 1.25};
  const std::vector<double> values = {0.25, -0.5, -1.25};
  EXPECT_EQ(refine_best_sample([](double at) { return -at; }, x, values, 1e-4).x, 1.25);
}

TEST(RefineBestSample, RefusesNoSamples) {
  EXPECT_THROW((void)refine_best_sample([](double at) { return at; }, {}, {}, 1e-4), base::Error);
}

TEST(ParallelFor, CallsEachIndexOnceWhateverTheThreads) {
  for (const int threads : {1, 2, 7}) {
    std::vector<int> calls(1000, 0);
    parallel_for(1000, threads, [&](int i) { ++calls[static_cast<std::size_t>(i)]; });
    for (const int count : calls) EXPECT_EQ(count, 1);
  }
}

TEST(ParallelFor, RethrowsAFailure) {
  EXPECT_THROW(parallel_for(10, 3,
                            [](int i) {
                              if (i == 4) throw base::Error(base::ErrorKind::kData, "4");
                            }),
               base::Error);
}

}  // namespace
}  // namespace laban::math
