#include "laban/align/segment_input.h"

#include <algorithm>
#include <map>
#include <utility>

#include "laban/align/dtw.h"
#include "laban/base/error.h"

namespace laban::align {
namespace {

using base::Error;
using base::ErrorKind;
using motion::PoseMatrix;

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

}  // namespace

FragmentSet::FragmentSet(ContentMetric metric, std::span<const PoseMatrix> poses,
                         std::vector<int> groups, std::vector<int> performers)
    : metric_(std::move(metric)), groups_(std::move(groups)), performers_(std::move(performers)) {
  if (poses.empty() || groups_.size() != poses.size() || performers_.size() != poses.size()) {
    throw Error(ErrorKind::kData, "FragmentSet: " + std::to_string(poses.size()) + " fragments, " +
                                      std::to_string(groups_.size()) + " groups, " +
                                      std::to_string(performers_.size()) +
                                      " performers (must be as many, at least 1)");
  }
  std::map<int, std::vector<PoseMatrix>> clips_of;
  for (std::size_t i = 0; i < poses.size(); ++i) clips_of[performers_[i]].push_back(poses[i]);
  std::map<int, Eigen::VectorXd> mean_of;
  for (const auto& [performer, clips] : clips_of) mean_of[performer] = metric_.mean_pose(clips);
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
  return found;
}

std::optional<InputSegmentation> segment_input(const PoseMatrix& input,
                                               const FragmentSet& fragments,
                                               const SegmentInputOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
  const ContentMetric& metric = fragments.metric();
  InputSegmentation result;
  result.features = metric.features(input, metric.mean_pose({&input, 1}));
  std::optional<Segmentation> current =
      segment(result.features, fragments.features(), options.steps);
  if (!current) return std::nullopt;
  const int rounds = metric.kind() == MetricKind::kRaw ? 0 : options.offset_rounds;
  result.converged = rounds == 0;
  while (!result.converged && result.rounds < rounds) {
    result.features.colwise() -=
        mean_difference(result.features, current->snippets, fragments.features());
    std::optional<Segmentation> next =
        segment(result.features, fragments.features(), options.steps);
    result.converged = same_snippets(current->snippets, next->snippets);
    current = std::move(next);
    ++result.rounds;
  }
  result.snippets = std::move(current->snippets);
  result.cost = current->cost;
  return result;
}

}  // namespace laban::align
