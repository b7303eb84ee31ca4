#pragma once

#include <optional>
#include <span>
#include <vector>

#include "laban/loop/endless_loop.h"

#include "loop/body_track.h"

namespace laban::loop {

/// What is usual in a capture: rms over its standard joints a frame.
struct UsualMotion {
  double speed_m_s = 0.0;                 ///< 99th percentile
  double acceleration_m_s2 = 0.0;         ///< 99th percentile
  std::vector<double> speeds_m_s;         ///< of each frame
  double lively_acceleration_m_s2 = 0.0;  ///< 90th percentile
};

/// rms speed and acceleration of each frame but the first and last, which copy their neighbours'.
struct MotionRates {
  std::vector<double> speed_m_s;
  std::vector<double> acceleration_m_s2;
};
[[nodiscard]] MotionRates motion_rates(const BodyRows& rows, std::span<const BodyFrame> frames,
                                       double frame_rate_hz);
[[nodiscard]] UsualMotion usual_motion(const BodyRows& rows, std::span<const BodyFrame> frames,
                                       double frame_rate_hz);

/// A seam that can be played: frames in the outgoing clip's place.
struct SewnSeam {
  FoundSeam found;
  std::vector<BodyFrame> frames;
  PlanarMotion outgoing_from_incoming;
  int join = 0;          ///< frame of the overlap at which the body switches
  double worth_m = 0.0;  ///< less is better: off the captured, feet that slide, clip left out
};

struct SeamTask {
  const BodyRows& rows;
  const std::vector<BodyFrame>& outgoing;
  const std::vector<BodyFrame>& incoming;
  double frame_rate_hz = 0.0;
  UsualMotion usual;
  const motion::Capture& rig;  ///< on whose rig both are
  /// Where the capture stands, if it does.
  std::optional<motion::FootFloor> floor;
  bool holds_feet = true;  ///< they will be held after it
};

/// Standard joints of a frame, model space: 3 x points.
[[nodiscard]] Eigen::Matrix3Xd point_positions(const BodyRows& rows, const BodyFrame& frame);

/// The overlap between up to `beside` captured frames on either side, in the outgoing clip's place.
struct Surrounded {
  std::vector<BodyFrame> frames;
  int first = 0;  ///< frame of the overlap's first
};
[[nodiscard]] Surrounded surrounded(const SeamTask& task, const SewnSeam& seam, int beside);

/// Greatest rates of `frames` frames from around.first on and two on either side.
struct RateRatios {
  double speed = 0.0;  ///< in the captures' 99th percentiles
  double acceleration = 0.0;
};
[[nodiscard]] RateRatios rate_ratios(const SeamTask& task, const Surrounded& around, int frames);
/// Writes speed_ratio and acceleration_ratio of a seam.
void measure_rates(const SeamTask& task, SewnSeam& seam);

/// Rates in the captures' 99th percentiles up to which a seam is as good as any: holding the feet
/// afterwards adds a few hundredths.
inline constexpr double kGoodRates = 0.95;
/// How far a seam is beyond what its captures do: kGoodRates if it is not.
[[nodiscard]] double excess(const SewnSeam& seam);

/// Those within the captures' rates first, then by how good they are.
[[nodiscard]] bool better(const SewnSeam& a, const SewnSeam& b);

/// Plays a seam that is too quick slower: as little as suffices, at most at half its speed.
void calm(const SeamTask& task, SewnSeam& seam);

}  // namespace laban::loop
