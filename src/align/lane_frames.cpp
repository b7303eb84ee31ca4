#include "align/lane_frames.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace laban::align {
namespace {

int whole_tiles(Eigen::Index frames) {
  return (static_cast<int>(frames) + kTileFrames - 1) / kTileFrames * kTileFrames;
}

// The power of two that brings `most` into (1/2, 1].
double factor_for(double most) {
  return most > 0.0 ? std::ldexp(1.0, -(std::ilogb(most) + 1)) : 1.0;
}

double most_beside(const Eigen::Ref<const Eigen::MatrixXd>& sequence,
                   const Eigen::VectorXd& center) {
  return (sequence.colwise() - center).cwiseAbs().maxCoeff();
}

}  // namespace

Scaling Scaling::of(std::span<const Eigen::MatrixXd> sequences) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(sequences[0].rows());
  double count = 0.0;
  for (const Eigen::MatrixXd& sequence : sequences) {
    sum += sequence.rowwise().sum();
    count += static_cast<double>(sequence.cols());
  }
  Scaling scaling{sum / count};
  double most = 0.0;
  for (const Eigen::MatrixXd& sequence : sequences) {
    most = std::max(most, most_beside(sequence, scaling.center));
  }
  scaling.factor = factor_for(most);
  return scaling;
}

Scaling Scaling::covering(const Eigen::Ref<const Eigen::MatrixXd>& sequence) const {
  return {center, std::min(factor, factor_for(most_beside(sequence, center)))};
}

Eigen::MatrixXf Scaling::apply(const Eigen::Ref<const Eigen::MatrixXd>& sequence) const {
  return ((sequence.colwise() - center) * factor).cast<float>();
}

PackedRows::PackedRows(const Eigen::MatrixXf& scaled, const LaneKernels& kernels)
    : dimensions_(static_cast<int>(scaled.rows())),
      frame_count_(static_cast<int>(scaled.cols())),
      values_(static_cast<std::size_t>(scaled.size())),
      norms_(static_cast<std::size_t>(scaled.cols())) {
  std::copy_n(scaled.data(), scaled.size(), values_.data());
  kernels.row_norms(values_.data(), frame_count_, dimensions_, norms_.data());
}

RowFrames PackedRows::view(int begin, int count) const {
  return {values_.data() + static_cast<std::ptrdiff_t>(begin) * dimensions_, norms_.data() + begin,
          count, dimensions_};
}

namespace {

// Norms of frames within, and each coordinate of others, which are at most sqrt(kMostDimensions)
// times as long: squared distances, and so those of boxes, stay below 2^31.
constexpr float kLargestOnGrid = 7000.0F;

// Numbers of 16 bits two by two, the first in the low half.
Eigen::MatrixXi pairs_of(const Eigen::MatrixXf& whole) {
  Eigen::MatrixXi pairs = Eigen::MatrixXi::Zero((whole.rows() + 1) / 2, whole.cols());
  for (Eigen::Index q = 0; q < whole.cols(); ++q) {
    for (Eigen::Index k = 0; k < whole.rows(); ++k) {
      const auto half = static_cast<unsigned>(static_cast<int>(whole(k, q))) & 0xFFFFU;
      int& pair = pairs(k / 2, q);
      pair = static_cast<int>(static_cast<unsigned>(pair) | half << (k % 2 == 0 ? 0U : 16U));
    }
  }
  return pairs;
}

}  // namespace

CoarseGrid::CoarseGrid(float largest_norm)
    : step_(largest_norm > 0.0F ? largest_norm / kLargestOnGrid : 1.0F) {}

Eigen::MatrixXf CoarseGrid::in_cube(const Eigen::MatrixXf& scaled) const {
  return (scaled / step_).cwiseMax(-kLargestOnGrid).cwiseMin(kLargestOnGrid);
}

CoarseFrames CoarseGrid::frames(const Eigen::MatrixXf& scaled) const {
  const Eigen::MatrixXf whole = in_cube(scaled).array().round();
  return {pairs_of(whole), whole.colwise().squaredNorm() * unit()};
}

Eigen::MatrixXi CoarseGrid::lower_bounds(const Eigen::MatrixXf& scaled) const {
  return pairs_of(in_cube(scaled).array().floor() + kLargestOnGrid);
}

Eigen::MatrixXi CoarseGrid::upper_bounds(const Eigen::MatrixXf& scaled) const {
  return pairs_of(in_cube(scaled).array().ceil() + kLargestOnGrid);
}

float CoarseGrid::rounding(int dimensions) const {
  return step_ * std::sqrt(static_cast<float>(dimensions));
}

PackedStrips::PackedStrips(const CoarseFrames& frames, float factor, const LaneKernels& kernels)
    : dimensions_(static_cast<int>(frames.values.rows())),
      frame_count_(static_cast<int>(frames.values.cols())),
      rows_(kStripBands * kernels.lanes),
      factor_(factor),
      values_(static_cast<std::size_t>(count()) * static_cast<std::size_t>(dimensions_ * rows_)),
      norms_(static_cast<std::size_t>(count() * rows_)) {
  const auto rows = static_cast<std::size_t>(rows_);
  for (int p = 0; p < frame_count_; ++p) {
    const auto strip = static_cast<std::size_t>(p / rows_);
    const auto row = static_cast<std::size_t>(rows_ - 1 - p % rows_);
    const std::size_t first = strip * static_cast<std::size_t>(dimensions_) * rows + row;
    for (int k = 0; k < dimensions_; ++k)
      values_[first + static_cast<std::size_t>(k) * rows] = frames.values(k, p);
    norms_[strip * rows + row] = frames.norms(p);
  }
}

SkewedRows PackedStrips::view(int n) const {
  return {values_.data() + static_cast<std::ptrdiff_t>(n) * dimensions_ * rows_,
          norms_.data() + static_cast<std::ptrdiff_t>(n) * rows_,
          std::min(rows_, frame_count_ - n * rows_), dimensions_, factor_};
}

PackedFrames::PackedFrames(const CoarseFrames& frames)
    : frame_count_(static_cast<int>(frames.values.cols())),
      values_(static_cast<std::size_t>(frames.values.size() + 2 * kFramePadding)),
      norms_(static_cast<std::size_t>(frames.values.cols() + 2 * kFramePadding)) {
  Eigen::Map<Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      values_.data() + kFramePadding, frames.values.rows(), frames.values.cols()) = frames.values;
  Eigen::Map<Eigen::RowVectorXf>(norms_.data() + kFramePadding, frames.norms.size()) = frames.norms;
}

FrameRows PackedFrames::view() const {
  return {values_.data() + kFramePadding, frame_count_, norms_.data() + kFramePadding,
          frame_count_};
}

PackedLanes::PackedLanes(std::span<const Eigen::MatrixXf* const> scaled,
                         const LaneKernels& kernels) {
  Eigen::Index longest = 0;
  for (const Eigen::MatrixXf* sequence : scaled) longest = std::max(longest, sequence->cols());
  frame_count_ = whole_tiles(longest);
  const auto dimensions = static_cast<std::size_t>(scaled[0]->rows());
  const auto lanes = static_cast<std::size_t>(kernels.lanes);
  values_ = AlignedArray<float>(static_cast<std::size_t>(frame_count_) * dimensions * lanes);
  norms_ = AlignedArray<float>(static_cast<std::size_t>(frame_count_) * lanes);
  const float* from[kMostLanes] = {};
  int count[kMostLanes] = {};
  for (std::size_t lane = 0; lane < scaled.size(); ++lane) {
    from[lane] = scaled[lane]->data();
    count[lane] = static_cast<int>(scaled[lane]->size());
  }
  kernels.interleave(from, count, frame_count_ * static_cast<int>(dimensions), values_.data());
  kernels.lane_norms(values_.data(), frame_count_, static_cast<int>(dimensions), norms_.data());
}

std::vector<int> longest_first(std::span<const Eigen::MatrixXd> sequences) {
  std::vector<int> order(sequences.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return sequences[static_cast<std::size_t>(a)].cols() >
           sequences[static_cast<std::size_t>(b)].cols();
  });
  return order;
}

LaneDtw::LaneDtw(const LaneKernels& kernels, int most_frames)
    : kernels_(&kernels),
      cost_(static_cast<std::size_t>(most_frames * kernels.lanes)),
      length_(static_cast<std::size_t>(most_frames * kernels.lanes)) {}

void LaneDtw::begin(const PackedRows& x, const PackedLanes& y, const bool* swapped) {
  x_ = &x;
  y_ = &y;
  frame_ = 0;
  for (int lane = 0; lane < kernels_->lanes; ++lane) swapped_[lane] = swapped[lane] ? -1 : 0;
  advance();
}

bool LaneDtw::advance() {
  const int count = std::min(kMostStripRows, x_->frame_count() - frame_);
  if (count == 0) return false;
  kernels_->dtw_strip(x_->view(frame_, count), y_->view(), frame_ == 0, swapped_, cost_.data(),
                      length_.data());
  frame_ += count;
  return true;
}

}  // namespace laban::align
