#include "laban/loop/graph_cut_seam.h"

#include <limits>
#include <random>

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <gmock/gmock.h>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

SeamCosts random_costs(int rows, int frames, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> cost(0.0, 1.0);
  SeamCosts costs{{-1}, Eigen::MatrixXd(rows, frames - 1), Eigen::MatrixXd(rows, frames)};
  for (int r = 1; r < rows; ++r)
    costs.parents.push_back(std::uniform_int_distribution(0, r - 1)(rng));
  for (Eigen::Index n = 0; n < costs.along_time.size(); ++n) costs.along_time(n) = cost(rng);
  for (Eigen::Index n = 0; n < costs.to_parent.size(); ++n) costs.to_parent(n) = 0.3 * cost(rng);
  return costs;
}

/// The least cost over every choice of a switch frame for every row.
double cheapest_by_enumeration(const SeamCosts& costs) {
  const auto frames = static_cast<int>(costs.to_parent.cols());
  std::vector<int> switches(costs.parents.size(), 1);
  double least = kInfinity;
  while (true) {
    least = std::min(least, seam_cost(costs, switches));
    std::size_t r = 0;
    while (r < switches.size() && ++switches[r] == frames) switches[r++] = 1;
    if (r == switches.size()) return least;
  }
}

/// The value of the minimum cut by maximum flow on the joints x time graph, with infinite arcs
/// against switching back.
double cheapest_by_maximum_flow(const SeamCosts& costs) {
  using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
  using Graph = boost::adjacency_list<
      boost::vecS, boost::vecS, boost::directedS,
      boost::property<boost::vertex_color_t, boost::default_color_type,
                      boost::property<boost::vertex_predecessor_t, Traits::edge_descriptor,
                                      boost::property<boost::vertex_distance_t, long>>>,
      boost::property<
          boost::edge_capacity_t, double,
          boost::property<boost::edge_residual_capacity_t, double,
                          boost::property<boost::edge_reverse_t, Traits::edge_descriptor>>>>;
  const auto rows = costs.parents.size();
  const auto frames = static_cast<std::size_t>(costs.to_parent.cols());
  Graph graph(rows * frames + 2);
  const auto source = rows * frames;
  const auto sink = source + 1;
  const auto node = [&](std::size_t r, std::size_t t) { return r * frames + t; };
  constexpr double kHuge = 1e9;
  const auto connect = [&](std::size_t a, std::size_t b, double there, double back) {
    const auto edge = boost::add_edge(a, b, graph).first;
    const auto reverse = boost::add_edge(b, a, graph).first;
    boost::put(boost::edge_capacity, graph, edge, there);
    boost::put(boost::edge_capacity, graph, reverse, back);
    boost::put(boost::edge_reverse, graph, edge, reverse);
    boost::put(boost::edge_reverse, graph, reverse, edge);
  };
  for (std::size_t r = 0; r < rows; ++r) {
    const auto row = static_cast<Eigen::Index>(r);
    connect(source, node(r, 0), kHuge, 0.0);
    connect(node(r, frames - 1), sink, kHuge, 0.0);
    for (std::size_t t = 0; t + 1 < frames; ++t) {
      connect(node(r, t), node(r, t + 1), costs.along_time(row, static_cast<Eigen::Index>(t)),
              kHuge);
    }
    if (r == 0) continue;
    for (std::size_t t = 0; t < frames; ++t) {
      const double cost = costs.to_parent(row, static_cast<Eigen::Index>(t));
      connect(node(r, t), node(static_cast<std::size_t>(costs.parents[r]), t), cost, cost);
    }
  }
  return boost::boykov_kolmogorov_max_flow(graph, source, sink);
}

TEST(GraphCutSeam, EqualsBruteForceOnSmallGrids) {
  std::mt19937_64 rng(7);
  for (int trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE(trial);
    const int rows = 1 + trial % 5;
    const SeamCosts costs = random_costs(rows, 3 + trial % 4, rng);
    const Seam seam = minimum_seam(costs);
    EXPECT_NEAR(seam.cost, cheapest_by_enumeration(costs), 1e-12);  // ~30 sums of O(1) terms
    EXPECT_NEAR(seam.cost, seam_cost(costs, seam.switch_frames), 1e-12);
  }
}

TEST(GraphCutSeam, EqualsBoykovAndKolmogorovsMinimumCut) {
  std::mt19937_64 rng(8);
  for (int trial = 0; trial < 10; ++trial) {
    SCOPED_TRACE(trial);
    const SeamCosts costs = random_costs(30, 50, rng);
    EXPECT_NEAR(minimum_seam(costs).cost, cheapest_by_maximum_flow(costs), 1e-9);
  }
}

TEST(GraphCutSeam, SwitchesTwoJointsApartOnlyWhereThatPays) {
  // The child is free to switch at frame 3, the parent at 1; between them lie frames 1 and 2.
  SeamCosts costs{{-1, 0}, Eigen::MatrixXd::Constant(2, 3, 1.0), Eigen::MatrixXd::Zero(2, 4)};
  costs.along_time(0, 0) = 0.0;
  costs.along_time(1, 2) = 0.0;
  costs.to_parent.row(1).setConstant(0.3);
  EXPECT_THAT(minimum_seam(costs).switch_frames, ElementsAre(1, 3));  // 0.6 < 1
  costs.to_parent.row(1).setConstant(0.6);
  EXPECT_THAT(minimum_seam(costs).switch_frames, ElementsAre(1, 1));  // 1.2 > 1
}

TEST(GraphCutSeam, NeverSwitchesWhereItMayNot) {
  std::mt19937_64 rng(9);
  SeamCosts costs = random_costs(6, 12, rng);
  costs.along_time.leftCols(4).setConstant(kInfinity);
  costs.along_time.rightCols(4).setConstant(kInfinity);
  for (const int frame : minimum_seam(costs).switch_frames) {
    EXPECT_GE(frame, 5);
    EXPECT_LE(frame, 7);
  }
}

TEST(GraphCutSeam, RefusesCostsThatDoNotFit) {
  const auto expect_error = [](const SeamCosts& costs, const char* part) {
    try {
      (void)minimum_seam(costs);
      FAIL() << part;
    } catch (const base::Error& error) {
      EXPECT_EQ(error.kind(), base::ErrorKind::kData);
      EXPECT_THAT(error.what(), HasSubstr(part));
    }
  };
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(2, 3);
  expect_error({{-1, 0}, one, Eigen::MatrixXd::Ones(2, 3)}, "R x (N - 1)");
  expect_error({{-1, 1}, one, Eigen::MatrixXd::Ones(2, 4)}, "before their children");
  expect_error({{-1, 0}, -one, Eigen::MatrixXd::Ones(2, 4)}, "negative");
  expect_error({{-1, 0}, kInfinity * one, Eigen::MatrixXd::Ones(2, 4)}, "switch nowhere");
}

TEST(GraphCutSeam, CostsVanishWhereBothMotionsAgree) {
  std::mt19937_64 rng(3);
  std::normal_distribution<double> normal;
  std::vector<Eigen::MatrixXd> a(2, Eigen::MatrixXd(4, 9));
  for (auto& row : a) {
    for (Eigen::Index n = 0; n < row.size(); ++n) row(n) = normal(rng);
  }
  std::vector<Eigen::MatrixXd> b = a;
  for (Eigen::Index t = 0; t < 9; ++t) {
    if (t != 4 && t != 5) b[0].col(t).array() += 0.1;
    if (t != 4 && t != 5) b[1].col(t).array() += 0.1;
  }
  for (const SeamMetric metric : {SeamMetric::kDifference, SeamMetric::kGradient}) {
    const SeamCosts costs = seam_costs(a, b, {-1, 0}, Eigen::VectorXd::Ones(2), metric, 0);
    EXPECT_EQ(costs.along_time(0, 4), 0.0);
    EXPECT_GT(costs.along_time(0, 3), 0.0);
    EXPECT_THAT(minimum_seam(costs).switch_frames, ElementsAre(5, 5));
    EXPECT_EQ(minimum_seam(costs).cost, 0.0);
  }
}

// [Graphcut, eq. 8] by hand: |A - B| = 0.2 on both frames, 0.4 in all; no gradient: 1 -
// exp(-0.4/eps).
TEST(GraphCutSeam, ChargesDifferencesOrTheirComplementOfSimilarity) {
  const std::vector<Eigen::MatrixXd> a = {Eigen::MatrixXd::Zero(1, 4)};
  const std::vector<Eigen::MatrixXd> b = {Eigen::MatrixXd::Constant(1, 4, 0.2)};
  const Eigen::VectorXd weight = Eigen::VectorXd::Constant(1, 2.0);
  EXPECT_NEAR(seam_costs(a, b, {-1}, weight, SeamMetric::kDifference, 0).along_time(0, 1), 0.8,
              1e-15);
  EXPECT_NEAR(seam_costs(a, b, {-1}, weight, SeamMetric::kGradient, 0).along_time(0, 1), 2.0,
              1e-12);
  // Of a line of slope 1 in both: G = 1 + 1 + 1 + 1.
  Eigen::MatrixXd line(1, 4);
  line << 0.0, 1.0, 2.0, 3.0;
  const double cost = seam_costs({line}, {line.array() + 0.2}, {-1}, Eigen::VectorXd::Ones(1),
                                 SeamMetric::kGradient, 0)
                          .along_time(0, 1);
  EXPECT_NEAR(cost, 1.0 - std::exp(-0.4 / 4.0), 1e-5);  // eps is 1e-4
}

TEST(BlendWeight, FallsFromOneToZeroAsThePaperSays) {
  EXPECT_EQ(blend_weight(-1.0, 10.0), 1.0);
  EXPECT_EQ(blend_weight(-5.0, 10.0), 1.0);
  EXPECT_EQ(blend_weight(9.0, 10.0), 0.0);
  EXPECT_EQ(blend_weight(50.0, 10.0), 0.0);
  EXPECT_NEAR(blend_weight(4.0, 10.0), 0.5, 1e-15);    // (p + 1) / k = 1/2
  EXPECT_NEAR(blend_weight(0.0, 10.0), 0.972, 1e-15);  // 0.002 - 0.03 + 1
  for (double p = -1.0; p < 9.0; p += 0.5)
    EXPECT_GT(blend_weight(p, 10.0), blend_weight(p + 0.5, 10.0));
}

}  // namespace
}  // namespace laban::loop
