#pragma once

namespace laban::texture {

/// Rows of a matrix that the kernels multiply at once, and what numbers of columns are multiples
/// of.
inline constexpr int kGroupRows = 5;
inline constexpr int kGroupColumns = 16;
/// Most frames of a tile, a multiple of kGroupColumns; and most rows of an observation.
inline constexpr int kTileColumns = 128;
inline constexpr int kTileRows = 128;
/// Most states of a texton.
inline constexpr int kMostStates = 40;

/// rows x cols floats in groups of kGroupRows rows, column by column within a group, the last group
/// filled up with zeros: [group][column][row in group].
struct PackedRows {
  const float* values = nullptr;
  const float* bias = nullptr;   ///< one a row: what a row's product begins with
  const int* columns = nullptr;  ///< of each group: columns that follow are zero
  int rows = 0;
  int stride = 0;  ///< columns of a group in memory
};

/// A texton as the kernels read it. Observations d rows, states m rows.
struct PackedTexton {
  int rows = 0;    ///< d <= kTileRows
  int states = 0;  ///< m <= kMostStates
  const float* mean = nullptr;
  PackedRows basis;  ///< m x d: x = C' y - C' mean
  PackedRows step;   ///< m x 3 m on (x_{t-1}, x_{t-2}, x_t): the innovation, whitened or not
  PackedRows start;  ///< 2 m x 2 m on (x_t, x_{t+1}): the start state, whitened; no rows: none
};

/// Where the kernels write, kTileColumns each.
struct TermEnergies {
  float* residual = nullptr;    ///< |(I - C C') (y_t - mean)|^2
  float* innovation = nullptr;  ///< squared length of the step's rows; columns 0 and 1 mean nothing
  float* start = nullptr;  ///< of the start's rows at (t, t + 1); the last column means nothing
};

struct TermKernels {
  const char* name;
  /// @param tile  d rows of kTileColumns floats. @param columns  a multiple of kGroupColumns.
  void (*energies)(const PackedTexton& texton, const float* tile, int columns,
                   const TermEnergies& to);
};

/// The fastest kernels that this machine can run, and those that any can.
[[nodiscard]] const TermKernels& term_kernels();
[[nodiscard]] const TermKernels& baseline_term_kernels();

}  // namespace laban::texture
