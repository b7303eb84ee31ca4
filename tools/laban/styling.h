#pragma once

#include <span>
#include <string>
#include <vector>

#include "laban/transfer/apply_style.h"
#include "laban/transfer/styled_clip.h"

#include "asked.h"
#include "files.h"

namespace laban::cli {

/// A snippet's blend set by hand, its fragments by their names.
struct HandSetBlend {
  int snippet = 0;
  std::string fragment_i;
  std::string fragment_j;
  double alpha = 0.0;
};

/// How clips are styled, whichever and however many.
struct StylingOptions {
  AskedOptions asked;
  bool may_ask_nothing = false;       ///< nothing asked for is no error: all is kept as captured
  std::vector<HandSetBlend> by_hand;  ///< of one clip; becomes ApplyOptions::by_hand
  transfer::ApplyOptions apply = {.rounds = transfer::kRounds};
  bool no_foot_fix = false;
  std::string model;  ///< path; empty: the default model
  ReadClipOptions reading;
};

/// Adds the target's and the search's options, --model, --detail, --strength, --keep-timing,
/// --strict, --no-foot-fix and how clips are read.
void add_styling_options(CLI::App* verb, StylingOptions& options);

/// A model and what is asked of it: read once, used for every clip.
struct Styling {
  StylingOptions options;
  transfer::AskedEffort asked;
  transfer::StyleModel model;
  std::vector<InputRecord> inputs;  ///< the model, and the curve's file if there is one
};

/// @throws Error{kUsage} before anything is read if what is asked breaks a rule; as find_blends.
[[nodiscard]] Styling read_styling(const StylingOptions& options);

/// What those blends are in a model. @throws Error{kUsage} naming a fragment that it does not have.
[[nodiscard]] std::vector<transfer::BlendByHand> find_blends(
    const std::vector<HandSetBlend>& by_hand, const transfer::StyleModel& model);

/// A clip, read and cut into snippets for one model: ready to be styled again and again.
struct SegmentedClip {
  CapturedClip input;
  transfer::SegmentedInput segmented;
  double seconds_taken = 0.0;  ///< to cut it
};
[[nodiscard]] SegmentedClip segment_clip(const transfer::StyleModel& model, CapturedClip input,
                                         const transfer::ApplyOptions& options,
                                         base::Progress* progress = nullptr);

/// One clip, styled.
struct StyledFile {
  CapturedClip input;
  transfer::AppliedStyle applied;
  transfer::StyledClip styled;
  transfer::StyledQuality quality;
  /// Of each snippet's prediction; nullopt where there is none.
  std::vector<std::optional<effort::Effort>> standard_errors;
  /// Content kept (transfer::content_ratio), nullopt if all is kept as captured.
  std::optional<double> content_ratio;
  double input_skate_cm = 0.0;  ///< of the input, over its own floor
  double seconds_taken = 0.0;   ///< from the clip in memory to the styled clip

  /// Seconds of motion made per second.
  [[nodiscard]] double speed() const;
};

/// The segmented clip in the style, each snippet measured as the output shows it
/// (measure_snippets).
[[nodiscard]] transfer::AppliedStyle restyled(const Styling& styling,
                                              const transfer::SegmentedInput& segmented,
                                              transfer::PlayMemory& memory,
                                              base::Progress* progress = nullptr);
/// Styles a clip; `memory` is of the styling's model.
[[nodiscard]] StyledFile style_segmented(const Styling& styling, SegmentedClip clip,
                                         transfer::PlayMemory& memory,
                                         base::Progress* progress = nullptr);
/// Reads a clip and styles it. @throws naming the file.
[[nodiscard]] StyledFile style_file(const Styling& styling, const std::string& path,
                                    const Common& common, base::Progress* progress = nullptr);

/// The bytes of the styled clip as the file of that path.
[[nodiscard]] std::string styled_bytes(const CapturedClip& input,
                                       const transfer::StyledClip& styled, const std::string& path,
                                       const WriteClipOptions& writing, const Common& common);
/// Writes the clip as `path`, in the format that its ending or `writing` says.
void write_styled(const StyledFile& file, const std::string& path, const WriteClipOptions& writing,
                  const Common& common);

/// Snippets that are kept as captured, and factors asked for beyond what is reachable: what the
/// user should know, a line each.
[[nodiscard]] std::vector<std::string> cautions(const Styling& styling,
                                                const transfer::AppliedStyle& applied,
                                                const std::string& path);

/// Options as resolved, for run records.
[[nodiscard]] Json options_json(const Styling& styling);

/// laban.apply/1 of one clip. It knows no clock: the same input, the same bytes.
[[nodiscard]] Json report_json(const Styling& styling, const StyledFile& file);
/// The same as text for people, lines with their ends.
[[nodiscard]] std::string report_text(const Styling& styling, const StyledFile& file);

}  // namespace laban::cli
