#include "laban/transfer/style_model.h"

#include <gtest/gtest.h>

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
  const EffortTarget target{{1.0, std::nullopt, -1.0}, {1.0, 1.0, 1.0}};
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

TEST(ClusterContents, FindsTheTwoActionsByDtwAlone) {
  const StyleCorpus corpus = test::toy_corpus(0);
  const auto groups = cluster_contents(corpus.fragments, 2);
  for (std::size_t i = 0; i < groups.size(); ++i) EXPECT_EQ(groups[i], i < 6 ? 0 : 1);
}

}  // namespace
}  // namespace laban::transfer
