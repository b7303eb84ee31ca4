#pragma once

#include <string>
#include <vector>

#include "laban/align/segment_input.h"
#include "laban/base/progress.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/pose_matrix.h"
#include "laban/transfer/style_model.h"

namespace laban::transfer {

/// One snippet of an input: what it shows, before anything is asked of it.
struct InputSnippet {
  int begin = 0;  ///< frames [begin, end) of the input
  int end = 0;
  int fragment = 0;              ///< the matching fragment of the database
  std::string content;           ///< its content group
  double match_cost = 0.0;       ///< mean path cost of the match, in the metric's units
  double match_threshold = 0.0;  ///< above it there is no content match
  effort::Observation before;    ///< as the kinematic observer sees it
  motion::PoseMatrix pose;       ///< these frames of the input
  motion::FootContacts contacts;

  [[nodiscard]] bool matches() const { return match_cost <= match_threshold; }
};

/// An input cut into snippets, for one model. Restyling it, again and again, needs no more
/// segmentation.
struct SegmentedInput {
  motion::PoseMatrix input;
  std::vector<InputSnippet> snippets;  ///< in input order, without gap or overlap; at least one
};

/// Shortest input that style transfer takes, seconds: below it there is nothing to match.
inline constexpr double kShortestInputS = 0.25;

/// Cuts an input into snippets that each show the content of one fragment of the model.
/// @param input  at the model's frame rate (motion::resample the clip first).
/// @throws Error{kUsage} if `options` has problems, or "interrupted" if progress asks; Error{kData}
///         if the rates differ, the input is shorter than kShortestInputS or cannot be segmented.
[[nodiscard]] SegmentedInput segment_input(const StyleModel& model, const motion::PoseMatrix& input,
                                           const align::SegmentInputOptions& options = {},
                                           base::Progress* progress = nullptr);

}  // namespace laban::transfer
