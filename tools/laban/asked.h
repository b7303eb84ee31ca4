#pragma once

#include <array>
#include <string>
#include <vector>

#include "laban/transfer/asked_effort.h"

#include "files.h"

namespace laban::cli {

/// What is asked for, as it stands on the command line.
struct AskedOptions {
  std::array<std::string, effort::kMaxFactorCount> factors;  ///< "-2", "+1", "+-1"; empty: free
  bool relative = false;
  std::vector<double> weights;  ///< none, three or four
  std::string curve;            ///< CSV file; empty: none
};

/// Adds --flow, --weight, --time, --space, --relative, --weights, --effort-curve.
void add_asked_options(CLI::App* verb, AskedOptions& options);

/// What is asked for. The curve's file is read, and recorded among `inputs`.
/// @param may_ask_nothing  as AskedEffort's.
/// @throws Error{kUsage} naming the option whose value breaks a rule, or if nothing is asked; as
///         transfer::parse_target_curve for the curve's file.
[[nodiscard]] transfer::AskedEffort read_asked(const AskedOptions& options, bool may_ask_nothing,
                                               std::vector<InputRecord>& inputs);

/// "flow -2.00  weight free  time +1.00 from the input's" or "the Effort of curve.csv".
[[nodiscard]] std::string to_text(const AskedOptions& options, const transfer::AskedEffort& asked);
/// For run records: values, which are relative, weights and the curve's file.
[[nodiscard]] Json to_json(const AskedOptions& options, const transfer::AskedEffort& asked);

}  // namespace laban::cli
