#include "loop/join_window.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"
#include "laban/loop/poisson.h"
#include "laban/math/rotation.h"

namespace laban::loop {
namespace {

using Frames = std::vector<BodyFrame>;

/// Rows of a clip as the cut compares them; the hips with their place, as far as it moves the body.
std::vector<Eigen::MatrixXd> cut_rows(const BodyRows& rows, const Frames& frames,
                                      const Frames& reference) {
  const auto count = static_cast<Eigen::Index>(frames.size());
  std::vector<Eigen::MatrixXd> values;
  for (std::size_t r = 0; r < rows.joints.size(); ++r) {
    Eigen::MatrixXd row(r == 0 ? 7 : 4, count);
    for (Eigen::Index t = 0; t < count; ++t) {
      const auto& q = frames[static_cast<std::size_t>(t)].rotations[r];
      const auto& near = reference[static_cast<std::size_t>(t)].rotations[r];
      row.col(t).head<4>() = math::same_hemisphere(q, near).coeffs();
      // |q - q'| is half an angle: a turn moves a point at reach L by 2 L |q - q'|.
      if (r == 0) {
        row.col(t).tail<3>() = frames[static_cast<std::size_t>(t)].hips / (2.0 * rows.reach_m[0]);
      }
    }
    values.push_back(std::move(row));
  }
  return values;
}

Frames blended(const BodyRows& rows, const Frames& a, const Frames& b,
               const std::vector<int>& switches, int blend_frames) {
  Frames mixed = a;
  for (std::size_t t = 0; t < a.size(); ++t) {
    const auto share = [&](std::size_t r) {
      return outgoing_share(static_cast<double>(t), switches[r], blend_frames);
    };
    for (std::size_t r = 0; r < rows.joints.size(); ++r) {
      const double out = share(r);
      mixed[t].rotations[r] = a[t].rotations[r].slerp(1.0 - out, b[t].rotations[r]).normalized();
      if (mixed[t].offsets.cols() > 0) {
        const auto row = static_cast<Eigen::Index>(r);
        mixed[t].offsets.col(row) =
            out * a[t].offsets.col(row) + (1.0 - out) * b[t].offsets.col(row);
      }
    }
    mixed[t].hips = share(0) * a[t].hips + (1.0 - share(0)) * b[t].hips;
    for (std::size_t p = 0; p < rows.feet.size(); ++p) {
      const double out = share(static_cast<std::size_t>(rows.feet[p]));
      const auto point = static_cast<Eigen::Index>(p);
      mixed[t].contacts[point] = out * a[t].contacts[point] + (1.0 - out) * b[t].contacts[point];
    }
    if (share(0) < 0.5) mixed[t].source_frame = b[t].source_frame;
  }
  return mixed;
}

/// A channel of three rows stacks: x of all joints, then y, then z.
void put(Eigen::MatrixXd& values, Eigen::Index row, Eigen::Index row_count, Eigen::Index column,
         const Eigen::Vector3d& v) {
  for (Eigen::Index c = 0; c < 3; ++c) values(c * row_count + row, column) = v[c];
}

/// Outgoing, incoming and blended signal of all rows, 3R x N.
struct Signals {
  Eigen::MatrixXd a;
  Eigen::MatrixXd b;
  Eigen::MatrixXd x;
};

/// Exponential maps about one reference a row, the blend at the seam.
Signals rotation_signals(const BodyRows& rows, const Frames& a, const Frames& b, const Frames& x,
                         const std::vector<int>& switches,
                         std::vector<Eigen::Quaterniond>& references) {
  const Eigen::Index R = rows.count();
  const auto N = static_cast<Eigen::Index>(a.size());
  Signals signals{Eigen::MatrixXd(3 * R, N), Eigen::MatrixXd(3 * R, N), Eigen::MatrixXd(3 * R, N)};
  references.resize(static_cast<std::size_t>(R));
  for (Eigen::Index r = 0; r < R; ++r) {
    const auto row = static_cast<std::size_t>(r);
    const Eigen::Index middle = switches[row];
    references[row] = x[static_cast<std::size_t>(middle)].rotations[row];
    const auto follow = [&](const Frames& frames, Eigen::MatrixXd& into) {
      const auto at = [&](Eigen::Index t) {
        return math::log(references[row].conjugate() *
                         frames[static_cast<std::size_t>(t)].rotations[row]);
      };
      Eigen::Vector3d first = at(middle);
      put(into, r, R, middle, first);
      Eigen::Vector3d previous = first;
      for (Eigen::Index t = middle + 1; t < N; ++t) {
        put(into, r, R, t, previous = math::nearest_branch(at(t), previous));
      }
      previous = first;
      for (Eigen::Index t = middle; t-- > 0;) {
        put(into, r, R, t, previous = math::nearest_branch(at(t), previous));
      }
    };
    follow(a, signals.a);
    follow(b, signals.b);
    follow(x, signals.x);
  }
  return signals;
}

/// The blend with each edge that the seam crosses given the weighted mean of both motions' own
/// gradients instead of its own, solved for; both ends are held.
Eigen::MatrixXd poisson_smoothed(const std::vector<int>& parents, const std::vector<int>& switches,
                                 const Signals& signals, int blend_frames, double joint_weight,
                                 double screening) {
  const Eigen::Index R = std::ssize(parents);
  const Eigen::Index N = signals.x.cols();
  const PoissonGrid grid(parents, static_cast<int>(N - 2), joint_weight, screening);
  // G' - grad x: zero but where the seam passes.
  Eigen::MatrixXd time = Eigen::MatrixXd::Zero(3 * R, N - 1);
  Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(3 * R, N - 2);
  for (Eigen::Index row = 0; row < 3 * R; ++row) {
    const Eigen::Index r = row % R;
    const int own = switches[static_cast<std::size_t>(r)];
    for (Eigen::Index t = 0; t + 1 < N; ++t) {
      const double out = outgoing_share(static_cast<double>(t) + 0.5, own, blend_frames);
      if (out <= 0.0 || out >= 1.0) continue;
      time(row, t) = out * (signals.a(row, t + 1) - signals.a(row, t)) +
                     (1.0 - out) * (signals.b(row, t + 1) - signals.b(row, t)) -
                     (signals.x(row, t + 1) - signals.x(row, t));
    }
    const int parent = parents[static_cast<std::size_t>(r)];
    if (parent < 0 || joint_weight == 0.0) continue;
    const int above = switches[static_cast<std::size_t>(parent)];
    const Eigen::Index up = row - r + parent;
    for (Eigen::Index t = 1; t + 1 < N; ++t) {
      const double one = outgoing_share(static_cast<double>(t), own, blend_frames);
      const double other = outgoing_share(static_cast<double>(t), above, blend_frames);
      if (one == other) continue;
      const double out = 0.5 * (one + other);
      joint(row, t - 1) = out * (signals.a(row, t) - signals.a(up, t)) +
                          (1.0 - out) * (signals.b(row, t) - signals.b(up, t)) -
                          (signals.x(row, t) - signals.x(up, t));
    }
  }
  Eigen::MatrixXd smooth = signals.x;
  smooth.middleCols(1, N - 2) += grid.solve(grid.divergence(time, joint));
  return smooth;
}

void smooth_rotations(const BodyRows& rows, const Frames& a, const Frames& b,
                      const std::vector<int>& switches, const JoinWindowOptions& options,
                      Frames& x) {
  std::vector<Eigen::Quaterniond> references;
  const Signals signals = rotation_signals(rows, a, b, x, switches, references);
  const Eigen::MatrixXd smooth =
      poisson_smoothed(rows.parents, switches, signals, options.blend_frames, options.joint_weight,
                       options.screening);
  const Eigen::Index R = rows.count();
  for (Eigen::Index t = 1; t + 1 < smooth.cols(); ++t) {
    for (Eigen::Index r = 0; r < R; ++r) {
      const Eigen::Vector3d v(smooth(r, t), smooth(R + r, t), smooth(2 * R + r, t));
      x[static_cast<std::size_t>(t)].rotations[static_cast<std::size_t>(r)] =
          (references[static_cast<std::size_t>(r)] * math::exp(v)).normalized();
    }
  }
}

void smooth_hips(const Frames& a, const Frames& b, int switch_frame,
                 const JoinWindowOptions& options, Frames& x) {
  const auto place = [](const Frames& frames) {
    Eigen::MatrixXd values(3, std::ssize(frames));
    for (std::size_t t = 0; t < frames.size(); ++t) {
      values.col(static_cast<Eigen::Index>(t)) = frames[t].hips;
    }
    return values;
  };
  const Eigen::MatrixXd smooth =
      poisson_smoothed({-1}, {switch_frame}, {place(a), place(b), place(x)}, options.blend_frames,
                       0.0, options.screening);
  for (std::size_t t = 1; t + 1 < x.size(); ++t)
    x[t].hips = smooth.col(static_cast<Eigen::Index>(t));
}

}  // namespace

double outgoing_share(double frame, int switch_frame, int blend_frames) {
  const double x = std::clamp((frame - (switch_frame - 0.5)) / blend_frames + 0.5, 0.0, 1.0);
  return 1.0 - x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
}

int blend_length(int overlap_frames, int blend_frames) {
  // It reaches half its length to either side of a seam.
  const int keep = std::min((blend_frames + 1) / 2, (overlap_frames - 2) / 2);
  return std::min(blend_frames, 2 * keep);
}

JoinedWindow join_window(const BodyRows& rows, const Frames& outgoing, const Frames& incoming,
                         const JoinWindowOptions& options) {
  LABAN_CHECK(outgoing.size() == incoming.size() && outgoing.size() >= 4);
  const int N = static_cast<int>(outgoing.size());
  // The blend reaches half its length to either side of a seam.
  const int keep = std::min((options.blend_frames + 1) / 2, (N - 2) / 2);
  const SeamCosts costs =
      seam_costs(cut_rows(rows, outgoing, outgoing), cut_rows(rows, incoming, outgoing),
                 rows.parents, 2.0 * rows.reach_m, options.metric, keep);
  const Seam seam = minimum_seam(costs);
  JoinedWindow window{
      blended(rows, outgoing, incoming, seam.switch_frames, blend_length(N, options.blend_frames)),
      seam.switch_frames, seam.cost};
  if (options.poisson) {
    JoinWindowOptions smoothing = options;
    smoothing.blend_frames = blend_length(N, options.blend_frames);
    smooth_rotations(rows, outgoing, incoming, seam.switch_frames, smoothing, window.frames);
    smooth_hips(outgoing, incoming, seam.switch_frames[0], smoothing, window.frames);
  }
  window.frames.front() = outgoing.front();
  window.frames.back() = incoming.back();
  return window;
}

std::vector<BodyFrame> cross_fade(const Frames& outgoing, const Frames& incoming) {
  Frames faded;
  const double k = static_cast<double>(outgoing.size()) - 1.0;
  for (std::size_t t = 0; t < outgoing.size(); ++t) {
    faded.push_back(mix(outgoing[t], incoming[t],
                        1.0 - blend_weight(static_cast<double>(t) - 1.0, std::max(1.0, k))));
  }
  return faded;
}

}  // namespace laban::loop
