#include "texture/merge_textons.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "laban/math/constants.h"
#include "laban/math/parallel.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Partners that are tried for each texton: those that explain each other best.
constexpr int kPartners = 3;

/// A texton and the segments it explains; none once it has been merged into another.
struct Cluster {
  std::vector<Segment> segments;
  Texton texton;
  double log_likelihood = 0.0;
};

class Merger {
 public:
  Merger(const MatrixXd& observations, const FloatObservations& y, double threshold,
         const TextonFit& fit, int threads)
      : observations_(observations), y_(y), threshold_(threshold), fit_(fit), threads_(threads) {}

  void begin(const std::vector<Segment>& segments) {
    for (const Segment& segment : segments) {
      const auto label = static_cast<std::size_t>(segment.texton);
      if (label >= clusters_.size()) clusters_.resize(label + 1);
      clusters_[label].segments.push_back(segment);
    }
    math::parallel_for(static_cast<int>(clusters_.size()), threads_, [&](int i) {
      Cluster& cluster = clusters_[static_cast<std::size_t>(i)];
      cluster = fitted(std::move(cluster.segments));
    });
    find_partners();
  }

  void run() {
    while (!gains_.empty()) {
      const auto best = std::max_element(
          gains_.begin(), gains_.end(),
          [](const auto& one, const auto& other) { return one.second < other.second; });
      if (best->second <= 0.0) return;
      merge(best->first.first, best->first.second);
    }
  }

  [[nodiscard]] std::vector<Segment> labelled() const {
    std::vector<Segment> segments;
    for (std::size_t i = 0; i < clusters_.size(); ++i) {
      for (Segment segment : clusters_[i].segments) {
        segment.texton = static_cast<int>(i);
        segments.push_back(segment);
      }
    }
    std::sort(segments.begin(), segments.end(),
              [](const Segment& a, const Segment& b) { return a.begin < b.begin; });
    std::map<int, int> number;
    for (Segment& segment : segments) {
      const auto next = static_cast<int>(number.size());
      segment.texton = number.try_emplace(segment.texton, next).first->second;
    }
    return segments;
  }

 private:
  using Pair = std::pair<int, int>;  // first < second

  [[nodiscard]] Cluster fitted(std::vector<Segment> segments) const {
    Cluster cluster{std::move(segments), {}, 0.0};
    cluster.texton = fit_texton(observations_, cluster.segments, fit_);
    cluster.log_likelihood =
        segments_log_likelihood(observations_, cluster.texton, cluster.segments);
    return cluster;
  }

  /// Nt x Nt: what texton j (column) says of the segments of i (row), per frame.
  [[nodiscard]] MatrixXd cross_likelihoods() const {
    const auto count = static_cast<Index>(clusters_.size());
    MatrixXd cross = MatrixXd::Zero(count, count);
    std::vector<TextonPack> packs;
    for (const Cluster& cluster : clusters_) packs.emplace_back(cluster.texton, y_.mean, true);
    math::parallel_for(static_cast<int>(count), threads_, [&](int i) {
      FrameTile tile;
      float step[kTileColumns];
      float start[kTileColumns];
      double frames = 0.0;
      for (const Segment& segment : clusters_[static_cast<std::size_t>(i)].segments) {
        const int end = segment.begin + segment.length;
        frames += segment.length;
        for (int from = segment.begin; from < end; from += FrameTile::kMostFrames) {
          tile.load(y_, from, std::min(FrameTile::kMostFrames, end - from), segment.begin, end);
          for (Index j = 0; j < count; ++j) {
            packs[static_cast<std::size_t>(j)].terms(tile, segment.begin, end, step, start);
            for (int n = 0; n < tile.count; ++n) cross(i, j) += static_cast<double>(step[n]);
          }
        }
      }
      cross.row(i) /= frames;
    });
    return cross;
  }

  void find_partners() {
    const MatrixXd cross = cross_likelihoods();
    std::map<Pair, double> pairs;
    for (Index i = 0; i < cross.rows(); ++i) {
      Eigen::VectorXd closeness = cross.row(i).transpose() + cross.col(i);
      closeness[i] = -math::kInfinity;
      for (int n = 0; n < kPartners && n + 1 < cross.rows(); ++n) {
        Index j = 0;
        closeness.maxCoeff(&j);
        closeness[j] = -math::kInfinity;
        pairs[pair_of(static_cast<int>(i), static_cast<int>(j))] = 0.0;
      }
    }
    gains_ = std::move(pairs);
    std::vector<Pair> list;
    for (const auto& [pair, gain] : gains_) list.push_back(pair);
    evaluate(list);
  }
  [[nodiscard]] static Pair pair_of(int i, int j) { return {std::min(i, j), std::max(i, j)}; }

  /// Whether the texton predicts each of its segments as well as the greedy start asks.
  [[nodiscard]] bool predicts_all(const Cluster& cluster) const {
    const TextonPack pack(cluster.texton, y_.mean, false);
    std::vector<double> errors;
    return std::all_of(cluster.segments.begin(), cluster.segments.end(), [&](const Segment& s) {
      errors.resize(static_cast<std::size_t>(s.length - 2));
      pack.squared_errors(y_, s.begin + 2, s.begin + s.length, errors.data());
      const double allowed = threshold_ * threshold_ * static_cast<double>(errors.size()) *
                             static_cast<double>(observations_.rows());
      return std::accumulate(errors.begin(), errors.end(), 0.0) <= allowed;
    });
  }

  /// What BIC, halved, gains by each merge; nothing if one texton cannot stand for both.
  void evaluate(const std::vector<Pair>& pairs) {
    std::vector<double> gains(pairs.size());
    math::parallel_for(static_cast<int>(pairs.size()), threads_, [&](int n) {
      const auto cell = static_cast<std::size_t>(n);
      const Cluster& a = clusters_[static_cast<std::size_t>(pairs[cell].first)];
      const Cluster& b = clusters_[static_cast<std::size_t>(pairs[cell].second)];
      const Cluster both = fitted(joined(a, b));
      if (!predicts_all(both)) return;
      const int saved =
          parameter_count(a.texton) + parameter_count(b.texton) - parameter_count(both.texton);
      gains[cell] = both.log_likelihood - a.log_likelihood - b.log_likelihood +
                    0.5 * saved * std::log(static_cast<double>(observations_.cols()));
    });
    for (std::size_t n = 0; n < pairs.size(); ++n) gains_[pairs[n]] = gains[n];
  }
  [[nodiscard]] static std::vector<Segment> joined(const Cluster& a, const Cluster& b) {
    std::vector<Segment> segments = a.segments;
    segments.insert(segments.end(), b.segments.begin(), b.segments.end());
    std::sort(segments.begin(), segments.end(),
              [](const Segment& one, const Segment& other) { return one.begin < other.begin; });
    return segments;
  }

  /// Makes j part of i; the partners of both become i's.
  void merge(int i, int j) {
    Cluster& kept = clusters_[static_cast<std::size_t>(i)];
    Cluster& gone = clusters_[static_cast<std::size_t>(j)];
    kept = fitted(joined(kept, gone));
    gone = {};
    std::map<Pair, double> rest;
    std::vector<Pair> again;
    for (const auto& [pair, gain] : gains_) {
      const auto renamed = [&](int k) { return k == j ? i : k; };
      const Pair now = pair_of(renamed(pair.first), renamed(pair.second));
      if (now.first == now.second) continue;
      rest[now] = gain;
      if ((now.first == i || now.second == i) &&
          std::find(again.begin(), again.end(), now) == again.end())
        again.push_back(now);
    }
    gains_ = std::move(rest);
    evaluate(again);
  }

  const MatrixXd& observations_;
  const FloatObservations& y_;
  double threshold_;
  const TextonFit& fit_;
  int threads_;
  std::vector<Cluster> clusters_;
  std::map<Pair, double> gains_;
};

}  // namespace

std::vector<Segment> merge_textons(const MatrixXd& observations, const FloatObservations& y,
                                   const std::vector<Segment>& segments, double threshold,
                                   const TextonFit& fit, int threads) {
  Merger merger(observations, y, threshold, fit, threads);
  merger.begin(segments);
  merger.run();
  return merger.labelled();
}

}  // namespace laban::texture
