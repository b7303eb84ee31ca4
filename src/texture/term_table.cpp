#include "texture/term_table.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"
#include "laban/math/parallel.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLogTwoPi = 1.8378770664093453;
// Terms kept from round to round: 400 MB, 900 textons over a quarter of an hour at 60 Hz.
constexpr double kMostKeptBytes = 400e6;
// A tile holds two frames before those asked for, and one behind.
constexpr int kBefore = 2;
constexpr int kTileFrames = kTileColumns - kBefore - 1;

/// The energies of one tile.
struct Tile {
  alignas(64) float values[kTileRows * kTileColumns];
  alignas(64) float residual[kTileColumns];
  alignas(64) float innovation[kTileColumns];
  alignas(64) float start[kTileColumns];

  /// Column 0 is frame `first`; frames outside [low, high) are zero.
  void load(const FloatObservations& y, int first, int columns, int low, int high) {
    const int from = std::max(first, low);
    const int to = std::min(first + columns, high);
    for (Index r = 0; r < y.values.rows(); ++r) {
      float* row = values + r * kTileColumns;
      std::fill(row, row + columns, 0.0F);
      std::copy(&y.values(r, from), &y.values(r, from) + (to - from), row + (from - first));
    }
  }
  [[nodiscard]] TermEnergies view() { return {residual, innovation, start}; }
};

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

TextonPack::Rows TextonPack::pack(const MatrixXd& matrix, const VectorXd& bias) {
  const auto rows = static_cast<int>(matrix.rows());
  const auto stride = static_cast<int>(matrix.cols());
  const int groups = (rows + kGroupRows - 1) / kGroupRows;
  Rows packed;
  packed.rows = rows;
  packed.stride = stride;
  packed.values.assign(static_cast<std::size_t>(groups * stride * kGroupRows), 0.0F);
  packed.bias.assign(static_cast<std::size_t>(groups * kGroupRows), 0.0F);
  for (int g = 0; g < groups; ++g) {
    int used = 0;
    for (int r = 0; r < kGroupRows && g * kGroupRows + r < rows; ++r) {
      const int row = g * kGroupRows + r;
      packed.bias[static_cast<std::size_t>(row)] = static_cast<float>(bias[row]);
      for (int k = 0; k < stride; ++k) {
        if (matrix(row, k) != 0.0) used = std::max(used, k + 1);
        packed.values[static_cast<std::size_t>((g * stride + k) * kGroupRows + r)] =
            static_cast<float>(matrix(row, k));
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
  const double residual = -0.5 * outside * (kLogTwoPi + std::log(texton.residual_variance));
  step_constant_ = residual - 0.5 * states * kLogTwoPi + white.diagonal().array().log().sum();
  start_constant_ = 2.0 * residual - states * kLogTwoPi + start.diagonal().array().log().sum();
  residual_weight_ = 1.0 / texton.residual_variance;
}

PackedTexton TextonPack::view() const {
  return {rows_, states_, mean_.data(), basis_.view(), step_.view(), start_.view()};
}

void TextonPack::squared_errors(const FloatObservations& y, int begin, int end, double* to) const {
  const PackedTexton texton = view();
  Tile tile;
  for (int from = begin; from < end; from += kTileFrames) {
    const int count = std::min(kTileFrames, end - from);
    const int columns = padded(count + kBefore);
    tile.load(y, from - kBefore, columns, 0, y.frame_count());
    term_kernels().energies(texton, tile.values, columns, tile.view());
    for (int n = 0; n < count; ++n) {
      to[from - begin + n] = static_cast<double>(tile.residual[n + kBefore]) +
                             static_cast<double>(tile.innovation[n + kBefore]);
    }
  }
}

void TextonPack::terms(const FloatObservations& y, int take_begin, int take_end, int begin, int end,
                       float* step, float* start) const {
  const PackedTexton texton = view();
  const auto weight = static_cast<float>(residual_weight_);
  const auto step_constant = static_cast<float>(step_constant_);
  const auto start_constant = static_cast<float>(start_constant_);
  Tile tile;
  for (int from = begin; from < end; from += kTileFrames) {
    const int count = std::min(kTileFrames, end - from);
    const int columns = padded(count + kBefore + 1);
    tile.load(y, from - kBefore, columns, take_begin, take_end);
    term_kernels().energies(texton, tile.values, columns, tile.view());
    for (int n = 0; n < count; ++n) {
      const int c = n + kBefore;
      const int frame = from + n;
      const int out = frame - begin;
      step[out] = frame < take_begin + 2
                      ? 0.0F
                      : step_constant - 0.5F * (tile.innovation[c] + weight * tile.residual[c]);
      start[out] =
          frame + 1 >= take_end
              ? 0.0F
              : start_constant -
                    0.5F * (tile.start[c] + weight * (tile.residual[c] + tile.residual[c + 1]));
    }
  }
}

TermTable::TermTable(const FloatObservations& y, std::vector<Take> takes, int threads)
    : y_(y), takes_(std::move(takes)), threads_(threads) {}

void TermTable::fill(std::size_t texton) {
  Terms& terms = table_[texton];
  terms.step.resize(static_cast<std::size_t>(y_.frame_count()));
  terms.start.resize(terms.step.size());
  for (const Take& take : takes_) {
    const int end = take.begin + take.length;
    packs_[texton].terms(y_, take.begin, end, take.begin, end, terms.step.data() + take.begin,
                         terms.start.data() + take.begin);
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
  math::parallel_for(static_cast<int>(changed.size()), threads_, [&](int n) {
    fill(static_cast<std::size_t>(changed[static_cast<std::size_t>(n)]));
  });
}

TermSource TermTable::source(const Take& take) const {
  return [this, take](int begin, int end, TermBlock& block) {
    const auto textons = static_cast<Index>(packs_.size());
    const Index count = end - begin;
    block.step.resize(textons, count);
    block.start.resize(textons, count);
    std::vector<float> step(static_cast<std::size_t>(count));
    std::vector<float> start(step.size());
    for (Index i = 0; i < textons; ++i) {
      const auto cell = static_cast<std::size_t>(i);
      const float* steps = step.data();
      const float* starts = start.data();
      if (!table_.empty()) {
        steps = table_[cell].step.data() + take.begin + begin;
        starts = table_[cell].start.data() + take.begin + begin;
      } else {
        packs_[cell].terms(y_, take.begin, take.begin + take.length, take.begin + begin,
                           take.begin + end, step.data(), start.data());
      }
      for (Index t = 0; t < count; ++t) {
        block.step(i, t) = static_cast<double>(steps[t]);
        block.start(i, t) = static_cast<double>(starts[t]);
      }
    }
  };
}

}  // namespace laban::texture
