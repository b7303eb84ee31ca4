#pragma once

#include <map>
#include <memory>
#include <string>

#include "effort_state.h"
#include "stage.h"
#include "work.h"

namespace laban::studio {

/// Styles the clips that are open by one model, again and again: what each request asks for stands
/// in a state (cli::EffortState), and nothing of it is remembered here.
class EffortRoom {
 public:
  /// @param model  path; empty: the default model.
  EffortRoom(const Stage& stage, const std::string& model, Work& work);

  [[nodiscard]] Routes routes();

  /// Contents, factors, snippets and the state to begin with.
  [[nodiscard]] Json open(const std::string& clip);
  /// The styled clip. A draft plays the search's first answer and leaves the quality figures out.
  [[nodiscard]] Response style(const Json& request);
  /// What else a snippet could play: runners-up, and Effort against alpha for the pair it plays.
  [[nodiscard]] Json snippet(const Json& request);
  /// Effort over time of the input, or of what a state makes of it.
  [[nodiscard]] Json over_time(const Json& request);
  /// The styled clip as a file, byte for byte what `laban apply --state` writes.
  [[nodiscard]] Response exported(const Json& request, const std::string& format);

 private:
  const cli::SegmentedClip& segmented(const std::string& clip);
  /// Makes what a state asks for what `styling_` asks for.
  void take(const Json& state);
  [[nodiscard]] transfer::AppliedStyle applied(const cli::SegmentedClip& clip);
  [[nodiscard]] transfer::StyledClip played(const cli::SegmentedClip& clip,
                                            const transfer::AppliedStyle& applied) const;
  [[nodiscard]] Json report(const cli::SegmentedClip& clip, const transfer::AppliedStyle& applied,
                            const transfer::StyledClip& styled, bool draft) const;

  const Stage& stage_;
  Work& work_;
  cli::Styling styling_;
  transfer::PlayMemory memory_;
  std::map<std::string, cli::SegmentedClip> segmented_;  // by clip
};

}  // namespace laban::studio
