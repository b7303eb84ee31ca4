#include "laban/texture/texton_synthesis.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "laban/base/error.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::VectorXd;

// Factors kept at most; one of 68 frames and 15 dimensions is 370 kB.
constexpr std::size_t kMostSystems = 32;

MatrixXd states_of(const Texton& texton, const Ref<const MatrixXd>& observations) {
  return texton.basis.transpose() * (observations.colwise() - texton.mean);
}

MatrixXd observed(const Texton& texton, const Ref<const MatrixXd>& states) {
  return (texton.basis * states).colwise() + texton.mean;
}

/// Values and slopes at two ends of a stretch of frames.
struct Hermite {
  VectorXd from;
  VectorXd from_slope;
  VectorXd to;
  VectorXd to_slope;
};

/// Fills columns begin + 1 .. end - 1, and no other.
void fill(MatrixXd& curve, int begin, int end, const Hermite& h) {
  const double span = end - begin;
  for (int f = std::max(0, begin + 1); f < std::min<Index>(end, curve.cols()); ++f) {
    const double x = (f - begin) / span;
    const double y = 1.0 - x;
    curve.col(f) = (y * y * (1.0 + 2.0 * x)) * h.from + (span * x * y * y) * h.from_slope +
                   (x * x * (3.0 - 2.0 * x)) * h.to - (span * x * x * y) * h.to_slope;
  }
}

/// Neighbouring frames, as places in the list of frames.
struct Run {
  int begin = 0;
  int end = 0;  // exclusive
};

std::vector<Run> runs_of(const std::vector<int>& frames) {
  std::vector<Run> runs;
  for (int n = 0; n < static_cast<int>(frames.size()); ++n) {
    const auto at = static_cast<std::size_t>(n);
    if (n > 0 && frames[at] == frames[at - 1] + 1) {
      ++runs.back().end;
    } else {
      runs.push_back({n, n + 1});
    }
  }
  return runs;
}

void check_pins(const std::vector<int>& frames, std::span<const PinnedFrame> pins, int length,
                Index rows) {
  for (std::size_t n = 0; n < pins.size(); ++n) {
    if (frames[n] < 0 || frames[n] >= length || (n > 0 && frames[n] <= frames[n - 1])) {
      throw Error(ErrorKind::kUsage, "pinned frame " + std::to_string(frames[n]) +
                                         " must follow the pins before it and lie in 0 to " +
                                         std::to_string(length - 1));
    }
    if (pins[n].observation.size() != rows) {
      throw Error(ErrorKind::kUsage, "a pinned frame of " +
                                         std::to_string(pins[n].observation.size()) +
                                         " numbers, not " + std::to_string(rows));
    }
  }
}

std::vector<int> frames_of(std::span<const PinnedFrame> pins) {
  std::vector<int> frames;
  for (const PinnedFrame& pin : pins) frames.push_back(pin.frame);
  return frames;
}

MatrixXd columns_of(std::span<const PinnedFrame> pins, Index rows) {
  MatrixXd columns(rows, std::ssize(pins));
  for (std::size_t n = 0; n < pins.size(); ++n) {
    columns.col(static_cast<Index>(n)) = pins[n].observation;
  }
  return columns;
}

}  // namespace

MatrixXd reproject(const Texton& texton, const Ref<const MatrixXd>& observations) {
  return observed(texton, states_of(texton, observations));
}

MatrixXd ramp_between(int length, const std::vector<int>& frames, const Ref<const MatrixXd>& values,
                      int ramp_frames) {
  MatrixXd curve = MatrixXd::Zero(values.rows(), length);
  const VectorXd zero = VectorXd::Zero(values.rows());
  const std::vector<Run> runs = runs_of(frames);
  const auto frame = [&](int n) { return frames[static_cast<std::size_t>(n)]; };
  const auto slope = [&](int n, const Run& run) -> VectorXd {
    if (run.end - run.begin < 2) return zero;
    return values.col(n + 1) - values.col(n);
  };
  for (int n = 0; n < static_cast<int>(frames.size()); ++n) curve.col(frame(n)) = values.col(n);
  const int ramp = std::max(1, ramp_frames);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Run& run = runs[r];
    const int first = frame(run.begin);
    const int last = frame(run.end - 1);
    const Hermite in{zero, zero, values.col(run.begin), slope(run.begin, run)};
    const Hermite out{values.col(run.end - 1), slope(std::max(run.begin, run.end - 2), run), zero,
                      zero};
    const bool joins_before = r > 0 && first - frame(runs[r - 1].end - 1) <= 2 * ramp;
    const bool joins_after = r + 1 < runs.size() && frame(runs[r + 1].begin) - last <= 2 * ramp;
    if (!joins_before) fill(curve, first - ramp, first, in);
    if (!joins_after) {
      fill(curve, last, last + ramp, out);
    } else {
      const Run& next = runs[r + 1];
      fill(curve, last, frame(next.begin),
           {out.from, out.from_slope, values.col(next.begin), slope(next.begin, next)});
    }
  }
  return curve;
}

const ConstrainedStates& TextonSynthesizer::system(int texton, int length,
                                                   const std::vector<int>& known) {
  const Key key{{texton, length}, known};
  const auto found = systems_.find(key);
  if (found != systems_.end()) return found->second;
  // Which one goes does not matter: walks come back to their textons, but to few lengths of them.
  if (systems_.size() >= kMostSystems) systems_.erase(systems_.begin());
  const LinearDynamics& dynamics = textons_[static_cast<std::size_t>(texton)].dynamics;
  return systems_.emplace(key, ConstrainedStates(dynamics, length, known)).first->second;
}

MatrixXd TextonSynthesizer::synthesize(int texton, int length, std::span<const PinnedFrame> pins,
                                       const Ref<const MatrixXd>& noise, const MatrixXd& residual) {
  if (texton < 0 || texton >= std::ssize(textons_)) {
    throw Error(ErrorKind::kUsage, "there is no texton " + std::to_string(texton));
  }
  const Texton& model = textons_[static_cast<std::size_t>(texton)];
  const std::vector<int> frames = frames_of(pins);
  check_pins(frames, pins, length, model.mean.size());
  const MatrixXd given = columns_of(pins, model.mean.size());
  const MatrixXd given_states = states_of(model, given);
  MatrixXd states = MatrixXd::Zero(model.dimension(), length);
  for (std::size_t n = 0; n < frames.size(); ++n) {
    states.col(frames[n]) = given_states.col(static_cast<Index>(n));
  }
  MatrixXd y = observed(model, system(texton, length, frames).solve(states, noise));
  MatrixXd beside = given - observed(model, given_states);
  if (residual.cols() > 0) {
    if (residual.rows() != y.rows() || residual.cols() != length) {
      throw Error(ErrorKind::kUsage, "a residual of " + std::to_string(residual.cols()) +
                                         " frames for a texton of " + std::to_string(length));
    }
    const MatrixXd outside = residual - model.basis * (model.basis.transpose() * residual);
    y += outside;
    beside -= outside(Eigen::all, frames);
  }
  y += ramp_between(length, frames, beside, ramp_frames_);
  // The sum above is exact to round-off; pinned frames are given.
  for (std::size_t n = 0; n < frames.size(); ++n) {
    y.col(frames[n]) = given.col(static_cast<Index>(n));
  }
  return y;
}

EditedTexton edit_texton(const Texton& texton, const Ref<const MatrixXd>& original,
                         std::span<const PinnedFrame> pins, int ramp_frames) {
  const auto length = static_cast<int>(original.cols());
  if (length < 5 || original.rows() != texton.mean.size()) {
    throw Error(ErrorKind::kUsage, "an edit needs at least five frames of " +
                                       std::to_string(texton.mean.size()) + " numbers");
  }
  check_pins(frames_of(pins), pins, length, texton.mean.size());
  MatrixXd goal = original;
  std::vector<bool> known(static_cast<std::size_t>(length), false);
  for (const int end : {0, 1, length - 2, length - 1}) known[static_cast<std::size_t>(end)] = true;
  for (const PinnedFrame& pin : pins) {
    goal.col(pin.frame) = pin.observation;
    known[static_cast<std::size_t>(pin.frame)] = true;
  }
  std::vector<int> frames;
  for (int f = 0; f < length; ++f) {
    if (known[static_cast<std::size_t>(f)]) frames.push_back(f);
  }
  const MatrixXd states = states_of(texton, original);
  const MatrixXd noise = innovations(texton.dynamics, states);
  const MatrixXd moved =
      ConstrainedStates(texton.dynamics, length, frames).solve(states_of(texton, goal), noise);
  // What the texton cannot show of the original stays; what it cannot show of a pin comes and goes.
  const MatrixXd change = goal - original;
  MatrixXd beside(texton.mean.size(), std::ssize(frames));
  for (std::size_t n = 0; n < frames.size(); ++n) {
    const VectorXd column = change.col(frames[n]);
    beside.col(static_cast<Index>(n)) = column - texton.basis * (texton.basis.transpose() * column);
  }
  EditedTexton edited;
  edited.observations = original + texton.basis * (moved - states) +
                        ramp_between(length, frames, beside, ramp_frames);
  const double pinned = static_cast<double>(std::max<std::size_t>(1, pins.size()));
  const double added = (innovations(texton.dynamics, moved) - noise).squaredNorm();
  edited.state_deviations = std::sqrt(added / (pinned * texton.dimension()));
  const double outside = static_cast<double>(texton.mean.size() - texton.dimension());
  if (outside > 0.0 && texton.residual_variance > 0.0) {
    edited.residual_deviations =
        std::sqrt(beside.squaredNorm() / (pinned * outside * texton.residual_variance));
  }
  return edited;
}

}  // namespace laban::texture
