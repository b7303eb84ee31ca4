#include "texture/greedy_segmentation.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace laban::texture {
namespace {

class Greedy {
 public:
  Greedy(const Eigen::MatrixXd& observations, const FloatObservations& y,
         const GreedyOptions& options)
      : observations_(observations), y_(y), options_(options) {}

  void add(const Take& take) {
    const int end = take.begin + take.length;
    int begin = take.begin;
    while (begin < end) {
      const int window = std::min(begin + options_.min_frames, end);
      const int texton = choose(begin, window);
      int segment_end = extend(texton, begin, window, end);
      if (end - segment_end < options_.min_frames) segment_end = end;
      segments_.push_back({begin, segment_end - begin, texton});
      begin = segment_end;
    }
  }

  [[nodiscard]] std::vector<Segment> take_segments() { return std::move(segments_); }

 private:
  /// The best texton so far on frames [begin, end), or a new one fitted to them.
  int choose(int begin, int end) {
    int best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < textons_.size(); ++i) {
      const double error = squared_error(i, begin, end);
      if (error < least) {
        least = error;
        best = static_cast<int>(i);
      }
    }
    if (least <= allowed(begin, end)) return best;
    if (static_cast<int>(textons_.size()) >= options_.most_textons) return best;
    const Segment window{begin, end - begin, 0};
    textons_.emplace_back(fit_texton(observations_, {&window, 1}, options_.fit), y_.mean, false);
    return static_cast<int>(textons_.size()) - 1;
  }

  /// How far the texton explains what begins at `begin`, at least up to `window`.
  int extend(int texton, int begin, int window, int end) {
    const auto cell = static_cast<std::size_t>(texton);
    double sum = squared_error(cell, begin, window);
    while (window < end) {
      const int next = std::min(window + options_.min_frames, end);
      errors_.resize(static_cast<std::size_t>(next - window));
      textons_[cell].squared_errors(y_, window, next, errors_.data());
      for (const double error : errors_) {
        sum += error;
        if (sum > allowed(begin, window + 1)) return window;
        ++window;
      }
    }
    return window;
  }

  /// Of the steps inside [begin, end): the first two frames have none.
  double squared_error(std::size_t texton, int begin, int end) {
    errors_.resize(static_cast<std::size_t>(end - begin - 2));
    textons_[texton].squared_errors(y_, begin + 2, end, errors_.data());
    return std::accumulate(errors_.begin(), errors_.end(), 0.0);
  }
  [[nodiscard]] double allowed(int begin, int end) const {
    return options_.threshold * options_.threshold * static_cast<double>(end - begin - 2) *
           static_cast<double>(observations_.rows());
  }

  const Eigen::MatrixXd& observations_;
  const FloatObservations& y_;
  const GreedyOptions& options_;
  std::vector<TextonPack> textons_;
  std::vector<Segment> segments_;
  std::vector<double> errors_;
};

}  // namespace

std::vector<Segment> segment_greedily(const Eigen::MatrixXd& observations,
                                      const FloatObservations& y, const std::vector<Take>& takes,
                                      const GreedyOptions& options) {
  Greedy greedy(observations, y, options);
  for (const Take& take : takes) greedy.add(take);
  return greedy.take_segments();
}

}  // namespace laban::texture
