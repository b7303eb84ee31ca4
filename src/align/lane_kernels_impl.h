// The inner loops of lane_kernels.h. Included by one .cpp file an instruction set, which sets
//
//   LABAN_LANES         floats a vector register has
//   LABAN_LANE_KERNELS  name of the table that is defined
//   LABAN_LANE_KERNELS_NAME  what it is called for users
//
// Everything else is in an unnamed namespace, and nothing here calls Eigen or std: a template or an
// inline function that is compiled for two instruction sets has one name, and the linker may keep
// the copy that an older machine cannot run (tests/architecture/check_kernel_symbols.py).

#include <cstddef>

#include "align/lane_kernels.h"

namespace laban::align {
namespace {

// Vectors of the compiler (g++ and clang++): arithmetic, comparison and choice lane by lane.
constexpr int kLanes = LABAN_LANES;
using Floats = float __attribute__((vector_size(kLanes * sizeof(float))));
using Ints = int __attribute__((vector_size(kLanes * sizeof(int))));

constexpr int kTileRows = 4;  // rows x frames of a tile fill twelve registers with sums
constexpr float kInfinity = __builtin_huge_valf();

// In memory vectors are aligned as their elements are: one unaligned move each.
[[gnu::always_inline]] inline Floats load(const float* from) {
  Floats value;
  __builtin_memcpy(&value, from, sizeof value);
  return value;
}
[[gnu::always_inline]] inline Ints load(const int* from) {
  Ints value;
  __builtin_memcpy(&value, from, sizeof value);
  return value;
}
[[gnu::always_inline]] inline void store(float* to, Floats value) {
  __builtin_memcpy(to, &value, sizeof value);
}
[[gnu::always_inline]] inline void store(int* to, Ints value) {
  __builtin_memcpy(to, &value, sizeof value);
}

// Sum and number of cells of the best paths to a cell.
struct Partial {
  Floats cost;
  Ints length;
};

// Distances of kRows rows to kTileFrames frames of the group. All sums run over the features in
// order, as the norms' do, so equal frames cancel exactly. Not inlined: the loop needs every
// register there is.
template <int kRows>
[[gnu::noinline]] void distance_tile(const RowFrames& x, int p, const LaneFrames& y, int q,
                                     Floats (&d)[kRows][kTileFrames]) {
  const int dimensions = x.dimensions;
  const float* rows = x.values + static_cast<std::ptrdiff_t>(p) * dimensions;
  const float* frames = y.values + static_cast<std::ptrdiff_t>(q) * dimensions * kLanes;
  Floats dot[kRows][kTileFrames] = {};
  for (int k = 0; k < dimensions; ++k) {
    Floats frame[kTileFrames];
#pragma GCC unroll 3
    for (int c = 0; c < kTileFrames; ++c) frame[c] = load(frames + (c * dimensions + k) * kLanes);
#pragma GCC unroll 4
    for (int r = 0; r < kRows; ++r) {
      const float value = rows[r * dimensions + k];
#pragma GCC unroll 3
      for (int c = 0; c < kTileFrames; ++c) dot[r][c] += frame[c] * value;
    }
  }
#pragma GCC unroll 4
  for (int r = 0; r < kRows; ++r) {
#pragma GCC unroll 3
    for (int c = 0; c < kTileFrames; ++c) {
      const Floats difference =
          (load(y.norms + (q + c) * kLanes) + x.norms[p + r]) - 2.0F * dot[r][c];
      d[r][c] = difference > 0.0F ? difference : Floats{};
    }
  }
}

// g(p, q) = d(p, q) + min{ g(p-1, q-1), g(p-1, q), g(p, q-1) }: a later predecessor only if it is
// cheaper. Where swapped, p and q have changed places and so have the last two.
[[gnu::always_inline]] inline Partial step(Partial diagonal, Partial above, Partial left,
                                           Floats distance, Ints swapped) {
  const Ints hold = above.cost < diagonal.cost;
  const Floats cost = hold ? above.cost : diagonal.cost;
  const Ints length = hold ? above.length : diagonal.length;
  const Ints skip = (left.cost < cost) | ((left.cost == cost) & hold & swapped);
  return {(skip ? left.cost : cost) + distance, (skip ? left.length : length) + 1};
}

// What lies left of a tile: the column before, from the row above the tile on.
struct LeftOfTile {
  Partial row[kTileRows + 1];
};

// The recursion over kRows rows and kTileFrames frames. `left` moves on to the tile's last column,
// `top`, the row above, to its last row.
template <int kRows>
[[gnu::always_inline]] inline void recursion_tile(const RowFrames& x, int p, const LaneFrames& y,
                                                  int q, Ints swapped, LeftOfTile& left,
                                                  Partial (&top)[kTileFrames]) {
  Floats d[kRows][kTileFrames];
  distance_tile<kRows>(x, p, y, q, d);
#pragma GCC unroll 3
  for (int c = 0; c < kTileFrames; ++c) {
    Partial diagonal = left.row[0];
    Partial above = top[c];
#pragma GCC unroll 4
    for (int r = 0; r < kRows; ++r) {
      const Partial before = left.row[r + 1];
      above = step(diagonal, above, before, d[r][c], swapped);
      diagonal = before;
      left.row[r + 1] = above;
    }
    left.row[0] = top[c];
    top[c] = above;
  }
}

void recursion_rows(const RowFrames& x, int p, const LaneFrames& y, int q, Ints swapped,
                    LeftOfTile& left, Partial (&top)[kTileFrames]) {
  switch (x.count - p) {
    case 1:
      return recursion_tile<1>(x, p, y, q, swapped, left, top);
    case 2:
      return recursion_tile<2>(x, p, y, q, swapped, left, top);
    case 3:
      return recursion_tile<3>(x, p, y, q, swapped, left, top);
    default:
      return recursion_tile<kTileRows>(x, p, y, q, swapped, left, top);
  }
}

// All rows of the strip for kTileFrames frames of the group, then the next ones: a tile's frames
// are read from memory once a strip.
void dtw_strip(const RowFrames& x, const LaneFrames& y, bool first, const int* swapped, float* cost,
               int* length) {
  const Partial none = {Floats{} + kInfinity, Ints{}};
  const Partial start = {Floats{}, Ints{}};
  const Ints swapped_lanes = load(swapped);
  LeftOfTile left[kMostStripRows / kTileRows];
  for (LeftOfTile& tile : left) {
    for (Partial& row : tile.row) row = none;
  }
  if (first) left[0].row[0] = start;
  for (int q = 0; q < y.count; q += kTileFrames) {
    Partial top[kTileFrames];
    for (int c = 0; c < kTileFrames; ++c) {
      const int cell = (q + c) * kLanes;
      top[c] = first ? none : Partial{load(cost + cell), load(length + cell)};
    }
    for (int p = 0; p < x.count; p += kTileRows) {
      recursion_rows(x, p, y, q, swapped_lanes, left[p / kTileRows], top);
    }
    for (int c = 0; c < kTileFrames; ++c) {
      store(cost + (q + c) * kLanes, top[c].cost);
      store(length + (q + c) * kLanes, top[c].length);
    }
  }
}

[[gnu::always_inline]] inline Floats least_of(Floats a, Floats b) {
  return a < b ? a : b;
}
[[gnu::always_inline]] inline Floats most_of(Floats a, Floats b) {
  return a > b ? a : b;
}

// As recursion_tile: left[0 .. kRows] and top are costs.
template <int kRows>
[[gnu::always_inline]] inline void excess_tile(const RowFrames& x, int p, const LaneFrames& y,
                                               int q, float limit, Floats* left,
                                               Floats (&top)[kTileFrames]) {
  Floats d[kRows][kTileFrames];
  distance_tile<kRows>(x, p, y, q, d);
#pragma GCC unroll 3
  for (int c = 0; c < kTileFrames; ++c) {
    Floats diagonal = left[0];
    Floats above = top[c];
#pragma GCC unroll 4
    for (int r = 0; r < kRows; ++r) {
      const Floats before = left[r + 1];
      above = least_of(least_of(diagonal, above), before) + (d[r][c] - limit);
      diagonal = before;
      left[r + 1] = above;
    }
    left[0] = top[c];
    top[c] = above;
  }
}

void excess_strip(const RowFrames& x, const LaneFrames& y, bool first, float limit, float* cost) {
  const Floats none = Floats{} + kInfinity;
  Floats left[kMostStripRows / kTileRows][kTileRows + 1];
  for (auto& tile : left) {
    for (Floats& row : tile) row = none;
  }
  if (first) left[0][0] = Floats{};
  for (int q = 0; q < y.count; q += kTileFrames) {
    Floats top[kTileFrames];
    for (int c = 0; c < kTileFrames; ++c) top[c] = first ? none : load(cost + (q + c) * kLanes);
    for (int p = 0; p < x.count; p += kTileRows) {
      Floats* tile = left[p / kTileRows];
      switch (x.count - p) {
        case 1:
          excess_tile<1>(x, p, y, q, limit, tile, top);
          break;
        case 2:
          excess_tile<2>(x, p, y, q, limit, tile, top);
          break;
        case 3:
          excess_tile<3>(x, p, y, q, limit, tile, top);
          break;
        default:
          excess_tile<kTileRows>(x, p, y, q, limit, tile, top);
          break;
      }
    }
    for (int c = 0; c < kTileFrames; ++c) store(cost + (q + c) * kLanes, top[c]);
  }
}

template <int kRows>
void distance_rows(const RowFrames& x, int p, const LaneFrames& y, int q, float* distances,
                   std::size_t row_stride) {
  Floats d[kRows][kTileFrames];
  distance_tile<kRows>(x, p, y, q, d);
  for (int r = 0; r < kRows; ++r) {
    float* row = distances + static_cast<std::size_t>(p + r) * row_stride;
    for (int c = 0; c < kTileFrames; ++c) store(row + (q + c) * kLanes, d[r][c]);
  }
}

void distances(const RowFrames& x, const LaneFrames& y, float* to, std::size_t row_stride) {
  for (int q = 0; q < y.count; q += kTileFrames) {
    int p = 0;
    for (; p + kTileRows <= x.count; p += kTileRows) {
      distance_rows<kTileRows>(x, p, y, q, to, row_stride);
    }
    for (; p < x.count; ++p) distance_rows<1>(x, p, y, q, to, row_stride);
  }
}

// Rounded once where the tiles' sums are: left to itself, the compiler may fuse some sums only.
[[gnu::always_inline]] inline float plus_square(float sum, float value) {
#ifdef __FMA__
  return __builtin_fmaf(value, value, sum);
#else
  return sum + value * value;
#endif
}

void row_norms(const float* values, int count, int dimensions, float* norms) {
  for (int p = 0; p < count; ++p) {
    const float* row = values + static_cast<std::ptrdiff_t>(p) * dimensions;
    float sum = 0.0F;
    for (int k = 0; k < dimensions; ++k) sum = plus_square(sum, row[k]);
    norms[p] = sum;
  }
}

void lane_norms(const float* values, int count, int dimensions, float* norms) {
  for (int q = 0; q < count; ++q) {
    const float* frame = values + static_cast<std::ptrdiff_t>(q) * dimensions * kLanes;
    Floats sum = {};
    for (int k = 0; k < dimensions; ++k) {
      const Floats value = load(frame + k * kLanes);
      sum += value * value;
    }
    store(norms + q * kLanes, sum);
  }
}

void interleave(const float* const* from, const int* count, int most_count, float* to) {
  int common = most_count;
  for (int l = 0; l < kLanes; ++l) common = count[l] < common ? count[l] : common;
  for (int n = 0; n < common; ++n) {
#pragma GCC unroll 8
    for (int l = 0; l < kLanes; ++l) to[n * kLanes + l] = from[l][n];
  }
  for (int n = common; n < most_count; ++n) {
    for (int l = 0; l < kLanes; ++l) to[n * kLanes + l] = n < count[l] ? from[l][n] : 0.0F;
  }
}

void strip_bound(const float* cost, const int* length, const float* frames,
                 const float* frames_extra, const float* rows, const float* rows_extra, float limit,
                 int count, const int* frame_count, float* bound) {
  const Ints end = load(frame_count);
  const Floats all_rows = load(rows);
  const Floats all_rows_extra = load(rows_extra);
  Floats least = Floats{} + kInfinity;
  for (int q = 0; q < count; ++q) {
    const int cell = q * kLanes;
    const Floats cells = __builtin_convertvector(load(length + cell), Floats);
    const Floats rest =
        most_of(all_rows + load(frames_extra + cell), load(frames + cell) + all_rows_extra);
    const Floats sum = load(cost + cell) - limit * cells + rest;
    const Ints lower = (sum < least) & (end > q);
    least = lower ? sum : least;
  }
  store(bound, least);
}

void box_distances(const float* rows, int row_count, const float* boxes, int box_count,
                   int dimensions, float* distances, float* row_least, float* box_least) {
  for (int b = 0; b < box_count; ++b) store(box_least + b * kLanes, Floats{} + kInfinity);
  for (int p = 0; p < row_count; ++p) {
    const float* low = rows + 2 * p * dimensions;
    const float* high = low + dimensions;
    Floats least = Floats{} + kInfinity;
    for (int b = 0; b < box_count; ++b) {
      const float* box_low = boxes + 2 * b * dimensions * kLanes;
      const float* box_high = box_low + dimensions * kLanes;
      Floats sum = {};
      for (int k = 0; k < dimensions; ++k) {
        const Floats gap = most_of(
            most_of(load(box_low + k * kLanes) - high[k], low[k] - load(box_high + k * kLanes)),
            Floats{});
        sum += gap * gap;
      }
      store(distances + (p * box_count + b) * kLanes, sum);
      least = least_of(sum, least);
      store(box_least + b * kLanes, least_of(sum, load(box_least + b * kLanes)));
    }
    store(row_least + p * kLanes, least);
  }
}

// Every path begins in the first cell.
void begin_path(float* path, int count) {
  for (int n = 0; n < count; ++n) store(path + n * kLanes, Floats{} + (n == 0 ? 0.0F : kInfinity));
}

void path_by_rows(const float* distances, const int* row_frames, int row_count, int box_count,
                  float* path) {
  begin_path(path, box_count);
  for (int p = 0; p < row_count; ++p) {
    for (int frame = 0; frame < row_frames[p]; ++frame) {
      Floats before = Floats{} + kInfinity;
      for (int b = 0; b < box_count; ++b) {
        before = least_of(load(path + b * kLanes), before);
        store(path + b * kLanes, before + load(distances + (p * box_count + b) * kLanes));
      }
    }
  }
}

void path_by_boxes(const float* distances, const int* box_frames, int row_count, int box_count,
                   float* path, float* ends) {
  begin_path(path, row_count);
  for (int b = 0; b < box_count; ++b) {
    const Ints frames = load(box_frames + b * kLanes);
    for (int frame = 0; frame < kBoxFrames; ++frame) {
      const Ints charged = frames > frame;
      Floats before = Floats{} + kInfinity;
      for (int p = 0; p < row_count; ++p) {
        const Floats here = load(path + p * kLanes);
        before = least_of(here, before);
        const Floats sum = before + load(distances + (p * box_count + b) * kLanes);
        store(path + p * kLanes, charged ? sum : here);
      }
    }
    store(ends + b * kLanes, load(path + (row_count - 1) * kLanes));
  }
}

void one_stage_row(const float* distances, int count, float entering, int frame, float* cost,
                   int* entry) {
  Floats diagonal_cost = Floats{} + kInfinity;
  Ints diagonal_entry = {};
  Floats left_cost = Floats{} + entering;
  Ints left_entry = Ints{} + frame;
  for (int q = 0; q < count; ++q) {
    const Floats above_cost = load(cost + q * kLanes);
    const Ints above_entry = load(entry + q * kLanes);
    const Ints hold = above_cost < diagonal_cost;
    const Floats best_cost = hold ? above_cost : diagonal_cost;
    const Ints best_entry = hold ? above_entry : diagonal_entry;
    const Ints skip = left_cost < best_cost;
    left_cost = (skip ? left_cost : best_cost) + load(distances + q * kLanes);
    left_entry = skip ? left_entry : best_entry;
    store(cost + q * kLanes, left_cost);
    store(entry + q * kLanes, left_entry);
    diagonal_cost = above_cost;
    diagonal_entry = above_entry;
  }
}

void lower(float* cost, std::size_t count, float by) {
  for (std::size_t n = 0; n < count; ++n) cost[n] -= by;
}

}  // namespace

extern const LaneKernels LABAN_LANE_KERNELS;  // a constant is not visible elsewhere without
const LaneKernels LABAN_LANE_KERNELS = {
    .name = LABAN_LANE_KERNELS_NAME,
    .lanes = kLanes,
    .row_norms = row_norms,
    .lane_norms = lane_norms,
    .distances = distances,
    .dtw_strip = dtw_strip,
    .excess_strip = excess_strip,
    .interleave = interleave,
    .strip_bound = strip_bound,
    .box_distances = box_distances,
    .path_by_rows = path_by_rows,
    .path_by_boxes = path_by_boxes,
    .one_stage_row = one_stage_row,
    .lower = lower,
};

}  // namespace laban::align
