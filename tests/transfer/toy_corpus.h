#pragma once

#include "laban/transfer/style_corpus.h"
#include "laban/transfer/style_model.h"

namespace laban::test {

/// Two actions, "swing" and "circle", by six performers who differ in posture, size and tempo;
/// labels are smooth functions of those, and blends' labels follow the blended size and tempo.
/// Small enough to train in a fraction of a second.
[[nodiscard]] transfer::StyleCorpus toy_corpus(int blends = 30);

/// One performer's clip of an action: size and tempo 1 are the middle.
[[nodiscard]] motion::PoseMatrix toy_clip(bool circle, double size, double tempo, double stoop_rad);

/// A model of the toy corpus, trained once.
[[nodiscard]] const transfer::StyleModel& toy_model();

/// The same of the toy corpus labelled by the observer, fitted to its fragments.
[[nodiscard]] const transfer::StyleModel& measured_toy_model();

}  // namespace laban::test
