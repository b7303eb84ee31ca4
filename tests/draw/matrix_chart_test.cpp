#include "laban/draw/matrix_chart.h"

#include <cmath>

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "picture.h"

namespace laban::draw {
namespace {

MatrixChart two_groups() {
  MatrixChart chart;
  chart.title = "Distances";
  chart.values.resize(4, 4);
  chart.values << 0, 1, 5, 6, 1, 0, 7, 8, 5, 7, 0, 2, 6, 8, 2, 0;
  chart.row_labels = {"walk 1", "walk 2", "bow 1", "bow 2"};
  chart.column_labels = {"a", "b", "c", "d"};
  chart.row_groups = {{"walk", 0, 2}, {"bow", 2, 4}};
  chart.value_label = "cost";
  chart.show_values = true;
  return chart;
}

std::string svg(const MatrixChart& chart) {
  return matrix_chart(chart, {.format = Format::kSvg});
}

TEST(MatrixChart, HoldsLabelsGroupsAndValuesAsText) {
  const std::string bytes = svg(two_groups());
  EXPECT_EQ(xml_fault(bytes), "");
  for (const std::string_view text :
       {">Distances<", ">walk 1<", ">bow 2<", ">a<", ">d<", ">walk<", ">bow<", ">cost<"}) {
    EXPECT_EQ(count_of(bytes, text), 1) << text;
  }
  EXPECT_EQ(count_of(bytes, ">7<"), 2);
}

TEST(MatrixChart, ColorsRunFromDarkViolettToYellow) {
  MatrixChart chart;
  chart.values = Eigen::MatrixXd::Constant(1, 2, 3.0);
  chart.values(0, 1) = 9.0;
  const std::string bytes = svg(chart);
  const auto low = bytes.find("#440154");   // viridis(0)
  const auto high = bytes.find("#fde725");  // viridis(1)
  ASSERT_NE(low, std::string::npos);
  ASSERT_NE(high, std::string::npos);
  EXPECT_LT(low, high);  // column 0 is drawn first
}

TEST(MatrixChart, ANanCellIsLeftWhite) {
  MatrixChart chart;
  chart.values = Eigen::MatrixXd::Constant(2, 2, NAN);
  const std::string empty = svg(chart);
  EXPECT_EQ(xml_fault(empty), "");
  chart.values(0, 0) = 1.0;
  EXPECT_EQ(count_of(svg(chart), "<rect"), count_of(empty, "<rect") + 1);
}

TEST(MatrixChart, LeavesOutLabelsTooSmallToRead) {
  MatrixChart chart;
  chart.values = Eigen::MatrixXd::Random(300, 300);
  chart.row_labels.assign(300, "name");
  const std::string bytes = svg(chart);
  EXPECT_EQ(xml_fault(bytes), "");
  EXPECT_EQ(count_of(bytes, ">name<"), 0);
}

TEST(MatrixChart, DrawsAwkwardMatrices) {
  for (const double value : {0.0, 1e300, -1e300, HUGE_VAL}) {
    MatrixChart chart;
    chart.values = Eigen::MatrixXd::Zero(1, 3);
    chart.values(0, 1) = value;
    chart.values(0, 2) = -value;
    chart.show_values = true;
    EXPECT_EQ(xml_fault(svg(chart)), "") << value;
    expect_png(matrix_chart(chart, {.width = 120.0, .height = 100.0}), 240, 200);
  }
}

TEST(MatrixChart, SameInputSameBytes) {
  EXPECT_EQ(svg(two_groups()), svg(two_groups()));
  EXPECT_EQ(matrix_chart(two_groups()), matrix_chart(two_groups()));
}

TEST(MatrixChart, RefusesWhatItCannotDraw) {
  const auto message = [](const MatrixChart& chart) -> std::string {
    try {
      (void)svg(chart);
    } catch (const base::Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(message({}).find("the matrix is empty"), std::string::npos);
  MatrixChart chart = two_groups();
  chart.row_labels.pop_back();
  EXPECT_NE(message(chart).find("3 row labels for 4"), std::string::npos);
  chart = two_groups();
  chart.column_groups = {{"x", 3, 9}};
  EXPECT_NE(message(chart).find("column group 'x' is [3, 9) of 4"), std::string::npos);
  chart = two_groups();
  chart.min = 2.0;
  chart.max = 2.0;
  EXPECT_NE(message(chart).find("an axis from 2 to 2"), std::string::npos);
}

}  // namespace
}  // namespace laban::draw
