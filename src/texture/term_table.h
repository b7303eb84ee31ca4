#pragma once

#include <vector>

#include <Eigen/Dense>

#include "laban/texture/motion_texture.h"
#include "laban/texture/semi_markov_search.h"

#include "texture/term_kernels.h"

namespace laban::texture {

/// The observations of a corpus as the kernels read them: floats, row-major, about their mean, so
/// that little is lost by rounding.
struct FloatObservations {
  Eigen::VectorXd mean;
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> values;

  /// @throws Error{kUsage} for more rows than the kernels take.
  explicit FloatObservations(const Eigen::MatrixXd& observations);
  [[nodiscard]] int frame_count() const noexcept { return static_cast<int>(values.cols()); }
};

/// Some frames as the kernels read them, with two frames before and one behind, and room for what
/// the kernels say of them.
struct FrameTile {
  static constexpr int kBefore = 2;
  static constexpr int kMostFrames = kTileColumns - kBefore - 1;

  int begin = 0;  ///< the first frame that is asked for
  int count = 0;  ///< at most kMostFrames
  int columns = 0;
  alignas(64) float values[kTileRows * kTileColumns];
  alignas(64) float residual[kTileColumns];
  alignas(64) float innovation[kTileColumns];
  alignas(64) float start[kTileColumns];

  /// Frames [frame, frame + frames); those before `low` or from `high` on are read as zero.
  void load(const FloatObservations& y, int frame, int frames, int low, int high);
};

/// A texton's numbers rearranged for the kernels.
class TextonPack {
 public:
  /// @param whitened  true: for log-likelihoods; false: innovations in observation units and no
  ///                  start, for prediction errors.
  TextonPack(const Texton& texton, const Eigen::VectorXd& mean, bool whitened);

  /// Squared one-step prediction error in observation units (not whitened), of frames [begin, end)
  /// of the observations; begin >= 2.
  void squared_errors(const FloatObservations& y, int begin, int end, double* to) const;
  /// Step and start terms of a tile's frames, which lie in a take that occupies
  /// [take_begin, take_end).
  void terms(FrameTile& tile, int take_begin, int take_end, float* step, float* start) const;

 private:
  struct Rows {
    std::vector<float> values;
    std::vector<float> bias;
    std::vector<int> columns;
    int rows = 0;
    int stride = 0;
    [[nodiscard]] PackedRows view() const {
      return {values.data(), bias.data(), columns.data(), rows, stride};
    }
  };
  [[nodiscard]] static Rows pack(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& bias);
  [[nodiscard]] PackedTexton view() const;

  int rows_ = 0;
  int states_ = 0;
  std::vector<float> mean_;
  Rows basis_;
  Rows step_;
  Rows start_;
  double step_constant_ = 0.0;
  double start_constant_ = 0.0;
  double residual_weight_ = 0.0;  // 1 / s^2
};

/// Log-likelihood terms of all frames under all textons, for search_segments; approximate to float
/// rounding (about 1e-5 of a term). Kept from round to round where they fit into memory, so that
/// only textons that have changed are computed anew.
class TermTable {
 public:
  /// @param y  outlives the table. @param takes  of y, without gap.
  TermTable(const FloatObservations& y, std::vector<Take> takes, int threads);

  /// Textons of this round; `changed` says which differ from the texton that had the place before
  /// (`kept_from`: that place; -1: new).
  void set_textons(const std::vector<Texton>& textons, const std::vector<int>& kept_from);
  [[nodiscard]] TermSource source(const Take& take) const;

 private:
  struct Terms {
    std::vector<float> step;
    std::vector<float> start;
  };
  void fill(const Take& take, const std::vector<int>& textons);

  const FloatObservations& y_;
  std::vector<Take> takes_;
  int threads_;
  std::vector<TextonPack> packs_;
  std::vector<Terms> table_;  // empty if it would be too large
};

}  // namespace laban::texture
