// Are five actions of an unseen performer, joined into one input, found again? The figure:
// one performer (or style) is left out, his actions are joined in three fixed orders, the database
// holds every other performer's takes, and the metric is learnt from the database alone. Right
// means the contents in order, equal neighbours merged. METHODS 1.5 tells what trials got. Also
// printed: how much of a left-out performer's takes is believed to match, and how much of takes of
// a content that the database lacks; how well clustering by DTW alone finds the contents, and which
// it confuses.
//
// Usage: segmentation_study FOLDER PATTERN CONTENT,CONTENT,.. [TAKE]
//   e.g. PATTERN 'dataset-1_{content}_{performer}_{take}', contents bow,bye,byebye,guide,walk, and
//   001: the take that is joined where a performer has several.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/content_groups.h"
#include "laban/align/content_metric.h"
#include "laban/align/segment_input.h"
#include "laban/align/unseen_costs.h"
#include "laban/base/error.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"

#include "takes.h"

namespace {

using namespace laban;

struct Take {
  int content;
  int performer;
  std::string take;
  motion::Capture capture;
  motion::PoseMatrix pose;
};

struct Corpus {
  std::vector<std::string> contents;
  std::vector<std::string> performers;
  std::vector<Take> takes;
};

int index_in(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) names.push_back(name);
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

/// The takes of some contents, all at the rate of the first.
Corpus read_corpus(const std::filesystem::path& folder, const std::string& pattern,
                   const std::vector<std::string>& contents) {
  Corpus corpus{contents, {}, {}};
  double frame_rate_hz = 0.0;
  for (studies::Take& take : studies::read_takes(folder, pattern)) {
    const auto content = std::find(contents.begin(), contents.end(), take.content);
    if (content == contents.end()) continue;
    motion::Capture& capture = take.capture;
    if (frame_rate_hz == 0.0) frame_rate_hz = capture.clip.frame_rate_hz();
    capture.clip = motion::resample(capture.clip, frame_rate_hz);
    motion::PoseMatrix pose = motion::to_pose_matrix(capture.clip, capture.humanoid);
    corpus.takes.push_back({static_cast<int>(content - contents.begin()),
                            index_in(corpus.performers, take.performer), take.take,
                            std::move(capture), std::move(pose)});
  }
  if (corpus.takes.empty()) {
    throw base::Error(base::ErrorKind::kData, folder.string() + ": no take of these contents");
  }
  return corpus;
}

// The rows of several takes, one after the other, as one clip.
motion::PoseMatrix joined(const std::vector<const Take*>& takes) {
  const motion::Clip& first = takes[0]->capture.clip;
  const int joints = first.joint_count();
  int frame_count = 0;
  for (const Take* take : takes) frame_count += take->capture.clip.frame_count();
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Matrix3Xd root_positions(3, frame_count);
  Eigen::Matrix3Xd translations(3, first.has_translations() ? frame_count * joints : 0);
  int frame = 0;
  for (const Take* take : takes) {
    const motion::Clip& clip = take->capture.clip;
    for (int t = 0; t < clip.frame_count(); ++t, ++frame) {
      const auto own = clip.rotations(t);
      rotations.insert(rotations.end(), own.begin(), own.end());
      root_positions.col(frame) = clip.root_positions().col(t);
      if (translations.cols() == 0) continue;
      for (int j = 0; j < joints; ++j)
        translations.col(frame * joints + j) = clip.translation(t, j);
    }
  }
  const motion::Clip clip(first.shared_skeleton(), first.frame_rate_hz(), std::move(root_positions),
                          std::move(rotations), std::move(translations));
  return motion::to_pose_matrix(clip, takes[0]->capture.humanoid);
}

// A boundary is well placed if it is no farther from the truth or from the still stretch around it.
constexpr double kNearS = 0.2;

struct Score {
  int right = 0;
  int runs = 0;
  double right_frames = 0.0;
  double frames = 0.0;
  std::vector<double> boundary_errors_s;  // of right runs
  // The same, 0 inside the still stretch between two takes: no one can tell where it is cut.
  std::vector<double> errors_beyond_stillness_s;
  std::vector<std::string> wrong;  // what was found instead
  std::vector<std::string> far;    // boundaries of right runs farther off than kNearS

  void add(const Score& other) {
    right += other.right;
    runs += other.runs;
    right_frames += other.right_frames;
    frames += other.frames;
    boundary_errors_s.insert(boundary_errors_s.end(), other.boundary_errors_s.begin(),
                             other.boundary_errors_s.end());
    errors_beyond_stillness_s.insert(errors_beyond_stillness_s.end(),
                                     other.errors_beyond_stillness_s.begin(),
                                     other.errors_beyond_stillness_s.end());
    wrong.insert(wrong.end(), other.wrong.begin(), other.wrong.end());
    far.insert(far.end(), other.far.begin(), other.far.end());
  }
};

struct Run {
  std::vector<int> order;        // contents joined
  std::vector<int> begin_frame;  // of each, and the end of the last
  motion::PoseMatrix input;
};

// Frames [first, last] around the boundary at which a run hardly moves: slower than a tenth of its
// quick moments (the 95th percentile of its speed), the jump between the takes not counted.
std::pair<int, int> still_stretch(const Run& run, int boundary) {
  const Eigen::MatrixXd& angles = run.input.angles;
  const Eigen::Index steps = angles.cols() - 1;
  const Eigen::VectorXd speed =
      (angles.rightCols(steps) - angles.leftCols(steps)).colwise().norm().transpose();
  const double still = 0.1 * math::percentile(math::as_span(speed), 95.0);
  int first = boundary;
  int last = boundary;
  while (first >= 2 && speed[first - 2] < still) --first;
  while (last < steps && speed[last] < still) ++last;
  return {first, last};
}

void judge(const Run& run, const std::vector<align::Snippet>& snippets,
           const std::vector<int>& groups, const Corpus& corpus, int performer, Score& score) {
  std::vector<int> found;
  std::vector<int> begins;
  std::string told = corpus.performers[static_cast<std::size_t>(performer)] + ":";
  for (const align::Snippet& snippet : snippets) {
    const int content = groups[static_cast<std::size_t>(snippet.fragment)];
    told += ' ' + corpus.contents[static_cast<std::size_t>(content)] + ' ' +
            std::to_string(snippet.end - snippet.begin);
    if (found.empty() || found.back() != content) {
      found.push_back(content);
      begins.push_back(snippet.begin);
    }
    for (std::size_t n = 0; n < run.order.size(); ++n) {
      if (run.order[n] != content) continue;
      const int overlap = std::min(snippet.end, run.begin_frame[n + 1]) -
                          std::max(snippet.begin, run.begin_frame[n]);
      score.right_frames += std::max(0, overlap);
    }
  }
  score.frames += run.begin_frame.back();
  ++score.runs;
  if (found != run.order) {
    score.wrong.push_back(told);
    return;
  }
  ++score.right;
  for (std::size_t n = 1; n < begins.size(); ++n) {
    score.boundary_errors_s.push_back(std::abs(begins[n] - run.begin_frame[n]) /
                                      run.input.frame_rate_hz);
    const auto [first, last] = still_stretch(run, run.begin_frame[n]);
    const double rate_hz = run.input.frame_rate_hz;
    score.errors_beyond_stillness_s.push_back(std::max({0, first - begins[n], begins[n] - last}) /
                                              rate_hz);
    if (score.errors_beyond_stillness_s.back() <= kNearS) continue;
    char told_far[160];
    std::snprintf(told_far, sizeof told_far,
                  "%s: %s | %s %+.2f s, still %.2f s before to %.2f after",
                  corpus.performers[static_cast<std::size_t>(performer)].c_str(),
                  corpus.contents[static_cast<std::size_t>(found[n - 1])].c_str(),
                  corpus.contents[static_cast<std::size_t>(found[n])].c_str(),
                  (begins[n] - run.begin_frame[n]) / rate_hz,
                  (run.begin_frame[n] - first) / rate_hz, (last - run.begin_frame[n]) / rate_hz);
    score.far.emplace_back(told_far);
  }
}

// The three fixed orders: as listed, reversed, and every other one first (1-3-5-2-4).
std::vector<std::vector<int>> orders_of(int content_count) {
  std::vector<int> listed(static_cast<std::size_t>(content_count));
  std::iota(listed.begin(), listed.end(), 0);
  std::vector<int> skipping;
  for (int start = 0; start < 2; ++start) {
    for (int content = start; content < content_count; content += 2) skipping.push_back(content);
  }
  return {listed, {listed.rbegin(), listed.rend()}, skipping};
}

std::vector<Run> runs_of(const Corpus& corpus, int performer, const std::string& joined_take) {
  std::vector<Run> runs;
  for (const auto& order : orders_of(static_cast<int>(corpus.contents.size()))) {
    Run run{order, {0}, {}};
    std::vector<const Take*> takes;
    for (const int content : order) {
      const auto take =
          std::find_if(corpus.takes.begin(), corpus.takes.end(), [&](const Take& candidate) {
            return candidate.content == content && candidate.performer == performer &&
                   (joined_take.empty() || candidate.take == joined_take);
          });
      if (take == corpus.takes.end()) return {};
      takes.push_back(&*take);
      run.begin_frame.push_back(run.begin_frame.back() + take->pose.frame_count());
    }
    run.input = joined(takes);
    runs.push_back(std::move(run));
  }
  return runs;
}

struct Database {
  std::vector<motion::PoseMatrix> poses;
  std::vector<int> groups;
  std::vector<int> performers;
};

Database all_but(const Corpus& corpus, int left_out) {
  Database database;
  for (const Take& take : corpus.takes) {
    if (take.performer == left_out) continue;
    database.poses.push_back(take.pose);
    database.groups.push_back(take.content);
    database.performers.push_back(take.performer);
  }
  return database;
}

void print_score(const char* metric, const Score& score) {
  std::printf("%-8s %3d of %3d right, frames %.1f %%", metric, score.right, score.runs,
              100.0 * score.right_frames / score.frames);
  if (!score.boundary_errors_s.empty()) {
    std::printf(", boundaries of right runs: median %.2f s, 95th percentile %.2f s",
                math::median(score.boundary_errors_s),
                math::percentile(score.boundary_errors_s, 95.0));
    const auto near = std::count_if(score.errors_beyond_stillness_s.begin(),
                                    score.errors_beyond_stillness_s.end(),
                                    [](double error) { return error <= kNearS; });
    std::printf(", %.1f %% within 0.2 s of the truth or of the still stretch around it",
                100.0 * static_cast<double>(near) /
                    static_cast<double>(score.errors_beyond_stillness_s.size()));
  }
  std::printf("\n");
  for (const std::string& wrong : score.wrong) std::printf("           %s\n", wrong.c_str());
  for (const std::string& far : score.far) std::printf("           far %s\n", far.c_str());
}

void print_segmentation(const Corpus& corpus, const std::string& joined_take) {
  const int performer_count = static_cast<int>(corpus.performers.size());
  std::vector<Score> raw(corpus.performers.size());
  std::vector<Score> content(corpus.performers.size());
  math::parallel_for(performer_count, 0, [&](int performer) {
    const Database database = all_but(corpus, performer);
    const align::FragmentSet raw_set(align::ContentMetric::raw(), database.poses, database.groups,
                                     database.performers);
    const align::FragmentSet content_set(
        align::fit_content_metric(database.poses, database.groups, database.performers),
        database.poses, database.groups, database.performers);
    for (const Run& run : runs_of(corpus, performer, joined_take)) {
      const auto slot = static_cast<std::size_t>(performer);
      judge(run, align::segment_input(run.input, raw_set)->snippets, database.groups, corpus,
            performer, raw[slot]);
      judge(run, align::segment_input(run.input, content_set)->snippets, database.groups, corpus,
            performer, content[slot]);
    }
  });
  Score raw_total;
  Score content_total;
  for (const Score& score : raw) raw_total.add(score);
  for (const Score& score : content) content_total.add(score);
  print_score("raw", raw_total);
  print_score("content", content_total);
}

/// How much of some takes is believed to match the database.
struct Believed {
  double frames = 0.0;
  double matched = 0.0;

  void add(const Believed& other) {
    frames += other.frames;
    matched += other.matched;
  }
  [[nodiscard]] double percent() const { return 100.0 * matched / frames; }
};

/// Takes of an unknown performer, of known contents and of one that the database lacks, by
/// thresholds from the costs inside the database and from unseen_costs.
struct Belief {
  std::array<Believed, 2> inside;  // known content, unknown one
  std::array<Believed, 2> unseen;

  void add(const Belief& other) {
    for (std::size_t k = 0; k < 2; ++k) {
      inside[k].add(other.inside[k]);
      unseen[k].add(other.unseen[k]);
    }
  }
};

Believed believed(const std::vector<align::Snippet>& snippets, const std::vector<int>& groups,
                  const std::vector<align::GroupCostStatistics>& costs) {
  Believed sum;
  for (const align::Snippet& snippet : snippets) {
    const auto group = static_cast<std::size_t>(groups[static_cast<std::size_t>(snippet.fragment)]);
    sum.frames += snippet.end - snippet.begin;
    if (snippet.mean_cost() <= costs[group].threshold) sum.matched += snippet.end - snippet.begin;
  }
  return sum;
}

/// @param missing  content left out of the database, whose takes are judged; -1: none, and all are.
Belief belief(const Corpus& corpus, int performer, int missing) {
  Database database;
  for (const Take& take : corpus.takes) {
    if (take.performer == performer || take.content == missing) continue;
    database.poses.push_back(take.pose);
    database.groups.push_back(take.content);
    database.performers.push_back(take.performer);
  }
  const align::FragmentSet set(
      align::fit_content_metric(database.poses, database.groups, database.performers),
      database.poses, database.groups, database.performers);
  const auto inside = align::group_cost_statistics(align::all_pair_costs(set.features()).mean_cost,
                                                   database.groups);
  const auto unseen = align::group_cost_statistics(
      align::unseen_costs(database.poses, database.groups, database.performers), database.groups,
      align::kUnseenThreshold);
  Belief sum;
  const std::size_t kind = missing < 0 ? 0 : 1;
  for (const Take& take : corpus.takes) {
    if (take.performer != performer || (missing >= 0 && take.content != missing)) continue;
    const auto snippets = align::segment_input(take.pose, set)->snippets;
    sum.inside[kind].add(believed(snippets, database.groups, inside));
    sum.unseen[kind].add(believed(snippets, database.groups, unseen));
  }
  return sum;
}

void print_belief(const Corpus& corpus) {
  const int contents = static_cast<int>(corpus.contents.size());
  const int performers = static_cast<int>(corpus.performers.size());
  std::vector<Belief> beliefs(static_cast<std::size_t>(performers * (contents + 1)));
  math::parallel_for(static_cast<int>(beliefs.size()), 0, [&](int n) {
    beliefs[static_cast<std::size_t>(n)] =
        belief(corpus, n / (contents + 1), n % (contents + 1) - 1);
  });
  Belief sum;
  for (const Belief& one : beliefs) sum.add(one);
  std::printf(
      "\nframes of single takes believed to match: of known contents %.1f %%, of a content that "
      "the database lacks %.1f %%\n  (by thresholds from costs inside the database %.1f %%, %.1f "
      "%%)\n",
      sum.unseen[0].percent(), sum.unseen[1].percent(), sum.inside[0].percent(),
      sum.inside[1].percent());
}

void print_groups(const Corpus& corpus, const char* metric,
                  const std::vector<Eigen::MatrixXd>& features) {
  std::vector<int> truth;
  for (const Take& take : corpus.takes) truth.push_back(take.content);
  const align::PairCosts costs = align::all_pair_costs(features, 0);
  align::ClusterOptions options;
  options.group_count = static_cast<int>(corpus.contents.size());
  const std::vector<int> groups =
      align::content_groups(align::locally_scaled(costs.mean_cost), options);
  std::printf("\ncontent groups by DTW alone, %s: adjusted Rand index %.3f\n", metric,
              math::adjusted_rand_index(groups, truth));
  for (int group = 0; group <= *std::max_element(groups.begin(), groups.end()); ++group) {
    std::printf("  group %d:", group);
    for (std::size_t c = 0; c < corpus.contents.size(); ++c) {
      int count = 0;
      for (std::size_t i = 0; i < groups.size(); ++i) {
        count += groups[i] == group && truth[i] == static_cast<int>(c) ? 1 : 0;
      }
      if (count > 0) std::printf(" %d %s", count, corpus.contents[c].c_str());
    }
    std::printf("\n");
  }
}

// Clustering knows no contents, so its metric may not either: raw angles, or each joint scaled to
// its spread relative to the performer's mean pose.
void print_all_groups(const Corpus& corpus) {
  const Database all = all_but(corpus, -1);
  const align::FragmentSet raw(align::ContentMetric::raw(), all.poses, all.groups, all.performers);
  print_groups(corpus, "raw angles", raw.features());
  const align::FragmentSet scaled(
      align::fit_content_metric(all.poses, {}, all.performers, {.dimensions = 63}), all.poses,
      all.groups, all.performers);
  print_groups(corpus, "relative to the performer's mean pose, scaled", scaled.features());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    std::fprintf(stderr, "usage: segmentation_study FOLDER PATTERN CONTENT,CONTENT,.. [TAKE]\n");
    return 2;
  }
  try {
    const Corpus corpus = read_corpus(argv[1], argv[2], studies::split(argv[3]));
    std::printf("%zu takes, %zu contents, %zu performers\n", corpus.takes.size(),
                corpus.contents.size(), corpus.performers.size());
    print_segmentation(corpus, argc == 5 ? argv[4] : "");
    print_belief(corpus);
    print_all_groups(corpus);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "segmentation_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
