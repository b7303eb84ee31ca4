#include "laban/draw/chart_page.h"

#include <vector>

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "picture.h"

namespace laban::draw {
namespace {

MatrixChart heat_map(const std::string& title) {
  MatrixChart chart;
  chart.title = title;
  chart.values = Eigen::MatrixXd::Identity(3, 3);
  return chart;
}

LineChart curve(const std::string& title) {
  LineChart chart;
  chart.title = title;
  chart.panels.push_back({.title = "",
                          .x = {"frame", 0.0, 1.0},
                          .y = {"symmetry", 0.0, 1.0},
                          .curves = {{.name = "", .x = {0.0, 1.0}, .y = {0.0, 1.0}}},
                          .spans = {},
                          .marks_x = {}});
  return chart;
}

std::vector<ChartTile> two_tiles() {
  std::vector<ChartTile> tiles;
  tiles.push_back({heat_map("the map"), 0.0, 0.0, 300.0, 300.0});
  tiles.push_back({curve("the curve"), 320.0, 40.0, 400.0, 200.0});
  return tiles;
}

TEST(ChartPage, HoldsEveryChartAtItsPlace) {
  const std::string page = chart_page(two_tiles(), {.format = Format::kSvg});
  EXPECT_EQ(xml_fault(page), "");
  EXPECT_EQ(count_of(page, ">the map<"), 1);
  EXPECT_EQ(count_of(page, ">the curve<"), 1);
  std::vector<ChartTile> moved = two_tiles();
  moved[1].x += 100.0;
  EXPECT_NE(chart_page(moved, {.format = Format::kSvg}), page);
}

TEST(ChartPage, IsAsLargeAsAsked) {
  // Two pixels a unit.
  expect_png(chart_page(two_tiles(), {.format = Format::kPng, .width = 720, .height = 300}), 1440,
             600);
}

TEST(ChartPage, RefusesAPageWithoutCharts) {
  EXPECT_THROW((void)chart_page({}), base::Error);
}

}  // namespace
}  // namespace laban::draw
