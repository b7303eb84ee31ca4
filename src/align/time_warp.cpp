#include "laban/align/time_warp.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "laban/base/error.h"

namespace laban::align {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;

/// |dv/du| of a warp of slope r or 1/r: v = q - p, u = p + q.
constexpr double drift_of_slope(double r) {
  return (r - 1.0) / (r + 1.0);
}

std::string number(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

/// The path as v(u) = q - p at every u = p + q; a diagonal step leaves v as it is and skips one u.
Eigen::VectorXd drift_of_path(std::span<const FramePair> path) {
  if (path.empty() || path.front() != FramePair{0, 0}) {
    throw Error(ErrorKind::kData, "time warp: the path does not begin at (0, 0)");
  }
  const FramePair end = path.back();
  Eigen::VectorXd drift(std::max(0, end.p + end.q) + 1);
  drift(0) = 0.0;
  for (std::size_t n = 1; n < path.size(); ++n) {
    const int dp = path[n].p - path[n - 1].p;
    const int dq = path[n].q - path[n - 1].q;
    if (dp < 0 || dp > 1 || dq < 0 || dq > 1 || dp + dq == 0) {
      throw Error(ErrorKind::kData, "time warp: path cell " + std::to_string(n) + " is (" +
                                        std::to_string(dp) + ", " + std::to_string(dq) +
                                        ") on from the one before (must be (1,0), (0,1) or (1,1))");
    }
    const int u = path[n].p + path[n].q;
    drift(u) = path[n].q - path[n].p;
    if (dp + dq == 2) drift(u - 1) = drift(u);
  }
  return drift;
}

/// A knot of the derivative of a convex piecewise quadratic function: value `slope` at `at`, linear
/// between knots. Two knots at one place are a jump.
struct Knot {
  double at;
  double slope;
};

/// Knots on one side of the least point, the nearest to it last. What happens to all of them is
/// noted instead of done: a knot stored as (at, slope) is at at + shift, with slope
/// slope + steepness at + rise.
class KnotSide {
 public:
  [[nodiscard]] bool empty() const { return stored_.empty(); }
  [[nodiscard]] Knot nearest() const {
    const Knot& knot = stored_.back();
    return {knot.at + shift_, knot.slope + steepness_ * knot.at + rise_};
  }
  void push(const Knot& knot) {
    const double at = knot.at - shift_;
    stored_.push_back({at, knot.slope - steepness_ * at - rise_});
  }
  Knot pop() {
    const Knot knot = nearest();
    stored_.pop_back();
    return knot;
  }
  void move(double by) { shift_ += by; }
  /// Adds the derivative of (x - y)^2.
  void add_square(double y) {
    steepness_ += 2.0;
    rise_ += 2.0 * (shift_ - y);
  }

 private:
  std::vector<Knot> stored_;
  double shift_ = 0.0;
  double steepness_ = 0.0;
  double rise_ = 0.0;
};

/// Puts every knot on its side, slopes below 0 left, and tells where the function is least.
double find_least(KnotSide& left, KnotSide& right) {
  while (!right.empty() && right.nearest().slope < 0.0) left.push(right.pop());
  while (!left.empty() && left.nearest().slope >= 0.0) right.push(left.pop());
  if (left.empty()) return right.nearest().at;
  const Knot a = left.nearest();
  if (right.empty()) return a.at;
  const Knot b = right.nearest();
  // By round-off of its sides' notes a knot that changes sides may change its sign; then b is
  // least.
  const double rise = b.slope - a.slope;
  return rise > -a.slope ? a.at + (b.at - a.at) * (-a.slope / rise) : b.at;
}

/// The values x(0) = y(0), .., x(U) = y(U) with |x(k + 1) - x(k)| <= limit that minimise
/// sum (x(k) - y(k))^2. Needs |y(U) - y(0)| <= limit U.
///
/// f_k(x), the least sum over 0 .. k with x(k) = x, is convex and piecewise quadratic:
/// f_k(x) = (x - y(k))^2 + min over |w - x| <= limit of f_(k-1)(w). That minimum spreads f_(k-1) by
/// `limit` to both sides of its least point m_(k-1), so only derivatives' knots need keeping, few
/// of which change sides: time is linear in U but for paths made for it. Going back, x(k - 1) is
/// m_(k-1) clamped to [x(k) - limit, x(k) + limit].
Eigen::VectorXd project_to_limited_slope(const Eigen::VectorXd& y, double limit) {
  const Index last = y.size() - 1;
  Eigen::VectorXd x(y.size());
  if (last <= 0) return y;
  KnotSide left, right;
  right.push({y(0), 0.0});  // f_0: finite at y(0) alone
  Eigen::VectorXd least(y.size());
  for (Index k = 0; k < last; ++k) {
    least(k) = find_least(left, right);
    left.move(-limit);
    right.move(limit);
    left.push({least(k) - limit, 0.0});
    right.push({least(k) + limit, 0.0});
    left.add_square(y(k + 1));
    right.add_square(y(k + 1));
  }
  x(last) = y(last);
  for (Index k = last - 1; k >= 0; --k) {
    x(k) = std::clamp(least(k), x(k + 1) - limit, x(k + 1) + limit);
  }
  x(0) = y(0);  // but for round-off it is
  return x;
}

/// Smooths the differences of `values` by a raised cosine of `half_width` samples, mirrored at the
/// ends: a mean of differences with the same sum, so both ends and every bound on them stay.
Eigen::VectorXd smooth_slope(const Eigen::VectorXd& values, double half_width) {
  const Index count = values.size() - 1;
  const auto reach = static_cast<Index>(std::ceil(half_width)) - 1;
  if (count < 2 || reach < 1) return values;
  Eigen::VectorXd weights(reach + 1);
  for (Index m = 0; m <= reach; ++m) {
    weights(m) = 1.0 + std::cos(std::numbers::pi * static_cast<double>(m) / half_width);
  }
  weights /= weights(0) + 2.0 * weights.tail(reach).sum();
  // Differences, mirrored `reach` (which may be more than there are) beyond either end.
  Eigen::VectorXd slope(count + 2 * reach);
  for (Index k = 0; k < slope.size(); ++k) {
    const Index period = 2 * count;
    const Index inside = ((k - reach) % period + period) % period;
    const Index mirrored = inside < count ? inside : period - 1 - inside;
    slope(k) = values(mirrored + 1) - values(mirrored);
  }
  Eigen::VectorXd window(2 * reach + 1);
  window << weights.tail(reach).reverse(), weights;
  Eigen::VectorXd smooth(values.size());
  smooth(0) = values(0);
  for (Index k = 0; k < count; ++k)
    smooth(k + 1) = smooth(k) + window.dot(slope.segment(k, window.size()));
  smooth(count) = values(count);
  return smooth;
}

void require_alpha(double alpha) {
  if (!(alpha >= -0.25 && alpha <= 1.25)) {
    throw Error(ErrorKind::kUsage,
                "blend: alpha = " + number(alpha) + " (must lie in [-0.25, 1.25])");
  }
}

double mix(double a, double b, double alpha) {
  return (1.0 - alpha) * a + alpha * b;
}

}  // namespace

bool blendable(int frames_i, int frames_j) {
  if (frames_i < 1 || frames_j < 1) return false;
  const double a = frames_i - 1;
  const double b = frames_j - 1;
  return a <= kMaxWarpSlope * b && b <= kMaxWarpSlope * a;
}

TimeWarp::TimeWarp(Eigen::VectorXd p, Eigen::VectorXd q) : p_(std::move(p)), q_(std::move(q)) {
  const auto refuse = [](Index knot, const std::string& rule) {
    throw Error(ErrorKind::kData, "time warp: knot " + std::to_string(knot) + " " + rule);
  };
  if (p_.size() != q_.size() || p_.size() < 1) {
    throw Error(ErrorKind::kData, "time warp: " + std::to_string(p_.size()) + " times p and " +
                                      std::to_string(q_.size()) +
                                      " times q (must be as many, at least one)");
  }
  if (p_(0) != 0.0 || q_(0) != 0.0) refuse(0, "is not (0, 0)");
  const Index last = p_.size() - 1;
  for (Index n = 1; n <= last; ++n) {
    const double dp = p_(n) - p_(n - 1);
    const double dq = q_(n) - q_(n - 1);
    // Knots carry round-off of about 1e-16 of the time itself.
    const double slack = 1e-12 * (1.0 + p_(n) + q_(n));
    if (!(dp > 0.0 && dq > 0.0)) refuse(n, "does not lie after the one before");
    if (!(dq <= kMaxWarpSlope * dp + slack && dp <= kMaxWarpSlope * dq + slack)) {
      refuse(n, "is reached with slope " + number(dq / dp) + " (must lie in [1/4, 4])");
    }
  }
  const bool finite = p_.allFinite() && q_.allFinite();
  if (!finite || p_(last) != std::round(p_(last)) || q_(last) != std::round(q_(last))) {
    refuse(last, "does not lie at whole frames");
  }
}

int TimeWarp::frames_i() const noexcept {
  return static_cast<int>(p_(p_.size() - 1)) + 1;
}

int TimeWarp::frames_j() const noexcept {
  return static_cast<int>(q_(q_.size() - 1)) + 1;
}

int TimeWarp::frame_count(double alpha) const {
  require_alpha(alpha);
  if (frames_i() == 1 && frames_j() == 1) return 1;
  // A length that is k + 1/2 but for round-off is rounded up from both orders of the pair.
  const double mean = mix(frames_i(), frames_j(), alpha);
  return std::max(2, static_cast<int>(std::floor(mean + 0.5 + 1e-9)));
}

WarpPoint TimeWarp::solve(double alpha, double tau) const {
  require_alpha(alpha);
  if (std::isnan(tau)) {
    throw Error(ErrorKind::kUsage, "time warp: tau is not a number");
  }
  // The first knot at or after tau.
  Index low = 0;
  Index high = p_.size() - 1;
  if (tau <= 0.0) return {0.0, 0.0};
  if (tau >= mix(p_(high), q_(high), alpha)) return {p_(high), q_(high)};
  while (high - low > 1) {
    const Index middle = (low + high) / 2;
    (mix(p_(middle), q_(middle), alpha) < tau ? low : high) = middle;
  }
  const double from = mix(p_(low), q_(low), alpha);
  const double to = mix(p_(high), q_(high), alpha);
  const double s = (tau - from) / (to - from);
  return {p_(low) + s * (p_(high) - p_(low)), q_(low) + s * (q_(high) - q_(low))};
}

std::vector<WarpPoint> TimeWarp::sample(double alpha) const {
  const int count = frame_count(alpha);
  const double length = mix(frames_i() - 1, frames_j() - 1, alpha);
  std::vector<WarpPoint> points(static_cast<std::size_t>(count));
  for (int k = 1; k < count - 1; ++k) {
    points[static_cast<std::size_t>(k)] = solve(alpha, length * k / (count - 1));
  }
  const Index last = p_.size() - 1;
  if (count > 1) points.back() = {p_(last), q_(last)};
  return points;
}

std::vector<std::string> TimeWarpOptions::problems() const {
  std::vector<std::string> list;
  if (!(smoothing_frames >= 0.0 && smoothing_frames <= 1e6)) {
    list.push_back("TimeWarpOptions::smoothing_frames = " + number(smoothing_frames) +
                   " (must lie in [0, 1e6])");
  }
  if (!(max_slope > 1.0 && max_slope <= kMaxWarpSlope)) {
    list.push_back("TimeWarpOptions::max_slope = " + number(max_slope) + " (must lie in (1, 4])");
  }
  return list;
}

TimeWarp warp_of_path(std::span<const FramePair> path, const TimeWarpOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  const Eigen::VectorXd raw = drift_of_path(path);
  const FramePair end = path.back();
  if (!blendable(end.p + 1, end.q + 1)) {
    throw Error(ErrorKind::kData, "time warp: clips of " + std::to_string(end.p + 1) + " and " +
                                      std::to_string(end.q + 1) +
                                      " frames (one may be at most four times as long)");
  }
  const double steps = std::max(1.0, static_cast<double>(raw.size() - 1));
  const double limit =
      std::max(drift_of_slope(options.max_slope), std::abs(raw(raw.size() - 1)) / steps);
  // u = p + q advances by 2 a frame.
  const Eigen::VectorXd v =
      smooth_slope(project_to_limited_slope(raw, limit), 2.0 * options.smoothing_frames);
  const Eigen::VectorXd u =
      Eigen::VectorXd::LinSpaced(v.size(), 0.0, static_cast<double>(v.size() - 1));
  return {0.5 * (u - v), 0.5 * (u + v)};
}

}  // namespace laban::align
