#pragma once

#include <cstdint>
#include <random>
#include <vector>

namespace laban::base {

/// Seeded random numbers that are the same on every platform and standard library: the engine is
/// std::mt19937_64, the distributions are our own.
class Rng {
 public:
  explicit Rng(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in [0, 1), 53 random bits.
  [[nodiscard]] double uniform();
  /// Uniform in [low, high).
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal (polar Box-Muller; the spare value is kept for the next call).
  [[nodiscard]] double normal();
  /// Uniform integer in [0, count), unbiased. @throws Error{kInternal} unless count > 0.
  [[nodiscard]] int index(int count);
  /// A random permutation of 0 .. count - 1 (Fisher-Yates).
  [[nodiscard]] std::vector<int> permutation(int count);
  /// A generator whose stream depends only on this one's seed state and `stream`: independent work
  /// gets the same numbers whatever thread runs it.
  [[nodiscard]] static Rng for_stream(std::uint64_t seed, std::uint64_t stream);

 private:
  std::mt19937_64 engine_;
  bool has_spare_ = false;
  double spare_ = 0.0;
};

}  // namespace laban::base
