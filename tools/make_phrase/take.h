#pragma once

#include "laban/motion/clip.h"

namespace laban::phrase {

/// One take of the five actions, one after the other without a cut, by a performer who is not in
/// the corpus: what a user brings to style transfer. Neutral in every Effort factor.
[[nodiscard]] motion::Clip make_take();

}  // namespace laban::phrase
