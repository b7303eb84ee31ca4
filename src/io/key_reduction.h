#pragma once

#include <algorithm>
#include <vector>

namespace laban::io {

/// Frames to keep as keys of `frame_count`, the first and the last among them, so that
/// `fits(i, j)` (frames between the keys i and j are near enough to what is drawn between them)
/// holds for neighbours. fits(i, i + 1) must hold.
///
/// Each step goes as far as doubling and then halving finds: O(n log n) frames looked at, even
/// where one step spans the clip.
template <typename Fits>
[[nodiscard]] std::vector<int> reduce_keys(int frame_count, const Fits& fits) {
  std::vector<int> keys = {0};
  const int last = frame_count - 1;
  while (keys.back() < last) {
    const int begin = keys.back();
    int good = begin + 1;
    int reach = 2;
    while (begin + reach <= last && fits(begin, begin + reach)) {
      good = begin + reach;
      reach *= 2;
    }
    int bad = std::min(begin + reach, last + 1);
    while (bad - good > 1) {
      const int middle = good + (bad - good) / 2;
      (fits(begin, middle) ? good : bad) = middle;
    }
    keys.push_back(good);
  }
  return keys;
}

}  // namespace laban::io
