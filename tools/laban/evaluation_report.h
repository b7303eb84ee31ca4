#pragma once

#include <string>

#include "laban/draw/bar_chart.h"
#include "laban/effort/evaluation.h"

#include "files.h"

namespace laban::cli {

/// Everything but the schema and the run record.
[[nodiscard]] Json to_json(const effort::EvaluationReport& report);

/// Table 1 with the paper's numbers beside ours, the paired differences with their intervals, and
/// what they say of the fifth regressor.
[[nodiscard]] std::string to_text(const effort::EvaluationReport& report);

/// Table 1, a row a factor and model, with the difference to linear interpolation.
[[nodiscard]] std::string table_csv(const effort::EvaluationReport& report);

/// The test errors of every run: a row a run, factor and model.
[[nodiscard]] std::string runs_csv(const effort::EvaluationReport& report);

/// Table 1 as bars, with the paper's numbers as marks.
[[nodiscard]] draw::BarChart table_chart(const effort::EvaluationReport& report);

}  // namespace laban::cli
