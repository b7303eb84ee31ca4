#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "align/lane_kernels.h"

namespace laban::align {

/// Numbers that begin on a cache line, 0 at first.
template <typename T>
class AlignedArray {
 public:
  AlignedArray() = default;
  explicit AlignedArray(std::size_t size) : lines_((size + kLineSize - 1) / kLineSize) {}
  [[nodiscard]] T* data() noexcept { return reinterpret_cast<T*>(lines_.data()); }
  [[nodiscard]] const T* data() const noexcept { return reinterpret_cast<const T*>(lines_.data()); }
  void prefetch() const noexcept {
    for (const Line& line : lines_) __builtin_prefetch(&line);
  }
  [[nodiscard]] T& operator[](std::size_t n) noexcept { return data()[n]; }
  [[nodiscard]] const T& operator[](std::size_t n) const noexcept { return data()[n]; }

 private:
  static constexpr std::size_t kLineSize = 64 / sizeof(T);
  struct alignas(64) Line {
    T values[kLineSize] = {};
  };
  std::vector<Line> lines_;
};

/// How features become single precision: (x - center) factor. Centering keeps the distances of near
/// frames from cancelling, the factor keeps squares from overflowing.
struct Scaling {
  Eigen::VectorXd center;
  double factor = 1.0;  ///< a power of two: it rounds nothing

  /// For sequences of D rows, at least one frame: their mean frame; no value beyond 1.
  [[nodiscard]] static Scaling of(std::span<const Eigen::MatrixXd> sequences);
  /// The same center; no value of the sequence beyond 1 either.
  [[nodiscard]] Scaling covering(const Eigen::Ref<const Eigen::MatrixXd>& sequence) const;

  [[nodiscard]] Eigen::MatrixXf apply(const Eigen::Ref<const Eigen::MatrixXd>& sequence) const;
  /// A sum of squared distances of scaled frames, in the features' own units.
  [[nodiscard]] double unscaled_cost(double cost) const { return cost / (factor * factor); }
};

/// A sequence as the kernels' rows.
class PackedRows {
 public:
  /// @param scaled  D x N, of a Scaling.
  PackedRows(const Eigen::MatrixXf& scaled, const LaneKernels& kernels);

  /// Frames [begin, begin + count).
  [[nodiscard]] RowFrames view(int begin, int count) const;
  [[nodiscard]] int frame_count() const noexcept { return frame_count_; }

 private:
  int dimensions_;
  int frame_count_;
  AlignedArray<float> values_;
  AlignedArray<float> norms_;
};

/// A sequence on a `CoarseGrid`.
struct CoarseFrames {
  Eigen::MatrixXi values;    ///< D / 2 x T, two whole numbers of 16 bits each
  Eigen::RowVectorXf norms;  ///< squared, of each frame
};

/// Whole numbers of 16 bits for coordinates and for boxes, for lower bounds of distances.
class CoarseGrid {
 public:
  static constexpr int kMostDimensions = 28;

  CoarseGrid() = default;
  /// @param largest_norm  of all frames of one of the two sequences that are compared.
  explicit CoarseGrid(float largest_norm);

  /// At most kMostDimensions x T, rounded to the grid and to the cube around `largest_norm`:
  /// distances to frames that lie in it grow by rounding alone.
  [[nodiscard]] CoarseFrames frames(const Eigen::MatrixXf& scaled) const;
  /// How much farther apart two frames of so many coordinates can be on the grid than they are.
  [[nodiscard]] float rounding(int dimensions) const;
  /// Bounds of boxes as LaneKernels::box_distances takes them, rounded outwards and to the cube.
  [[nodiscard]] Eigen::MatrixXi lower_bounds(const Eigen::MatrixXf& scaled) const;
  [[nodiscard]] Eigen::MatrixXi upper_bounds(const Eigen::MatrixXf& scaled) const;
  /// Square of a step.
  [[nodiscard]] float unit() const noexcept { return step_ * step_; }
  /// SkewedRows::factor.
  [[nodiscard]] float factor() const noexcept { return -2.0F * unit(); }

 private:
  [[nodiscard]] Eigen::MatrixXf in_cube(const Eigen::MatrixXf& scaled) const;
  float step_ = 1.0F;
};

/// A sequence as rows for alignments one at a time: strips of kStripBands * lanes of them.
class PackedStrips {
 public:
  PackedStrips(const CoarseFrames& frames, float factor, const LaneKernels& kernels);

  [[nodiscard]] int count() const noexcept { return (frame_count_ + rows_ - 1) / rows_; }
  [[nodiscard]] SkewedRows view(int n) const;

 private:
  int dimensions_;
  int frame_count_;
  int rows_;  // of a strip
  float factor_;
  AlignedArray<int> values_;
  AlignedArray<float> norms_;
};

/// A sequence feature by feature, for alignments one at a time.
class PackedFrames {
 public:
  explicit PackedFrames(const CoarseFrames& frames);

  [[nodiscard]] FrameRows view() const;
  /// Has it fetched from memory while something else is done.
  void prefetch() const noexcept { values_.prefetch(); }

 private:
  int frame_count_;
  AlignedArray<int> values_;
  AlignedArray<float> norms_;
};

/// Up to `lanes` sequences side by side as the kernels' lanes; what is padded is 0.
class PackedLanes {
 public:
  /// @param scaled  at least one, at most kernels.lanes, each D x T_l with one D.
  PackedLanes(std::span<const Eigen::MatrixXf* const> scaled, const LaneKernels& kernels);

  [[nodiscard]] LaneFrames view() const noexcept {
    return {values_.data(), norms_.data(), frame_count_};
  }
  [[nodiscard]] int frame_count() const noexcept { return frame_count_; }

 private:
  int frame_count_;  // of the longest, rounded up to whole tiles
  AlignedArray<float> values_;
  AlignedArray<float> norms_;
};

/// Indices of sequences by falling length, so that neighbours waste few padded cells; equal lengths
/// by index.
[[nodiscard]] std::vector<int> longest_first(std::span<const Eigen::MatrixXd> sequences);

/// The cost and path length of `dtw` in single precision, for one sequence and the lanes of a group
/// at a time.
class LaneDtw {
 public:
  /// @param most_frames  of the groups to come, whole tiles.
  LaneDtw(const LaneKernels& kernels, int most_frames);

  /// Begins with x's first strip. `swapped[l]` is true if the lane's fragment is `dtw`'s first
  /// sequence. Both sequences must live until `frame()` is x's length or nobody advances.
  void begin(const PackedRows& x, const PackedLanes& y, const bool* swapped);
  /// The next strip; false if there is none.
  bool advance();

  /// Frames of x done.
  [[nodiscard]] int frame() const noexcept { return frame_; }
  /// Of the best path to x's frame() - 1 and frame `q` of a lane's fragment.
  [[nodiscard]] float cost(int lane, int q) const { return cost_[cell(lane, q)]; }
  [[nodiscard]] int length(int lane, int q) const { return length_[cell(lane, q)]; }

 private:
  [[nodiscard]] std::size_t cell(int lane, int q) const {
    return static_cast<std::size_t>(q) * static_cast<std::size_t>(kernels_->lanes) +
           static_cast<std::size_t>(lane);
  }
  const LaneKernels* kernels_;
  const PackedRows* x_ = nullptr;
  const PackedLanes* y_ = nullptr;
  int frame_ = 0;
  int swapped_[kMostLanes] = {};
  AlignedArray<float> cost_;
  AlignedArray<int> length_;
};

}  // namespace laban::align
