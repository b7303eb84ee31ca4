#pragma once

#include <span>
#include <vector>

#include "loop/sewn_seam.h"

namespace laban::loop {

/// How many frames at the beginning, 0 to 3, are no motion but leap into it (what is left of a
/// T-pose that a rig's files begin with): steps over 1.5 times any later one.
[[nodiscard]] int first_flowing_frame(const motion::Clip& clip, const motion::Humanoid& humanoid);
/// The capture from that frame on.
[[nodiscard]] motion::Capture flowing(const motion::Capture& capture, int first_frame);

/// Places the overlap, cuts, blends and smooths, leads the feet: the best `count` seams that differ
/// in place, best first. At least one. Seams whose speed or acceleration is beyond the captures'
/// own come after all others and are left out where there are others, and so are seams that are
/// much worse than the best: frames far from all captured ones, and feet that slide.
[[nodiscard]] std::vector<SewnSeam> find_seams(const SeamTask& task, const SeamOptions& options,
                                               int count);

/// The turn and shift that bring the incoming overlap to the outgoing one: least squares over the
/// joints, feet that stand in both counting most, the middle of the overlap more than its ends.
[[nodiscard]] PlanarMotion align_overlap(const BodyRows& rows, std::span<const BodyFrame> outgoing,
                                         std::span<const BodyFrame> incoming);

}  // namespace laban::loop
