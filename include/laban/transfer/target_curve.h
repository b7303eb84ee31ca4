#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "laban/effort/effort.h"

namespace laban::transfer {

/// Effort asked for over time: values at some times, straight lines between them.
///
/// A factor is free at a row that leaves it blank, and between that row and its neighbours. Before
/// the first row and after the last one their values hold.
struct TargetCurve {
  struct Row {
    double seconds = 0.0;  ///< from the beginning of the input's motion
    std::array<std::optional<double>, effort::kMaxFactorCount> factors;  ///< flow .. space
  };
  std::vector<Row> rows;  ///< at least one, times increasing

  /// What is asked of a factor at a time; nullopt where it is free.
  [[nodiscard]] std::optional<double> at(effort::Factor factor, double seconds) const;
  /// What is asked of `frames` frames from `begin_s` on: of each factor its mean over the frames
  /// that ask for it; free where fewer than half of them do.
  [[nodiscard]] std::array<std::optional<double>, effort::kMaxFactorCount> mean_over(
      double begin_s, int frames, double frame_rate_hz) const;
};

/// Most that a change of Effort may be, from one end of the scale to the other.
inline constexpr double kMostEffortChange = effort::kEffortMax - effort::kEffortMin;

/// Reads a curve: CSV with the head "seconds,flow,weight,time,space" (of the factors only those
/// that are used, in any order) and a row a time; blank cells are free.
/// @param name   of the file, for messages.
/// @param limit  greatest magnitude of a value: 3, or kMostEffortChange of changes.
/// @throws Error{kFormat} "name:line: ..." for the first row that breaks a rule: a head without
///         seconds, with another column or one twice; a cell that is no number or beyond the limit;
///         a row of another length; times that are negative or do not increase; no row; nothing
///         asked at all.
[[nodiscard]] TargetCurve parse_target_curve(std::string_view text, std::string_view name,
                                             double limit = effort::kEffortMax);

}  // namespace laban::transfer
