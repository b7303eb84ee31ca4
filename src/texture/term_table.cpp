#include "texture/term_table.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/parallel.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Terms kept from round to round: 400 MB, 900 textons over a quarter of an hour at 60 Hz.
constexpr double kMostKeptBytes = 400e6;
int padded(int columns) {
  return (columns + kGroupColumns - 1) / kGroupColumns * kGroupColumns;
}

/// The inverse of the lower Cholesky factor.
MatrixXd whitener(const MatrixXd& covariance) {
  const Eigen::LLT<MatrixXd> llt(covariance);
  if (llt.info() != Eigen::Success) {
    throw Error(ErrorKind::kNumeric, "texton: a covariance is not positive definite");
  }
  return llt.matrixL().solve(MatrixXd::Identity(covariance.rows(), covariance.cols()));
}

}  // namespace

FloatObservations::FloatObservations(const MatrixXd& observations)
    : mean(observations.rowwise().mean()) {
  if (observations.rows() > kTileRows) {
    throw Error(ErrorKind::kUsage,
                "texture: an observation has at most " + std::to_string(kTileRows) + " rows");
  }
  values = (observations.colwise() - mean).cast<float>();
}

void FrameTile::load(const FloatObservations& y, int frame, int frames, int low, int high) {
  begin = frame;
  count = frames;
  const int first = frame - kBefore;
  columns = padded(frames + kBefore + 1);
  const int from = std::max(first, low);
  const int to = std::min(first + columns, high);
  for (Index r = 0; r < y.values.rows(); ++r) {
    float* row = values + r * kTileColumns;
    std::fill(row, row + columns, 0.0F);
    const float* source = y.values.data() + r * y.values.cols();
    std::copy(source + from, source + to, row + (from - first));
  }
}

TextonPack::Rows TextonPack::pack(const MatrixXd& matrix, const VectorXd& bias) {
  const auto rows = static_cast<int>(matrix.rows());
  const auto stride = static_cast<int>(matrix.cols());
  const int groups = (rows + kGroupRows - 1) / kGroupRows;
  Rows packed;
  packed.rows = rows;
  packed.stride = stride;
  const int padded_rows = groups * kGroupRows;
  const int padded = padded_rows * stride;
  packed.values.assign(static_cast<std::size_t>(padded), 0.0F);
  packed.bias.assign(static_cast<std::size_t>(padded_rows), 0.0F);
  for (int g = 0; g < groups; ++g) {
    int used = 0;
    for (int r = 0; r < kGroupRows && g * kGroupRows + r < rows; ++r) {
      const int row = g * kGroupRows + r;
      packed.bias[static_cast<std::size_t>(row)] = static_cast<float>(bias[row]);
      for (int k = 0; k < stride; ++k) {
        if (matrix(row, k) != 0.0) used = std::max(used, k + 1);
        const int cell = (g * stride + k) * kGroupRows + r;
        packed.values[static_cast<std::size_t>(cell)] = static_cast<float>(matrix(row, k));
      }
    }
    packed.columns.push_back(used);
  }
  return packed;
}

TextonPack::TextonPack(const Texton& texton, const VectorXd& mean, bool whitened)
    : rows_(static_cast<int>(texton.mean.size())), states_(texton.dimension()) {
  if (states_ > kMostStates) {
    throw Error(ErrorKind::kUsage,
                "texture: a texton has at most " + std::to_string(kMostStates) + " states");
  }
  const Index m = states_;
  const VectorXd away = texton.mean - mean;
  mean_.resize(static_cast<std::size_t>(rows_));
  for (int r = 0; r < rows_; ++r) mean_[static_cast<std::size_t>(r)] = static_cast<float>(away[r]);
  basis_ = pack(texton.basis.transpose(), -(texton.basis.transpose() * away));
  const LinearDynamics& dynamics = texton.dynamics;
  const MatrixXd white =
      whitened ? whitener(dynamics.covariance) : MatrixXd(MatrixXd::Identity(m, m));
  MatrixXd step(m, 3 * m);
  step << -white * dynamics.a1, -white * dynamics.a2,
      MatrixXd(white.triangularView<Eigen::Lower>());
  step_ = pack(step, -(white * dynamics.offset));
  if (!whitened) return;
  const MatrixXd start =
      whitener(texton.start_covariance).triangularView<Eigen::Lower>().toDenseMatrix();
  start_ = pack(start, -(start * texton.start_mean));
  const auto states = static_cast<double>(m);
  const double outside = static_cast<double>(rows_) - states;
  const double residual = -0.5 * outside * (math::kLogTwoPi + std::log(texton.residual_variance));
  step_constant_ = residual - 0.5 * states * math::kLogTwoPi + white.diagonal().array().log().sum();
  start_constant_ =
      2.0 * residual - states * math::kLogTwoPi + start.diagonal().array().log().sum();
  residual_weight_ = 1.0 / texton.residual_variance;
}

PackedTexton TextonPack::view() const {
  return {rows_, states_, mean_.data(), basis_.view(), step_.view(), start_.view()};
}

void TextonPack::squared_errors(const FloatObservations& y, int begin, int end, double* to) const {
  const PackedTexton texton = view();
  FrameTile tile;
  for (int from = begin; from < end; from += FrameTile::kMostFrames) {
    tile.load(y, from, std::min(FrameTile::kMostFrames, end - from), 0, y.frame_count());
    term_kernels().energies(texton, tile.values, tile.columns,
                            {tile.residual, tile.innovation, tile.start});
    for (int n = 0; n < tile.count; ++n) {
      const int c = n + FrameTile::kBefore;
      to[from - begin + n] =
          static_cast<double>(tile.residual[c]) + static_cast<double>(tile.innovation[c]);
    }
  }
}

void TextonPack::terms(FrameTile& tile, int take_begin, int take_end, float* step,
                       float* start) const {
  const auto weight = static_cast<float>(residual_weight_);
  const auto step_constant = static_cast<float>(step_constant_);
  const auto start_constant = static_cast<float>(start_constant_);
  term_kernels().energies(view(), tile.values, tile.columns,
                          {tile.residual, tile.innovation, tile.start});
  for (int n = 0; n < tile.count; ++n) {
    const int c = n + FrameTile::kBefore;
    step[n] = step_constant - 0.5F * (tile.innovation[c] + weight * tile.residual[c]);
    start[n] = start_constant -
               0.5F * (tile.start[c] + weight * (tile.residual[c] + tile.residual[c + 1]));
  }
  for (int n = 0; n < tile.count && tile.begin + n < take_begin + 2; ++n) step[n] = 0.0F;
  if (tile.begin + tile.count == take_end) start[tile.count - 1] = 0.0F;
}

TermTable::TermTable(const FloatObservations& y, std::vector<Take> takes, int threads)
    : y_(y), takes_(std::move(takes)), threads_(threads) {}

// Frames outside, textons inside: the textons' numbers are fewer than the frames'.
void TermTable::fill(const Take& take, const std::vector<int>& textons) {
  FrameTile tile;
  const int end = take.begin + take.length;
  for (int from = take.begin; from < end; from += FrameTile::kMostFrames) {
    tile.load(y_, from, std::min(FrameTile::kMostFrames, end - from), take.begin, end);
    for (const int i : textons) {
      Terms& terms = table_[static_cast<std::size_t>(i)];
      packs_[static_cast<std::size_t>(i)].terms(tile, take.begin, end, terms.step.data() + from,
                                                terms.start.data() + from);
    }
  }
}

void TermTable::set_textons(const std::vector<Texton>& textons, const std::vector<int>& kept_from) {
  std::vector<TextonPack> packs;
  std::vector<Terms> table(textons.size());
  std::vector<int> changed;
  const double bytes = 2.0 * sizeof(float) * static_cast<double>(textons.size()) *
                       static_cast<double>(y_.frame_count());
  const bool keeps = bytes <= kMostKeptBytes;
  for (std::size_t i = 0; i < textons.size(); ++i) {
    const int before = kept_from[i];
    if (before >= 0) {
      packs.push_back(std::move(packs_[static_cast<std::size_t>(before)]));
      if (static_cast<std::size_t>(before) < table_.size())
        table[i] = std::move(table_[static_cast<std::size_t>(before)]);
    } else {
      packs.emplace_back(textons[i], y_.mean, true);
    }
    if (keeps && table[i].step.empty()) changed.push_back(static_cast<int>(i));
  }
  packs_ = std::move(packs);
  table_.clear();
  if (!keeps) return;
  table_ = std::move(table);
  for (const int i : changed) {
    table_[static_cast<std::size_t>(i)].step.resize(static_cast<std::size_t>(y_.frame_count()));
    table_[static_cast<std::size_t>(i)].start.resize(static_cast<std::size_t>(y_.frame_count()));
  }
  math::parallel_for(static_cast<int>(takes_.size()), threads_,
                     [&](int n) { fill(takes_[static_cast<std::size_t>(n)], changed); });
}

TermSource TermTable::source(const Take& take) const {
  return [this, take](int begin, int end, TermBlock& block) {
    const auto textons = static_cast<Index>(packs_.size());
    const Index count = end - begin;
    block.step.resize(textons, count);
    block.start.resize(textons, count);
    const auto put = [&](Index i, Index t, const float* step, const float* start, Index frames) {
      for (Index n = 0; n < frames; ++n) {
        block.step(i, t + n) = static_cast<double>(step[n]);
        block.start(i, t + n) = static_cast<double>(start[n]);
      }
    };
    if (!table_.empty()) {
      const int at = take.begin + begin;
      for (Index i = 0; i < textons; ++i) {
        const Terms& terms = table_[static_cast<std::size_t>(i)];
        put(i, 0, terms.step.data() + at, terms.start.data() + at, count);
      }
      return;
    }
    FrameTile tile;
    float step[kTileColumns];
    float start[kTileColumns];
    for (int from = begin; from < end; from += FrameTile::kMostFrames) {
      tile.load(y_, take.begin + from, std::min(FrameTile::kMostFrames, end - from), take.begin,
                take.begin + take.length);
      for (Index i = 0; i < textons; ++i) {
        packs_[static_cast<std::size_t>(i)].terms(tile, take.begin, take.begin + take.length, step,
                                                  start);
        put(i, from - begin, step, start, tile.count);
      }
    }
  };
}

}  // namespace laban::texture
