#include "laban/transfer/apply_style.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "laban/base/error.h"

#include "transfer/blend_tries.h"
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

/// A snippet of the input, what is asked of it, and what may be played for that.
struct Styling {
  const InputSnippet* own = nullptr;
  EffortTarget asked;
  std::optional<BlendTries> tries;     ///< none: kept, or set by hand
  std::optional<ChosenBlend> by_hand;  ///< if it is

  /// The blend that is played; null: it is kept as captured.
  [[nodiscard]] const ChosenBlend* blend() const {
    return tries ? &tries->best() : by_hand ? &*by_hand : nullptr;
  }
};

StyledPiece piece_of(const StyleModel& model, const InputSnippet& own, const PlayedChoice& played,
                     const ApplyOptions& options) {
  StyledPiece piece = options.detail == Detail::kResidual ? restyled_in_detail(own, model, played)
                                                          : replaced(own, played);
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

/// Every snippet with what is tried for it by itself.
std::vector<Styling> stylings_of(PlayMemory& memory, const SegmentedInput& segmented,
                                 const AskedEffort& asked, const ApplyOptions& options,
                                 base::Progress* progress) {
  const double rate_hz = segmented.input.frame_rate_hz;
  std::vector<Styling> stylings;
  for (const InputSnippet& own : segmented.snippets) {
    base::tell(progress, static_cast<double>(own.begin) / segmented.input.frame_count());
    const BlendByHand* set = by_hand(options, static_cast<int>(stylings.size()));
    Styling& styling = stylings.emplace_back();
    styling.own = &own;
    styling.asked =
        asked.of_snippet(own.begin / rate_hz, own.end - own.begin, rate_hz, own.before.effort);
    if (set != nullptr) {
      styling.by_hand =
          blend_by_hand(memory, own.fragment, set->fragment_i, set->fragment_j, set->alpha,
                        styling.asked, options.search, options.fastest_play);
    } else if (own.matches() && !styling.asked.is_free()) {
      styling.tries.emplace(memory, own.fragment, styling.asked, options.search,
                            options.fastest_play);
      while (styling.tries->count() < options.tries && styling.tries->try_next()) {
      }
    }
  }
  return stylings;
}

AppliedSnippet report_of(const Styling& styling) {
  const InputSnippet& own = *styling.own;
  AppliedSnippet report;
  report.begin = own.begin;
  report.end = own.end;
  report.fragment = own.fragment;
  report.content = own.content;
  report.match_cost = own.match_cost;
  report.match_threshold = own.match_threshold;
  report.asked = styling.asked;
  report.before = own.before;
  return report;
}

/// A snippet's motion; how it came about goes into the report.
StyledPiece piece_of(const StyleModel& model, const Styling& styling, const ApplyOptions& options,
                     AppliedSnippet& report) {
  const InputSnippet& own = *styling.own;
  const ChosenBlend* blend = styling.blend();
  if (blend == nullptr) {
    report.kept = true;
    report.own_share = 1.0;
    report.measured = own.before;
    return as_captured(own);
  }
  report.own_share = 1.0 - options.strength;
  report.choice = blend->choice;
  report.measured = blend->measured;
  StyledPiece piece = piece_of(model, own, blend->played, options);
  if (!options.plays_the_blend())
    report.measured = effort::observe(effort::describe(piece.pose), model.observer, own.content);
  return piece;
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

/// The snippets as they are played now, joined.
AppliedStyle joined(const StyleModel& model, const SegmentedInput& segmented,
                    std::span<const Styling> stylings, const ApplyOptions& options) {
  AppliedStyle applied;
  applied.keeps_timing = options.keep_timing;
  std::vector<motion::PoseMatrix> parts;
  std::vector<motion::FootContacts> contacts;
  int frame = 0;
  for (const Styling& styling : stylings) {
    AppliedSnippet report = report_of(styling);
    StyledPiece piece = piece_of(model, styling, options, report);
    report.output_begin = frame;
    frame += piece.pose.frame_count();
    report.output_end = frame;
    for (const double own_frame : piece.own_frames)
      applied.source_frames.push_back(report.begin + own_frame);
    applied.snippets.push_back(std::move(report));
    parts.push_back(std::move(piece.pose));
    contacts.push_back(std::move(piece.contacts));
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

/// What a joined motion misses of what was searched: the sum of squares of the snippets' costs.
double missed_by(std::span<const Styling> stylings, std::span<const effort::Observation> measured) {
  double sum = 0.0;
  for (std::size_t n = 0; n < stylings.size(); ++n) {
    if (stylings[n].tries) sum += std::pow(stylings[n].tries->cost_of(measured[n].effort), 2);
  }
  return sum;
}

/// One more try for each snippet, knowing what it measures as joined.
/// @returns whether another blend is to be played anywhere.
bool try_again(std::span<Styling> stylings, std::span<const effort::Observation> measured) {
  bool any = false;
  for (std::size_t n = 0; n < stylings.size(); ++n) {
    std::optional<BlendTries>& tries = stylings[n].tries;
    if (!tries) continue;
    const std::size_t before = tries->best_number();
    tries->joined_as(measured[n].effort);
    tries->try_next();
    any |= tries->best_number() != before;
  }
  return any;
}

/// Rounds of tries that know what joining changes (ApplyOptions::rounds).
/// @param first  the stylings joined, as they come.
AppliedStyle tried_as_joined(const StyleModel& model, const SegmentedInput& segmented,
                             std::span<Styling> stylings, const ApplyOptions& options,
                             AppliedStyle first, base::Progress* progress) {
  AppliedStyle best = std::move(first);
  std::vector<effort::Observation> measured = measure_snippets(model, best);
  double least = missed_by(stylings, measured);
  for (int round = 0; round < options.rounds; ++round) {
    base::tell(progress, static_cast<double>(round) / options.rounds);
    if (!try_again(stylings, measured)) continue;
    AppliedStyle next = joined(model, segmented, stylings, options);
    measured = measure_snippets(model, next);
    const double missed = missed_by(stylings, measured);
    if (missed >= least) continue;
    least = missed;
    best = std::move(next);
  }
  return best;
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
  if (rounds < 0)
    found.push_back("ApplyOptions::rounds = " + std::to_string(rounds) + " (must be >= 0)");
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
  const StyleModel& model = memory.model();
  if (options.strict) require_matches(model, segmented);
  require_snippets(segmented, options);
  const bool again = options.rounds > 0 && model.labels_measured && options.plays_the_blend();
  base::ProgressPart alone(progress, 0.0, again ? 1.0 / (1.0 + options.rounds) : 1.0);
  base::ProgressPart together(progress, 1.0 / (1.0 + options.rounds), 1.0);
  std::vector<Styling> stylings = stylings_of(memory, segmented, asked, options, &alone);
  AppliedStyle applied = joined(model, segmented, stylings, options);
  if (!again) return applied;
  return tried_as_joined(model, segmented, stylings, options, std::move(applied), &together);
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
