#include "timing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace laban::phrase {
namespace {

/// Quintic with end values p0, p1, end velocities v0, v1 (a unit of u) and no acceleration at the
/// ends, at u in [0, 1].
double quintic(double p0, double v0, double p1, double v1, double u) {
  const double rise = p1 - p0;
  const double c3 = 10.0 * rise - 6.0 * v0 - 4.0 * v1;
  const double c4 = -15.0 * rise + 8.0 * v0 + 7.0 * v1;
  const double c5 = 6.0 * rise - 3.0 * (v0 + v1);
  return p0 + u * (v0 + u * u * (c3 + u * (c4 + u * c5)));
}

/// u moved on by at most a quarter of the way in the middle of the segment; first and second
/// derivatives at the ends are kept, and it increases for |attack| <= 1.
double attacked(double u, double attack) {
  constexpr double kStrength = 0.25 * 64.0;
  return u + attack * kStrength * std::pow(u * (1.0 - u), 3);
}

/// Speed of the score's clock around hesitations: 1 less a bell, twice differentiable.
double clock_speed(double score_time_s, const std::vector<Hesitation>& hesitations) {
  double speed = 1.0;
  for (const Hesitation& pause : hesitations) {
    const double x = 2.0 * (score_time_s - pause.at_s) / pause.length_s;
    if (std::abs(x) < 1.0) speed = std::min(speed, 1.0 - pause.depth * std::pow(1.0 - x * x, 3));
  }
  return speed;
}

}  // namespace

void Track::add(const Key& key) {
  const auto place =
      std::lower_bound(keys_.begin(), keys_.end(), key,
                       [](const Key& a, const Key& b) { return a.time_s < b.time_s; });
  if (place != keys_.end() && place->time_s == key.time_s) {
    *place = key;
  } else {
    keys_.insert(place, key);
  }
}

double Track::velocity(std::size_t key, double fluency) const {
  if (key == 0 || key + 1 == keys_.size()) return 0.0;
  const Key& before = keys_[key - 1];
  const Key& here = keys_[key];
  const Key& after = keys_[key + 1];
  const double in = (here.value - before.value) / (here.time_s - before.time_s);
  const double out = (after.value - here.value) / (after.time_s - here.time_s);
  if (in * out <= 0.0) return 0.0;
  // Harmonic mean of the slopes: never so fast that a segment overshoots.
  return fluency * 2.0 * in * out / (in + out);
}

double Track::value(double time_s, double fluency, double attack) const {
  if (keys_.empty()) return 0.0;
  if (time_s <= keys_.front().time_s) return keys_.front().value;
  if (time_s >= keys_.back().time_s) return keys_.back().value;
  const auto after = std::upper_bound(keys_.begin(), keys_.end(), time_s,
                                      [](double t, const Key& key) { return t < key.time_s; });
  const auto i = static_cast<std::size_t>(after - keys_.begin()) - 1;
  const double span = keys_[i + 1].time_s - keys_[i].time_s;
  const double u = attacked((time_s - keys_[i].time_s) / span, attack);
  return quintic(keys_[i].value, span * velocity(i, fluency), keys_[i + 1].value,
                 span * velocity(i + 1, fluency), u);
}

std::vector<double> performed_times(double score_s, double frame_rate_hz,
                                    const std::vector<Hesitation>& hesitations) {
  constexpr int kSubsteps = 32;  // midpoint rule: the clock is good to far below a frame
  const double step = 1.0 / (frame_rate_hz * kSubsteps);
  std::vector<double> times;
  double time = 0.0;
  // The margin keeps round-off from deciding whether there is a last frame.
  while (time < score_s - 1e-6 * step) {
    times.push_back(time);
    for (int i = 0; i < kSubsteps; ++i) {
      const double middle = time + 0.5 * step * clock_speed(time, hesitations);
      time += step * clock_speed(middle, hesitations);
    }
  }
  return times;
}

}  // namespace laban::phrase
