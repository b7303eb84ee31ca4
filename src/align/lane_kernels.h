#pragma once

#include <cstddef>

namespace laban::align {

/// Widest `LaneKernels::lanes` of any instruction set.
inline constexpr int kMostLanes = 8;

/// Frames a tile of distances has along a group of fragments: groups are padded to a multiple.
inline constexpr int kTileFrames = 3;

/// Frames of the other sequence that `dtw_strip` may take at once.
inline constexpr int kMostStripRows = 16;

/// Most frames that a bounding box holds.
inline constexpr int kBoxFrames = 8;

/// A sequence as single precision rows, one after the other: frame p's feature k is
/// values[p * dimensions + k], norms[p] = |x_p|^2 by `LaneKernels::row_norms`.
struct RowFrames {
  const float* values;
  const float* norms;
  int count;
  int dimensions;
};

/// `lanes` fragments side by side: frame q's feature k of lane l is
/// values[(q * dimensions + k) * lanes + l], norms[q * lanes + l] by `lane_norms`. `count` frames,
/// a multiple of kTileFrames; those behind a shorter fragment's end are there but never looked at.
struct LaneFrames {
  const float* values;
  const float* norms;
  int count;
};

/// Frames before the first and behind the last of `FrameRows` and what belongs to them that are
/// read, and of the costs beside them also written; what stands there does not count.
inline constexpr int kFramePadding = 32;

/// Rows of a sequence that `excess_strip` takes at once, times `lanes`.
inline constexpr int kStripBands = 2;

/// At most R = kStripBands * lanes rows of a sequence for `excess_strip`, the last one first:
/// features 2k and 2k + 1 of row p, whole numbers of 16 bits, are values[k * R + R - 1 - p],
/// |x_p|^2 is norms[R - 1 - p], and distances are |x|^2 + |y|^2 + factor x'y. Sums of products must
/// stay below 2^31.
struct SkewedRows {
  const int* values;
  const float* norms;
  int count;
  int dimensions;
  float factor;
};

/// A sequence feature by feature: features 2k and 2k + 1 of frame q are values[k * stride + q],
/// |y_q|^2 is norms[q].
struct FrameRows {
  const int* values;
  std::ptrdiff_t stride;
  const float* norms;
  int count;
};

/// What a path costs at least beyond a limit a cell once it has left frame q or row p (p counted as
/// in SkewedRows): frames[q] + rows_extra[p], or rows[p] + frames_extra[q]. Behind the last row
/// also boxes[b * lanes] + rows_allowed + frames_extra[q], where q is in box b of kBoxFrames
/// frames.
struct RestOfPath {
  const float* frames;
  const float* frames_extra;
  const float* rows;
  const float* rows_extra;
  const float* boxes;
  float rows_allowed;
};

/// Frames [begin, end).
struct FrameRange {
  int begin;
  int end;
};

/// The inner loops of `align`, compiled once for every instruction set: `lanes` alignments at a
/// time, one a SIMD lane, in single precision.
///
/// Local distances come as |x|^2 + |y|^2 - 2 x'y, with all three sums taken in the same order: two
/// equal frames are exactly 0 apart, and a distance is never negative. Ties of the recursion go as
/// in `dtw`. Instruction sets agree to about 1e-6 of the mean cell (only one of them fuses
/// multiplication and addition); each gives the same bytes on every call.
struct LaneKernels {
  const char* name;
  int lanes;  ///< fragments side by side, at most kMostLanes

  /// norms[p] = |x_p|^2.
  void (*row_norms)(const float* values, int count, int dimensions, float* norms);
  /// norms[q * lanes + l] = |y_q|^2 of lane l.
  void (*lane_norms)(const float* values, int count, int dimensions, float* norms);

  /// Distances of all frames of `x` to all of `y`: lane l of (p, q) to
  /// distances[p * row_stride + q * lanes + l].
  void (*distances)(const RowFrames& x, const LaneFrames& y, float* distances,
                    std::size_t row_stride);

  /// Moves the recursion of `dtw` on over the at most kMostStripRows frames of `x`.
  ///
  /// cost and length, y.count x lanes: of the best paths to the frame before x's first, overwritten
  /// by those to its last. `first`: x begins the sequence, and what cost and length hold is not
  /// read. swapped[l] is -1 in a lane whose fragment is `dtw`'s first sequence (ties between the
  /// two straight steps then go the other way), else 0.
  void (*dtw_strip)(const RowFrames& x, const LaneFrames& y, bool first, const int* swapped,
                    float* cost, int* length);

  /// Moves the recursion of `dtw` on over x, for one sequence y alone, on distances less `limit`
  /// and for the cost alone: paths that `rest` takes above 0 are given up, so a path to the end of
  /// both is left only if it may cost `limit` a cell or less.
  ///
  /// cost[q], -kFramePadding <= q < y.count + kFramePadding, is of the best path to the row before
  /// x's first, infinity where there is none or it was given up (before the first row of all, 0 at
  /// q = -1 alone), overwritten by those to x's last. `live` holds all other q >= 0.
  /// @returns where paths are left.
  FrameRange (*excess_strip)(const SkewedRows& x, const FrameRows& y, float limit,
                             const RestOfPath& rest, FrameRange live, float* cost);

  /// to[n * lanes + l] = from[l][n] for all n < count[l], else 0, n < most_count.
  void (*interleave)(const float* const* from, const int* count, int most_count, float* to);

  /// Squared distances between boxes of two sequences times `unit`, row_count x box_count x lanes,
  /// and the least of each row (row_least, row_count x lanes) and of each box (box_least, box_count
  /// x lanes). Bounds are two whole numbers from 0 to 2^15 - 1 each, as in SkewedRows; sums of
  /// squares must stay below 2^31. A row's box has its lower bounds, then its upper ones,
  /// `dimensions` ints of each; so have the lanes' boxes, `lanes` side by side.
  void (*box_distances)(const int* rows, int row_count, const int* boxes, int box_count,
                        int dimensions, float unit, float* distances, float* row_least,
                        float* box_least);
  /// sums[l] = the sum over n of frames[n * lanes + l] min(0, least[n * lanes + l] - limit).
  void (*sums_below)(const float* least, const int* frames, int count, float limit, float* sums);

  /// The cheapest monotone paths through such distances to the last of `frame_count` frames, of
  /// which a row has kBoxFrames, charging a cell for each: rest[(n * box_count + b) * lanes + l] is
  /// of frames [n * lanes, frame_count) in boxes from b on, for each n * lanes below frame_count
  /// and 0 for the next; of all frames (n = 0), the first one is in box b.
  void (*rest_by_rows)(const float* distances, int frame_count, int box_count, float* rest);
  /// The cheapest monotone paths from the first row to the last, charging a cell for each of the
  /// box_frames[Q * lanes + l] frames of a box, at most kBoxFrames: ends, box_count x lanes, after
  /// each box. `path` is scratch, row_count x lanes.
  void (*path_by_boxes)(const float* distances, const int* box_frames, int row_count, int box_count,
                        float* path, float* ends);

  /// One input frame of the one-stage recursion with free steps: cost and entry, count x lanes, are
  /// those of the best paths to the previous input frame, overwritten by those to this one, whose
  /// distances are `distances`. Entering a fragment costs `entering`; the entry is `frame`.
  void (*one_stage_row)(const float* distances, int count, float entering, int frame, float* cost,
                        int* entry);

  /// cost -= by.
  void (*lower)(float* cost, std::size_t count, float by);
};

/// Those for what every machine of this architecture has.
[[nodiscard]] const LaneKernels& baseline_lane_kernels();

/// The fastest that this machine can run: compiled for x86-64-v3 (AVX2 and FMA) where it has these.
[[nodiscard]] const LaneKernels& best_lane_kernels();

/// What the module uses: the best, unless a LaneKernelsForTest is alive.
[[nodiscard]] const LaneKernels& lane_kernels();

/// While it lives, `lane_kernels()` are the given ones, in all threads. For tests and benchmarks.
class LaneKernelsForTest {
 public:
  explicit LaneKernelsForTest(const LaneKernels& kernels);
  ~LaneKernelsForTest();
  LaneKernelsForTest(const LaneKernelsForTest&) = delete;
  LaneKernelsForTest& operator=(const LaneKernelsForTest&) = delete;

 private:
  const LaneKernels* before_;
};

}  // namespace laban::align
