#pragma once

#include <string>

#include "laban/effort/effort.h"
#include "laban/transfer/apply_style.h"
#include "laban/transfer/styled_clip.h"

#include "files.h"

namespace laban::cli {

/// {"flow": .., "weight": .., "time": ..}
[[nodiscard]] Json to_json(const effort::Effort& effort);
/// Factors asked for; null where one is left free.
[[nodiscard]] Json to_json(const transfer::EffortTarget& target);
/// One snippet of an applied style: frames, content, pair, alpha, asked, predicted, reachable,
/// measured before and after.
[[nodiscard]] Json to_json(const transfer::AppliedSnippet& snippet,
                           const transfer::StyleModel& model);

/// Quality figures of an output beside its sources (DESIGN 7).
[[nodiscard]] Json to_json(const transfer::StyledQuality& quality);
/// The same in one line.
[[nodiscard]] std::string to_text(const transfer::StyledQuality& quality);

/// "flow +2.00  weight free  time -1.50"
[[nodiscard]] std::string to_text(const transfer::EffortTarget& target);
/// "+2.00 -1.13 +0.40"
[[nodiscard]] std::string to_text(const effort::Effort& effort);

/// Adds --flow, --weight and --time.
void add_target_options(CLI::App* verb, transfer::EffortTarget& target);
/// Adds --neighbours and --samples.
void add_search_options(CLI::App* verb, transfer::SearchOptions& options);

}  // namespace laban::cli
