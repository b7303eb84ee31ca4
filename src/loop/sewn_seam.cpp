#include "loop/sewn_seam.h"

#include <algorithm>
#include <cmath>

#include "laban/math/statistics.h"

namespace laban::loop {
namespace {

// Frames beside an overlap in which it may still be quick.
constexpr int kBeside = 2;

/// The overlap played in `count` frames instead of its own: at full speed at both ends, slower
/// between.
/// @param around  the overlap among captured frames, which tell how it begins and ends.
std::vector<BodyFrame> slowed(Surrounded around, int own_count, int count) {
  // Steps add up to the same way in however many frames.
  for (std::size_t f = 1; f < around.frames.size(); ++f) {
    around.frames[f].added_steps += around.frames[f - 1].added_steps;
  }
  // Speed falls to 1 - depth over the first quarter and rises again over the last: a ramp
  // x^2 (3 - 2x) has the mean 1/2, so 3/4 of `depth` are lost in all.
  const int last = count - 1;
  const double depth = (1.0 - static_cast<double>(own_count - 1) / last) / 0.75;
  std::vector<BodyFrame> played;
  for (int t = 0; t < count; ++t) {
    const auto lost = [](double u) {  // integral of the ramp, then of 1, from 0 to u <= 1/2
      const double x = std::min(1.0, 4.0 * u);
      return 0.25 * x * x * x * (1.0 - 0.5 * x) + std::max(0.0, u - 0.25);
    };
    const double u = static_cast<double>(t) / last;
    const double loss = u <= 0.5 ? lost(u) : 0.75 - lost(1.0 - u);
    played.push_back(sample(around.frames, around.first + last * (u - depth * loss)));
  }
  for (std::size_t f = played.size(); f-- > 1;) {
    played[f].added_steps -= played[f - 1].added_steps;
  }
  played.front().added_steps.setZero();
  return played;
}

}  // namespace

Eigen::Matrix3Xd point_positions(const BodyRows& rows, const BodyFrame& frame) {
  return positions(rows, frame)(Eigen::all, rows.points);
}

MotionRates motion_rates(const BodyRows& rows, std::span<const BodyFrame> frames,
                         double frame_rate_hz) {
  const std::size_t count = frames.size();
  MotionRates rates{std::vector<double>(count, 0.0), std::vector<double>(count, 0.0)};
  if (count < 3) return rates;
  std::vector<Eigen::Matrix3Xd> places;
  for (const BodyFrame& frame : frames) places.push_back(point_positions(rows, frame));
  const double per_point =
      1.0 / std::sqrt(static_cast<double>(std::max<std::size_t>(1, rows.points.size())));
  for (std::size_t f = 1; f + 1 < count; ++f) {
    rates.speed_m_s[f] = (places[f + 1] - places[f - 1]).norm() * 0.5 * frame_rate_hz * per_point;
    rates.acceleration_m_s2[f] = (places[f + 1] - 2.0 * places[f] + places[f - 1]).norm() *
                                 frame_rate_hz * frame_rate_hz * per_point;
  }
  for (auto* values : {&rates.speed_m_s, &rates.acceleration_m_s2}) {
    values->front() = (*values)[1];
    values->back() = (*values)[count - 2];
  }
  return rates;
}

UsualMotion usual_motion(const BodyRows& rows, std::span<const BodyFrame> frames,
                         double frame_rate_hz) {
  MotionRates rates = motion_rates(rows, frames, frame_rate_hz);
  UsualMotion usual;
  usual.speed_m_s = math::percentile(rates.speed_m_s, 99.0);
  usual.acceleration_m_s2 = math::percentile(rates.acceleration_m_s2, 99.0);
  usual.lively_acceleration_m_s2 = math::percentile(rates.acceleration_m_s2, 90.0);
  usual.speeds_m_s = std::move(rates.speed_m_s);
  return usual;
}

Surrounded surrounded(const SeamTask& task, const SewnSeam& seam, int beside) {
  Surrounded around;
  const int out_begin = seam.found.out_begin;
  for (int f = std::max(0, out_begin - beside); f < out_begin; ++f) {
    around.frames.push_back(task.outgoing[static_cast<std::size_t>(f)]);
  }
  around.first = static_cast<int>(around.frames.size());
  around.frames.insert(around.frames.end(), seam.frames.begin(), seam.frames.end());
  const int in_end = seam.found.in_begin + seam.found.frames;
  const int last = std::min(in_end + beside, static_cast<int>(task.incoming.size()));
  for (int f = in_end; f < last; ++f) {
    around.frames.push_back(task.incoming[static_cast<std::size_t>(f)]);
    around.frames.back().move(seam.outgoing_from_incoming);
  }
  return around;
}

RateRatios rate_ratios(const SeamTask& task, const Surrounded& around, int frames) {
  // Rates of a row's end are its neighbours'.
  const int count = static_cast<int>(around.frames.size());
  const int first = std::max(0, around.first - kBeside - 1);
  const int last = std::min(count, around.first + frames + kBeside + 1);
  const MotionRates rates = motion_rates(
      task.rows,
      std::span(around.frames)
          .subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(last - first)),
      task.frame_rate_hz);
  const int begin = std::max(0, around.first - kBeside) - first;
  const int end = std::min(count, around.first + frames + kBeside) - first;
  const auto largest = [&](const std::vector<double>& values) {
    return *std::max_element(values.begin() + begin, values.begin() + end);
  };
  return {largest(rates.speed_m_s) / std::max(1e-9, task.usual.speed_m_s),
          largest(rates.acceleration_m_s2) / std::max(1e-9, task.usual.acceleration_m_s2)};
}

void measure_rates(const SeamTask& task, SewnSeam& seam) {
  const RateRatios ratios =
      rate_ratios(task, surrounded(task, seam, kBeside + 1), seam.found.played_frames);
  seam.found.speed_ratio = ratios.speed;
  seam.found.acceleration_ratio = ratios.acceleration;
}

double excess(const SewnSeam& seam) {
  return std::max({kGoodRates, seam.found.speed_ratio, seam.found.acceleration_ratio});
}

bool better(const SewnSeam& a, const SewnSeam& b) {
  if (excess(a) != excess(b)) return excess(a) < excess(b);
  return a.worth_m < b.worth_m;
}

void calm(const SeamTask& task, SewnSeam& seam) {
  const Surrounded own = surrounded(task, seam, 2);
  SewnSeam best = seam;
  for (int percent = 120; percent <= 200 && excess(best) > 1.0; percent += 20) {
    const int count = (seam.found.frames * percent + 50) / 100;
    SewnSeam slower = seam;
    slower.frames = slowed(own, seam.found.frames, count);
    slower.found.played_frames = count;
    slower.join = seam.join * count / seam.found.frames;
    measure_rates(task, slower);
    if (excess(slower) < excess(best)) best = std::move(slower);
  }
  seam = std::move(best);
}

}  // namespace laban::loop
