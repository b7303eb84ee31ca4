#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Dense>

namespace laban::effort {

/// The Effort factors, in the order of every array, column and table.
enum class Factor { kFlow, kWeight, kTime, kSpace };

/// The factors that the paper models [Torresani06] and the observer measures: those of every label.
inline constexpr int kFactorCount = 3;
inline constexpr std::array<Factor, kFactorCount> kFactors = {Factor::kFlow, Factor::kWeight,
                                                              Factor::kTime};

/// With Space, which experts may label besides (METHODS 0).
inline constexpr int kMaxFactorCount = 4;
inline constexpr std::array<Factor, kMaxFactorCount> kFactorsWithSpace = {
    Factor::kFlow, Factor::kWeight, Factor::kTime, Factor::kSpace};

/// The first `count` factors: what samples or a model of so many rows are about.
/// @param count  kFactorCount or kMaxFactorCount.
[[nodiscard]] constexpr std::span<const Factor> factors_of(Eigen::Index count) noexcept {
  return std::span(kFactorsWithSpace).first(static_cast<std::size_t>(count));
}

/// Ends of the Effort scale (METHODS 0): -3 indulging (Free, Light, Sustained), 0 neutral, +3
/// condensing (Bound, Strong, Sudden).
inline constexpr double kEffortMin = -3.0;
inline constexpr double kEffortMax = 3.0;

/// (flow, weight, time) or (flow, weight, time, space), as learners see it.
using EffortVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxFactorCount, 1>;
/// Columns of such.
using EffortMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxFactorCount, Eigen::Dynamic>;

/// One judgement of how a movement is done; each factor in [-3, 3] when it is a label. A prediction
/// may leave that range.
struct Effort {
  double flow = 0.0;
  double weight = 0.0;
  double time = 0.0;
  double space = 0.0;  ///< read only where Space is modelled, 0 elsewhere

  [[nodiscard]] double operator[](Factor factor) const noexcept { return this->*member(factor); }
  [[nodiscard]] double& operator[](Factor factor) noexcept { return this->*member(factor); }
  friend bool operator==(const Effort&, const Effort&) = default;

 private:
  static constexpr double Effort::*member(Factor factor) noexcept {
    constexpr std::array kMembers = {&Effort::flow, &Effort::weight, &Effort::time, &Effort::space};
    return kMembers[static_cast<std::size_t>(factor)];
  }
};

/// Row of a factor in an EffortVector, 0 .. 3.
[[nodiscard]] constexpr int index_of(Factor factor) noexcept {
  return static_cast<int>(factor);
}

/// "flow", "weight", "time" or "space".
[[nodiscard]] constexpr std::string_view name_of(Factor factor) noexcept {
  constexpr std::array<std::string_view, kMaxFactorCount> kNames = {"flow", "weight", "time",
                                                                    "space"};
  return kNames[static_cast<std::size_t>(factor)];
}

/// The factor of that name (lower case); nullopt if there is none.
[[nodiscard]] constexpr std::optional<Factor> factor_named(std::string_view name) noexcept {
  for (const Factor factor : kFactorsWithSpace) {
    if (name_of(factor) == name) return factor;
  }
  return std::nullopt;
}

/// The pole that a value of the factor leans to: "Free"/"Bound", "Light"/"Strong",
/// "Sustained"/"Sudden" or "Indirect"/"Direct"; "neutral" for 0.
[[nodiscard]] constexpr std::string_view pole_name(Factor factor, double value) noexcept {
  constexpr std::array<std::string_view, kMaxFactorCount> kIndulging = {"Free", "Light",
                                                                        "Sustained", "Indirect"};
  constexpr std::array<std::string_view, kMaxFactorCount> kCondensing = {"Bound", "Strong",
                                                                         "Sudden", "Direct"};
  if (value == 0.0) return "neutral";
  return (value > 0.0 ? kCondensing : kIndulging)[static_cast<std::size_t>(factor)];
}

/// The first `count` factors of an Effort.
[[nodiscard]] inline EffortVector to_vector(const Effort& effort,
                                            Eigen::Index count = kFactorCount) {
  EffortVector vector(count);
  for (const Factor factor : factors_of(count)) vector[index_of(factor)] = effort[factor];
  return vector;
}

[[nodiscard]] inline Effort to_effort(const Eigen::Ref<const EffortVector>& vector) {
  Effort effort;
  for (const Factor factor : factors_of(vector.size())) effort[factor] = vector[index_of(factor)];
  return effort;
}

}  // namespace laban::effort
