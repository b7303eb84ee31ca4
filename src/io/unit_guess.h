#pragma once

#include <vector>

#include "laban/motion/skeleton.h"

#include "io/warnings.h"

namespace laban::io {

/// Metres per unit of a skeleton of a person whose file does not say it (see read_bvh): the unit
/// that brings its reach, the longest sum of offset lengths from the first branching joint down to
/// a leaf, nearest to an adult's; a centimetre, with a warning, if the skeleton has no size.
///
/// @param joints  in the file's unit, parents before children.
[[nodiscard]] double guess_unit_m(const std::vector<motion::Joint>& joints, Warnings& warnings);

}  // namespace laban::io
