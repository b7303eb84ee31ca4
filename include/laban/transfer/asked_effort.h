#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "laban/effort/observer.h"
#include "laban/transfer/style_search.h"
#include "laban/transfer/target_curve.h"

namespace laban::transfer {

/// What is asked of a whole clip; of each of its snippets it makes a target.
struct AskedEffort {
  /// The same for every snippet; its weights count with a curve too.
  EffortTarget target;
  /// Factors whose value is a change of what the observer measures in the input's snippet.
  std::array<bool, effort::kMaxFactorCount> relative = {};
  /// Instead of the target's factors; each relative or not, as above.
  std::optional<TargetCurve> curve;
  /// True: it is no problem if nothing is asked; snippets are then kept, but for those whose blend
  /// is set by hand.
  bool may_ask_nothing = false;

  /// The target of `frames` frames from `begin_s` on. Relative values are added to `before` and
  /// the sum clamped to [-3, 3]. Nothing may be asked (a curve can be free there).
  [[nodiscard]] EffortTarget of_snippet(double begin_s, int frames, double frame_rate_hz,
                                        const effort::Effort& before) const;
  /// Broken rules: as EffortTarget's (a relative value may lie in [-6, 6]); factors beside a
  /// curve; a change of Space, which is not measured.
  [[nodiscard]] std::vector<std::string> problems() const;
};

}  // namespace laban::transfer
