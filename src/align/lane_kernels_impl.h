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

// Vectors of the compiler (g++ and clang++): arithmetic, comparison and choice lane by lane. In
// memory they are aligned as their elements are.
constexpr int kLanes = LABAN_LANES;
using Floats = float __attribute__((vector_size(kLanes * sizeof(float))));
using Ints = int __attribute__((vector_size(kLanes * sizeof(int))));
using FloatsInMemory =
    float __attribute__((vector_size(kLanes * sizeof(float)), aligned(alignof(float)), may_alias));
using IntsInMemory =
    int __attribute__((vector_size(kLanes * sizeof(int)), aligned(alignof(int)), may_alias));

constexpr int kTileRows = 4;  // rows x frames of a tile fill twelve registers with sums
constexpr float kInfinity = __builtin_huge_valf();

[[gnu::always_inline]] inline Floats load(const float* from) {
  return *reinterpret_cast<const FloatsInMemory*>(from);
}
[[gnu::always_inline]] inline Ints load(const int* from) {
  return *reinterpret_cast<const IntsInMemory*>(from);
}
[[gnu::always_inline]] inline void store(float* to, Floats value) {
  *reinterpret_cast<FloatsInMemory*>(to) = value;
}
[[gnu::always_inline]] inline void store(int* to, Ints value) {
  *reinterpret_cast<IntsInMemory*>(to) = value;
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
[[gnu::noinline]] void distance_tile(const RowFrames& x, int p, const LaneFrames& y,
                                                 int q, Floats (&d)[kRows][kTileFrames]) {
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

void row_norms(const float* values, int count, int dimensions, float* norms) {
  for (int p = 0; p < count; ++p) {
    const float* row = values + static_cast<std::ptrdiff_t>(p) * dimensions;
    float sum = 0.0F;
    for (int k = 0; k < dimensions; ++k) sum += row[k] * row[k];
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

void strip_bound(const float* cost, const int* length, const float* rest, float limit, int count,
                 const int* frame_count, float* bound) {
  const Ints end = load(frame_count);
  Floats least = Floats{} + kInfinity;
  for (int q = 0; q < count; ++q) {
    const Floats cells = __builtin_convertvector(load(length + q * kLanes), Floats);
    const Floats sum = load(cost + q * kLanes) - limit * cells + load(rest + q * kLanes);
    const Ints lower = (sum < least) & (end > q);
    least = lower ? sum : least;
  }
  store(bound, least);
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
    LABAN_LANE_KERNELS_NAME, kLanes, row_norms, lane_norms, distances, dtw_strip, strip_bound,
    one_stage_row,           lower};

}  // namespace laban::align
