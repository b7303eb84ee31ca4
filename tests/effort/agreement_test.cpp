#include "laban/effort/agreement.h"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"

namespace laban::effort {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAreArray;

const double kNan = std::nan("");

/// [Krippendorff11, C]: 12 units, 4 observers, data missing.
Eigen::MatrixXd krippendorff_example() {
  Eigen::MatrixXd observers(4, 12);
  observers << 1, 2, 3, 3, 2, 1, 4, 1, 2, kNan, kNan, kNan,  //
      1, 2, 3, 3, 2, 2, 4, 1, 2, 5, kNan, 3,                 //
      kNan, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, kNan,              //
      1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, kNan;
  return observers.transpose();
}

/// [ShroutFleiss79, table 2]: six targets, four judges.
Eigen::MatrixXd shrout_fleiss_example() {
  Eigen::MatrixXd ratings(6, 4);
  ratings << 9, 2, 5, 8, 6, 1, 3, 2, 8, 4, 6, 8, 7, 1, 2, 6, 10, 5, 6, 9, 6, 2, 4, 7;
  return ratings;
}

/// Alpha straight from its definition, pair by pair.
double alpha_by_pairs(const Eigen::MatrixXd& ratings) {
  std::vector<double> all;
  double observed = 0.0;
  for (Eigen::Index u = 0; u < ratings.rows(); ++u) {
    std::vector<double> values;
    for (Eigen::Index r = 0; r < ratings.cols(); ++r) {
      if (!std::isnan(ratings(u, r))) values.push_back(ratings(u, r));
    }
    if (values.size() < 2) continue;
    for (const double a : values) {
      for (const double b : values) {
        observed += (a - b) * (a - b) / static_cast<double>(values.size() - 1);
      }
    }
    all.insert(all.end(), values.begin(), values.end());
  }
  double expected = 0.0;
  for (const double a : all) {
    for (const double b : all) expected += (a - b) * (a - b);
  }
  const auto n = static_cast<double>(all.size());
  return 1.0 - (observed / n) / (expected / (n * (n - 1.0)));
}

template <typename Call>
std::string message_of(base::ErrorKind kind, const Call& call) {
  try {
    (void)call();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), kind);
    return error.what();
  }
  return "no error";
}

TEST(KrippendorffAlpha, IsThatOfThePublishedExample) {
  const KrippendorffAlpha found = krippendorff_alpha(krippendorff_example());
  EXPECT_NEAR(*found.alpha, 0.849, 0.0005);  // [Krippendorff11, D]: interval metric
  EXPECT_EQ(found.units, 11);                // unit 12 has one value
  EXPECT_EQ(found.values, 40);               // n.. of the paper
}

TEST(KrippendorffAlpha, MatchesItsDefinitionPairByPair) {
  std::mt19937_64 rng(3);
  for (int trial = 0; trial < 50; ++trial) {
    SCOPED_TRACE(trial);
    Eigen::MatrixXd ratings = Eigen::MatrixXd::Zero(3 + trial % 9, 2 + trial % 4);
    for (double& value : ratings.reshaped()) {
      value = rng() % 5 == 0 ? kNan : static_cast<double>(rng() % 61) / 10.0 - 3.0;
    }
    const double expected = alpha_by_pairs(ratings);
    const auto found = krippendorff_alpha(ratings, {.resamples = 1}).alpha;
    ASSERT_EQ(found.has_value(), !std::isnan(expected));
    if (found) EXPECT_NEAR(*found, expected, 1e-12);
  }
}

TEST(KrippendorffAlpha, IsOneForPerfectAgreementAndKeptByShiftAndScale) {
  Eigen::MatrixXd same(5, 3);
  same << -3, -3, -3, 1, 1, 1, 0, 0, 0, 2.5, 2.5, 2.5, 1, 1, 1;
  const KrippendorffAlpha perfect = krippendorff_alpha(same);
  EXPECT_EQ(perfect.alpha, 1.0);
  EXPECT_EQ(perfect.interval->low, 1.0);
  EXPECT_EQ(perfect.interval->high, 1.0);
  EXPECT_LT(perfect.resamples, 2000);  // some draw the two units that are 1 alone
  const Eigen::MatrixXd data = krippendorff_example();
  const auto moved = krippendorff_alpha((100.0 - 2.0 * data.array()).matrix());
  EXPECT_NEAR(*moved.alpha, *krippendorff_alpha(data).alpha, 1e-12);
}

TEST(KrippendorffAlpha, IsNotDefinedWithoutPairsOrVariation) {
  EXPECT_FALSE(krippendorff_alpha(Eigen::MatrixXd::Constant(4, 1, 2.0)).alpha);
  EXPECT_FALSE(krippendorff_alpha(Eigen::MatrixXd::Constant(4, 3, 0.1)).alpha);
  EXPECT_FALSE(krippendorff_alpha(Eigen::MatrixXd::Constant(4, 3, kNan)).alpha);
  EXPECT_FALSE(krippendorff_alpha(Eigen::MatrixXd(0, 0)).alpha);
}

// The published example again, whose unit bootstrap any program can redo: bounds by 60 000
// resamples of an independent one (Python), to the error of 20 000 here.
TEST(KrippendorffAlpha, BootstrapResamplesUnits) {
  const auto found = krippendorff_alpha(krippendorff_example(), {.resamples = 20000, .seed = 1});
  EXPECT_NEAR(found.interval->low, 0.428, 0.01);
  EXPECT_NEAR(found.interval->high, 1.0, 1e-12);  // those that miss all units with disagreement
  const auto again = krippendorff_alpha(krippendorff_example(), {.resamples = 20000, .seed = 1});
  EXPECT_EQ(found.interval->low, again.interval->low);
  const auto narrow = krippendorff_alpha(krippendorff_example(), {.level = 0.5});
  EXPECT_GT(narrow.interval->low, found.interval->low);
  EXPECT_LT(narrow.interval->high, found.interval->high);
}

// A law of large numbers for the interval: with many units it closes in on what the raters' noise
// makes of alpha, 1 - noise / (signal + noise).
TEST(KrippendorffAlpha, IntervalCoversTheAlphaThatTheRatingsWereMadeWith) {
  std::mt19937_64 rng(5);
  std::normal_distribution<double> normal;
  int covered = 0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    Eigen::MatrixXd ratings(60, 3);
    for (Eigen::Index u = 0; u < ratings.rows(); ++u) {
      const double truth = normal(rng);
      for (Eigen::Index r = 0; r < 3; ++r) ratings(u, r) = truth + 0.5 * normal(rng);
    }
    const auto found = krippendorff_alpha(ratings, {.resamples = 400});
    covered += found.interval->low <= 0.8 && 0.8 <= found.interval->high ? 1 : 0;
  }
  // 95 of 100 in theory; a percentile bootstrap of 60 units falls a little short.
  EXPECT_GE(covered, 85);
}

TEST(IntraclassCorrelation, IsThatOfShroutAndFleiss) {
  const IntraclassCorrelation found = icc_two_way(shrout_fleiss_example());
  EXPECT_NEAR(*found.value, 0.29, 0.005);  // [ShroutFleiss79, table 4]
  // R's irr::icc(model = "twoway", type = "agreement") of the same data: 0.019 < ICC < 0.761.
  EXPECT_NEAR(found.interval->low, 0.019, 0.0005);
  EXPECT_NEAR(found.interval->high, 0.761, 0.0005);
  EXPECT_EQ(found.units, 6);
  EXPECT_EQ(found.dropped, 0);
  const IntraclassCorrelation one_way = icc_one_way(shrout_fleiss_example());
  EXPECT_NEAR(*one_way.value, 0.17, 0.005);  // [ShroutFleiss79, table 4]
  // R's psych::ICC: -0.133 .. 0.723.
  EXPECT_NEAR(one_way.interval->low, -0.133, 0.0005);
  EXPECT_NEAR(one_way.interval->high, 0.723, 0.0005);
}

TEST(IntraclassCorrelation, UsesOnlyUnitsThatAllHaveRatedAndSaysHowManyWereDropped) {
  Eigen::MatrixXd ratings(9, 4);
  ratings.topRows(6) = shrout_fleiss_example();
  ratings.row(6) << 1, kNan, 10, 3;
  ratings.row(7) << kNan, kNan, kNan, kNan;
  ratings.row(8) << kNan, kNan, 1, kNan;
  const IntraclassCorrelation found = icc_two_way(ratings);
  EXPECT_NEAR(*found.value, *icc_two_way(shrout_fleiss_example()).value, 1e-14);
  EXPECT_EQ(found.units, 6);
  EXPECT_EQ(found.dropped, 2);  // nobody has rated the unit between them
}

// Two raters in perfect order, one of them higher by d: BMS = 2 s^2, JMS = n d^2 / 2, EMS = 0, so
// ICC = s^2 / (s^2 + d^2 / 2).
TEST(IntraclassCorrelation, ABiasCountsAgainstAgreement) {
  Eigen::MatrixXd ratings(5, 2);
  ratings.col(0) << -2, -1, 0, 1, 2;  // s^2 = 2.5
  for (const double bias : {0.0, 0.5, 2.0}) {
    SCOPED_TRACE(bias);
    ratings.col(1) = ratings.col(0).array() + bias;
    const auto found = icc_two_way(ratings);
    EXPECT_NEAR(*found.value, 2.5 / (2.5 + 0.5 * bias * bias), 1e-12);
    EXPECT_LE(found.interval->low, *found.value);
    EXPECT_GE(found.interval->high, *found.value);
  }
}

TEST(IccTwoWay, RatersWhoDifferByAConstantAndUnitsNotAtAllHaveNoInterval) {
  Eigen::MatrixXd ratings(4, 2);
  ratings.col(0).setConstant(1.0);
  ratings.col(1).setConstant(-1.0);
  const IntraclassCorrelation icc = icc_two_way(ratings);
  EXPECT_EQ(icc.value, 0.0);
  EXPECT_FALSE(icc.interval);
}

TEST(IntraclassCorrelation, IsNotDefinedWithoutTwoUnitsTwoRatersOrVariation) {
  EXPECT_FALSE(icc_two_way(Eigen::MatrixXd::Constant(5, 3, 0.1)).value);
  EXPECT_FALSE(icc_two_way(Eigen::MatrixXd::Random(1, 3)).value);
  EXPECT_FALSE(icc_two_way(Eigen::MatrixXd::Random(4, 1)).value);
  EXPECT_FALSE(icc_one_way(Eigen::MatrixXd::Constant(5, 3, 0.1)).value);
  EXPECT_FALSE(icc_one_way(Eigen::MatrixXd::Random(5, 1)).value);
}

TEST(IntraclassCorrelation, OfUnrelatedRatersHasBoundsAroundNought) {
  std::mt19937_64 rng(7);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    SCOPED_TRACE(trial);
    Eigen::MatrixXd ratings(3 + trial % 20, 2 + trial % 3);
    for (double& value : ratings.reshaped()) value = normal(rng);
    for (const auto& found : {icc_two_way(ratings), icc_one_way(ratings)}) {
      ASSERT_TRUE(found.value && found.interval);
      EXPECT_LE(found.interval->low, *found.value + 1e-9);
      EXPECT_GE(found.interval->high, *found.value - 1e-9);
      EXPECT_LE(found.interval->high, 1.0);
    }
  }
}

// Units of 2 and 3 values, worked by hand: N = 5, k_0 = (5 - 13 / 5) / 1 = 2.4; means 1.5 and 5,
// grand 3.6; SSB = 2 * 2.1^2 + 3 * 1.4^2 = 14.7, SSW = 0.5 + 2 = 2.5, WMS = 2.5 / 3.
TEST(IntraclassCorrelation, OfUnequalRepeatsUsesTheirAverageNumber) {
  Eigen::MatrixXd ratings(2, 3);
  ratings << 1, 2, kNan, 4, 5, 6;
  const auto found = icc_one_way(ratings);
  const double WMS = 2.5 / 3.0;
  EXPECT_NEAR(*found.value, (14.7 - WMS) / (14.7 + 1.4 * WMS), 1e-14);
  EXPECT_FALSE(found.interval);
  // (1 + mean of 1, 1, 2) / 2
  EXPECT_NEAR(*mean_absolute_difference(ratings), 0.5 * (1.0 + 4.0 / 3.0), 1e-14);
  EXPECT_FALSE(mean_absolute_difference(Eigen::MatrixXd::Random(3, 1)));
}

TEST(Agreement, RefusesALevelOrCountThatIsNone) {
  EXPECT_THAT(
      message_of(base::ErrorKind::kUsage, [] { return icc_two_way(shrout_fleiss_example(), 1.0); }),
      HasSubstr("level = 1 (must be in (0, 1))"));
  EXPECT_THAT(
      message_of(base::ErrorKind::kUsage,
                 [] { return krippendorff_alpha(krippendorff_example(), {.resamples = 0}); }),
      HasSubstr("BootstrapOptions::resamples = 0 (must be >= 1)"));
}

std::string fragment_name(Eigen::Index unit) {
  return std::string("f").append(std::to_string(unit));
}

/// A table in which rater r says ratings(u, r) of Flow of fragment u; NaN: no row.
LabelTable table_of(const Eigen::MatrixXd& ratings, const std::vector<std::string>& names) {
  LabelTable table;
  for (Eigen::Index u = 0; u < ratings.rows(); ++u) {
    for (Eigen::Index r = 0; r < ratings.cols(); ++r) {
      if (std::isnan(ratings(u, r))) continue;
      LabelRow row;
      row.fragment = fragment_name(u);
      row.clip = row.fragment + ".bvh";
      row.flow = ratings(u, r);
      row.observer = names[static_cast<std::size_t>(r)];
      table.rows.push_back(row);
    }
  }
  return table;
}

const std::vector<std::string> kFour = {"ann", "bob", "cat", "dan"};

TEST(Agreement, OfATableIsThatOfItsRatings) {
  const Eigen::MatrixXd ratings = krippendorff_example();
  const AgreementReport report = rater_agreement(table_of(ratings, kFour));
  EXPECT_THAT(report.raters, ElementsAre("ann", "bob", "dan", "cat"));  // as they appear
  EXPECT_EQ(report.fragments, 12);
  ASSERT_THAT(report.factors, SizeIs(1));
  EXPECT_EQ(report.factors[0].factor, "flow");
  EXPECT_NEAR(*report.factors[0].alpha.alpha, 0.849, 0.0005);
  EXPECT_EQ(report.factors[0].alpha.interval->low, krippendorff_alpha(ratings).interval->low);
  EXPECT_NEAR(*report.factors[0].icc.value, *icc_two_way(ratings).value, 1e-12);
  EXPECT_EQ(report.factors[0].icc.units, 8);
  EXPECT_EQ(report.factors[0].icc.dropped, 4);
  EXPECT_THAT(report.repeats, IsEmpty());
}

TEST(Agreement, RowsOfNoConfidenceAndBlankFactorsAreMissing) {
  LabelTable table = table_of(krippendorff_example(), kFour);
  for (LabelRow& row : table.rows) row.confidence = 0.3;
  LabelRow wild = table.rows.front();
  wild.observer = "eve";
  wild.confidence = 0.0;
  wild.flow = 3.0;
  wild.time = 2.0;
  table.rows.push_back(wild);
  wild.observer = "dan";
  wild.repeat = 1;
  wild.confidence.reset();
  wild.flow.reset();
  table.rows.push_back(wild);
  const AgreementReport report = rater_agreement(table);
  EXPECT_THAT(report.raters, UnorderedElementsAreArray(kFour));
  ASSERT_THAT(report.factors, SizeIs(2));
  EXPECT_NEAR(*report.factors[0].alpha.alpha, 0.849, 0.0005);
  EXPECT_EQ(report.factors[1].factor, "time");
  EXPECT_FALSE(report.factors[1].alpha.alpha);  // of time there is one value only
}

TEST(Agreement, RepeatsTellOfOneRaterAndNotOfTwo) {
  LabelTable table = table_of(krippendorff_example(), kFour);
  // Ann again, of the first three fragments: off by 0.5, 0 and 0.5. The first is marked by the
  // comment of older tables.
  for (int u = 0; u < 3; ++u) {
    LabelRow row = table.rows[0];
    row.fragment = fragment_name(u);
    row.flow = krippendorff_example()(u, 0) + (u == 1 ? 0.0 : 0.5);
    if (u == 0)
      row.comment = "repeat";
    else
      row.repeat = 1;
    table.rows.push_back(row);
  }
  // A repeat is the second word even where it stands first.
  std::swap(table.rows.front(), table.rows.back());
  const AgreementReport report = rater_agreement(table);
  EXPECT_NEAR(*report.factors[0].alpha.alpha, 0.849, 0.0005);
  ASSERT_THAT(report.repeats, SizeIs(1));
  const RepeatAgreement& own = report.repeats[0];
  EXPECT_EQ(own.rater, "ann");
  EXPECT_EQ(own.factor, "flow");
  EXPECT_EQ(own.units, 3);
  EXPECT_EQ(own.values, 6);
  EXPECT_NEAR(own.mean_absolute_difference, 1.0 / 3.0, 1e-14);
  Eigen::MatrixXd pairs(3, 2);
  pairs << 1, 1.5, 2, 2, 3, 3.5;
  EXPECT_NEAR(*own.icc.value, *icc_one_way(pairs).value, 1e-14);
}

TEST(Agreement, ComparesPeopleUnlessAFormulaIsNamed) {
  LabelTable table = table_of(shrout_fleiss_example(), kFour);
  for (LabelRow& row : table.rows) {
    if (row.observer == "dan") row.source = LabelSource::kMeasured;
    if (row.observer == "cat") row.observer = "bob", row.source = LabelSource::kPerformer;
  }
  EXPECT_THAT(rater_agreement(table).raters, ElementsAre("ann", "bob", "bob (performer)"));
  const auto named = rater_agreement(table, {.raters = {"dan", "bob"}});
  EXPECT_THAT(named.raters, ElementsAre("bob", "dan"));
  EXPECT_NEAR(*named.factors[0].icc.value,
              *icc_two_way(shrout_fleiss_example()(Eigen::all, std::vector<int>{1, 3})).value,
              1e-12);
  EXPECT_EQ(message_of(base::ErrorKind::kUsage,
                       [&] { return rater_agreement(table, {.raters = {"eve"}}); }),
            "no row has labels by rater 'eve' (raters are 'ann', 'bob', 'bob (performer)', 'dan')");
  EXPECT_THAT(message_of(base::ErrorKind::kData,
                         [&] { return rater_agreement(table, {.raters = {"dan"}}); }),
              HasSubstr("agreement needs two raters, or repeats of one; compared: 'dan'"));
}

}  // namespace
}  // namespace laban::effort
