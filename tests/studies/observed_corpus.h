#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "laban/effort/observer.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/transfer/style_corpus.h"
#include "laban/transfer/style_model.h"

#include "takes.h"

namespace laban::studies {

/// Models play at the captures' rate, at most at this.
inline constexpr double kMostRateHz = 60.0;
/// Labelled blends of a corpus, as many as the paper's.
inline constexpr int kBlends = 105;

inline transfer::Fragment fragment_of(const Take& take) {
  const double rate_hz = std::min(kMostRateHz, take.capture.clip.frame_rate_hz());
  return {
      take.name, take.content, take.performer,
      motion::resample(motion::to_pose_matrix(take.capture.clip, take.capture.humanoid), rate_hz),
      std::nullopt};
}

inline std::vector<transfer::Fragment> fragments_of(std::span<const Take> takes) {
  std::vector<transfer::Fragment> fragments;
  for (const Take& take : takes) fragments.push_back(fragment_of(take));
  return fragments;
}

/// Fragments with random blends of them, all labelled by the observer, fitted to the fragments.
inline transfer::StyleCorpus observed_corpus(std::vector<transfer::Fragment> fragments,
                                             const transfer::DrawBlendsOptions& draw = {}) {
  transfer::StyleCorpus corpus;
  corpus.fragments = std::move(fragments);
  corpus.blends = transfer::draw_blends(corpus.fragments, draw);
  std::vector<effort::Descriptors> descriptors;
  std::vector<std::string> contents;
  for (const transfer::Fragment& fragment : corpus.fragments) {
    descriptors.push_back(effort::describe(fragment.pose));
    contents.push_back(fragment.content);
  }
  const auto reference = effort::fit_observer_reference(descriptors, contents);
  for (std::size_t n = 0; n < corpus.fragments.size(); ++n)
    corpus.fragments[n].effort = effort::observe(descriptors[n], reference, contents[n]).effort;
  for (transfer::CorpusBlend& blend : corpus.blends) {
    const auto made = transfer::make_blend(corpus.fragments, blend);
    blend.effort = effort::observe(effort::describe(made.pose), reference,
                                   contents[static_cast<std::size_t>(blend.fragment_i)])
                       .effort;
  }
  return corpus;
}

/// A model of all takes but one performer's, labelled by the observer.
inline transfer::StyleModel model_without(std::span<const transfer::Fragment> takes,
                                          const std::string& performer) {
  std::vector<transfer::Fragment> others;
  for (const transfer::Fragment& take : takes) {
    if (take.performer != performer) others.push_back(take);
  }
  transfer::TrainOptions options;
  options.threads = 2;
  return transfer::train_style_model(
      observed_corpus(std::move(others), {.count = kBlends, .seed = 1}), options);
}

}  // namespace laban::studies
