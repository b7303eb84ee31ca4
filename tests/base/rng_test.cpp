#include "laban/base/rng.h"

#include <gtest/gtest.h>

namespace laban::base {
namespace {

TEST(Rng, SameSeedSameNumbers) {
  Rng a(7);
  Rng b(7);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.uniform(), b.uniform());
}

TEST(Rng, NormalHasMeanZeroAndVarianceOne) {
  Rng rng(1);
  double sum = 0.0;
  double squares = 0.0;
  constexpr int kCount = 100000;
  for (int i = 0; i < kCount; ++i) {
    const double x = rng.normal();
    sum += x;
    squares += x * x;
  }
  EXPECT_NEAR(sum / kCount, 0.0, 4.0 / std::sqrt(kCount));  // 4 standard errors
  EXPECT_NEAR(squares / kCount, 1.0, 4.0 * std::sqrt(2.0) / std::sqrt(kCount));
}

TEST(Rng, PermutationHoldsEveryIndexOnce) {
  Rng rng(3);
  auto order = rng.permutation(50);
  std::sort(order.begin(), order.end());
  for (int i = 0; i < 50; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
}

}  // namespace
}  // namespace laban::base
