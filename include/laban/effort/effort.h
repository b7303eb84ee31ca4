#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include <Eigen/Dense>

namespace laban::effort {

/// The Effort factors that are modelled, in the order of every array, column and table
/// [Torresani06]. (Space may stand in a label file; nothing here models it.)
enum class Factor { kFlow, kWeight, kTime };

inline constexpr int kFactorCount = 3;
inline constexpr std::array<Factor, kFactorCount> kFactors = {Factor::kFlow, Factor::kWeight,
                                                              Factor::kTime};

/// Ends of the Effort scale (METHODS 0): -3 indulging (Free, Light, Sustained), 0 neutral, +3
/// condensing (Bound, Strong, Sudden).
inline constexpr double kEffortMin = -3.0;
inline constexpr double kEffortMax = 3.0;

/// (flow, weight, time) as learners see it.
using EffortVector = Eigen::Vector3d;

/// One judgement of how a movement is done; each factor in [-3, 3] when it is a label. A prediction
/// may leave that range.
struct Effort {
  double flow = 0.0;
  double weight = 0.0;
  double time = 0.0;

  [[nodiscard]] double operator[](Factor factor) const noexcept {
    return factor == Factor::kFlow ? flow : factor == Factor::kWeight ? weight : time;
  }
  [[nodiscard]] double& operator[](Factor factor) noexcept {
    return factor == Factor::kFlow ? flow : factor == Factor::kWeight ? weight : time;
  }
  friend bool operator==(const Effort&, const Effort&) = default;
};

/// Row of a factor in an EffortVector, 0 .. 2.
[[nodiscard]] constexpr int index_of(Factor factor) noexcept {
  return static_cast<int>(factor);
}

/// "flow", "weight" or "time".
[[nodiscard]] constexpr std::string_view name_of(Factor factor) noexcept {
  constexpr std::array<std::string_view, kFactorCount> kNames = {"flow", "weight", "time"};
  return kNames[static_cast<std::size_t>(factor)];
}

/// The factor of that name (lower case); nullopt if there is none.
[[nodiscard]] constexpr std::optional<Factor> factor_named(std::string_view name) noexcept {
  for (const Factor factor : kFactors) {
    if (name_of(factor) == name) return factor;
  }
  return std::nullopt;
}

/// The pole that a value of the factor leans to: "Free"/"Bound", "Light"/"Strong" or
/// "Sustained"/"Sudden"; "neutral" for 0.
[[nodiscard]] constexpr std::string_view pole_name(Factor factor, double value) noexcept {
  constexpr std::array<std::string_view, kFactorCount> kIndulging = {"Free", "Light", "Sustained"};
  constexpr std::array<std::string_view, kFactorCount> kCondensing = {"Bound", "Strong", "Sudden"};
  if (value == 0.0) return "neutral";
  return (value > 0.0 ? kCondensing : kIndulging)[static_cast<std::size_t>(factor)];
}

[[nodiscard]] inline EffortVector to_vector(const Effort& effort) {
  return {effort.flow, effort.weight, effort.time};
}

[[nodiscard]] inline Effort to_effort(const EffortVector& vector) {
  return {vector[0], vector[1], vector[2]};
}

}  // namespace laban::effort
