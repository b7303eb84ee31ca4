// What the kinematic observer says of real captures: do its factors differ, is it stable, and does
// it change smoothly along blends? DESIGN 6 sets the targets. Usage: observer_study FOLDER, a
// folder of dataset-1_{content}_{style}_{take}.bvh.

#include "laban/effort/observer.h"

#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/content_metric.h"
#include "laban/align/dtw.h"
#include "laban/align/time_warp.h"
#include "laban/base/rng.h"
#include "laban/blend/space_time_interpolation.h"
#include "laban/io/bvh.h"
#include "laban/math/statistics.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/motion/standard_body.h"

namespace {

using namespace laban;

struct Capture {
  motion::Capture source;
  motion::PoseMatrix pose;
  std::string content;
  std::string style;
};

std::vector<Capture> read_captures(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".bvh") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Capture> captures;
  for (const auto& path : files) {
    std::ifstream file(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    motion::Capture source = motion::find_capture(io::read_bvh(text, path.string()).clip);
    motion::PoseMatrix pose = motion::to_pose_matrix(source.clip, source.humanoid);
    const std::string name = path.stem().string();
    const std::size_t first = name.find('_'), second = name.find('_', first + 1);
    const std::size_t third = name.find('_', second + 1);
    captures.push_back({std::move(source), std::move(pose),
                        name.substr(first + 1, second - first - 1),
                        name.substr(second + 1, third - second - 1)});
  }
  return captures;
}

/// The pose with `noise` (67 rows: angles, height, x, z) added, scaled.
motion::PoseMatrix plus(motion::PoseMatrix pose, const Eigen::MatrixXd& noise, double scale) {
  pose.angles += scale * noise.topRows<motion::kAngleRowCount>();
  pose.height += scale * noise.row(motion::kAngleRowCount);
  Eigen::Matrix3Xd path = motion::planar_path(pose);
  path.topRows<2>() += scale * noise.bottomRows<2>();
  pose.steps = motion::planar_steps(path);
  return pose;
}

/// White noise on all rows of a pose matrix, of a size that moves joints by 1 mm (root mean square
/// a coordinate, on the standard body).
motion::PoseMatrix with_noise(const motion::PoseMatrix& pose, base::Rng& rng) {
  Eigen::MatrixXd noise(motion::kAngleRowCount + 3, pose.frame_count());
  for (double& value : noise.reshaped()) value = 0.001 * rng.normal();
  const Eigen::Matrix3Xd moved =
      motion::joint_positions(motion::to_standard_clip(plus(pose, noise, 1.0))) -
      motion::joint_positions(motion::to_standard_clip(pose));
  const double rms = std::sqrt(moved.array().square().mean());
  return plus(pose, noise, 0.001 / rms);
}

using Rows = Eigen::Matrix3Xd;

Rows observed(const std::vector<effort::Descriptors>& descriptors,
              const effort::ObserverReference& reference, const std::vector<std::string>& groups,
              bool clipped) {
  Rows rows(3, static_cast<Eigen::Index>(descriptors.size()));
  for (std::size_t n = 0; n < descriptors.size(); ++n) {
    const auto seen = effort::observe(descriptors[n], reference, groups[n]);
    rows.col(static_cast<Eigen::Index>(n)) =
        effort::to_vector(clipped ? seen.effort : seen.unclipped);
  }
  return rows;
}

void print_factors(const char* label, const Eigen::Vector3d& values) {
  std::printf("%-46s flow %6.3f  weight %6.3f  time %6.3f\n", label, values[0], values[1],
              values[2]);
}

Eigen::VectorXd row(const Rows& rows, int factor) {
  return rows.row(factor).transpose();
}

void print_stability(const char* label, const Rows& original, const Rows& changed) {
  Eigen::Vector3d rank, shift;
  for (int f = 0; f < 3; ++f) {
    const Eigen::VectorXd a = row(original, f), b = row(changed, f);
    rank[f] = math::spearman(math::as_span(a), math::as_span(b));
    shift[f] = (b - a).cwiseAbs().mean();
  }
  print_factors((std::string(label) + ": rank correlation").c_str(), rank);
  print_factors((std::string(label) + ": mean |change|").c_str(), shift);
}

/// Share of the variance of y(alpha) explained by a quadratic, and by the line between its values
/// at 0 and 1; sums of squares over all pairs.
struct Smoothness {
  Eigen::Vector3d total = Eigen::Vector3d::Zero();
  Eigen::Vector3d quadratic = Eigen::Vector3d::Zero();
  Eigen::Vector3d line = Eigen::Vector3d::Zero();
  Eigen::Vector3d monotone = Eigen::Vector3d::Zero();
  int pairs = 0;
};

void add_pair(const Eigen::VectorXd& alphas, const Rows& labels, int at_zero, int at_one,
              Smoothness& sum) {
  Eigen::MatrixXd basis(alphas.size(), 3);
  basis << Eigen::VectorXd::Ones(alphas.size()), alphas, alphas.cwiseAbs2();
  for (int f = 0; f < 3; ++f) {
    const Eigen::VectorXd y = row(labels, f);
    const Eigen::VectorXd fitted = basis * basis.colPivHouseholderQr().solve(y);
    const Eigen::VectorXd line = ((1.0 - alphas.array()) * y[at_zero] + alphas.array() * y[at_one]);
    sum.total[f] += (y.array() - y.mean()).square().sum();
    sum.quadratic[f] += (y - fitted).squaredNorm();
    sum.line[f] += (y - line).squaredNorm();
    sum.monotone[f] += std::abs(math::spearman(math::as_span(alphas), math::as_span(y)));
  }
  ++sum.pairs;
}

std::vector<Eigen::MatrixXd> content_features(const std::vector<Capture>& captures) {
  std::vector<motion::PoseMatrix> poses;
  std::vector<std::string> contents, styles;
  std::vector<int> groups, performers;
  const auto number = [](std::vector<std::string>& names, const std::string& name) {
    const auto at = std::find(names.begin(), names.end(), name);
    const auto index = static_cast<int>(at - names.begin());
    if (at == names.end()) names.push_back(name);
    return index;
  };
  for (const Capture& capture : captures) {
    poses.push_back(capture.pose);
    groups.push_back(number(contents, capture.content));
    performers.push_back(number(styles, capture.style));
  }
  const auto metric = align::fit_content_metric(poses, groups, performers);
  std::vector<Eigen::MatrixXd> features;
  for (std::size_t n = 0; n < poses.size(); ++n) {
    std::vector<motion::PoseMatrix> own;
    for (std::size_t m = 0; m < poses.size(); ++m) {
      if (performers[m] == performers[n]) own.push_back(poses[m]);
    }
    features.push_back(metric.features(poses[n], metric.mean_pose(own)));
  }
  return features;
}

/// Labels along blends of random pairs of one content, 13 weights a pair.
Smoothness study_blends(const std::vector<Capture>& captures,
                        const effort::ObserverReference& reference, int pair_count) {
  const auto features = content_features(captures);
  const Eigen::VectorXd alphas = Eigen::VectorXd::LinSpaced(13, -0.25, 1.25);
  Smoothness sum;
  base::Rng rng(1);
  while (sum.pairs < pair_count) {
    const auto i = static_cast<std::size_t>(rng.index(static_cast<int>(captures.size())));
    const auto j = static_cast<std::size_t>(rng.index(static_cast<int>(captures.size())));
    const Capture &a = captures[i], &b = captures[j];
    if (i == j || a.content != b.content ||
        !align::blendable(a.pose.frame_count(), b.pose.frame_count())) {
      continue;
    }
    const auto path = align::dtw(features[i], features[j]).path;
    const blend::BlendPair pair(a.pose, b.pose, align::warp_of_path(path));
    std::vector<effort::Descriptors> descriptors;
    for (const double alpha : alphas) {
      descriptors.push_back(effort::describe(blend::blend(pair, alpha).pose));
    }
    const std::vector<std::string> groups(descriptors.size(), a.content);
    add_pair(alphas, observed(descriptors, reference, groups, true), 2, 10, sum);
  }
  return sum;
}

void study(const std::filesystem::path& folder) {
  const std::vector<Capture> captures = read_captures(folder);
  std::vector<std::string> groups;
  std::vector<effort::Descriptors> plain, at_60, at_120, noisy;
  base::Rng rng(2);
  for (const Capture& capture : captures) {
    const auto at_rate = [&](double rate) {
      const motion::Clip clip = motion::resample(capture.source.clip, rate);
      return effort::describe(motion::to_pose_matrix(clip, capture.source.humanoid));
    };
    groups.push_back(capture.content);
    plain.push_back(effort::describe(capture.pose));
    at_60.push_back(at_rate(60.0));
    at_120.push_back(at_rate(120.0));
    noisy.push_back(effort::describe(with_noise(capture.pose, rng)));
  }
  const auto reference = effort::fit_observer_reference(plain, groups);
  std::printf("%zu captures, %zu groups\n\n", captures.size(), reference.groups.size());
  for (std::size_t g = 0; g <= reference.groups.size(); ++g) {
    const auto column = static_cast<Eigen::Index>(g);
    const std::string name = g < reference.groups.size() ? reference.groups[g] : "pooled";
    print_factors((name + ": center").c_str(), reference.center.col(column));
    print_factors((name + ": scale").c_str(), reference.scale.col(column));
  }
  const Rows labels = observed(plain, reference, groups, true);
  const Rows unclipped = observed(plain, reference, groups, false);
  const auto correlation = [&](int a, int b) {
    const Eigen::VectorXd x = row(labels, a), y = row(labels, b);
    return math::pearson(math::as_span(x), math::as_span(y));
  };
  std::printf(
      "\ncorrelation (target: at most 0.5): flow-weight %.3f  flow-time %.3f  weight-time %.3f\n",
      correlation(0, 1), correlation(0, 2), correlation(1, 2));
  Eigen::Vector3d deviation, ends;
  for (int f = 0; f < 3; ++f) {
    const Eigen::VectorXd values = row(labels, f);
    deviation[f] = math::standard_deviation(math::as_span(values));
    ends[f] = (values.array().abs() >= 3.0).cast<double>().mean();
  }
  print_factors("standard deviation of labels", deviation);
  print_factors("share at the ends of the scale", ends);
  std::printf("\n");
  print_stability("30 -> 60 Hz", unclipped, observed(at_60, reference, groups, false));
  print_stability("30 -> 120 Hz", unclipped, observed(at_120, reference, groups, false));
  print_stability("1 mm of noise", unclipped, observed(noisy, reference, groups, false));
  const Smoothness smooth = study_blends(captures, reference, 60);
  const Eigen::Vector3d ones = Eigen::Vector3d::Ones();
  std::printf("\nalong blends, %d pairs, 13 weights each\n", smooth.pairs);
  print_factors("R^2 of a quadratic in alpha", ones - smooth.quadratic.cwiseQuotient(smooth.total));
  print_factors("rms residual of the quadratic",
                (smooth.quadratic / (13.0 * smooth.pairs)).cwiseSqrt());
  print_factors("R^2 of the line between labels of the parents",
                ones - smooth.line.cwiseQuotient(smooth.total));
  print_factors("mean |rank correlation| with alpha", smooth.monotone / smooth.pairs);
}

}  // namespace

int main(int argument_count, char** arguments) {
  if (argument_count != 2) {
    std::fprintf(stderr, "usage: observer_study FOLDER\n");
    return 2;
  }
  try {
    study(arguments[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "observer_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
