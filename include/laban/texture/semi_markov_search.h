#pragma once

#include <functional>
#include <vector>

#include <Eigen/Dense>

namespace laban::texture {

/// Log-likelihood terms of some frames under every texton: Nt x F each, see TextonLikelihood.
struct TermBlock {
  using Terms = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Terms step;   ///< of frame t within a segment; that of a take's frames 0 and 1 is 0
  Terms start;  ///< of a segment that begins at t; that of the take's last frame is 0
};

/// Gives the terms of frames [begin, end) of a take; asked in order, each frame once for its step
/// and start.
using TermSource = std::function<void(int begin, int end, TermBlock& block)>;

/// What may follow what: log M_ji, from j to i, only where M_ji > 0.
class LogTransitions {
 public:
  /// @param matrix  Nt x Nt, row = from, entries in [0, 1]. @throws Error{kData} otherwise.
  explicit LogTransitions(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

  struct Arc {
    int from = 0;
    double log_probability = 0.0;
  };
  [[nodiscard]] int texton_count() const noexcept { return static_cast<int>(into_.size()); }
  /// Arcs into a texton, by their origin.
  [[nodiscard]] const std::vector<Arc>& into(int texton) const {
    return into_[static_cast<std::size_t>(texton)];
  }
  /// log M_from,to; -infinity if none.
  [[nodiscard]] double at(int from, int to) const;

 private:
  std::vector<std::vector<Arc>> into_;
};

/// One segment of a found path: frames [begin, next begin).
struct PathSegment {
  int begin = 0;
  int texton = 0;
};

struct SegmentPath {
  std::vector<PathSegment> segments;
  double log_likelihood = 0.0;
};

/// The likeliest labels and cuts of one take: exactly the maximum over all segmentations into
/// segments of at least `min_frames` of sum start + steps + log M, no prior on the first label
/// (METHODS 2.2, [Li02, App. A] with every label kept).
///
///   delta(t, i) = S_i(t) + max over b <= t - T_min + 1 of
///                 [ max_j (delta(b - 1, j) + log M_ji) + start_i(b) - S_i(b + 1) ]
///
/// by a running maximum over b. Ties: the earlier cut, then the lower label.
/// @param frames      of the take; if fewer than min_frames the take is one segment.
/// @param min_frames  T_min >= 3.
/// @throws Error{kUsage} for frames < 3, min_frames < 3 or no texton.
/// Time O(frames * (Nt + arcs)), memory O(Nt * min_frames) and the paths still open.
[[nodiscard]] SegmentPath search_segments(int frames, int min_frames,
                                          const LogTransitions& transitions,
                                          const TermSource& terms);

}  // namespace laban::texture
