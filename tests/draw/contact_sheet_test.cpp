#include "laban/draw/contact_sheet.h"

#include <gtest/gtest.h>

#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::draw {
namespace {

TEST(ContactSheet, DrawsAsManyFiguresAsAsked) {
  const std::vector<Strip> strips = {
      {.clip = motion::to_standard_clip(test::random_pose_matrix({.frames = 90}))}};
  EXPECT_FALSE(contact_sheet(strips, {.pose_count = 7}).empty());
}

}  // namespace
}  // namespace laban::draw
