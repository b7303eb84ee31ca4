// Is the kinematic observer sound on real captures? DESIGN 6 and the issue set the targets: factors
// that do not repeat each other; labels that keep where the motion is the same (frame rate,
// heading, place, a millimetre of noise, another rig); Time and Weight that rise with faster play
// and Flow that rises with inserted holds; and labels along blends that follow from those of the
// parents.
//
// Usage: observer_study FOLDER PATTERN [BLEND_PAIRS]
//   e.g. PATTERN 'dataset-1_{content}_{performer}_{take}'; BLEND_PAIRS (50): pairs that are blended
// or:    observer_study --rigs CORPUS PATTERN FILE FILE [FILE FILE ..]
//   where each two files hold one take on two rigs, and CORPUS tells what a label unit is.

#include "laban/effort/observer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/transfer/style_corpus.h"
#include "support/changed_motion.h"

#include "name_pattern.h"

namespace {

using namespace laban;

struct Take {
  motion::Capture capture;
  transfer::Fragment fragment;
};

std::vector<Take> read_takes(const std::filesystem::path& folder, const std::string& pattern) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (io::is_motion_file(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Take> takes;
  for (const auto& path : files) {
    auto fields = studies::match(pattern, path.stem().string());
    if (fields.empty()) continue;
    motion::Capture capture = motion::find_capture(io::read_clip(path).clip);
    motion::PoseMatrix pose = motion::to_pose_matrix(capture.clip, capture.humanoid);
    transfer::Fragment fragment{
        path.stem().string(), fields["content"], fields["performer"], std::move(pose), {}};
    takes.push_back({std::move(capture), std::move(fragment)});
  }
  if (takes.empty()) {
    throw base::Error(base::ErrorKind::kData, folder.string() + ": no file fits the pattern");
  }
  return takes;
}

// ---- What is done to a take -------------------------------------------------------------------

using Change = std::function<motion::PoseMatrix(const Take&)>;

Change at_rate(double rate_hz) {
  return [rate_hz](const Take& take) {
    return motion::to_pose_matrix(motion::resample(take.capture.clip, rate_hz),
                                  take.capture.humanoid);
  };
}

Change elsewhere(double yaw, const Eigen::Vector3d& to) {
  return [yaw, to](const Take& take) {
    return motion::to_pose_matrix(test::elsewhere(take.capture.clip, yaw, to),
                                  take.capture.humanoid);
  };
}

motion::PoseMatrix with_noise(const Take& take) {
  return test::with_noise(take.fragment.pose, 0.001);
}

// ---- Tables -----------------------------------------------------------------------------------

using Rows = Eigen::Matrix3Xd;

void print_factors(const std::string& label, const Eigen::Vector3d& values) {
  std::printf("%-52s flow %7.3f  weight %7.3f  time %7.3f\n", label.c_str(), values[0], values[1],
              values[2]);
}

Eigen::VectorXd row(const Rows& rows, int factor) {
  return rows.row(factor).transpose();
}

std::vector<effort::Descriptors> describe_all(const std::vector<Take>& takes,
                                              const Change& change) {
  std::vector<effort::Descriptors> descriptors(takes.size());
  math::parallel_for(static_cast<int>(takes.size()), 2, [&](int n) {
    const auto at = static_cast<std::size_t>(n);
    descriptors[at] = effort::describe(change(takes[at]));
  });
  return descriptors;
}

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

Eigen::Vector3d shares_at_the_ends(const Rows& labels) {
  return (labels.array().abs() >= effort::kEffortMax).cast<double>().rowwise().mean();
}

/// Rank correlations flow-weight, flow-time, weight-time.
Eigen::Vector3d rank_correlations(const Rows& rows) {
  const auto of = [&](int a, int b) {
    const Eigen::VectorXd x = row(rows, a), y = row(rows, b);
    return math::spearman(math::as_span(x), math::as_span(y));
  };
  return {of(0, 1), of(0, 2), of(1, 2)};
}

void print_correlations(const std::string& label, const Eigen::Vector3d& r) {
  std::printf("%-52s flow-weight %6.3f  flow-time %6.3f  weight-time %6.3f\n", label.c_str(), r[0],
              r[1], r[2]);
}

void print_stability(const std::string& label, const Rows& original, const Rows& changed) {
  const Rows change = (changed - original).cwiseAbs();
  Eigen::Vector3d median, high;
  for (int f = 0; f < 3; ++f) {
    const Eigen::VectorXd values = row(change, f);
    median[f] = math::median(math::as_span(values));
    high[f] = math::percentile(math::as_span(values), 95.0);
  }
  print_factors(label + ": median |change|", median);
  print_factors(label + ": 95th percentile", high);
}

/// How often a factor fails to rise, and the worst of it, in label units.
struct Monotony {
  Eigen::Vector3d failures = Eigen::Vector3d::Zero();
  Eigen::Vector3d clips = Eigen::Vector3d::Zero();
  Eigen::Vector3d least = Eigen::Vector3d::Constant(1e9);
  int trials = 0;
};

Monotony follow(const std::vector<Take>& takes, const effort::ObserverReference& reference,
                const std::function<std::vector<motion::PoseMatrix>(const Take&)>& series,
                bool from_first) {
  std::vector<std::vector<Eigen::Vector3d>> rises(takes.size());
  math::parallel_for(static_cast<int>(takes.size()), 2, [&](int n) {
    const auto at = static_cast<std::size_t>(n);
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    const auto poses = series(takes[at]);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Eigen::Vector3d now = effort::to_vector(
          effort::observe(effort::describe(poses[k]), reference, takes[at].fragment.content)
              .unclipped);
      if (k > 0) rises[at].push_back(now - before);
      if (k == 0 || !from_first) before = now;
    }
  });
  Monotony result;
  for (const auto& of_clip : rises) {
    Eigen::Vector3d broken = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& rise : of_clip) {
      const Eigen::Vector3d fails = (rise.array() <= 0.0).cast<double>();
      result.failures += fails;
      broken = broken.cwiseMax(fails);
      result.least = result.least.cwiseMin(rise);
      ++result.trials;
    }
    result.clips += broken;
  }
  return result;
}

void print_monotony(const std::string& label, const Monotony& m, const Eigen::Vector3d& asked) {
  std::printf("%-40s %5d steps:", label.c_str(), m.trials);
  for (const effort::Factor factor : effort::kFactors) {
    const int f = effort::index_of(factor);
    if (asked[f] == 0.0) continue;
    std::printf("  %s falls in %g steps of %g clips, least rise %.4f",
                std::string(effort::name_of(factor)).c_str(), m.failures[f], m.clips[f],
                m.least[f]);
  }
  std::printf("\n");
}

void study_monotony(const std::vector<Take>& takes, const effort::ObserverReference& reference) {
  const std::vector<double> tempi = {1.0, 1.1, 1.25, 1.5, 2.0};
  const auto resampled = [&](const Take& take) {
    std::vector<motion::PoseMatrix> poses;
    for (const double tempo : tempi) poses.push_back(test::faster(take.fragment.pose, tempo));
    return poses;
  };
  const auto same_frames = [&](const Take& take) {
    std::vector<motion::PoseMatrix> poses(tempi.size(), take.fragment.pose);
    for (std::size_t k = 0; k < tempi.size(); ++k) poses[k].frame_rate_hz *= tempi[k];
    return poses;
  };
  const auto held = [&](const Take& take) {
    std::vector<motion::PoseMatrix> poses = {take.fragment.pose};
    for (const double where : {0.1, 0.25, 0.5, 0.75, 0.9}) {
      for (const double hold_s : {0.2, 0.5, 1.0}) {
        poses.push_back(test::with_hold(take.fragment.pose, where, hold_s));
      }
    }
    return poses;
  };
  print_monotony("faster 1, 1.1, 1.25, 1.5, 2, resampled",
                 follow(takes, reference, resampled, false), {0.0, 1.0, 1.0});
  print_monotony("the same, frames as they are", follow(takes, reference, same_frames, false),
                 {0.0, 1.0, 1.0});
  print_monotony("holds of 0.2, 0.5, 1 s at five places", follow(takes, reference, held, true),
                 {1.0, 0.0, 0.0});
}

/// Labels along blends: how far from the line between the parents' and from a quadratic, and how
/// jagged (root mean square of the second difference at steps of 0.05), in label units.
void study_curves(const std::vector<Take>& takes, const std::vector<transfer::Fragment>& fragments,
                  const effort::ObserverReference& reference, int pair_count) {
  const Eigen::VectorXd alphas = Eigen::VectorXd::LinSpaced(31, -0.25, 1.25);
  Eigen::MatrixXd basis(alphas.size(), 3);
  basis << Eigen::VectorXd::Ones(alphas.size()), alphas, alphas.cwiseAbs2();
  const auto pairs = transfer::draw_blends(fragments, {.count = pair_count, .seed = 3});
  std::vector<Rows> curves(pairs.size());
  math::parallel_for(static_cast<int>(pairs.size()), 2, [&](int n) {
    const auto& pair = pairs[static_cast<std::size_t>(n)];
    const auto i = static_cast<std::size_t>(pair.fragment_i);
    const auto j = static_cast<std::size_t>(pair.fragment_j);
    const auto aligned = transfer::align_pair(fragments[i].pose, fragments[j].pose);
    Rows rows(3, alphas.size());
    for (Eigen::Index k = 0; k < alphas.size(); ++k) {
      const auto descriptors = effort::describe(blend::blend(aligned, alphas[k]).pose);
      rows.col(k) = effort::to_vector(
          effort::observe(descriptors, reference, takes[i].fragment.content).unclipped);
    }
    curves[static_cast<std::size_t>(n)] = rows;
  });
  Eigen::Vector3d total = Eigen::Vector3d::Zero(), quadratic = total, line = total, jagged = total,
                  monotone = total;
  for (const Rows& rows : curves) {
    for (int f = 0; f < 3; ++f) {
      const Eigen::VectorXd y = row(rows, f);
      const Eigen::VectorXd fitted = basis * basis.colPivHouseholderQr().solve(y);
      const Eigen::VectorXd straight = (1.0 - alphas.array()) * y[5] + alphas.array() * y[25];
      const Eigen::Index n = y.size();
      total[f] += (y.array() - y.mean()).square().mean();
      quadratic[f] += (y - fitted).array().square().mean();
      line[f] += (y - straight).array().square().mean();
      jagged[f] +=
          (y.tail(n - 2) - 2.0 * y.segment(1, n - 2) + y.head(n - 2)).array().square().mean();
      monotone[f] += std::abs(math::spearman(math::as_span(alphas), math::as_span(y)));
    }
  }
  const auto count = static_cast<double>(curves.size());
  std::printf("\nalong %zu pairs, alpha from -0.25 to 1.25, label units before clipping\n",
              curves.size());
  print_factors("rms about its mean", (total / count).cwiseSqrt());
  print_factors("rms from the line between the parents' labels", (line / count).cwiseSqrt());
  print_factors("rms from a quadratic", (quadratic / count).cwiseSqrt());
  print_factors("rms second difference, steps of 0.05", (jagged / count).cwiseSqrt());
  print_factors("mean |rank correlation| with alpha", monotone / count);
}

void study_correlations(const std::vector<Take>& takes,
                        const std::vector<transfer::Fragment>& fragments,
                        const std::vector<std::string>& groups, const Rows& labels,
                        const effort::ObserverReference& reference) {
  print_correlations("rank correlation of labels", rank_correlations(labels));
  Eigen::Vector3d inside = Eigen::Vector3d::Zero();
  for (const std::string& group : reference.groups) {
    Rows own(3, 0);
    for (std::size_t n = 0; n < groups.size(); ++n) {
      if (groups[n] != group) continue;
      own.conservativeResize(3, own.cols() + 1);
      own.rightCols(1) = labels.col(static_cast<Eigen::Index>(n));
    }
    const Eigen::Vector3d r = rank_correlations(own);
    print_correlations("  inside " + group, r);
    inside += r.cwiseAbs() / static_cast<double>(reference.groups.size());
  }
  print_correlations("mean |rank correlation| inside groups", inside);
  const auto blends = transfer::draw_blends(fragments, {.count = 105, .seed = 1});
  std::vector<effort::Descriptors> blended(blends.size());
  std::vector<std::string> blend_groups;
  for (const auto& blend : blends) {
    blend_groups.push_back(takes[static_cast<std::size_t>(blend.fragment_i)].fragment.content);
  }
  math::parallel_for(static_cast<int>(blends.size()), 2, [&](int n) {
    const auto at = static_cast<std::size_t>(n);
    blended[at] = effort::describe(transfer::make_blend(fragments, blends[at]).pose);
  });
  const Rows blend_labels = observed(blended, reference, blend_groups, true);
  print_correlations("rank correlation of 105 blends' labels", rank_correlations(blend_labels));
  Rows all(3, labels.cols() + blend_labels.cols());
  all << labels, blend_labels;
  print_correlations("rank correlation of takes and blends", rank_correlations(all));
  print_factors("share at the ends of the scale, takes", shares_at_the_ends(labels));
  print_factors("share at the ends of the scale, blends", shares_at_the_ends(blend_labels));
}

void study(const std::filesystem::path& folder, const std::string& pattern, int pair_count) {
  const std::vector<Take> takes = read_takes(folder, pattern);
  std::vector<std::string> groups;
  std::vector<transfer::Fragment> fragments;
  for (const Take& take : takes) {
    groups.push_back(take.fragment.content);
    fragments.push_back(take.fragment);
  }
  const auto as_it_is = [](const Take& take) { return take.fragment.pose; };
  const auto plain = describe_all(takes, as_it_is);
  const auto reference = effort::fit_observer_reference(plain, groups);
  std::printf("%zu takes, %zu groups\n\n", takes.size(), reference.groups.size());
  for (std::size_t g = 0; g <= reference.groups.size(); ++g) {
    const auto column = static_cast<Eigen::Index>(g);
    const std::string name = g < reference.groups.size() ? reference.groups[g] : "pooled";
    print_factors(name + ": center", reference.center.col(column));
    print_factors(name + ": scale", reference.scale.col(column));
  }
  const Rows labels = observed(plain, reference, groups, true);
  std::printf("\n");
  study_correlations(takes, fragments, groups, labels, reference);
  std::printf("\nchange in label units, before clipping\n");
  const Rows unclipped = observed(plain, reference, groups, false);
  const auto compare = [&](const std::string& name, const Change& change) {
    print_stability(name, unclipped,
                    observed(describe_all(takes, change), reference, groups, false));
  };
  compare("at 30 Hz", at_rate(30.0));
  compare("at 60 Hz", at_rate(60.0));
  compare("at 120 Hz", at_rate(120.0));
  compare("turned and moved", elsewhere(2.0, {3.0, 0.0, -5.0}));
  compare("1 mm of noise", with_noise);
  std::printf("\n");
  study_monotony(takes, reference);
  study_curves(takes, fragments, reference, pair_count);
}

/// Files that begin with a T-pose fade from it within four frames after it, in one of the two rigs
/// alone: a movement that would outweigh all others of a piece in which the performer waits.
constexpr double kTPoseFadeS = 0.1;

void study_rigs(const std::filesystem::path& corpus, const std::string& pattern,
                const std::vector<std::string>& files) {
  const std::vector<Take> takes = read_takes(corpus, pattern);
  std::vector<std::string> groups;
  for (const Take& take : takes) groups.push_back(take.fragment.content);
  const auto reference = effort::fit_observer_reference(
      describe_all(takes, [](const Take& take) { return take.fragment.pose; }), groups);
  const Eigen::Index last = reference.scale.cols() - 1;
  Eigen::Vector3d unit;
  for (int f = 0; f < 3; ++f) {
    const Eigen::VectorXd scales = reference.scale.row(f).head(last).transpose();
    unit[f] = math::median(math::as_span(scales)) / effort::kEffortPerDeviation;
  }
  std::vector<double> all;
  for (std::size_t n = 0; n + 1 < files.size(); n += 2) {
    std::vector<motion::PoseMatrix> poses;
    for (std::size_t k = n; k < n + 2; ++k) {
      const motion::Capture capture = motion::find_capture(io::read_clip(files[k]).clip);
      poses.push_back(motion::to_pose_matrix(capture.clip, capture.humanoid));
    }
    // Whole takes, and pieces of 3 s, which are as long as fragments.
    const double shorter = std::min(poses[0].duration_s(), poses[1].duration_s());
    std::vector<Eigen::Vector3d> changes;
    const auto add = [&](double begin_s, double end_s) {
      Eigen::Vector3d seen[2];
      for (std::size_t k = 0; k < 2; ++k) {
        const auto frame = [&](double s) {
          return static_cast<int>(std::lround(s * poses[k].frame_rate_hz));
        };
        const auto d = effort::describe(poses[k].slice(frame(begin_s), frame(end_s)));
        seen[k] = Eigen::Vector3d(d.flow, d.weight, d.time).cwiseQuotient(unit);
      }
      changes.push_back(seen[1] - seen[0]);
    };
    add(0.0, shorter);
    print_factors(std::filesystem::path(files[n]).stem().string() + ", whole", changes.back());
    for (double at = kTPoseFadeS; at + 3.0 <= shorter; at += 3.0) add(at, at + 3.0);
    Rows rows(3, static_cast<Eigen::Index>(changes.size()));
    for (std::size_t k = 0; k < changes.size(); ++k) {
      rows.col(static_cast<Eigen::Index>(k)) = changes[k].cwiseAbs();
      for (const double value : changes[k]) all.push_back(std::abs(value));
    }
    print_stability("  and its pieces of 3 s", Rows::Zero(3, rows.cols()), rows);
  }
  std::printf("all: median %.3f, 95th percentile %.3f label units\n", math::median(all),
              math::percentile(all, 95.0));
}

}  // namespace

int main(int argument_count, char** arguments) {
  const bool rigs = argument_count >= 6 && std::strcmp(arguments[1], "--rigs") == 0;
  if (!rigs && argument_count != 3 && argument_count != 4) {
    std::fprintf(stderr,
                 "usage: observer_study FOLDER PATTERN [BLEND_PAIRS]\n"
                 "       observer_study --rigs CORPUS PATTERN FILE FILE [FILE FILE ..]\n");
    return 2;
  }
  try {
    if (rigs) {
      study_rigs(arguments[2], arguments[3], {arguments + 4, arguments + argument_count});
    } else {
      study(arguments[1], arguments[2], argument_count == 4 ? std::atoi(arguments[3]) : 50);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "observer_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
