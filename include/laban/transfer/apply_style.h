#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "laban/align/segment_input.h"
#include "laban/base/progress.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/join.h"
#include "laban/transfer/asked_effort.h"
#include "laban/transfer/choose_blend.h"
#include "laban/transfer/play_choice.h"
#include "laban/transfer/segmented_input.h"
#include "laban/transfer/style_model.h"
#include "laban/transfer/style_search.h"

namespace laban::transfer {

/// What of the input's own motion lives on in the output.
enum class Detail {
  kReplace,   ///< what is done, and nothing else: the paper's way
  kResidual,  ///< (ours) posture and slow manner of the upper body, beside the nearest fragment's
};

/// "replace" or "residual".
[[nodiscard]] std::string_view name_of(Detail detail);

/// ApplyOptions::rounds for a result that is kept.
inline constexpr int kRounds = 3;

/// A snippet's blend, chosen by hand.
struct BlendByHand {
  int snippet = 0;     ///< of the segmented input
  int fragment_i = 0;  ///< of the model; equal to fragment_j: the fragment itself
  int fragment_j = 0;
  double alpha = 0.0;
};

struct ApplyOptions {
  align::SegmentInputOptions segmentation;
  SearchOptions search;
  /// Blends that are played and measured for a snippet, >= 1 (see choose_blend): 1 answers at once,
  /// as while a slider moves.
  int tries = kTries;
  /// (Ours.) Rounds that follow, >= 0. What is joined to other motion measures otherwise than by
  /// itself, where little moves by an Effort point; so in each round all snippets are measured in
  /// the joined motion, each gets one more try whose target is moved by what joining changed, and
  /// what comes of it is joined again. The motion is kept that misses least of what is asked of all
  /// snippets together. (A snippet alone gets further tries.) A round takes some two thirds as long
  /// as all tries before the first; 0 is for targets that still change. None where labels are not
  /// measured, or more than the blends is played (plays_the_blend).
  int rounds = 0;
  /// Offsets of joins that would bend the motion more than the fragments themselves decay up to
  /// twice as slowly, and what jerks more than half as much as the fragments at most is calmed.
  motion::JoinOptions join = {.longest_halflife_s = 0.2, .most_jerk_share = 0.5};
  /// How fast fragments may play in a blend; in (1, 4].
  double fastest_play = kFastestPlay;
  /// A snippet that matches no content is an error; otherwise it is kept as captured and reported.
  bool strict = false;
  Detail detail = Detail::kReplace;
  /// Snippets for which nothing is searched: they play what is set here, whatever is asked, and
  /// even where no content matches. No snippet twice.
  std::vector<BlendByHand> by_hand = {};
  /// How far from the input, 0, to the full style, 1: timing, pose and root travel are mixed.
  double strength = 1.0;
  /// Each output frame shows the same moment as the input's frame of that number.
  bool keep_timing = false;

  /// True if nothing of the input's own motion or timing is mixed in.
  [[nodiscard]] bool plays_the_blend() const {
    return detail == Detail::kReplace && strength == 1.0 && !keep_timing;
  }
  /// Broken rules, those of `search` and `join` included; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
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
  /// The input's own motion is kept: there is no content match, or nothing is asked here.
  bool kept = false;
  EffortTarget asked;  ///< of this snippet: relative targets and curves resolved
  BlendChoice choice;  ///< meaningless if kept
  /// Share of the input's own motion, 0 .. 1: what the output is compared with includes it.
  double own_share = 0.0;
  effort::Observation before;    ///< the input's snippet, as the kinematic observer sees it
  effort::Observation measured;  ///< the snippet after synthesis, by itself: see measure_snippets
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
  /// ApplyOptions::keep_timing: source_frames count 0, 1, .. over the whole input.
  bool keeps_timing = false;
};

/// Chooses for each snippet the blend that comes nearest to what is asked of it, plays it in the
/// way that `options` say and joins the results [Torresani06, 7], METHODS 1.6.
///
/// Of the options all but `segmentation` count. Kept as captured: snippets that match no content
/// (unless strict), and those of which a curve asks nothing. Strength 0 gives the input back.
/// @throws Error{kUsage} if `asked` or `options` have problems, or a blend by hand is of a snippet
///         that there is not or breaks a rule of BlendSearch::of_pair; Error{kData} if (strict) a
///         snippet matches no content, naming it and the contents that the model knows.
/// @throws Error{kUsage} "interrupted" if progress asks.
[[nodiscard]] AppliedStyle restyle(const StyleModel& model, const SegmentedInput& segmented,
                                   const AskedEffort& asked, const ApplyOptions& options = {},
                                   base::Progress* progress = nullptr);
/// The same again, with what earlier calls found out about the fragments: for target after target.
[[nodiscard]] AppliedStyle restyle(PlayMemory& memory, const SegmentedInput& segmented,
                                   const AskedEffort& asked, const ApplyOptions& options = {},
                                   base::Progress* progress = nullptr);

/// What the observer says of each snippet's frames of the output, joins included: what a body does
/// from one action to the next is none of a blend's own.
[[nodiscard]] std::vector<effort::Observation> measure_snippets(const StyleModel& model,
                                                                const AppliedStyle& applied);

/// segment_input, then restyle: METHODS 1.5-1.6.
/// @throws as these.
[[nodiscard]] AppliedStyle apply_style(const StyleModel& model, const motion::PoseMatrix& input,
                                       const EffortTarget& target,
                                       const ApplyOptions& options = {});

}  // namespace laban::transfer
