#include "align/box_bounds.h"

#include <algorithm>
#include <limits>

namespace laban::align {
namespace {

using Eigen::Index;

// Frames of a sequence that its n-th box holds; none behind its end.
int frames_in_box(int n, Index frames) {
  return static_cast<int>(std::clamp<Index>(frames - n * kBoxFrames, 0, kBoxFrames));
}

// Lower bounds, then upper bounds, a column a box.
Eigen::MatrixXi boxes_of(const Eigen::MatrixXf& rotated, const CoarseGrid& grid) {
  const Eigen::MatrixXf values = leading_and_norm(rotated, kLeadingCoordinates);
  Eigen::MatrixXf least(values.rows(), box_count_for(values.cols()));
  Eigen::MatrixXf most(values.rows(), least.cols());
  for (Index n = 0; n < least.cols(); ++n) {
    const auto part =
        values.middleCols(n * kBoxFrames, frames_in_box(static_cast<int>(n), values.cols()));
    least.col(n) = part.rowwise().minCoeff();
    most.col(n) = part.rowwise().maxCoeff();
  }
  const Eigen::MatrixXi lower = grid.lower_bounds(least);
  Eigen::MatrixXi boxes(2 * lower.rows(), lower.cols());
  boxes << lower, grid.upper_bounds(most);
  return boxes;
}

}  // namespace

int box_count_for(Index frames) {
  return static_cast<int>((frames + kBoxFrames - 1) / kBoxFrames);
}

Eigen::MatrixXf leading_and_norm(const Eigen::MatrixXf& rotated, Index leading) {
  const Index own = std::min(rotated.rows(), leading);
  Eigen::MatrixXf values(own + 1, rotated.cols());
  values << rotated.topRows(own), rotated.bottomRows(rotated.rows() - own).colwise().norm();
  return values;
}

FragmentBoxes::FragmentBoxes(std::span<const Eigen::MatrixXf* const> rotated,
                             const CoarseGrid& grid, const LaneKernels& kernels)
    : kernels_(&kernels), grid_(grid), lanes_(static_cast<std::size_t>(kernels.lanes)) {
  for (const Eigen::MatrixXf* fragment : rotated) frames_.push_back(fragment->cols());
  for (std::size_t n = 0; n < rotated.size(); n += lanes_) {
    groups_.push_back(group_of(rotated.subspan(n, std::min(lanes_, rotated.size() - n))));
    most_boxes_ = std::max(most_boxes_, groups_.back().box_count);
  }
}

FragmentBoxes::Group FragmentBoxes::group_of(
    std::span<const Eigen::MatrixXf* const> rotated) const {
  std::vector<Eigen::MatrixXi> boxes;
  for (const Eigen::MatrixXf* fragment : rotated) boxes.push_back(boxes_of(*fragment, grid_));
  Group group;
  for (const Eigen::MatrixXi& of_lane : boxes)
    group.box_count = std::max(group.box_count, static_cast<int>(of_lane.cols()));
  const auto height = static_cast<std::size_t>(boxes[0].rows());
  const auto count = static_cast<std::size_t>(group.box_count);
  group.boxes = AlignedArray<int>(count * height * lanes_);
  group.frames = AlignedArray<int>(count * lanes_);
  for (std::size_t l = 0; l < boxes.size(); ++l) {
    for (std::size_t n = 0; n < count; ++n) {
      const int* box = boxes[l].col(std::min(static_cast<Index>(n), boxes[l].cols() - 1)).data();
      for (std::size_t k = 0; k < height; ++k) {
        group.boxes[(n * height + k) * lanes_ + l] = box[k];
      }
      group.frames[n * lanes_ + l] = frames_in_box(static_cast<int>(n), rotated[l]->cols());
    }
  }
  return group;
}

BoxBounds::BoxBounds(const FragmentBoxes& fragments, const Eigen::MatrixXf& rotated)
    : fragments_(fragments),
      lanes_(fragments.lanes_),
      strip_(kStripBands * lanes_),
      rows_(rotated.cols()),
      boxes_(boxes_of(rotated, fragments.grid_)),
      row_sums_((static_cast<std::size_t>(rows_) + strip_ - 1) / strip_ * strip_),
      frame_sums_(
          static_cast<std::size_t>(fragments.most_boxes_ * kBoxFrames + 2 * kFramePadding)) {
  const auto most = static_cast<std::size_t>(fragments.most_boxes_);
  const auto rows = static_cast<std::size_t>(boxes_.cols());
  const std::size_t bands = (static_cast<std::size_t>(rows_) + lanes_ - 1) / lanes_;
  distances_ = AlignedArray<float>(rows * most * lanes_);
  row_least_ = AlignedArray<float>(rows * lanes_);
  row_frames_ = AlignedArray<int>(rows * lanes_);
  for (std::size_t n = 0; n < rows; ++n) {
    std::fill_n(row_frames_.data() + n * lanes_, lanes_, frames_in_box(static_cast<int>(n), rows_));
  }
  box_least_ = AlignedArray<float>(most * lanes_);
  rest_by_rows_ = AlignedArray<float>((bands + 1) * most * lanes_);
  path_ = AlignedArray<float>(rows * lanes_);
  ends_ = AlignedArray<float>(most * lanes_);
}

void BoxBounds::fill(std::size_t group, float limit) {
  group_ = group;
  const FragmentBoxes::Group& boxes = fragments_.groups_[group];
  const LaneKernels& kernels = *fragments_.kernels_;
  const auto rows = static_cast<int>(boxes_.cols());
  kernels.box_distances(boxes_.data(), rows, boxes.boxes.data(), boxes.box_count,
                        static_cast<int>(boxes_.rows() / 2), fragments_.grid_.unit(),
                        distances_.data(), row_least_.data(), box_least_.data());
  kernels.rest_by_rows(distances_.data(), static_cast<int>(rows_), boxes.box_count,
                       rest_by_rows_.data());
  kernels.path_by_boxes(distances_.data(), boxes.frames.data(), rows, boxes.box_count, path_.data(),
                        ends_.data());
  fill_beyond(limit);
}

// By the cheapest paths through the boxes.
void BoxBounds::fill_beyond(float limit) {
  const LaneKernels& kernels = *fragments_.kernels_;
  const FragmentBoxes::Group& boxes = fragments_.groups_[group_];
  float rows_below[kMostLanes];
  float frames_below[kMostLanes];
  kernels.sums_below(row_least_.data(), row_frames_.data(), static_cast<int>(boxes_.cols()), limit,
                     rows_below);
  kernels.sums_below(box_least_.data(), boxes.frames.data(), boxes.box_count, limit, frames_below);
  const std::size_t first = group_ * lanes_;
  for (std::size_t l = 0; l < std::min(lanes_, fragments_.frames_.size() - first); ++l) {
    const Index frames = fragments_.frames_[first + l];
    const auto last = static_cast<std::size_t>(box_count_for(frames) - 1);
    const float by_rows = rest_by_rows_[l] - limit * static_cast<float>(rows_) + frames_below[l];
    const float by_boxes =
        ends_[last * lanes_ + l] - limit * static_cast<float>(frames) + rows_below[l];
    beyond_[l] = std::max(by_rows, by_boxes);
  }
}

void BoxBounds::fill_rest(std::size_t lane, float limit) {
  lane_ = lane;
  limit_ = limit;
  const Index frames = fragments_.frames_[group_ * lanes_ + lane];
  frame_sums_.fill(box_least_.data() + lane, lanes_, frames, limit, kFramePadding);
  row_sums_.fill(row_least_.data() + lane, lanes_, rows_, limit, 0);
  std::reverse(row_sums_.all.begin(), row_sums_.all.end());
  std::reverse(row_sums_.extra.begin(), row_sums_.extra.end());
}

RestOfPath BoxBounds::rest(int n) const {
  const std::size_t begin = static_cast<std::size_t>(n) * strip_;
  const std::size_t end = std::min(begin + strip_, static_cast<std::size_t>(rows_));
  const std::size_t last = row_sums_.all.size() - begin - strip_;
  const std::size_t bands = (end + lanes_ - 1) / lanes_;
  const auto box_count = static_cast<std::size_t>(fragments_.groups_[group_].box_count);
  return {frame_sums_.all.data() + kFramePadding,
          frame_sums_.extra.data() + kFramePadding,
          row_sums_.all.data() + last,
          row_sums_.extra.data() + last,
          rest_by_rows_.data() + bands * box_count * lanes_ + lane_,
          -limit_ * static_cast<float>(static_cast<std::size_t>(rows_) - end)};
}

// Frame 0 at `first`. Behind the last one there is no path.
void BoxBounds::Sums::fill(const float* least, std::size_t lanes, Index count, float limit,
                           Index first) {
  float all_behind = 0.0F;
  float extra_behind = 0.0F;
  for (int b = box_count_for(count) - 1; b >= 0; --b) {
    const int held = frames_in_box(b, count);
    const float beyond = least[static_cast<std::size_t>(b) * lanes] - limit;
    const float below = std::min(0.0F, beyond);
    float* to_all = all.data() + first + b * kBoxFrames;
    float* to_extra = extra.data() + first + b * kBoxFrames;
    for (int q = 0; q < kBoxFrames; ++q) {
      to_all[q] = all_behind + static_cast<float>(held - 1 - q) * beyond;
      to_extra[q] = extra_behind + static_cast<float>(held - 1 - q) * below;
    }
    all_behind += static_cast<float>(held) * beyond;
    extra_behind += static_cast<float>(held) * below;
  }
  std::fill(all.begin() + first + count, all.end(), kUnreachable);
  std::fill(extra.begin() + first + count, extra.end(), kUnreachable);
}

}  // namespace laban::align
