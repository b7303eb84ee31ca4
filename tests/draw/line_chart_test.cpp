#include "laban/draw/line_chart.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "picture.h"

namespace laban::draw {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Figure 1's axes with one curve.
LineChart effort_chart(std::vector<double> x, std::vector<double> y) {
  LineChart chart;
  chart.title = "Effort against alpha";
  chart.panels.push_back({.title = "Flow",
                          .x = {"alpha", -0.5, 1.5},
                          .y = {"Effort", -3.0, 3.0},
                          .curves = {{.name = "pair 1", .x = std::move(x), .y = std::move(y)}},
                          .spans = {},
                          .marks_x = {}});
  return chart;
}

std::string svg(const LineChart& chart) {
  return line_chart(chart, {.format = Format::kSvg});
}

std::string message_of(const LineChart& chart, base::ErrorKind kind) {
  try {
    (void)svg(chart);
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), kind);
    return error.what();
  }
  return "no error";
}

TEST(LineChart, HoldsTitlesLabelsLegendAndTicksAsText) {
  const std::string bytes = svg(effort_chart({0.0, 1.0}, {-1.0, 2.0}));
  EXPECT_EQ(xml_fault(bytes), "");
  for (const std::string_view text : {">Effort against alpha<", ">Flow<", ">alpha<", ">Effort<",
                                      ">pair 1<", ">\u22123<", ">3<", ">\u22120.5<", ">1.5<"}) {
    EXPECT_EQ(count_of(bytes, text), 1) << text;
  }
}

// The curve's points, read back through the axes, are the data.
TEST(LineChart, PutsPointsWhereTheAxesSay) {
  const std::string bytes = svg(effort_chart({-0.5, 1.5, 0.5}, {-3.0, 3.0, 0.0}));
  const auto at = bytes.find("points=\"", bytes.find("<g class=\"curve\">")) + 8;
  double x[3];
  double y[3];
  ASSERT_EQ(std::sscanf(bytes.c_str() + at, "%lf,%lf %lf,%lf %lf,%lf", &x[0], &y[0], &x[1], &y[1],
                        &x[2], &y[2]),
            6);
  EXPECT_LT(x[0], x[1]);
  EXPECT_GT(y[0], y[1]);                          // larger values stand higher
  EXPECT_NEAR(x[2], 0.5 * (x[0] + x[1]), 0.011);  // coordinates have two decimals
  EXPECT_NEAR(y[2], 0.5 * (y[0] + y[1]), 0.011);
}

TEST(LineChart, APointThatIsNotFiniteBreaksTheCurve) {
  const auto lines = [](const std::vector<double>& y) {
    const std::string bytes = svg(effort_chart({0.0, 0.2, 0.4, 0.6, 0.8}, y));
    EXPECT_EQ(xml_fault(bytes), "");
    const auto begin = bytes.find("<g class=\"curve\">");
    return count_of(bytes.substr(begin, bytes.find("</g>", begin) - begin), "<polyline");
  };
  EXPECT_EQ(lines({0, 1, 2, 1, 0}), 1);
  EXPECT_EQ(lines({0, 1, NAN, 1, 0}), 2);
  EXPECT_EQ(lines({0, 1, kInfinity, 1, 0}), 2);
  EXPECT_EQ(lines({NAN, NAN, NAN, NAN, NAN}), 0);
}

TEST(LineChart, SaysWhenThereIsNoData) {
  EXPECT_EQ(count_of(svg(effort_chart({}, {})), ">no data<"), 1);
  EXPECT_EQ(count_of(svg(effort_chart({0.0}, {NAN})), ">no data<"), 1);
  EXPECT_EQ(count_of(svg(effort_chart({0.0}, {1.0})), ">no data<"), 0);
}

TEST(LineChart, CurvesOfOneNameShareOneLegendEntryAndColor) {
  LineChart chart = effort_chart({0.0, 1.0}, {0.0, 1.0});
  chart.panels.push_back(chart.panels.front());
  chart.panels.back().curves.push_back({.name = "pair 2", .x = {0.0, 1.0}, .y = {1.0, 0.0}});
  const std::string bytes = svg(chart);
  EXPECT_EQ(count_of(bytes, ">pair 1<"), 1);
  EXPECT_EQ(count_of(bytes, "<g class=\"curve\">"), 3);
  EXPECT_EQ(count_of(bytes, "stroke=\"#0072b2\""), 3);  // two curves and the legend
  EXPECT_EQ(count_of(bytes, "stroke=\"#d55e00\""), 2);
}

TEST(LineChart, DrawsAwkwardData) {
  const std::vector<std::vector<double>> rows = {{},
                                                 {5.0, 5.0},
                                                 {1e300, -1e300},
                                                 {1e-300, 2e-300},
                                                 {1e16, 1e16 + 2.0},
                                                 {-0.0, 0.0},
                                                 {kInfinity, -kInfinity}};
  for (const auto& row : rows) {
    LineChart chart = effort_chart(row, row);
    chart.panels[0].x = {};
    chart.panels[0].y = {};
    chart.panels[0].spans = {{-kInfinity, 1.0, "a"}, {2.0, 1.0, "b"}, {NAN, NAN, "c"}};
    chart.panels[0].marks_x = {NAN, kInfinity, 5.0};
    EXPECT_EQ(xml_fault(svg(chart)), "");
    const std::string png = line_chart(chart, {.width = 300.0, .height = 200.0});
    expect_png(png, 600, 400);
  }
}

TEST(LineChart, SameInputSameBytes) {
  const LineChart chart = effort_chart({0.0, 0.3, 1.0}, {0.1, 2.0, -1.0});
  EXPECT_EQ(svg(chart), svg(chart));
  EXPECT_EQ(line_chart(chart), line_chart(chart));
}

TEST(LineChart, RefusesWhatItCannotDraw) {
  using base::ErrorKind;
  EXPECT_NE(message_of({}, ErrorKind::kUsage).find("no panel"), std::string::npos);
  LineChart chart = effort_chart({0.0, 1.0}, {0.0});
  EXPECT_NE(message_of(chart, ErrorKind::kData).find("panel 0, curve 0: 2 x, 1 y"),
            std::string::npos);
  chart = effort_chart({0.0, 1.0}, {0.0, 1.0});
  chart.panels[0].curves[0].band_low = {0.0, 1.0};
  EXPECT_NE(message_of(chart, ErrorKind::kData).find("2 and 0 of the band"), std::string::npos);
  chart = effort_chart({0.0, 1.0}, {0.0, 1.0});
  chart.panels[0].y.max = -3.0;
  EXPECT_NE(message_of(chart, ErrorKind::kUsage).find("panel 0, y: an axis from -3 to -3"),
            std::string::npos);
  chart.panels[0].y.max = NAN;
  EXPECT_NE(message_of(chart, ErrorKind::kUsage).find("must be finite"), std::string::npos);
  chart = effort_chart({0.0}, {0.0});
  chart.columns = -1;
  EXPECT_NE(message_of(chart, ErrorKind::kUsage).find("columns = -1"), std::string::npos);
  EXPECT_THROW((void)line_chart(effort_chart({}, {}), {.width = 5.0}), base::Error);
}

}  // namespace
}  // namespace laban::draw
