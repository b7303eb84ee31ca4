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
[[nodiscard]] StyledPiece replaced(const InputSnippet& own, const PlayedChoice& played);

/// The blend in the performer's own manner (ours, DESIGN 5): timing, travel and legs are the
/// blend's; to the upper body is added what is slow in the difference between the snippet and the
/// fragment nearest to it, at the same moment of the action.
[[nodiscard]] StyledPiece restyled_in_detail(const InputSnippet& own, const StyleModel& model,
                                             const PlayedChoice& played);

/// Part of the way from the snippet (strength 0) to a piece (1), in timing, pose and root travel.
[[nodiscard]] StyledPiece mixed(const InputSnippet& own, const StyledPiece& piece, double strength);

/// A piece played so that its frame t shows the moment of the snippet's frame t.
[[nodiscard]] StyledPiece with_own_timing(const InputSnippet& own, const StyledPiece& piece);

}  // namespace laban::transfer
