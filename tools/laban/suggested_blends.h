#pragma once

#include <vector>

#include "laban/transfer/style_corpus.h"

namespace laban::cli {

/// A blend that is worth a label, and how much of the pool's predictive variance it would take away
/// (effort::Suggestion).
struct SuggestedBlend {
  transfer::CorpusBlend blend;
  double expected_drop = 0.0;
};

/// True if both fragments that it is a blend of have a label: only then can it be suggested, or
/// learnt from.
[[nodiscard]] bool has_labelled_parents(const transfer::StyleCorpus& corpus,
                                        const transfer::CorpusBlend& blend);

/// The blends of a pool that a rater should label next (effort::suggest_blends), the most useful
/// first, beside the corpus's own blends that have a label.
/// @param pool        blends of the corpus's fragments with labelled parents, at least one.
/// @param components  principal components of content.
/// @throws as transfer::fit_corpus_content_map and effort::suggest_blends.
[[nodiscard]] std::vector<SuggestedBlend> suggested_blends(
    const transfer::StyleCorpus& corpus, const std::vector<transfer::CorpusBlend>& pool, int count,
    int components = 3);

}  // namespace laban::cli
