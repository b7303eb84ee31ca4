#include "laban/transfer/style_model.h"

#include <fstream>
#include <functional>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/align/dtw.h"
#include "laban/base/container.h"
#include "laban/base/error.h"
#include "laban/transfer/style_search.h"

#include "toy_corpus.h"

namespace laban::transfer {
namespace {

TEST(StyleModel, ReadsBackAsItWasWritten) {
  const StyleModel& model = test::toy_model();
  const std::string bytes = write_style_model(model);
  const StyleModel back = read_style_model(bytes, "toy.laban");
  EXPECT_EQ(write_style_model(back), bytes);
  EXPECT_EQ(back.neighbors, model.neighbors);
  EXPECT_EQ(back.content_margins, model.content_margins);
  const EffortTarget target{{1.0, std::nullopt, -1.0}, {1.0, 1.0, 1.0, 1.0}};
  const BlendChoice a = search_blend(model, 2, target);
  const BlendChoice b = search_blend(back, 2, target);
  EXPECT_EQ(a.alpha, b.alpha);
  EXPECT_EQ(a.predicted, b.predicted);
}

TEST(StyleModel, TrainingTwiceGivesTheSameBytes) {
  EXPECT_EQ(write_style_model(train_style_model(test::toy_corpus())),
            write_style_model(test::toy_model()));
}

TEST(StyleModel, AFragmentIsItsOwnNearestNeighbourAndNeighboursShareItsContent) {
  const StyleModel& model = test::toy_model();
  for (std::size_t i = 0; i < model.fragments.size(); ++i) {
    EXPECT_EQ(model.neighbors[i].front(), static_cast<int>(i));
    EXPECT_EQ(model.neighbors[i].size(), 6U);
    for (const int j : model.neighbors[i]) {
      EXPECT_EQ(model.fragments[static_cast<std::size_t>(j)].content, model.fragments[i].content);
    }
  }
}

TEST(StyleModel, ContentMarginsAreWhatAlignmentsOfAllPairsSay) {
  const StyleModel& model = test::toy_model();
  ASSERT_EQ(model.content_margins.size(), model.fragments.size());
  for (std::size_t i = 0; i < model.fragments.size(); ++i) {
    double own = 1e9, other = 1e9;
    for (std::size_t k = 0; k < model.fragments.size(); ++k) {
      if (k == i) continue;
      const double cost =
          align::dtw_cost(model.database.features()[i], model.database.features()[k]).mean_cost();
      double& least = model.fragments[k].content == model.fragments[i].content ? own : other;
      least = std::min(least, cost);
    }
    EXPECT_NEAR(model.content_margins[i], other - own, 1e-4 * other) << i;
    EXPECT_GT(model.content_margins[i], 0.0) << "swings and circles are not alike";
  }
}

TEST(StyleModel, AFragmentThatLooksLikeAnotherContentHasANegativeMargin) {
  StyleCorpus corpus = test::toy_corpus();
  corpus.fragments[0].content = "circle";  // a swing
  std::erase_if(corpus.blends,
                [](const CorpusBlend& b) { return b.fragment_i == 0 || b.fragment_j == 0; });
  const StyleModel model = train_style_model(corpus);
  for (std::size_t i = 0; i < model.fragments.size(); ++i)
    EXPECT_EQ(model.content_margins[i] < 0.0, i == 0) << i;
}

TEST(StyleModel, OneContentAloneHasNoMargins) {
  StyleCorpus corpus = test::toy_corpus();
  corpus.fragments.resize(6);  // the swings
  std::erase_if(corpus.blends, [](const CorpusBlend& b) { return b.fragment_i >= 6; });
  const StyleModel model = train_style_model(corpus);
  EXPECT_THAT(model.content_margins, ::testing::Each(0.0));
}

TEST(StyleModel, AModelFromANewerVersionIsRefused) {
  std::string bytes = write_style_model(test::toy_model());
  bytes[40] = 9;  // the version, after magic and kind
  try {
    (void)read_style_model(bytes, "new.laban");
    FAIL();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kFormat);
    EXPECT_EQ(std::string(error.what()).find("new.laban: its format version is 9"), 0U)
        << error.what();
  }
}

TEST(StyleModel, AFragmentWithoutALabelIsNamed) {
  StyleCorpus corpus = test::toy_corpus();
  corpus.fragments[3].effort.reset();
  EXPECT_THROW((void)train_style_model(corpus), base::Error);
}

std::string read_error(std::string_view bytes) {
  try {
    (void)read_style_model(bytes, "toy.laban");
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kFormat) << error.what();
    EXPECT_EQ(std::string(error.what()).rfind("toy.laban: ", 0), 0U) << error.what();
    return error.what();
  }
  return "read";
}

TEST(StyleModel, AFileCutShortIsRefused) {
  const std::string bytes = write_style_model(test::toy_model());
  for (std::size_t size = 0; size < bytes.size(); size += size < 4096 ? 1 : 9973) {
    ASSERT_NE(read_error(std::string_view(bytes).substr(0, size)), "read") << size << " bytes";
  }
}

TEST(StyleModel, AFlippedBitIsRefused) {
  std::string bytes = write_style_model(test::toy_model());
  for (std::size_t i = 0; i < bytes.size(); i += i < 512 ? 1 : 9973) {
    bytes[i] = static_cast<char>(bytes[i] ^ 0x04);
    ASSERT_NE(read_error(bytes), "read") << "byte " << i;
    bytes[i] = static_cast<char>(bytes[i] ^ 0x04);
  }
}

struct Harm {
  std::string message;
  std::function<void(base::Container& file)> harm;
};

/// The first of `from` in the header becomes `to`.
std::function<void(base::Container&)> replace_in_header(std::string from, std::string to) {
  return [from = std::move(from), to = std::move(to)](base::Container& file) {
    const std::size_t at = file.header_json.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    file.header_json.replace(at, from.size(), to);
  };
}

std::function<void(base::Container&)> set_value(std::string array, std::size_t index,
                                                double value) {
  return [=](base::Container& file) { file.arrays.at(array).values.at(index) = value; };
}

std::function<void(base::Container&)> set_array(std::string name, base::Array array) {
  return [=](base::Container& file) { file.arrays[name] = array; };
}

std::function<void(base::Container&)> set_header(std::string header) {
  return [=](base::Container& file) { file.header_json = header; };
}

std::string repeated(std::string_view text, int count) {
  std::string result;
  for (int i = 0; i < count; ++i) result += text;
  return result;
}

std::string object_of_keys(int count) {
  std::string text = "{";
  for (int i = 0; i < count; ++i) text += "\"k" + std::to_string(i) + "\":0,";
  return text + "\"last\":0}";
}

// Files made to harm: their checksum is right, what it covers is not.
TEST(StyleModel, PartsThatDoNotFitAreRefusedWhateverTheChecksumSays) {
  const std::vector<double> many(13, 0.0);
  const std::vector<Harm> harms = {
      {"its header is malformed", set_header("")},
      {"its header is malformed", set_header("{\"fragments\":[}")},
      {"its header is malformed", set_header("[]")},
      {"its header is malformed", set_header("{\"frame_rate_hz\":1e999}")},
      {"its header is nested more than 64 deep", set_header(repeated("[", 1'000'000))},
      {"its header is nested more than 64 deep", set_header(repeated("{\"a\":", 1'000'000))},
      {"more than 4096 keys in one object", set_header(object_of_keys(100'000))},
      {"its header is malformed", replace_in_header("\"frame_rate_hz\":60.0", "\"x\":60.0")},
      {"the frame rate must be positive", replace_in_header("60.0", "0.0")},
      {"the frame rate must be positive", replace_in_header("60.0", "1e300")},
      {"its header is malformed",
       replace_in_header("\"leg_length_m\":0.8", "\"leg_length_m\":\"\"")},
      {"a leg length must be positive",
       replace_in_header("\"leg_length_m\":0.8", "\"leg_length_m\":-0.8")},
      {"its metric is unknown", replace_in_header("\"metric\":\"content\"", "\"metric\":\"x\"")},
      {"array 'fragment.3' is missing",
       [](base::Container& file) { file.arrays.erase("fragment.3"); }},
      {"array 'fragment.3' should have 67 rows", set_array("fragment.3", {1, 1, {0.0}})},
      {"a fragment has no frames", set_array("fragment.3", {67, 0, {}})},
      {"a fragment holds no poses", set_value("fragment.3", 0, 1e300)},
      {"its neighbours do not fit its fragments", set_array("neighbors", {1, 13, many})},
      {"its neighbours do not fit its fragments", set_array("neighbors", {0, 2'000'000'000, {}})},
      {"a neighbour is out of range", set_value("neighbors", 0, 12.0)},
      {"a neighbour is out of range", set_value("neighbors", 0, 1e300)},
      {"a neighbour has another content", set_value("neighbors", 0, 11.0)},
      {"a fragment has no neighbours", set_value("neighbors", 0, -1.0)},
      {"(must be k x 126, 1 <= k <= 126, and 63)", set_array("metric.map", {1, 2, {1.0, 1.0}})},
      {"(must be k x 126, 1 <= k <= 126, and 63)", set_array("metric.map", {0, 63, {}})},
      {"array 'metric.reference' should have 63 rows",
       set_array("metric.reference", {1, 1, {0.0}})},
      {"must divide the", set_value("content_map.shape", 0, 1e18)},
      {"must divide the", set_value("content_map.shape", 0, -2.0)},
      {"must divide the", set_value("content_map.shape", 0, 31.0)},
      {"model array content_map.basis", set_array("content_map.basis", {2, 2, {1, 0, 0, 1}})},
      {"coordinates that are not finite",
       [](base::Container& file) {
         file.arrays.at("content_map.basis").values[0] = 1e308;
         file.arrays.at("content_map.mean").values[0] = 1e308;
       }},
      {"regressor 77.000000, must be", set_value("regressor.form", 0, 77.0)},
      {"the sizes of its arrays do not agree", set_array("regressor.inverse_scale", {1, 1, {1.0}})},
      {"model array regressor.weights", set_array("regressor.weights", {2, 1, {1.0, 1.0}})},
      {"must be [c_i, c_j, e_i, e_j, alpha]", set_array("regressor.mean", {2, 1, {0.0, 0.0}})},
      {"its observer has a scale that is not positive", set_value("observer.scale", 0, 0.0)},
      {"array 'observer.center' should have 3 rows", set_array("observer.center", {1, 1, {0.0}})},
      {"array 'match_costs' should have 2 columns", set_array("match_costs", {2, 0, {}})},
  };
  const base::Container sound =
      base::read_container(write_style_model(test::toy_model()), "toy", "laban.style", 3);
  for (const Harm& harm : harms) {
    SCOPED_TRACE(harm.message);
    base::Container file = sound;
    harm.harm(file);
    EXPECT_THAT(read_error(base::write_container(file)), ::testing::HasSubstr(harm.message));
  }
}

// tests/transfer/models/version_1.laban was written when version 1 of the format was the newest:
// six short fragments of the toy corpus. Later versions must go on reading it.
TEST(StyleModel, AFileOfFormatVersion1IsRead) {
  std::ifstream file(LABAN_SOURCE_DIR "/tests/transfer/models/version_1.laban", std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  const StyleModel model = read_style_model(bytes, "version_1.laban");
  ASSERT_EQ(model.fragments.size(), 6U);
  EXPECT_EQ(model.fragments[4].name, "circle_p1");
  EXPECT_EQ(model.fragments[4].content, "circle");
  EXPECT_EQ(model.frame_rate_hz(), 60.0);
  EXPECT_THAT(model.content_margins, ::testing::ElementsAre(0, 0, 0, 0, 0, 0)) << "not known then";
  EXPECT_DOUBLE_EQ(model.fragments[4].pose.leg_length_m, 0.8);
  EXPECT_DOUBLE_EQ(model.fragments[4].effort->flow, 0.36);
  EXPECT_NEAR(
      model.fragments[0].pose.angles(3 * motion::index_of(motion::StandardJoint::kSpine), 2), -0.25,
      1e-15);
  const BlendChoice choice =
      search_blend(model, 4, {{1.0, std::nullopt, -1.0}, {1.0, 1.0, 1.0, 1.0}});
  EXPECT_EQ(model.fragments[static_cast<std::size_t>(choice.fragment_j)].content, "circle");
}

// Version 2 looked at angles and height alone: a map of 64 columns.
TEST(StyleModel, ARowThatAnOlderMetricDidNotKnowCountsNothing) {
  base::Container file =
      base::read_container(write_style_model(test::toy_model()), "toy", "laban.style", 3);
  const base::Array& whole = file.arrays.at("metric.map");
  ASSERT_EQ(whole.cols, align::kContentRowCount);
  base::Array known{whole.rows, 64, {}};
  known.values.assign(whole.values.begin(), whole.values.begin() + 64 * whole.rows);
  file.arrays["metric.map"] = known;
  file.version = 2;
  const StyleModel model = read_style_model(base::write_container(file), "old.laban");
  const Eigen::MatrixXd& map = model.database.metric().map();
  ASSERT_EQ(map.cols(), align::kContentRowCount);
  EXPECT_EQ(map.leftCols(64), test::toy_model().database.metric().map().leftCols(64));
  EXPECT_EQ(map.rightCols(align::kContentRowCount - 64).squaredNorm(), 0.0);
}

TEST(ClusterContents, FindsTheTwoActionsByDtwAlone) {
  const StyleCorpus corpus = test::toy_corpus(0);
  const auto groups = cluster_contents(corpus.fragments, 2);
  for (std::size_t i = 0; i < groups.size(); ++i) EXPECT_EQ(groups[i], i < 6 ? 0 : 1);
}

}  // namespace
}  // namespace laban::transfer
