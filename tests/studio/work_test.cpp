#include "work.h"

#include <gtest/gtest.h>

namespace laban::studio {
namespace {

TEST(Work, TellsHowFarARequestHasCome) {
  Work work;
  EXPECT_EQ(work.told()["busy"], false);
  {
    const Work::Turn turn(work);
    EXPECT_EQ(work.told()["busy"], true);
    EXPECT_TRUE(work.told()["fraction"].is_null());
    EXPECT_TRUE(work.update(0.25));
    EXPECT_EQ(work.told()["fraction"], 0.25);
  }
  EXPECT_EQ(work.told()["busy"], false);
  EXPECT_TRUE(work.told()["fraction"].is_null());
}

TEST(Work, IsStoppedOnceAndGoesOnWithTheNextRequest) {
  Work work;
  {
    const Work::Turn turn(work);
    work.stop();
    EXPECT_FALSE(work.update(0.5));
  }
  const Work::Turn next(work);
  EXPECT_TRUE(work.update(0.0));
}

}  // namespace
}  // namespace laban::studio
