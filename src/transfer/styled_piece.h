#pragma once

#include <vector>

#include "laban/motion/foot_contacts.h"
#include "laban/motion/pose_matrix.h"
#include "laban/transfer/play_choice.h"
#include "laban/transfer/segmented_input.h"

namespace laban::transfer {

/// What becomes of one snippet before it is joined to the others.
struct StyledPiece {
  motion::PoseMatrix pose;
  motion::FootContacts contacts;
  /// For each frame of `pose` the (fractional) frame of the snippet, counted from its beginning,
  /// that shows the same moment; from its first to its last, increasing.
  std::vector<double> own_frames;
};

/// The snippet as it was captured.
[[nodiscard]] StyledPiece as_captured(const InputSnippet& own);

/// The blend itself, the paper's way: nothing of the snippet but what is done.
[[nodiscard]] StyledPiece replaced(const InputSnippet& own, PlayedChoice played);

/// The snippet itself, changed by what the blend has other than the fragment nearest to it (ours,
/// DESIGN 5): pose, height and steps by the difference, timing by the ratio of their speeds.
/// Where the blend is the nearest fragment, this is the snippet.
[[nodiscard]] StyledPiece restyled_in_detail(const InputSnippet& own, PlayMemory& memory,
                                             const PlayedChoice& played);

/// Part of the way from the snippet (strength 0) to a piece (1), in timing, pose and root travel.
[[nodiscard]] StyledPiece mixed(const InputSnippet& own, const StyledPiece& piece, double strength);

/// A piece played so that its frame t shows the moment of the snippet's frame t.
[[nodiscard]] StyledPiece with_own_timing(const InputSnippet& own, const StyledPiece& piece);

}  // namespace laban::transfer
