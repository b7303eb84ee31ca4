#include "laban/align/segment_input.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/math/statistics.h"

#include "align/boundary_vote.h"
#include "align/one_stage.h"

namespace laban::align {
namespace {

using base::Error;
using base::ErrorKind;
using motion::PoseMatrix;

// First guesses are compared on so many frames a second: which basin, not where in it.
constexpr double kStartRateHz = 5.0;
// Of an input that holds several contents, any guess lowers the cost a little by bending one
// content into another; an input of one content alone falls far lower from the guess that is right.
// Bandai, styles left out: of 90 single takes 66 were named rightly at 0.5, 78 at 0.6 and 80 at
// 0.7, of 45 inputs of five actions always 42; HDM05's 12 of 12 at all three.
constexpr double kClearlyLower = 0.7;
// A boundary is voted on within half a slow gesture: farther off stands another content's affair.
constexpr double kVoteReachS = 1.0;
// Of boundaries of left-out performers those of Bandai's takes, which begin and end nearly still,
// come nearer to the truth the more this is, up to 8; HDM05's, which are cut amid motion, are a
// tenth farther off from 4 on (METHODS 1.5's inputs).
constexpr double kStillness = 2.0;
// What counts as quick in an input: few of its steps from frame to frame are longer.
constexpr double kQuickPercentile = 95.0;
// What the snippets' own fragments may lose by it: from there on to no limit boundaries of left-out
// performers came out the same, below some stayed that would have come nearer.
constexpr double kMostRise = 0.3;

// How far the work has come, by and by: first guesses, offset, path, boundaries.
constexpr double kGuessed = 0.1;
constexpr double kOffsetFound = 0.4;
constexpr double kPathFound = 0.8;

// Every stride-th frame, the first among them.
Eigen::MatrixXd thinned(const Eigen::MatrixXd& features, int stride) {
  const Eigen::Index count = (features.cols() + stride - 1) / stride;
  return features(Eigen::all, Eigen::seqN(0, count, stride));
}

// The mean difference between input frames and the fragment frames they lie beside, a path cell
// counting one.
Eigen::VectorXd mean_difference(const Eigen::MatrixXd& features,
                                const std::vector<Snippet>& snippets,
                                const std::vector<Eigen::MatrixXd>& fragments) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(features.rows());
  double cells = 0.0;
  for (const Snippet& snippet : snippets) {
    const Eigen::MatrixXd part = features.middleCols(snippet.begin, snippet.end - snippet.begin);
    const Eigen::MatrixXd& fragment = fragments[static_cast<std::size_t>(snippet.fragment)];
    for (const FramePair& pair : dtw(part, fragment).path) {
      sum += part.col(pair.p) - fragment.col(pair.q);
      cells += 1.0;
    }
  }
  return sum / cells;
}

bool same_snippets(const std::vector<Snippet>& a, const std::vector<Snippet>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Snippet& x, const Snippet& y) {
    return x.begin == y.begin && x.end == y.end && x.fragment == y.fragment;
  });
}

// Input and fragments at some frame rate.
struct Features {
  Eigen::MatrixXd input;
  std::vector<Eigen::MatrixXd> fragments;
};

Features thinned(const Features& all, int stride) {
  Features few{thinned(all.input, stride), {}};
  for (const Eigen::MatrixXd& fragment : all.fragments) {
    few.fragments.push_back(thinned(fragment, stride));
  }
  return few;
}

struct Offset {
  Eigen::VectorXd value;
  double cost = 0.0;  // of the path that goes with it
  int rounds = 0;
  bool converged = false;
};

// What the rounds of all first guesses share.
class OffsetSearch {
 public:
  OffsetSearch(Features features, const SegmentInputOptions& options)
      : features_(std::move(features)),
        one_stage_(features_.input, features_.fragments, options.steps),
        most_rounds_(options.offset_rounds) {}
  OffsetSearch(const OffsetSearch&) = delete;  // one_stage_ looks at features_
  OffsetSearch& operator=(const OffsetSearch&) = delete;

  [[nodiscard]] int dimension_count() const { return static_cast<int>(features_.input.rows()); }
  // The offset of the input's features, found in turn with the path, from a first guess on; nothing
  // if the slope limit leaves no path.
  [[nodiscard]] std::optional<Offset> from(const Eigen::VectorXd& start,
                                           base::Progress* progress) const;

 private:
  const Features features_;
  const OneStage one_stage_;
  const int most_rounds_;
};

std::optional<Offset> OffsetSearch::from(const Eigen::VectorXd& start,
                                         base::Progress* progress) const {
  Offset offset{start};
  Eigen::MatrixXd input = features_.input.colwise() - start;
  const auto round = [&](int number) {
    const double share = 1.0 / (most_rounds_ + 1);
    base::ProgressPart part(progress, number * share, (number + 1) * share);
    return one_stage_.segment(input, &part);
  };
  std::optional<Segmentation> current = round(0);
  if (!current) return std::nullopt;
  while (!offset.converged && offset.rounds < most_rounds_) {
    const Eigen::VectorXd step = mean_difference(input, current->snippets, features_.fragments);
    offset.value += step;
    input.colwise() -= step;
    std::optional<Segmentation> next = round(offset.rounds + 1);
    offset.converged = same_snippets(current->snippets, next->snippets);
    current = std::move(next);
    ++offset.rounds;
  }
  offset.cost = current->cost;
  return offset;
}

// What the offset would be if the input held one content and nothing else: its mean frame is 0, the
// content's is not.
std::vector<Eigen::VectorXd> offsets_of_contents(const FragmentSet& fragments) {
  std::map<int, std::pair<Eigen::VectorXd, double>> sums;
  for (std::size_t i = 0; i < fragments.features().size(); ++i) {
    const Eigen::MatrixXd& features = fragments.features()[i];
    auto& [sum, count] = sums[fragments.groups()[i]];
    if (count == 0.0) sum = Eigen::VectorXd::Zero(features.rows());
    sum += features.rowwise().sum();
    count += static_cast<double>(features.cols());
  }
  std::vector<Eigen::VectorXd> offsets;
  for (const auto& content : sums) {
    offsets.push_back(-content.second.first / content.second.second);
  }
  return offsets;
}

// The plain mean of the input's frames, or the first guess from which the cost falls clearly lower,
// on few frames.
Eigen::VectorXd best_start(const OffsetSearch& search, const FragmentSet& fragments,
                           base::Progress* progress) {
  std::vector<Eigen::VectorXd> starts = offsets_of_contents(fragments);
  starts.insert(starts.begin(), Eigen::VectorXd::Zero(search.dimension_count()));
  const Eigen::VectorXd* best = &starts.front();
  double least = std::numeric_limits<double>::infinity();
  const double share = 1.0 / static_cast<double>(starts.size());
  double done = 0.0;
  for (const Eigen::VectorXd& start : starts) {
    base::ProgressPart part(progress, done, done + share);
    done += share;
    const std::optional<Offset> offset = search.from(start, &part);
    if (!offset || !(offset->cost < least)) continue;
    // What comes after the plain mean has to be clearly better than it.
    least = &start == &starts.front() ? kClearlyLower * offset->cost : offset->cost;
    best = &start;
  }
  return *best;
}

int stride_for(double rate_hz, double wanted_hz) {
  return static_cast<int>(std::max(1.0, std::floor(rate_hz / wanted_hz)));
}

// How fast the joints turn at each frame, as a share of the input's quick moments.
std::vector<double> speed_of(const PoseMatrix& input) {
  const Eigen::Index count = input.angles.cols() - 1;
  if (count < 1) return {};
  Eigen::VectorXd steps(count + 1);
  steps.tail(count) =
      (input.angles.rightCols(count) - input.angles.leftCols(count)).colwise().norm().transpose();
  steps(0) = steps(1);
  const double quick = math::percentile(math::as_span(steps), kQuickPercentile);
  if (!(quick > 0.0)) return {};
  steps /= quick;
  return {steps.begin(), steps.end()};
}

// Boundaries by the vote of several fragments, and the cost that goes with them.
void vote(const PoseMatrix& input, const FragmentSet& fragments, const SegmentInputOptions& options,
          InputSegmentation& found, base::Progress* progress) {
  const double rate_hz = fragments.frame_rate_hz();
  vote_on_boundaries(found.features, fragments.features(), fragments.groups(),
                     {.voters = options.boundary_voters,
                      .stride = stride_for(rate_hz, options.offset_rate_hz),
                      .reach_frames = static_cast<int>(std::lround(kVoteReachS * rate_hz)),
                      .speed = speed_of(input),
                      .stillness = kStillness,
                      .most_rise = kMostRise},
                     found.snippets, progress);
  found.cost = 0.0;
  for (const Snippet& snippet : found.snippets) {
    found.cost += snippet.cost + options.steps.snippet_cost;
  }
}

}  // namespace

FragmentSet::FragmentSet(ContentMetric metric, std::span<const PoseMatrix> poses,
                         std::vector<int> groups, std::vector<int> performers)
    : frame_rate_hz_(poses.empty() ? 0.0 : poses[0].frame_rate_hz),
      metric_(std::move(metric)),
      groups_(std::move(groups)),
      performers_(std::move(performers)) {
  if (poses.empty() || groups_.size() != poses.size() || performers_.size() != poses.size()) {
    throw Error(ErrorKind::kData, "FragmentSet: " + std::to_string(poses.size()) + " fragments, " +
                                      std::to_string(groups_.size()) + " groups, " +
                                      std::to_string(performers_.size()) +
                                      " performers (must be as many, at least 1)");
  }
  std::map<int, std::vector<PoseMatrix>> clips_of;
  std::map<int, std::vector<int>> contents_of;
  for (const PoseMatrix& pose : poses) {
    if (pose.frame_rate_hz != frame_rate_hz_) {
      throw Error(ErrorKind::kData, "FragmentSet: frame rates " + std::to_string(frame_rate_hz_) +
                                        " and " + std::to_string(pose.frame_rate_hz) +
                                        " Hz (must be one)");
    }
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    clips_of[performers_[i]].push_back(poses[i]);
    contents_of[performers_[i]].push_back(groups_[i]);
  }
  std::map<int, Eigen::VectorXd> mean_of;
  for (const auto& [performer, clips] : clips_of) {
    mean_of[performer] = metric_.mean_pose(clips, contents_of.at(performer));
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    features_.push_back(metric_.features(poses[i], mean_of.at(performers_[i])));
  }
}

std::vector<std::string> SegmentInputOptions::problems() const {
  std::vector<std::string> found = steps.problems();
  if (offset_rounds < 0) {
    found.push_back("SegmentInputOptions::offset_rounds = " + std::to_string(offset_rounds) +
                    " (must be >= 0)");
  }
  if (!(offset_rate_hz > 0.0)) {
    found.push_back("SegmentInputOptions::offset_rate_hz = " + std::to_string(offset_rate_hz) +
                    " (must be > 0)");
  }
  if (boundary_voters < 0) {
    found.push_back("SegmentInputOptions::boundary_voters = " + std::to_string(boundary_voters) +
                    " (must be >= 0)");
  }
  return found;
}

std::optional<InputSegmentation> segment_input(const PoseMatrix& input,
                                               const FragmentSet& fragments,
                                               const SegmentInputOptions& options,
                                               base::Progress* progress) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
  if (input.frame_rate_hz != fragments.frame_rate_hz()) {
    throw Error(ErrorKind::kData, "segment_input: input at " + std::to_string(input.frame_rate_hz) +
                                      " Hz, fragments at " +
                                      std::to_string(fragments.frame_rate_hz()) +
                                      " Hz (resample it first)");
  }
  const ContentMetric& metric = fragments.metric();
  InputSegmentation result;
  result.features = metric.features(input, metric.mean_pose({&input, 1}));
  result.converged = true;
  if (metric.kind() == MetricKind::kContent && options.offset_rounds > 0) {
    const Features all{result.features, fragments.features()};
    const auto at_rate = [&](double rate_hz) {
      return thinned(all, stride_for(input.frame_rate_hz, rate_hz));
    };
    base::ProgressPart guessing(progress, 0.0, kGuessed);
    const Eigen::VectorXd start =
        best_start({at_rate(kStartRateHz), options}, fragments, &guessing);
    base::ProgressPart finding(progress, kGuessed, kOffsetFound);
    const std::optional<Offset> offset =
        OffsetSearch(at_rate(options.offset_rate_hz), options).from(start, &finding);
    if (offset) {
      result.features.colwise() -= offset->value;
      result.rounds = offset->rounds;
    }
    result.converged = offset && offset->converged;
  }
  base::ProgressPart cutting(progress, kOffsetFound, kPathFound);
  std::optional<Segmentation> found =
      segment(result.features, fragments.features(), options.steps, &cutting);
  if (!found) return std::nullopt;
  result.snippets = std::move(found->snippets);
  result.cost = found->cost;
  const bool by_vote = metric.kind() == MetricKind::kContent && options.boundary_voters > 0 &&
                       !options.steps.slope_limit;
  base::ProgressPart voting(progress, kPathFound, 1.0);
  if (by_vote) vote(input, fragments, options, result, &voting);
  return result;
}

}  // namespace laban::align
