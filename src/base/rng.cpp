#include "laban/base/rng.h"

#include <cmath>
#include <numeric>

#include "laban/base/error.h"

namespace laban::base {
namespace {

// SplitMix64's finalizer: spreads neighbouring (seed, stream) pairs over the whole seed space.
std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace

double Rng::uniform() {
  return static_cast<double>(engine_() >> 11) * 0x1.0p-53;
}

double Rng::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  double u = 0.0;
  double v = 0.0;
  double s = 0.0;
  do {
    u = uniform(-1.0, 1.0);
    v = uniform(-1.0, 1.0);
    s = u * u + v * v;
  } while (s >= 1.0 || s == 0.0);
  const double scale = std::sqrt(-2.0 * std::log(s) / s);
  spare_ = v * scale;
  has_spare_ = true;
  return u * scale;
}

int Rng::index(int count) {
  LABAN_CHECK(count > 0);
  const auto bound = static_cast<std::uint64_t>(count);
  const std::uint64_t limit = UINT64_MAX - UINT64_MAX % bound;  // reject the uneven tail
  std::uint64_t x = engine_();
  while (x >= limit) x = engine_();
  return static_cast<int>(x % bound);
}

std::vector<int> Rng::permutation(int count) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  for (int i = count - 1; i > 0; --i) {
    std::swap(order[static_cast<std::size_t>(i)], order[static_cast<std::size_t>(index(i + 1))]);
  }
  return order;
}

Rng Rng::for_stream(std::uint64_t seed, std::uint64_t stream) {
  return Rng(mix(mix(seed) ^ stream));
}

}  // namespace laban::base
