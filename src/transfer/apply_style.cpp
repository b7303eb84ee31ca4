#include "laban/transfer/apply_style.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"

#include "transfer/styled_piece.h"

namespace laban::transfer {
namespace {

using base::Error;
using base::ErrorKind;

std::string known_contents(const StyleModel& model) {
  std::string list;
  for (const std::string& name : model.contents.names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

void require_matches(const StyleModel& model, const SegmentedInput& segmented) {
  for (const InputSnippet& own : segmented.snippets) {
    if (own.matches()) continue;
    throw Error(
        ErrorKind::kData,
        "input frames " + std::to_string(own.begin) + " to " + std::to_string(own.end) +
            " match no content of the model, which knows: " + known_contents(model) +
            "; add such fragments to its corpus, or leave --strict out to keep them as captured");
  }
}

/// A snippet as it is asked for: its motion, and the report of it but for its place in the output.
struct Restyled {
  AppliedSnippet report;
  StyledPiece piece;
};

StyledPiece piece_of(const StyleModel& model, const InputSnippet& own, PlayedChoice played,
                     const ApplyOptions& options) {
  StyledPiece piece = options.detail == Detail::kResidual ? restyled_in_detail(own, model, played)
                                                          : replaced(own, std::move(played));
  if (options.strength < 1.0) piece = mixed(own, piece, options.strength);
  if (options.keep_timing) piece = with_own_timing(own, piece);
  return piece;
}

/// The blend that is set by hand for a snippet; null: none.
const BlendByHand* by_hand(const ApplyOptions& options, int snippet) {
  for (const BlendByHand& blend : options.by_hand)
    if (blend.snippet == snippet) return &blend;
  return nullptr;
}

void require_snippets(const SegmentedInput& segmented, const ApplyOptions& options) {
  const auto count = static_cast<int>(segmented.snippets.size());
  for (const BlendByHand& blend : options.by_hand) {
    if (blend.snippet >= 0 && blend.snippet < count) continue;
    throw Error(ErrorKind::kUsage, "a blend by hand: there is no snippet " +
                                       std::to_string(blend.snippet) + "; the input has " +
                                       std::to_string(count) + ", from 0 on");
  }
}

Restyled restyle(PlayMemory& memory, const InputSnippet& own, const EffortTarget& asked,
                 const BlendByHand* set, const ApplyOptions& options) {
  const StyleModel& model = memory.model();
  Restyled restyled;
  AppliedSnippet& report = restyled.report;
  report.begin = own.begin;
  report.end = own.end;
  report.fragment = own.fragment;
  report.content = own.content;
  report.match_cost = own.match_cost;
  report.match_threshold = own.match_threshold;
  report.kept = set == nullptr && (!own.matches() || asked.is_free());
  report.asked = asked;
  report.before = own.before;
  if (report.kept) {
    report.own_share = 1.0;
    report.measured = own.before;
    restyled.piece = as_captured(own);
    return restyled;
  }
  report.own_share = 1.0 - options.strength;
  ChosenBlend chosen = set == nullptr
                           ? choose_blend(memory, own.fragment, asked, options.search,
                                          options.tries, options.fastest_play)
                           : blend_by_hand(memory, own.fragment, set->fragment_i, set->fragment_j,
                                           set->alpha, asked, options.search, options.fastest_play);
  report.choice = std::move(chosen.choice);
  report.measured = chosen.measured;
  restyled.piece = piece_of(model, own, std::move(chosen.played), options);
  if (!options.plays_the_blend()) {
    report.measured =
        effort::observe(effort::describe(restyled.piece.pose), model.observer, own.content);
  }
  return restyled;
}

/// Pieces know no step from one to the next, and a join makes one up; where both are the input's
/// own motion, so is the step between them.
void restore_own_steps(AppliedStyle& applied, const motion::PoseMatrix& input) {
  for (std::size_t n = 1; n < applied.snippets.size(); ++n) {
    const AppliedSnippet& before = applied.snippets[n - 1];
    const AppliedSnippet& after = applied.snippets[n];
    const double share = std::min(before.own_share, after.own_share);
    const int at = after.begin;
    if (share <= 0.0 || before.end - before.begin < 2 || after.end - after.begin < 2) continue;
    const Eigen::Vector3d made_up = 0.5 * (input.steps.col(at - 1) + input.steps.col(at + 1));
    applied.pose.steps.col(after.output_begin) += share * (input.steps.col(at) - made_up);
  }
}

}  // namespace

std::string_view name_of(Detail detail) {
  return detail == Detail::kResidual ? "residual" : "replace";
}

std::vector<std::string> ApplyOptions::problems() const {
  std::vector<std::string> found = search.problems();
  const std::vector<std::string> joining = join.problems();
  found.insert(found.end(), joining.begin(), joining.end());
  if (!(fastest_play > 1.0 && fastest_play <= align::kMaxWarpSlope)) {
    found.push_back("ApplyOptions::fastest_play = " + std::to_string(fastest_play) +
                    " (must be in (1, 4])");
  }
  if (tries < 1)
    found.push_back("ApplyOptions::tries = " + std::to_string(tries) + " (must be >= 1)");
  for (std::size_t n = 0; n < by_hand.size(); ++n) {
    for (std::size_t m = 0; m < n; ++m) {
      if (by_hand[m].snippet == by_hand[n].snippet) {
        found.push_back("ApplyOptions::by_hand sets snippet " + std::to_string(by_hand[n].snippet) +
                        " twice");
      }
    }
  }
  if (!(strength >= 0.0 && strength <= 1.0)) {
    found.push_back("ApplyOptions::strength = " + std::to_string(strength) +
                    " (must be in [0, 1])");
  }
  return found;
}

AppliedStyle restyle(PlayMemory& memory, const SegmentedInput& segmented, const AskedEffort& asked,
                     const ApplyOptions& options, base::Progress* progress) {
  base::require_none(asked.problems());
  base::require_none(options.problems());
  if (options.strict) require_matches(memory.model(), segmented);
  require_snippets(segmented, options);
  AppliedStyle applied;
  applied.keeps_timing = options.keep_timing;
  std::vector<motion::PoseMatrix> parts;
  std::vector<motion::FootContacts> contacts;
  const double rate_hz = segmented.input.frame_rate_hz;
  int frame = 0;
  for (const InputSnippet& own : segmented.snippets) {
    base::tell(progress, static_cast<double>(own.begin) / segmented.input.frame_count());
    const EffortTarget target =
        asked.of_snippet(own.begin / rate_hz, own.end - own.begin, rate_hz, own.before.effort);
    const auto snippet = static_cast<int>(applied.snippets.size());
    Restyled restyled = restyle(memory, own, target, by_hand(options, snippet), options);
    restyled.report.output_begin = frame;
    frame += restyled.piece.pose.frame_count();
    restyled.report.output_end = frame;
    for (const double own_frame : restyled.piece.own_frames)
      applied.source_frames.push_back(own.begin + own_frame);
    applied.snippets.push_back(std::move(restyled.report));
    parts.push_back(std::move(restyled.piece.pose));
    contacts.push_back(std::move(restyled.piece.contacts));
  }
  motion::JoinOptions join = options.join;
  const bool own_motion =
      std::all_of(applied.snippets.begin(), applied.snippets.end(),
                  [](const AppliedSnippet& snippet) { return snippet.own_share == 1.0; });
  if (own_motion) join.most_jerk_share.reset();  // what the input does where it was cut is its own
  applied.pose = motion::concatenate(parts, join);
  restore_own_steps(applied, segmented.input);
  applied.contacts = motion::concatenate(contacts);
  // Leg lengths of fragments are other people's; the motion goes back onto the input's body.
  applied.pose.leg_length_m = segmented.input.leg_length_m;
  return applied;
}

AppliedStyle restyle(const StyleModel& model, const SegmentedInput& segmented,
                     const AskedEffort& asked, const ApplyOptions& options,
                     base::Progress* progress) {
  PlayMemory memory(model);
  return restyle(memory, segmented, asked, options, progress);
}

std::vector<effort::Observation> measure_snippets(const StyleModel& model,
                                                  const AppliedStyle& applied) {
  std::vector<effort::Observation> measured;
  for (const AppliedSnippet& snippet : applied.snippets) {
    const motion::PoseMatrix own = applied.pose.slice(snippet.output_begin, snippet.output_end);
    measured.push_back(effort::observe(effort::describe(own), model.observer, snippet.content));
  }
  return measured;
}

AppliedStyle apply_style(const StyleModel& model, const motion::PoseMatrix& input,
                         const EffortTarget& target, const ApplyOptions& options) {
  base::require_none(target.problems());
  base::require_none(options.problems());
  return restyle(model, segment_input(model, input, options.segmentation), {target, {}, {}},
                 options);
}

}  // namespace laban::transfer
