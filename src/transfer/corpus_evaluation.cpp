#include "laban/transfer/corpus_evaluation.h"

#include "laban/base/error.h"

namespace laban::transfer {
namespace {

Numbering number_groups(std::span<const Fragment> fragments, effort::Protocol protocol) {
  if (protocol == effort::Protocol::kRandom) {
    throw base::Error(base::ErrorKind::kUsage,
                      "random splits hold out blends, not performers or contents");
  }
  return protocol == effort::Protocol::kLeavePerformerOut ? number_performers(fragments)
                                                          : number_contents(fragments);
}

effort::ParentGroups groups_of_parents(std::span<const CorpusBlend> blends,
                                       const Numbering& numbering) {
  effort::ParentGroups groups;
  groups.names = numbering.names;
  for (const CorpusBlend& blend : blends) {
    groups.first.push_back(numbering.numbers[static_cast<std::size_t>(blend.fragment_i)]);
    groups.second.push_back(numbering.numbers[static_cast<std::size_t>(blend.fragment_j)]);
  }
  return groups;
}

std::vector<int> fragments_without(const Numbering& numbering, int group) {
  std::vector<int> rest;
  for (std::size_t n = 0; n < numbering.numbers.size(); ++n) {
    if (numbering.numbers[n] != group) rest.push_back(static_cast<int>(n));
  }
  return rest;
}

}  // namespace

effort::ParentGroups parent_groups(const StyleCorpus& corpus, effort::Protocol protocol) {
  corpus.check();
  return groups_of_parents(corpus.blends, number_groups(corpus.fragments, protocol));
}

effort::EvaluationReport evaluate_corpus(const StyleCorpus& corpus, effort::Protocol protocol,
                                         const effort::EvaluationOptions& options,
                                         const effort::ContentMapOptions& content,
                                         base::Progress* progress) {
  corpus.check();
  const effort::ContentMap map = fit_corpus_content_map(corpus.fragments, content);
  const effort::StyleSamples samples =
      style_samples(corpus, content_coordinates(corpus.fragments, map));
  if (protocol == effort::Protocol::kRandom) return effort::evaluate(samples, options, progress);
  const Numbering numbering = number_groups(corpus.fragments, protocol);
  const auto features_without = [&](int group) {
    return style_samples(corpus, coordinates_known_to(corpus.fragments,
                                                      fragments_without(numbering, group), content))
        .features;
  };
  return effort::evaluate_leaving_one_out(samples, groups_of_parents(corpus.blends, numbering),
                                          protocol, features_without, options, progress);
}

}  // namespace laban::transfer
