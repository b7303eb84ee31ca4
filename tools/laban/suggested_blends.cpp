#include "suggested_blends.h"

#include "laban/effort/suggestion.h"

namespace laban::cli {
namespace {

Eigen::MatrixXd features_of(const transfer::StyleCorpus& corpus,
                            const std::vector<transfer::CorpusBlend>& blends,
                            const std::vector<Eigen::VectorXd>& coordinates) {
  const int factors = corpus.factor_count;
  Eigen::MatrixXd z(effort::feature_count(static_cast<int>(coordinates.front().size()), factors),
                    static_cast<Eigen::Index>(blends.size()));
  for (std::size_t n = 0; n < blends.size(); ++n) {
    const auto i = static_cast<std::size_t>(blends[n].fragment_i);
    const auto j = static_cast<std::size_t>(blends[n].fragment_j);
    z.col(static_cast<Eigen::Index>(n)) = effort::style_features(
        coordinates[i], coordinates[j], effort::to_vector(*corpus.fragments[i].effort, factors),
        effort::to_vector(*corpus.fragments[j].effort, factors), blends[n].alpha);
  }
  return z;
}

}  // namespace

bool has_labelled_parents(const transfer::StyleCorpus& corpus, const transfer::CorpusBlend& blend) {
  const auto is_labelled = [&](int fragment) {
    return corpus.fragments[static_cast<std::size_t>(fragment)].effort.has_value();
  };
  return is_labelled(blend.fragment_i) && is_labelled(blend.fragment_j);
}

std::vector<SuggestedBlend> suggested_blends(const transfer::StyleCorpus& corpus,
                                             const std::vector<transfer::CorpusBlend>& pool,
                                             int count, int components) {
  std::vector<transfer::CorpusBlend> labelled;
  for (const transfer::CorpusBlend& blend : corpus.blends) {
    if (blend.effort && has_labelled_parents(corpus, blend)) labelled.push_back(blend);
  }
  effort::ContentMapOptions content;
  content.components = components;
  const auto coordinates = transfer::content_coordinates(
      corpus.fragments, transfer::fit_corpus_content_map(corpus.fragments, content));
  std::vector<SuggestedBlend> suggested;
  for (const effort::Suggestion& suggestion : effort::suggest_blends(
           features_of(corpus, labelled, coordinates), features_of(corpus, pool, coordinates),
           {.count = count, .factor_count = corpus.factor_count})) {
    suggested.push_back(
        {pool[static_cast<std::size_t>(suggestion.column)], suggestion.expected_drop});
  }
  return suggested;
}

}  // namespace laban::cli
