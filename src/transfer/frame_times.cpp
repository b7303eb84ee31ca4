#include "transfer/frame_times.h"

#include <algorithm>
#include <numeric>

namespace laban::transfer {
namespace {

std::vector<double> averaged(const std::vector<double>& values, int reach) {
  const int last = static_cast<int>(values.size()) - 1;
  const auto at = [&](int k) { return values[static_cast<std::size_t>(std::clamp(k, 0, last))]; };
  const auto beyond = [&](int k) {
    if (k < 0) return 2.0 * values.front() - at(-k);
    return k <= last ? at(k) : 2.0 * values.back() - at(2 * last - k);
  };
  std::vector<double> means;
  means.reserve(values.size());
  for (int k = 0; k <= last; ++k) {
    double sum = 0.0;
    for (int away = -reach; away <= reach; ++away) sum += beyond(k + away);
    means.push_back(sum / (2 * reach + 1));
  }
  return means;
}

}  // namespace

std::vector<double> counted(int frames) {
  std::vector<double> numbers(static_cast<std::size_t>(frames));
  std::iota(numbers.begin(), numbers.end(), 0.0);
  return numbers;
}

std::vector<double> evenly(int count, double last) {
  std::vector<double> times = counted(count);
  for (double& time : times) time *= count > 1 ? last / (count - 1) : 0.0;
  return times;
}

std::vector<double> read_at(std::span<const double> values, std::span<const double> frames) {
  const auto last = static_cast<double>(values.size() - 1);
  std::vector<double> read;
  read.reserve(frames.size());
  for (const double frame : frames) {
    const double at = std::clamp(frame, 0.0, last);
    const auto before = static_cast<std::size_t>(at);
    const std::size_t after = std::min(before + 1, values.size() - 1);
    const double share = at - static_cast<double>(before);
    read.push_back((1.0 - share) * values[before] + share * values[after]);
  }
  return read;
}

std::vector<double> where(std::span<const double> values, std::span<const double> wanted) {
  std::vector<double> found;
  found.reserve(wanted.size());
  std::size_t n = 0;
  for (const double value : wanted) {
    while (n + 2 < values.size() && values[n + 1] < value) ++n;
    const double step = values.size() > 1 ? values[n + 1] - values[n] : 0.0;
    const double share = step > 0.0 ? std::clamp((value - values[n]) / step, 0.0, 1.0) : 0.0;
    found.push_back(static_cast<double>(n) + share);
  }
  return found;
}

std::vector<double> smoothed_times(std::vector<double> times, int reach) {
  reach = std::min(reach, static_cast<int>(times.size()) - 1);
  for (int pass = 0; pass < 3; ++pass) times = averaged(times, reach);
  return times;
}

}  // namespace laban::transfer
