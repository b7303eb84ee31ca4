#pragma once

#include <optional>
#include <span>
#include <string>

#include "laban/effort/effort.h"
#include "laban/transfer/apply_style.h"
#include "laban/transfer/styled_clip.h"

#include "files.h"

namespace laban::cli {

/// {"flow": .., "weight": .., "time": ..}, and "space" where it is among the factors.
[[nodiscard]] Json to_json(const effort::Effort& effort,
                           std::span<const effort::Factor> factors = effort::kFactors);
/// Factors asked for; null where one is left free.
[[nodiscard]] Json to_json(const transfer::EffortTarget& target,
                           std::span<const effort::Factor> factors = effort::kFactorsWithSpace);
/// One snippet of an applied style: frames, content, fragments, asked, predicted (with its standard
/// error, where there is one), reachable, measured before and after.
[[nodiscard]] Json to_json(const transfer::AppliedSnippet& snippet,
                           const std::optional<effort::Effort>& standard_error,
                           const transfer::StyleModel& model);
/// The same as a few lines.
[[nodiscard]] std::string to_text(const transfer::AppliedSnippet& snippet,
                                  const std::optional<effort::Effort>& standard_error,
                                  const transfer::StyleModel& model);

/// Quality figures of an output beside its sources (DESIGN 7).
[[nodiscard]] Json to_json(const transfer::StyledQuality& quality);
/// The same in one line.
[[nodiscard]] std::string to_text(const transfer::StyledQuality& quality);

/// "+2.00 -1.13 +0.40"
[[nodiscard]] std::string to_text(const effort::Effort& effort);

/// Adds --neighbours, --samples and --way.
void add_search_options(CLI::App* verb, transfer::SearchOptions& options, int& tries);

}  // namespace laban::cli
