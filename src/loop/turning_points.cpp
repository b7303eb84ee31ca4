#include "laban/loop/turning_points.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"
#include "laban/loop/distance_map.h"

namespace laban::loop {
namespace {

using base::Error;
using base::ErrorKind;

constexpr double kNone = -1.0;

int window_frames(double seconds, double frame_rate_hz) {
  return std::max(1, static_cast<int>(std::lround(seconds * frame_rate_hz)));
}

/// Distance of two frames of angles by the metric asked for.
std::function<double(const Eigen::VectorXd&, const Eigen::VectorXd&)> metric(
    const Eigen::Ref<const Eigen::MatrixXd>& angles, double frame_rate_hz, FrameDistance which) {
  if (which == FrameDistance::kMahalanobis) {
    const Eigen::VectorXd precision = velocity_variance(angles, frame_rate_hz).cwiseInverse();
    return [precision](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
      return (a - b).cwiseAbs2().dot(precision);
    };
  }
  const double mean = mean_l2_distance(angles);
  const double scale = mean > 0.0 ? mean : 1.0;
  return [scale](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    double sum = 0.0;
    for (Eigen::Index row = 0; row < a.size(); row += 3) {
      sum += (a.segment<3>(row) - b.segment<3>(row)).norm();
    }
    return 1.0 - std::exp(-sum / scale);
  };
}

/// sum_r w_r D of the frame and the motion mirrored through it, over the r that fit.
template <typename Distance>
double weighted_sum(const Eigen::VectorXd& weights, int fit, const Distance& distance) {
  double sum = 0.0;
  double weight = 0.0;
  for (int r = 1; r <= fit; ++r) {
    if (weights[r - 1] <= 0.0) break;
    sum += weights[r - 1] * distance(r);
    weight += weights[r - 1];
  }
  return weight > 0.0 ? sum / weight : 0.0;
}

/// The largest weighted sum, by which eq. 4 maps to [0, 1], and what it maps.
struct Sums {
  Eigen::VectorXd values;  // kNone where the window does not fit
  double largest = 0.0;
};

Sums symmetry_sums(int frame_count, const Eigen::VectorXd& weights,
                   const std::function<double(int, int)>& distance) {
  const int window = static_cast<int>(weights.size());
  Sums sums{Eigen::VectorXd::Constant(frame_count, kNone), 0.0};
  for (int i = 0; i < frame_count; ++i) {
    const int fit = std::min({window, i, frame_count - 1 - i});
    if (2 * fit < window) continue;
    sums.values[i] = weighted_sum(weights, fit, [&](int r) { return distance(i - r, i + r); });
    sums.largest = std::max(sums.largest, sums.values[i]);
  }
  return sums;
}

Eigen::VectorXd mapped(const Sums& sums) {
  Eigen::VectorXd symmetry = Eigen::VectorXd::Constant(sums.values.size(), kNone);
  if (!(sums.largest > 0.0)) return symmetry;
  for (Eigen::Index i = 0; i < symmetry.size(); ++i) {
    if (sums.values[i] >= 0.0) symmetry[i] = 1.0 - sums.values[i] / sums.largest;
  }
  return symmetry;
}

std::vector<TurningPoint> local_maxima(const Eigen::VectorXd& symmetry, int apart,
                                       double threshold) {
  std::vector<TurningPoint> points;
  const int frames = static_cast<int>(symmetry.size());
  for (int i = 0; i < frames; ++i) {
    if (symmetry[i] < threshold || symmetry[i] < 0.0) continue;
    const int begin = std::max(0, i - apart);
    const int end = std::min(frames, i + apart + 1);
    // The first of equals is kept.
    const bool largest =
        symmetry.segment(begin, end - begin).maxCoeff() <= symmetry[i] &&
        (i == begin || symmetry.segment(begin, i - begin).maxCoeff() < symmetry[i]);
    if (largest) points.push_back({i, symmetry[i]});
  }
  return points;
}

}  // namespace

std::vector<std::string> TurningPointOptions::problems() const {
  std::vector<std::string> found;
  const auto check = [&](bool good, const char* name, double value, const char* rule) {
    if (!good) {
      found.push_back(std::string("TurningPointOptions::") + name + " = " + std::to_string(value) +
                      " (must be " + rule + ")");
    }
  };
  check(window_s > 0.0 && window_s <= 60.0, "window_s", window_s, "> 0 and at most 60");
  check(falloff >= 1, "falloff", falloff, ">= 1");
  check(apart_s >= 0.0 && apart_s <= 3600.0, "apart_s", apart_s, "from 0 to 3600");
  check(threshold >= 0.0 && threshold <= 1.0, "threshold", threshold, "from 0 to 1");
  return found;
}

Eigen::VectorXd symmetry_weights(int window, int falloff) {
  LABAN_CHECK(window >= 1 && falloff >= 1);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(window);
  // log C(2n, k) relative to its largest value log C(2n, n): no overflow, and near ones keep
  // digits.
  const double n = window;
  for (int r = 1; r <= window; ++r) {
    const double k = n - static_cast<double>(r) * falloff;
    if (k < 0.0) break;
    weights[r - 1] = std::exp(2.0 * std::lgamma(n + 1.0) - std::lgamma(k + 1.0) -
                              std::lgamma(2.0 * n - k + 1.0));
  }
  const double sum = weights.sum();
  // falloff > n leaves no binomial at all: the nearest frames alone then count.
  if (!(sum > 0.0)) {
    weights[0] = 1.0;
    return weights;
  }
  return weights / sum;
}

Eigen::VectorXd symmetry(int frame_count, const Eigen::VectorXd& weights,
                         const std::function<double(int, int)>& distance) {
  return mapped(symmetry_sums(frame_count, weights, distance));
}

Turning find_turning_points(const Eigen::Ref<const Eigen::MatrixXd>& angles, double frame_rate_hz,
                            const TurningPointOptions& options) {
  const auto problems = options.problems();
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
  const auto distance = metric(angles, frame_rate_hz, options.distance);
  const int frames = static_cast<int>(angles.cols());
  const Eigen::VectorXd weights =
      symmetry_weights(window_frames(options.window_s, frame_rate_hz), options.falloff);
  const Sums sums = symmetry_sums(
      frames, weights, [&](int i, int j) { return distance(angles.col(i), angles.col(j)); });
  Turning turning;
  turning.symmetry = mapped(sums);
  const int apart = static_cast<int>(std::lround(options.apart_s * frame_rate_hz));
  turning.points = local_maxima(turning.symmetry, apart, options.threshold);
  const auto at_end = [&](int end, int inwards) {
    if (!(sums.largest > 0.0)) return 1.0;
    const int fit = std::min(static_cast<int>(weights.size()), frames - 1);
    const double sum = weighted_sum(weights, fit, [&](int r) {
      const Eigen::VectorXd inside = angles.col(end + inwards * r);
      return distance(2.0 * angles.col(end) - inside, inside);
    });
    return std::clamp(1.0 - sum / sums.largest, 0.0, 1.0);
  };
  turning.first_symmetry = at_end(0, 1);
  turning.last_symmetry = at_end(frames - 1, -1);
  return turning;
}

}  // namespace laban::loop
