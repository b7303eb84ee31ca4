#include "laban/transfer/target_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/transfer/asked_effort.h"

namespace laban::transfer {
namespace {

using effort::Factor;

std::string message_of(const std::string& text, double limit = 3.0) {
  try {
    (void)parse_target_curve(text, "curve.csv", limit);
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kFormat);
    return error.what();
  }
  return "read";
}

TEST(TargetCurve, RunsStraightBetweenRowsAndHoldsItsEnds) {
  const TargetCurve curve =
      parse_target_curve("seconds,flow,weight,time\n1,0,,-2\n3,+1,,2\n", "curve.csv");
  EXPECT_EQ(curve.at(Factor::kFlow, 0.0), 0.0);
  EXPECT_DOUBLE_EQ(*curve.at(Factor::kFlow, 1.5), 0.25);
  EXPECT_EQ(curve.at(Factor::kFlow, 9.0), 1.0);
  EXPECT_EQ(curve.at(Factor::kTime, 2.0), 0.0);
  EXPECT_EQ(curve.at(Factor::kWeight, 2.0), std::nullopt);
}

TEST(TargetCurve, ABlankCellFreesItsNeighbourhood) {
  const TargetCurve curve =
      parse_target_curve("seconds,time\n0,1\n1,1\n2,\n3,1\n4,1\n", "curve.csv");
  EXPECT_EQ(curve.at(Factor::kTime, 1.0), 1.0);
  EXPECT_EQ(curve.at(Factor::kTime, 1.1), std::nullopt);
  EXPECT_EQ(curve.at(Factor::kTime, 2.0), std::nullopt);
  EXPECT_EQ(curve.at(Factor::kTime, 2.9), std::nullopt);
  EXPECT_EQ(curve.at(Factor::kTime, 3.0), 1.0);
}

TEST(TargetCurve, ASnippetTakesTheMeanOverItsFrames) {
  const TargetCurve curve = parse_target_curve("time,seconds\n0,0\n3,3\n,3.5\n", "curve.csv");
  // Frames at 1.0, 1.1, .. 1.9 s.
  EXPECT_NEAR(*curve.mean_over(1.0, 10, 10.0)[2], 1.45, 1e-12);
  // Of 3.0, 3.1, .. only the first one asks: free.
  EXPECT_EQ(curve.mean_over(3.0, 5, 10.0)[2], std::nullopt);
  // 2.8, 2.9, 3.0 ask, 3.1 and 3.2 do not.
  EXPECT_NEAR(*curve.mean_over(2.8, 5, 10.0)[2], 2.9, 1e-12);
}

TEST(TargetCurve, FaultsAreToldByLine) {
  using ::testing::StartsWith;
  EXPECT_THAT(message_of(""), StartsWith("curve.csv:1: it is empty"));
  EXPECT_THAT(message_of("flow,time\n1,2\n"), StartsWith("curve.csv:1: the head has no column"));
  EXPECT_THAT(message_of("seconds,grace\n1,2\n"), StartsWith("curve.csv:1: column 'grace'"));
  EXPECT_THAT(message_of("seconds,flow,flow\n1,2,2\n"), StartsWith("curve.csv:1: column 'flow'"));
  EXPECT_THAT(message_of("seconds,flow\n0,1\n1,2,3\n"),
              StartsWith("curve.csv:3: 3 cells (the head has 2)"));
  EXPECT_THAT(message_of("seconds,flow\n0,slow\n"),
              StartsWith("curve.csv:2: flow = 'slow' is no number"));
  EXPECT_THAT(message_of("seconds,flow\n,1\n"), StartsWith("curve.csv:2: seconds = '' is no"));
  EXPECT_THAT(message_of("seconds,flow\n0,nan\n"), StartsWith("curve.csv:2: flow = 'nan'"));
  EXPECT_THAT(message_of("seconds,flow\n0,3.5\n"),
              StartsWith("curve.csv:2: flow = 3.5 (must be in [-3, 3])"));
  EXPECT_EQ(message_of("seconds,flow\n0,3.5\n", kMostEffortChange), "read");
  EXPECT_THAT(message_of("seconds,flow\n-1,1\n"), StartsWith("curve.csv:2: seconds = -1"));
  EXPECT_THAT(message_of("seconds,flow\n1,1\n\n1,2\n"),
              StartsWith("curve.csv:4: seconds = 1 does not come after 1"));
  EXPECT_THAT(message_of("seconds,flow\n0,\n2,\n"), StartsWith("curve.csv:3: nothing is asked"));
}

TEST(AskedEffort, RelativeValuesAreAddedAndClampedToTheScale) {
  AskedEffort asked{{{1.0, -1.5, 0.5}, {1.0, 1.0, 1.0, 1.0}}, {true, true, false}, std::nullopt};
  const EffortTarget target = asked.of_snippet(0.0, 10, 60.0, {0.25, -2.0, 2.0});
  EXPECT_EQ(*target.factors[0], 1.25);
  EXPECT_EQ(*target.factors[1], -3.0);
  EXPECT_EQ(*target.factors[2], 0.5);
}

TEST(AskedEffort, SaysWhichRuleIsBroken) {
  using ::testing::ElementsAre;
  using ::testing::HasSubstr;
  using ::testing::IsEmpty;
  EXPECT_THAT(AskedEffort{}.problems(), ElementsAre(HasSubstr("no target given")));
  AskedEffort asked{{{4.0, {}, {}}, {1.0, 1.0, 1.0, 1.0}}, {true, false, false}, std::nullopt};
  EXPECT_THAT(asked.problems(), IsEmpty());
  asked.relative[0] = false;
  EXPECT_THAT(asked.problems(), ElementsAre(HasSubstr("flow = 4")));
  asked.relative[0] = true;
  asked.target.factors[0] = -6.5;
  EXPECT_THAT(asked.problems(), ElementsAre(HasSubstr("change of flow = -6.5")));
  asked.target.factors[0] = 1.0;
  asked.curve = TargetCurve{{{0.0, {1.0, {}, {}}}}};
  EXPECT_THAT(asked.problems(), ElementsAre(HasSubstr("beside an Effort curve")));
  asked.target.factors[0].reset();
  EXPECT_THAT(asked.problems(), IsEmpty());
  asked.target.weights[1] = 0.0;
  EXPECT_THAT(asked.problems(), ElementsAre(HasSubstr("weight of weight = 0")));
}

}  // namespace
}  // namespace laban::transfer
