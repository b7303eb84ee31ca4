#include "laban/texture/semi_markov_search.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"
#include "laban/math/constants.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kNobody = -1;

/// The paths that are still open, as trees of their segments grown from the take's beginning: each
/// node is a segment's begin and label. Nodes that no open path comes from are dropped from time to
/// time, so that memory follows what is open, not the take's length.
class PathTree {
 public:
  struct Node {
    int begin = 0;
    int texton = 0;
    int before = kNobody;  // node of the segment before
  };

  [[nodiscard]] int add(const Node& node) {
    nodes_.push_back(node);
    return static_cast<int>(nodes_.size()) - 1;
  }
  [[nodiscard]] bool is_full() const { return nodes_.size() >= full_; }

  /// Keeps what `open` leads to and renumbers it. Nodes come after the one before them.
  void prune(const std::vector<std::vector<int>*>& open) {
    std::vector<int> number(nodes_.size(), kNobody);
    for (const auto* list : open) {
      for (const int node : *list) mark(node, number);
    }
    std::size_t kept = 0;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      if (number[n] == kNobody) continue;
      Node node = nodes_[n];
      if (node.before != kNobody) node.before = number[static_cast<std::size_t>(node.before)];
      number[n] = static_cast<int>(kept);
      nodes_[kept++] = node;
    }
    nodes_.resize(kept);
    for (auto* list : open) {
      for (int& node : *list) {
        if (node != kNobody) node = number[static_cast<std::size_t>(node)];
      }
    }
    full_ = std::max(full_, 2 * kept);
  }

  [[nodiscard]] std::vector<PathSegment> path(int node) const {
    std::vector<PathSegment> segments;
    for (; node != kNobody; node = nodes_[static_cast<std::size_t>(node)].before) {
      const Node& at = nodes_[static_cast<std::size_t>(node)];
      segments.push_back({at.begin, at.texton});
    }
    std::reverse(segments.begin(), segments.end());
    return segments;
  }

 private:
  void mark(int node, std::vector<int>& number) const {
    while (node != kNobody && number[static_cast<std::size_t>(node)] == kNobody) {
      number[static_cast<std::size_t>(node)] = 0;
      node = nodes_[static_cast<std::size_t>(node)].before;
    }
  }

  std::vector<Node> nodes_;
  std::size_t full_ = std::size_t{1} << 18U;
};

/// What is known of one texton over the last frames. Column c of a window is frame
/// (first frame of the block) - T_min + c: T_min frames of the past, then those of the block.
struct Window {
  std::vector<double> delta;       ///< best log-likelihood of the take up to t, the last label i
  std::vector<int> node;           ///< its last segment
  std::vector<double> sum;         ///< S_i(t)
  std::vector<double> start;       ///< start_i(t)
  double best = -math::kInfinity;  ///< the running maximum over b
  int best_node = kNobody;
};

/// The search over one take, a block of at most T_min frames after the other: within a block no
/// texton needs what another has found in it, for a segment is at least that long.
class Search {
 public:
  Search(int frames, int min_frames, const LogTransitions& transitions)
      : frames_(frames), min_frames_(min_frames), transitions_(transitions) {
    const auto size = 2 * static_cast<std::size_t>(min_frames);
    windows_.resize(static_cast<std::size_t>(transitions.texton_count()));
    for (Window& window : windows_) {
      window.delta.assign(size, -math::kInfinity);
      window.node.assign(size, kNobody);
      window.sum.assign(size, 0.0);
      window.start.assign(size, 0.0);
    }
    enter_.resize(static_cast<std::size_t>(min_frames));
    from_.resize(static_cast<std::size_t>(min_frames));
  }

  SegmentPath run(const TermSource& terms) {
    TermBlock block;
    for (int begin = 0; begin < frames_; begin += min_frames_) {
      const int end = std::min(frames_, begin + min_frames_);
      terms(begin, end, block);
      for (int i = 0; i < transitions_.texton_count(); ++i) advance(i, begin, end, block);
      if (end < frames_) shift();
      if (tree_.is_full()) prune();
    }
    return finish();
  }

 private:
  /// Texton i over frames [begin, end).
  void advance(int i, int begin, int end, const TermBlock& block) {
    Window& window = windows_[static_cast<std::size_t>(i)];
    find_entries(i, begin, end);
    for (int t = begin; t < end; ++t) {
      const int c = t - begin + min_frames_;
      const auto cell = static_cast<std::size_t>(c);
      window.start[cell] = block.start(i, t - begin);
      window.sum[cell] = window.sum[cell - 1] + block.step(i, t - begin);
      const int b = t - min_frames_ + 1;
      if (b < 0) continue;
      const auto entry = static_cast<std::size_t>(t - begin);
      const int first = c - min_frames_ + 1;
      const auto at_b = static_cast<std::size_t>(first);
      // The parts of Eq. at the head: enter + start_i(b) - S_i(b + 1).
      const double candidate = enter_[entry] + window.start[at_b] - window.sum[at_b + 1];
      if (candidate > window.best) {
        window.best = candidate;
        window.best_node = tree_.add({b, i, from_[entry]});
      }
      window.delta[cell] = window.best + window.sum[cell];
      window.node[cell] = window.best_node;
    }
  }

  /// For each t of the block, the best that a segment of i which begins at b = t - T_min + 1 may
  /// follow: max over j of delta(b - 1, j) + log M_ji, and that path's last segment.
  void find_entries(int i, int begin, int end) {
    std::fill(enter_.begin(), enter_.end(), -math::kInfinity);
    std::fill(from_.begin(), from_.end(), kNobody);
    for (const LogTransitions::Arc& arc : transitions_.into(i)) {
      const Window& before = windows_[static_cast<std::size_t>(arc.from)];
      for (int t = begin; t < end; ++t) {
        // b - 1 = t - T_min is column t - begin of the window.
        const auto cell = static_cast<std::size_t>(t - begin);
        const double value = before.delta[cell] + arc.log_probability;
        if (value > enter_[cell]) {
          enter_[cell] = value;
          from_[cell] = before.node[cell];
        }
      }
    }
    const int first = min_frames_ - 1 - begin;  // where b = 0
    if (first >= 0 && first < end - begin) enter_[static_cast<std::size_t>(first)] = 0.0;
  }

  /// Makes the block the past of the next one.
  void shift() {
    for (Window& window : windows_) {
      std::copy(window.delta.begin() + min_frames_, window.delta.end(), window.delta.begin());
      std::copy(window.node.begin() + min_frames_, window.node.end(), window.node.begin());
      std::copy(window.sum.begin() + min_frames_, window.sum.end(), window.sum.begin());
      std::copy(window.start.begin() + min_frames_, window.start.end(), window.start.begin());
    }
  }

  void prune() {
    std::vector<std::vector<int>*> open;
    std::vector<int> best;
    for (Window& window : windows_) {
      open.push_back(&window.node);
      best.push_back(window.best_node);
    }
    open.push_back(&best);
    tree_.prune(open);
    for (std::size_t i = 0; i < windows_.size(); ++i) windows_[i].best_node = best[i];
  }

  [[nodiscard]] SegmentPath finish() const {
    const int newest = (frames_ - 1) % min_frames_ + min_frames_;
    const auto last = static_cast<std::size_t>(newest);
    const Window* winner = &windows_.front();
    for (const Window& window : windows_) {
      if (window.delta[last] > winner->delta[last]) winner = &window;
    }
    return {tree_.path(winner->node[last]), winner->delta[last]};
  }

  int frames_;
  int min_frames_;
  const LogTransitions& transitions_;
  std::vector<Window> windows_;
  std::vector<double> enter_;
  std::vector<int> from_;
  PathTree tree_;
};

}  // namespace

LogTransitions::LogTransitions(const Eigen::Ref<const MatrixXd>& matrix) {
  if (matrix.rows() != matrix.cols()) {
    throw Error(ErrorKind::kData, "transitions: the matrix must be square");
  }
  into_.resize(static_cast<std::size_t>(matrix.cols()));
  for (Index to = 0; to < matrix.cols(); ++to) {
    for (Index from = 0; from < matrix.rows(); ++from) {
      const double p = matrix(from, to);
      if (!(p >= 0.0 && p <= 1.0)) {
        throw Error(ErrorKind::kData, "transitions: a probability must be in [0, 1]");
      }
      if (p > 0.0) {
        into_[static_cast<std::size_t>(to)].push_back({static_cast<int>(from), std::log(p)});
      }
    }
  }
}

double LogTransitions::at(int from, int to) const {
  for (const Arc& arc : into(to)) {
    if (arc.from == from) return arc.log_probability;
  }
  return -math::kInfinity;
}

SegmentPath search_segments(int frames, int min_frames, const LogTransitions& transitions,
                            const TermSource& terms) {
  if (frames < 3 || min_frames < 3) {
    throw Error(ErrorKind::kUsage, "search_segments: a segment needs three frames");
  }
  if (transitions.texton_count() == 0) {
    throw Error(ErrorKind::kUsage, "search_segments: there is no texton");
  }
  return Search(frames, std::min(frames, min_frames), transitions).run(terms);
}

}  // namespace laban::texture
