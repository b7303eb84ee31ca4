#include "laban/draw/bar_chart.h"

#include <cmath>

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "picture.h"

namespace laban::draw {
namespace {

BarChart table() {
  return {.title = "Mean squared error",
          .groups = {"Flow", "Weight", "Time"},
          .series = {{"linear interpolation", {0.60, 0.90, 1.00}, {0.02, 0.02, 0.02}, {}},
                     {"kernel ridge", {0.30, 0.45, 0.50}, {}, {0.50, 0.39, 0.60}}},
          .y = {.label = "MSE", .min = {}, .max = {}},
          .reference_name = "paper"};
}

std::string svg(const BarChart& chart) {
  return bar_chart(chart, {.format = Format::kSvg});
}

// Heights of the bars' rectangles, in order.
std::vector<double> bar_heights(const std::string& bytes) {
  std::vector<double> heights;
  for (auto at = bytes.find("<g class=\"bar\">"); at != std::string::npos;
       at = bytes.find("<g class=\"bar\">", at + 1)) {
    heights.push_back(std::stod(bytes.substr(bytes.find("height=\"", at) + 8, 10)));
  }
  return heights;
}

TEST(BarChart, HoldsNamesAndValuesAsText) {
  const std::string bytes = svg(table());
  EXPECT_EQ(xml_fault(bytes), "");
  for (const std::string_view text :
       {">Mean squared error<", ">Flow<", ">Weight<", ">Time<", ">linear interpolation<",
        ">kernel ridge<", ">paper<", ">MSE<", ">0.90<", ">0.45<"}) {
    EXPECT_EQ(count_of(bytes, text), 1) << text;
  }
}

TEST(BarChart, BarsAreAsHighAsTheirValues) {
  const auto heights = bar_heights(svg(table()));  // a group after another
  const std::vector<double> values = {0.60, 0.30, 0.90, 0.45, 1.00, 0.50};
  ASSERT_EQ(heights.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_NEAR(heights[i] / heights[4], values[i], 1e-3);  // coordinates have two decimals
  }
}

TEST(BarChart, AValueThatIsNotFiniteLeavesAGap) {
  BarChart chart = table();
  chart.series[0].values[1] = NAN;
  const std::string bytes = svg(chart);
  EXPECT_EQ(xml_fault(bytes), "");
  EXPECT_EQ(bar_heights(bytes).size(), 5U);
}

TEST(BarChart, DrawsAwkwardValues) {
  for (const double value : {0.0, -5.0, 1e300, -1e300, 1e-300}) {
    BarChart chart = table();
    chart.series[1].values = {value, -value, 0.0};
    chart.series[1].errors = {0.0, NAN, HUGE_VAL};
    EXPECT_EQ(xml_fault(svg(chart)), "") << value;
    expect_png(bar_chart(chart, {.width = 200.0, .height = 100.0, .pixel_ratio = 1.0}), 200, 100);
  }
}

TEST(BarChart, SameInputSameBytes) {
  EXPECT_EQ(svg(table()), svg(table()));
  EXPECT_EQ(bar_chart(table()), bar_chart(table()));
}

TEST(BarChart, RefusesWhatItCannotDraw) {
  const auto message = [](const BarChart& chart) -> std::string {
    try {
      (void)svg(chart);
    } catch (const base::Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(message({}).find("0 groups and 0 series"), std::string::npos);
  BarChart chart = table();
  chart.series[1].values.pop_back();
  EXPECT_NE(message(chart).find("series 'kernel ridge' has 2 values"), std::string::npos);
  chart = table();
  chart.series[0].errors[2] = -1.0;
  EXPECT_NE(message(chart).find("has the error -1 (must be at least 0)"), std::string::npos);
  chart = table();
  chart.y = {.label = {}, .min = 2.0, .max = 1.0};
  EXPECT_NE(message(chart).find("an axis from 2 to 1"), std::string::npos);
}

}  // namespace
}  // namespace laban::draw
