#pragma once

#include <vector>

namespace laban::phrase {

/// A value that a control must have at a moment.
struct Key {
  double time_s = 0.0;
  double value = 0.0;
};

/// A curve through keys, twice continuously differentiable: between two keys a quintic that has no
/// acceleration at either and there the velocities of `fluency`:
///   0  the motion stops at every key: a minimum-jerk segment each [Flash & Hogan 1985];
///   1  it passes through keys that lie on its way, and stops where it turns round.
/// `attack` in [-1, 1] moves the peak speed of a segment: > 0 early, < 0 late. Before the first key
/// and after the last the value rests.
class Track {
 public:
  /// Keys may be added in any order; of two at one time the later one added counts.
  void add(const Key& key);
  [[nodiscard]] bool empty() const noexcept { return keys_.empty(); }
  [[nodiscard]] double value(double time_s, double fluency, double attack) const;

 private:
  [[nodiscard]] double velocity(std::size_t key, double fluency) const;

  std::vector<Key> keys_;  // by time, strictly increasing
};

/// Near-stops in the flow of time: where each is, how long and how deep.
struct Hesitation {
  double at_s = 0.0;      ///< on the clock of the score
  double length_s = 0.0;  ///< on that clock: what the slow part spans
  double depth = 0.0;     ///< in [0, 0.95]: share of the speed that is lost in the middle
};

/// The score's clock read at F even ticks of the performance's clock: runs at speed 1 except around
/// hesitations, from 0 to `score_s`, and so lasts longer the more there are.
[[nodiscard]] std::vector<double> performed_times(double score_s, double frame_rate_hz,
                                                  const std::vector<Hesitation>& hesitations);

}  // namespace laban::phrase
