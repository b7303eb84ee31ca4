#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "laban/base/error.h"
#include "laban/math/parallel.h"
#include "laban/texture/learn_texture.h"
#include "laban/texture/semi_markov_search.h"

#include "texture/greedy_segmentation.h"
#include "texture/merge_textons.h"
#include "texture/term_table.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kRelativeGain = 1e-6;
// What summing the same numbers in another order may change, relative.
constexpr double kRounding = 1e-9;

void check_takes(const MatrixXd& observations, const std::vector<Take>& takes) {
  if (takes.empty()) throw Error(ErrorKind::kUsage, "learn_textons: there is no take");
  Index at = 0;
  for (const Take& take : takes) {
    if (take.begin != at) {
      throw Error(ErrorKind::kData, "learn_textons: take '" + take.name +
                                        "' does not begin where the one before ends");
    }
    if (take.length < 3) {
      throw Error(ErrorKind::kData, take.name + ": " + std::to_string(take.length) +
                                        " frames are too few for a texture; give at least three");
    }
    at += take.length;
  }
  if (at != observations.cols()) {
    throw Error(ErrorKind::kData, "learn_textons: the takes do not cover the observations");
  }
  if (!observations.allFinite()) {
    throw Error(ErrorKind::kData, "learn_textons: an observation is not finite");
  }
}

/// Segments of each texton.
std::vector<std::vector<Segment>> by_texton(const std::vector<Segment>& segments,
                                            std::size_t textons) {
  std::vector<std::vector<Segment>> lists(textons);
  for (const Segment& segment : segments)
    lists[static_cast<std::size_t>(segment.texton)].push_back(segment);
  return lists;
}

bool same_frames(const std::vector<Segment>& a, const std::vector<Segment>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Segment& one, const Segment& other) {
                      return one.begin == other.begin && one.length == other.length;
                    });
}

/// Calls visit(from, to) for each pair of neighbours in one take.
template <typename Visit>
void for_neighbors(const std::vector<Take>& takes, const std::vector<Segment>& segments,
                   const Visit& visit) {
  std::size_t take = 0;
  for (std::size_t s = 0; s + 1 < segments.size(); ++s) {
    while (segments[s].begin >= takes[take].begin + takes[take].length) ++take;
    if (segments[s + 1].begin < takes[take].begin + takes[take].length)
      visit(segments[s].texton, segments[s + 1].texton);
  }
}

MatrixXd count_pairs(const std::vector<Take>& takes, const std::vector<Segment>& segments,
                     std::size_t textons) {
  const auto n = static_cast<Index>(textons);
  MatrixXd counts = MatrixXd::Zero(n, n);
  for_neighbors(takes, segments, [&](int from, int to) { counts(from, to) += 1.0; });
  return counts;
}

MatrixXd normalized(MatrixXd counts) {
  for (Index row = 0; row < counts.rows(); ++row) {
    const double sum = counts.row(row).sum();
    if (sum > 0.0) counts.row(row) /= sum;
  }
  return counts;
}

/// Frames whose texton differs, and cuts that are new, between two labellings of the same frames.
void count_changes(const std::vector<Segment>& before, const std::vector<Segment>& after,
                   LearningRound& round) {
  std::set<int> cuts;
  for (const Segment& segment : before) cuts.insert(segment.begin);
  for (const Segment& segment : after) round.changed_cuts += cuts.contains(segment.begin) ? 0 : 1;
  std::size_t at = 0;
  for (const Segment& segment : after) {
    int frame = segment.begin;
    const int end = segment.begin + segment.length;
    while (frame < end) {
      while (before[at].begin + before[at].length <= frame) ++at;
      const int until = std::min(end, before[at].begin + before[at].length);
      if (before[at].texton != segment.texton) round.changed_frames += until - frame;
      frame = until;
    }
  }
}

/// Hard EM on one corpus.
class HardEm {
 public:
  HardEm(const MatrixXd& observations, const FloatObservations& y, const std::vector<Take>& takes,
         const TextureLearning& options)
      : observations_(observations),
        takes_(takes),
        options_(options),
        table_(y, takes, options.threads) {}

  /// Textons fitted to segments that somebody has found.
  void begin(std::vector<Segment> segments) {
    int count = 0;
    for (const Segment& segment : segments) count = std::max(count, segment.texton + 1);
    state_.segments = std::move(segments);
    fitted_to_ = by_texton(state_.segments, static_cast<std::size_t>(count));
    state_.textons.resize(fitted_to_.size());
    math::parallel_for(count, options_.threads, [&](int i) {
      const auto cell = static_cast<std::size_t>(i);
      state_.textons[cell] = fit_texton(observations_, fitted_to_[cell], options_.fit);
    });
    state_.transition_counts = count_pairs(takes_, state_.segments, fitted_to_.size());
    kept_from_.assign(fitted_to_.size(), -1);
    objective_ = objective();
    state_.report.start_log_likelihood = objective_;
    state_.report.start_textons = count;
  }
  void go_on(const LearntTextons& state) {
    state_ = state;
    // Whether a texton was fitted to its segments as they are cannot be told: the next round does.
    fitted_to_.assign(state_.textons.size(), {});
    kept_from_.assign(state_.textons.size(), -1);
    objective_ = objective();
  }

  /// One round. @returns false once nothing changes any more.
  bool round() {
    LearningRound round;
    if (!search(round)) return false;
    drop_unused();
    fit(round);
    const double after = objective();
    LABAN_CHECK(after >= objective_ - kRounding * std::abs(objective_));
    const double gain = after - objective_;
    objective_ = after;
    round.log_likelihood = after;
    round.textons = static_cast<int>(state_.textons.size());
    state_.report.rounds.push_back(round);
    return gain >= kRelativeGain * std::abs(after);
  }

  [[nodiscard]] double log_likelihood() const { return objective_; }
  [[nodiscard]] LearntTextons& state() { return state_; }

 private:
  [[nodiscard]] double objective() const {
    return texture::log_likelihood(observations_, takes_, state_.segments, state_.textons,
                                   state_.transition_counts);
  }

  /// E-step. @returns false if it finds nothing better than what there is.
  bool search(LearningRound& round) {
    table_.set_textons(state_.textons, kept_from_);
    for (std::size_t i = 0; i < kept_from_.size(); ++i) kept_from_[i] = static_cast<int>(i);
    const LogTransitions transitions(normalized(state_.transition_counts));
    std::vector<SegmentPath> paths(takes_.size());
    math::parallel_for(static_cast<int>(takes_.size()), options_.threads, [&](int n) {
      const Take& take = takes_[static_cast<std::size_t>(n)];
      paths[static_cast<std::size_t>(n)] =
          search_segments(take.length, options_.min_frames, transitions, table_.source(take));
    });
    std::vector<Segment> found;
    for (std::size_t n = 0; n < takes_.size(); ++n) {
      const auto& segments = paths[n].segments;
      for (std::size_t s = 0; s < segments.size(); ++s) {
        const int end = s + 1 < segments.size() ? segments[s + 1].begin : takes_[n].length;
        found.push_back(
            {takes_[n].begin + segments[s].begin, end - segments[s].begin, segments[s].texton});
      }
    }
    count_changes(state_.segments, found, round);
    if (round.changed_frames == 0 && round.changed_cuts == 0) return false;
    // The search works with terms in float: a path that is better by their rounding alone is none.
    const double better = texture::log_likelihood(observations_, takes_, found, state_.textons,
                                                  state_.transition_counts);
    if (better <= objective_) return false;
    state_.segments = std::move(found);
    objective_ = better;
    return true;
  }

  void drop_unused() {
    auto lists = by_texton(state_.segments, state_.textons.size());
    std::vector<int> number(lists.size(), -1);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < lists.size(); ++i) {
      if (lists[i].empty()) continue;
      number[i] = static_cast<int>(kept);
      if (kept != i) {
        state_.textons[kept] = std::move(state_.textons[i]);
        fitted_to_[kept] = std::move(fitted_to_[i]);
        kept_from_[kept] = kept_from_[i];
      }
      ++kept;
    }
    state_.textons.resize(kept);
    fitted_to_.resize(kept);
    kept_from_.resize(kept);
    for (Segment& segment : state_.segments)
      segment.texton = number[static_cast<std::size_t>(segment.texton)];
  }

  /// M-step: closed form, for those textons whose segments have changed; a refit is refused that
  /// explains them worse (basis by singular values, ridge and floors do not maximise likelihood).
  void fit(LearningRound& round) {
    const auto lists = by_texton(state_.segments, state_.textons.size());
    std::vector<int> changed;
    for (std::size_t i = 0; i < lists.size(); ++i) {
      if (!same_frames(lists[i], fitted_to_[i])) changed.push_back(static_cast<int>(i));
    }
    std::vector<char> accepted(changed.size(), 0);
    math::parallel_for(static_cast<int>(changed.size()), options_.threads, [&](int n) {
      const auto i = static_cast<std::size_t>(changed[static_cast<std::size_t>(n)]);
      Texton refit = fit_texton(observations_, lists[i], options_.fit);
      if (segments_log_likelihood(observations_, refit, lists[i]) <
          segments_log_likelihood(observations_, state_.textons[i], lists[i])) {
        return;
      }
      state_.textons[i] = std::move(refit);
      accepted[static_cast<std::size_t>(n)] = 1;
    });
    for (std::size_t n = 0; n < changed.size(); ++n) {
      const auto i = static_cast<std::size_t>(changed[n]);
      fitted_to_[i] = lists[i];
      if (accepted[n] != 0) kept_from_[i] = -1;
      ++(accepted[n] != 0 ? round.refits : round.refused_refits);
    }
    state_.transition_counts = count_pairs(takes_, state_.segments, state_.textons.size());
  }

  const MatrixXd& observations_;
  const std::vector<Take>& takes_;
  const TextureLearning& options_;
  TermTable table_;
  LearntTextons state_;
  std::vector<std::vector<Segment>> fitted_to_;  // the segments each texton was last fitted to
  std::vector<int> kept_from_;                   // place in the table, -1: refitted
  double objective_ = 0.0;
};

/// The greedy start: at a threshold, with a number of textons, or what BIC likes best.
class Start {
 public:
  Start(const MatrixXd& observations, const FloatObservations& y, const std::vector<Take>& takes,
        const TextureLearning& options, base::Progress* progress)
      : observations_(observations),
        y_(y),
        takes_(takes),
        options_(options),
        progress_(progress),
        spread_(std::sqrt(y.values.cast<double>().squaredNorm() /
                          static_cast<double>(y.values.size()))) {}

  std::vector<Segment> find(LearningReport& report) {
    if (options_.textons) return with_textons(*options_.textons, report);
    if (options_.threshold) {
      report.threshold = *options_.threshold;
      return merged(*options_.threshold);
    }
    return by_bic(report);
  }

 private:
  [[nodiscard]] std::vector<Segment> at(double threshold,
                                        int most = std::numeric_limits<int>::max()) const {
    return segment_greedily(observations_, y_, takes_,
                            {options_.min_frames, threshold, most, options_.fit});
  }
  [[nodiscard]] std::vector<Segment> merged(double threshold) const {
    return merge_textons(observations_, y_, at(threshold), threshold, options_.fit,
                         options_.threads);
  }
  [[nodiscard]] static int count_textons(const std::vector<Segment>& segments) {
    int count = 0;
    for (const Segment& segment : segments) count = std::max(count, segment.texton + 1);
    return count;
  }

  /// The largest threshold that still gives that many, by halving; more are then not begun.
  std::vector<Segment> with_textons(int wanted, LearningReport& report) {
    double low = 0.0;  // gives the most textons there can be
    double high = 2.0 * spread_;
    constexpr int kHalvings = 7;
    for (int n = 0; n < kHalvings; ++n) {
      base::tell(progress_, 0.3 * n / kHalvings);
      const double middle = 0.5 * (low + high);
      (count_textons(at(middle, wanted)) >= wanted ? low : high) = middle;
    }
    report.threshold = low;
    return at(low, wanted);
  }

  /// A grid of thresholds, then the middles beside the best. EM moves each of them up by about as
  /// much, so they are compared as they start.
  std::vector<Segment> by_bic(LearningReport& report) {
    constexpr int kGrid = 4;
    constexpr double kLeast = 0.1;  // of the observations' spread
    constexpr double kMost = 0.4;
    const double step = std::log(kMost / kLeast) / (kGrid - 1);
    for (int n = 0; n < kGrid; ++n) {
      base::tell(progress_, 0.4 * n / kGrid);
      compare(kLeast * spread_ * std::exp(n * step), report);
    }
    const double best = report.threshold;
    for (const double side : {-0.5, 0.5}) {
      base::tell(progress_, side < 0.0 ? 0.4 : 0.5);
      compare(best * std::exp(side * step), report);
    }
    std::sort(report.candidates.begin(), report.candidates.end(),
              [](const auto& one, const auto& other) { return one.threshold < other.threshold; });
    return std::move(best_);
  }

  /// Keeps the start at a threshold if it is the best so far.
  void compare(double threshold, LearningReport& report) {
    std::vector<Segment> segments = merged(threshold);
    HardEm em(observations_, y_, takes_, options_);
    em.begin(segments);
    const double bic = bayesian_information(em.state(), em.log_likelihood());
    report.candidates.push_back(
        {threshold, static_cast<int>(em.state().textons.size()), em.log_likelihood(), bic});
    if (!best_.empty() && bic >= best_bic_) return;
    best_ = std::move(segments);
    best_bic_ = bic;
    report.threshold = threshold;
  }

  const MatrixXd& observations_;
  const FloatObservations& y_;
  const std::vector<Take>& takes_;
  const TextureLearning& options_;
  base::Progress* progress_;
  double spread_;              // rms of a row about its mean
  std::vector<Segment> best_;  // of those compared
  double best_bic_ = 0.0;
};

}  // namespace

std::vector<std::string> TextureLearning::problems() const {
  std::vector<std::string> found = fit.problems();
  const auto require = [&](bool holds, const std::string& what) {
    if (!holds) found.push_back("TextureLearning::" + what);
  };
  require(!frame_rate_hz || (*frame_rate_hz > 0.0 && std::isfinite(*frame_rate_hz)),
          "frame_rate_hz must be positive");
  require(min_frames >= 3, "min_frames = " + std::to_string(min_frames) + " (must be >= 3)");
  require(!threshold || (*threshold >= 0.0 && std::isfinite(*threshold)), "threshold must be >= 0");
  require(!textons || *textons >= 1, "textons must be >= 1");
  require(!textons || !threshold, "textons and threshold exclude each other");
  require(max_rounds >= 0, "max_rounds must be >= 0");
  require(fit.max_dimension <= kMostStates,
          "fit.max_dimension must be <= " + std::to_string(kMostStates));
  return found;
}

double log_likelihood(const MatrixXd& observations, const std::vector<Take>& takes,
                      const std::vector<Segment>& segments, const std::vector<Texton>& textons,
                      const Eigen::Ref<const MatrixXd>& transition_counts) {
  const auto lists = by_texton(segments, textons.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < textons.size(); ++i) {
    if (!lists[i].empty()) sum += segments_log_likelihood(observations, textons[i], lists[i]);
  }
  const MatrixXd transitions = normalized(transition_counts);
  for_neighbors(takes, segments, [&](int from, int to) { sum += std::log(transitions(from, to)); });
  return sum;
}

double bayesian_information(const LearntTextons& learnt, double log_likelihood) {
  double frames = 0.0;
  for (const Segment& segment : learnt.segments) frames += segment.length;
  double parameters = (learnt.transition_counts.array() > 0.0).cast<double>().sum();
  for (const Texton& texton : learnt.textons) parameters += parameter_count(texton);
  return parameters * std::log(frames) - 2.0 * log_likelihood;
}

LearntTextons learn_textons(const MatrixXd& observations, const std::vector<Take>& takes,
                            const TextureLearning& options, base::Progress* progress,
                            const RoundListener& listener, const LearntTextons* go_on) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  check_takes(observations, takes);
  const FloatObservations y(observations);
  HardEm em(observations, y, takes, options);
  if (go_on != nullptr) {
    em.go_on(*go_on);
  } else {
    LearningReport report;
    em.begin(Start(observations, y, takes, options, progress).find(report));
    report.start_log_likelihood = em.state().report.start_log_likelihood;
    report.start_textons = em.state().report.start_textons;
    em.state().report = std::move(report);
  }
  LearningReport& report = em.state().report;
  bool more = go_on == nullptr || report.end != LearningEnd::kConverged;
  while (more && static_cast<int>(report.rounds.size()) < options.max_rounds) {
    // How many rounds there will be is not known: the share done comes ever nearer to 1.
    base::tell(progress, 1.0 - 0.4 * std::pow(0.8, static_cast<double>(report.rounds.size())));
    more = em.round();
    report.end = more ? LearningEnd::kMaxRounds : LearningEnd::kConverged;
    report.bic = bayesian_information(em.state(), em.log_likelihood());
    if (listener) listener(em.state());
  }
  report.bic = bayesian_information(em.state(), em.log_likelihood());
  return std::move(em.state());
}

}  // namespace laban::texture
