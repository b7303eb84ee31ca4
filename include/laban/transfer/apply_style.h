#pragma once

#include <string>
#include <vector>

#include "laban/align/segment_input.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/join.h"
#include "laban/transfer/play_choice.h"
#include "laban/transfer/style_model.h"
#include "laban/transfer/style_search.h"

namespace laban::transfer {

struct ApplyOptions {
  align::SegmentInputOptions segmentation;
  SearchOptions search;
  /// Offsets of joins that would bend the motion more than the fragments themselves decay up to
  /// five times as slowly, and what jerks more than half as much as the fragments at most is
  /// calmed.
  motion::JoinOptions join = {.longest_halflife_s = 0.5, .most_jerk_share = 0.5};
  /// How fast fragments may play in a blend; in (1, 4].
  double fastest_play = kFastestPlay;
  /// A snippet that matches no content is an error; otherwise it is kept as captured and reported.
  bool strict = false;
};

/// One snippet of the input and what became of it.
struct AppliedSnippet {
  int begin = 0;  ///< frames [begin, end) of the input
  int end = 0;
  int output_begin = 0;  ///< frames [output_begin, output_end) of the output
  int output_end = 0;
  int fragment = 0;              ///< the matching fragment of the database
  std::string content;           ///< its content group
  double match_cost = 0.0;       ///< mean path cost of the match, in the metric's units
  double match_threshold = 0.0;  ///< above it there is no content match
  bool kept = false;             ///< no content match: the input's own motion is kept
  BlendChoice choice;            ///< meaningless if kept
  effort::Observation before;    ///< the input's snippet, as the kinematic observer sees it
  effort::Observation measured;  ///< the snippet after synthesis
};

/// An input in another style, on the standard humanoid, at the model's rate.
struct AppliedStyle {
  motion::PoseMatrix pose;
  /// For each output frame the (fractional) input frame that shows the same moment of the action:
  /// what the pose matrix does not say is taken from there (motion::RetargetOptions).
  std::vector<double> source_frames;
  std::vector<AppliedSnippet> snippets;
  /// Where feet touch the ground: found on the fragments, carried through blends and joins; a
  /// column a frame of `pose`.
  motion::FootContacts contacts;
};

/// Shortest input that style transfer takes, seconds: below it there is nothing to match.
inline constexpr double kShortestInputS = 0.25;

/// Style transfer [Torresani06, 7], METHODS 1.5-1.6: cuts the input into fragments of the database,
/// chooses for each the blend that comes nearest to the target, and joins the blends.
///
/// @param input  at the model's frame rate (motion::resample the clip first).
/// @throws Error{kUsage} if target or options have problems; Error{kData} if the rates differ, the
///         input is shorter than kShortestInputS, cannot be segmented, or (strict) a snippet
///         matches no content, naming it and the contents that the model knows.
[[nodiscard]] AppliedStyle apply_style(const StyleModel& model, const motion::PoseMatrix& input,
                                       const EffortTarget& target,
                                       const ApplyOptions& options = {});

}  // namespace laban::transfer
