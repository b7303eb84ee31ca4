#include "laban/align/nearest_fragments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "laban/base/error.h"

#include "align/lane_frames.h"
#include "align/local_distance.h"

namespace laban::align {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;

constexpr float kUnreachable = std::numeric_limits<float>::infinity();
// Leading coordinates that are bounded on their own by the boxes; the others are by their norm. Of
// joint angles 8 hold most of the variance, 21 nearly all.
constexpr Index kLeadingCoordinates = 21;
constexpr Index kScreenedCoordinates = 27;  // likewise, by screening: with the norm 14 pairs
static_assert(kScreenedCoordinates < CoarseGrid::kMostDimensions);
constexpr Index kMostAxisFrames = 20000;  // the axes need not be exact to be axes

int box_count_for(Index frames) {
  return static_cast<int>((frames + kBoxFrames - 1) / kBoxFrames);
}

// Frames of a sequence that its n-th box holds; none behind its end.
int frames_in_box(int n, Index frames) {
  return static_cast<int>(std::clamp<Index>(frames - n * kBoxFrames, 0, kBoxFrames));
}

// The principal axes of all fragments' frames as rows, by falling variance, orthonormal: distances
// stay, and the first coordinates hold most of them.
Eigen::MatrixXd principal_axes(std::span<const Eigen::MatrixXd> fragments,
                               const Eigen::VectorXd& center) {
  Index total = 0;
  for (const Eigen::MatrixXd& fragment : fragments) total += fragment.cols();
  const Index stride = 1 + total / kMostAxisFrames;
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(center.size(), center.size());
  for (const Eigen::MatrixXd& fragment : fragments) {
    const Index count = (fragment.cols() + stride - 1) / stride;
    const Eigen::MatrixXd some =
        fragment(Eigen::all, Eigen::seqN(0, count, stride)).colwise() - center;
    scatter.noalias() += some * some.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scatter);
  if (solver.info() != Eigen::Success)
    return Eigen::MatrixXd::Identity(center.size(), center.size());
  return solver.eigenvectors().rowwise().reverse().transpose();
}

// The norm of all coordinates but the leading ones, whose difference is at most the distance of
// these coordinates: beside the leading ones it bounds distances from below.
Eigen::RowVectorXf norm_behind(const Eigen::MatrixXf& rotated, Index leading) {
  return rotated.bottomRows(std::max<Index>(rotated.rows() - leading, 0)).colwise().norm();
}

// What screening looks at.
Eigen::MatrixXf screened(const Eigen::MatrixXf& rotated) {
  const Index leading = std::min(rotated.rows(), kScreenedCoordinates);
  Eigen::MatrixXf values(leading + 1, rotated.cols());
  values << rotated.topRows(leading), norm_behind(rotated, leading);
  return values;
}

// Leading coordinates at evenly spaced frames, a column: near outlines are mostly near sequences.
Eigen::VectorXf outline_of(const Eigen::MatrixXf& rotated) {
  constexpr Index kOutlineFrames = 8;
  const Index leading = std::min(rotated.rows(), kLeadingCoordinates);
  Eigen::VectorXf outline(leading * kOutlineFrames);
  for (Index n = 0; n < kOutlineFrames; ++n) {
    const Index frame = n * (rotated.cols() - 1) / (kOutlineFrames - 1);
    outline.segment(n * leading, leading) = rotated.col(frame).head(leading);
  }
  return outline;
}

// Lower bounds, then upper bounds, a column a box.
Eigen::MatrixXi boxes_of(const Eigen::MatrixXf& rotated, const CoarseGrid& grid) {
  const Index leading = std::min(rotated.rows(), kLeadingCoordinates);
  Eigen::MatrixXf values(leading + 1, rotated.cols());
  values << rotated.topRows(leading), norm_behind(rotated, leading);
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

// `lanes` fragments' boxes side by side. Behind a fragment's end its last box is repeated: a path
// that goes on there costs what it costs to stay.
struct BoxGroup {
  int box_count = 0;  // of the longest
  AlignedArray<int> boxes;
  AlignedArray<int> frames;  // box_count x lanes
};

BoxGroup box_group(std::span<const Eigen::MatrixXf* const> rotated, const CoarseGrid& grid,
                   std::size_t lanes) {
  std::vector<Eigen::MatrixXi> boxes;
  for (const Eigen::MatrixXf* fragment : rotated) boxes.push_back(boxes_of(*fragment, grid));
  BoxGroup group;
  for (const Eigen::MatrixXi& of_lane : boxes)
    group.box_count = std::max(group.box_count, static_cast<int>(of_lane.cols()));
  const auto height = static_cast<std::size_t>(boxes[0].rows());
  const auto count = static_cast<std::size_t>(group.box_count);
  group.boxes = AlignedArray<int>(count * height * lanes);
  group.frames = AlignedArray<int>(count * lanes);
  for (std::size_t l = 0; l < boxes.size(); ++l) {
    for (std::size_t n = 0; n < count; ++n) {
      const int* box = boxes[l].col(std::min(static_cast<Index>(n), boxes[l].cols() - 1)).data();
      for (std::size_t k = 0; k < height; ++k) {
        group.boxes[(n * height + k) * lanes + l] = box[k];
      }
      group.frames[n * lanes + l] = frames_in_box(static_cast<int>(n), rotated[l]->cols());
    }
  }
  return group;
}

void require_usable(int count, std::span<const int> candidates, std::size_t fragment_count) {
  if (count < 1) {
    throw Error(ErrorKind::kUsage, "nearest: count = " + std::to_string(count) + " (must be >= 1)");
  }
  for (const int fragment : candidates) {
    if (fragment >= 0 && static_cast<std::size_t>(fragment) < fragment_count) continue;
    throw Error(ErrorKind::kUsage, "nearest: candidate " + std::to_string(fragment) + " of " +
                                       std::to_string(fragment_count) + " fragments");
  }
}

// What a FragmentIndex keeps of its fragments.
struct PreparedFragments {
  const LaneKernels& kernels = lane_kernels();
  std::size_t lanes = static_cast<std::size_t>(kernels.lanes);
  std::span<const Eigen::MatrixXd> fragments;
  Scaling scaling;
  Eigen::MatrixXd axes;                     // D x D
  std::vector<Eigen::MatrixXf> rotated;     // one a fragment, scaled, for lanes
  std::vector<PackedFrames<float>> packed;  // the same for alignments one at a time
  CoarseGrid grid;
  std::vector<PackedFrames<int>> coarse;  // `screened`, on the grid
  Eigen::MatrixXf outlines;               // a column a fragment
  float largest_norm = 0.0F;              // squared, of all frames
  std::vector<BoxGroup> groups;           // fragments by falling length
  std::vector<int> order;                 // fragment at each place, group * lanes + lane
  std::vector<Index> frames_at;           // of the fragment at each place
  std::vector<std::size_t> place;         // of each fragment

  explicit PreparedFragments(std::span<const Eigen::MatrixXd> all) : fragments(all) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::string place_name = "nearest: fragment " + std::to_string(i);
      require_sequence(all[i], place_name);
      require_same_rows(all[i].rows(), all[0].rows(), place_name);
    }
    if (all.empty()) throw Error(ErrorKind::kData, "nearest: no fragment, at least one is needed");
    scaling = Scaling::of(all);
    axes = principal_axes(all, scaling.center);
    for (const Eigen::MatrixXd& fragment : all) {
      rotated.push_back(rotate(fragment, scaling));
      packed.emplace_back(fine_frames(rotated.back()));
      largest_norm = std::max(largest_norm, rotated.back().colwise().squaredNorm().maxCoeff());
    }
    grid = CoarseGrid(std::sqrt(largest_norm));
    for (const Eigen::MatrixXf& fragment : rotated)
      coarse.emplace_back(grid.frames(screened(fragment)));
    outlines.resize(outline_of(rotated[0]).size(), static_cast<Index>(rotated.size()));
    for (std::size_t i = 0; i < rotated.size(); ++i)
      outlines.col(static_cast<Index>(i)) = outline_of(rotated[i]);
    add_groups();
  }

  [[nodiscard]] Eigen::MatrixXf rotate(const Eigen::Ref<const Eigen::MatrixXd>& sequence,
                                       const Scaling& scale) const {
    return (axes * ((sequence.colwise() - scale.center) * scale.factor)).cast<float>();
  }

  void add_groups() {
    order = longest_first(fragments);
    place.resize(order.size());
    std::vector<const Eigen::MatrixXf*> group;
    for (std::size_t n = 0; n < order.size(); ++n) {
      const auto i = static_cast<std::size_t>(order[n]);
      place[i] = n;
      frames_at.push_back(fragments[i].cols());
      group.push_back(&rotated[i]);
      if (group.size() < lanes && n + 1 < order.size()) continue;
      groups.push_back(box_group(group, grid, lanes));
      group.clear();
    }
  }
};

// Lower bounds of what an alignment of N query frames with M fragment frames costs beyond `limit` a
// cell. A path has a cell a query frame at least, and each further cell is the first of a fragment
// frame (and the other way round). So it costs more than `limit` a cell if
//
//   sum over frames p of (d(p, .) - limit) + sum over frames q of min(0, d(., q) - limit) > 0,
//
// where the first sum is at least the cheapest monotone path's through the boxes. The greater of
// both ways round counts. The same holds of what is left of a path behind a cell.
struct BoxBound {
  // Sums of d(p, .), likewise, behind each strip of `lanes` rows: LaneKernels::rest_by_rows.
  const float* rest_by_rows = nullptr;
  std::size_t box_count = 0;
  // d(p, .) of each box of rows and d(., q) of each of the fragment's boxes, `lanes` apart.
  const float* row_least = nullptr;
  const float* box_least = nullptr;
  std::size_t lanes = 0;
  Index rows = 0;
  Index frames = 0;

  [[nodiscard]] float of_row(Index p) const {
    return row_least[static_cast<std::size_t>(p / kBoxFrames) * lanes];
  }
  [[nodiscard]] float of_frame(Index q) const {
    return box_least[static_cast<std::size_t>(q / kBoxFrames) * lanes];
  }
};

// The bounds of a group's fragments with one query.
class BoxBounds {
 public:
  BoxBounds(const PreparedFragments& data, const Eigen::MatrixXf& rotated)
      : data_(data), rows_(rotated.cols()), boxes_(boxes_of(rotated, data.grid)) {
    std::size_t most = 0;
    for (const BoxGroup& group : data.groups)
      most = std::max(most, static_cast<std::size_t>(group.box_count));
    const auto rows = static_cast<std::size_t>(boxes_.cols());
    const std::size_t strips = (static_cast<std::size_t>(rows_) + data.lanes - 1) / data.lanes;
    distances_ = AlignedArray<float>(rows * most * data.lanes);
    row_least_ = AlignedArray<float>(rows * data.lanes);
    row_frames_ = AlignedArray<int>(rows * data.lanes);
    for (std::size_t n = 0; n < rows; ++n) {
      std::fill_n(row_frames_.data() + n * data.lanes, data.lanes,
                  frames_in_box(static_cast<int>(n), rows_));
    }
    box_least_ = AlignedArray<float>(most * data.lanes);
    rest_ = AlignedArray<float>((strips + 1) * most * data.lanes);
    path_ = AlignedArray<float>(rows * data.lanes);
    ends_ = AlignedArray<float>(most * data.lanes);
  }

  // Until it is called again, `of` and `beyond` are about this group, `beyond` about `limit`.
  void fill(std::size_t group, float limit) {
    group_ = group;
    const BoxGroup& boxes = data_.groups[group];
    const LaneKernels& kernels = data_.kernels;
    const auto rows = static_cast<int>(boxes_.cols());
    kernels.box_distances(boxes_.data(), rows, boxes.boxes.data(), boxes.box_count,
                          static_cast<int>(boxes_.rows() / 2), data_.grid.unit(), distances_.data(),
                          row_least_.data(), box_least_.data());
    kernels.rest_by_rows(distances_.data(), static_cast<int>(rows_), boxes.box_count, rest_.data());
    kernels.path_by_boxes(distances_.data(), boxes.frames.data(), rows, boxes.box_count,
                          path_.data(), ends_.data());
    fill_beyond(limit);
  }

  [[nodiscard]] float beyond(std::size_t lane) const { return beyond_[lane]; }

  [[nodiscard]] BoxBound of(std::size_t lane) const {
    BoxBound bound;
    bound.rows = rows_;
    bound.frames = data_.frames_at[group_ * data_.lanes + lane];
    bound.rest_by_rows = rest_.data() + lane;
    bound.box_count = static_cast<std::size_t>(data_.groups[group_].box_count);
    bound.row_least = row_least_.data() + lane;
    bound.box_least = box_least_.data() + lane;
    bound.lanes = data_.lanes;
    return bound;
  }

 private:
  // By the cheapest paths through the boxes.
  void fill_beyond(float limit) {
    const LaneKernels& kernels = data_.kernels;
    const BoxGroup& boxes = data_.groups[group_];
    float rows_below[kMostLanes];
    float frames_below[kMostLanes];
    kernels.sums_below(row_least_.data(), row_frames_.data(), static_cast<int>(boxes_.cols()),
                       limit, rows_below);
    kernels.sums_below(box_least_.data(), boxes.frames.data(), boxes.box_count, limit,
                       frames_below);
    const std::size_t first = group_ * data_.lanes;
    for (std::size_t l = 0; l < std::min(data_.lanes, data_.order.size() - first); ++l) {
      const Index frames = data_.frames_at[first + l];
      const auto last = static_cast<std::size_t>(box_count_for(frames) - 1);
      const float by_rows = rest_[l] - limit * static_cast<float>(rows_) + frames_below[l];
      const float by_boxes =
          ends_[last * data_.lanes + l] - limit * static_cast<float>(frames) + rows_below[l];
      beyond_[l] = std::max(by_rows, by_boxes);
    }
  }

  const PreparedFragments& data_;
  Index rows_;
  Eigen::MatrixXi boxes_;  // of the query
  std::array<float, kMostLanes> beyond_ = {};
  AlignedArray<int> row_frames_;  // of the query's boxes, the same in all lanes
  std::size_t group_ = 0;
  // As LaneKernels names them.
  AlignedArray<float> distances_;
  AlignedArray<float> row_least_;
  AlignedArray<float> box_least_;
  AlignedArray<float> rest_;
  AlignedArray<float> path_;
  AlignedArray<float> ends_;
};

// What is left of paths behind each frame of a query and a fragment (RestOfPath).
class Rest {
 public:
  Rest(Index rows, Index most_frames, std::size_t lanes)
      : lanes_(lanes),
        rows_((static_cast<std::size_t>(rows) + lanes - 1) / lanes * lanes),
        rows_extra_(rows_),
        frames_(static_cast<std::size_t>(most_frames + 2 * kFramePadding)),
        frames_extra_(frames_) {}

  void fill(const BoxBound& bound, float limit) {
    bound_ = bound;
    limit_ = limit;
    const Sum end;
    std::fill(rows_.begin(), rows_.end(), kUnreachable);
    std::fill(rows_extra_.begin(), rows_extra_.end(), kUnreachable);
    Sum sum = end;
    for (Index p = bound.rows - 1; p >= 0; --p) {
      const auto cell = static_cast<std::size_t>(p) / lanes_ * lanes_ +
                        (lanes_ - 1 - static_cast<std::size_t>(p) % lanes_);
      rows_[cell] = sum.all;
      rows_extra_[cell] = sum.extra;
      sum.add(bound.of_row(p) - limit);
    }
    sum = end;
    const Index behind = bound.frames + kFramePadding;
    std::fill(frames_.begin() + behind, frames_.begin() + behind + kFramePadding, kUnreachable);
    std::fill(frames_extra_.begin() + behind, frames_extra_.begin() + behind + kFramePadding,
              kUnreachable);
    for (Index q = bound.frames - 1; q >= 0; --q) {
      const auto cell = static_cast<std::size_t>(q + kFramePadding);
      frames_[cell] = sum.all;
      frames_extra_[cell] = sum.extra;
      sum.add(bound.of_frame(q) - limit);
    }
  }

  // For the rows of strip n.
  [[nodiscard]] RestOfPath view(int n) const {
    const std::size_t first = static_cast<std::size_t>(n) * lanes_;
    const Index behind = std::max<Index>(bound_.rows - (n + 1) * static_cast<Index>(lanes_), 0);
    return {frames_.data() + kFramePadding,
            frames_extra_.data() + kFramePadding,
            rows_.data() + first,
            rows_extra_.data() + first,
            bound_.rest_by_rows + static_cast<std::size_t>(n + 1) * bound_.box_count * lanes_,
            -limit_ * static_cast<float>(behind)};
  }

 private:
  struct Sum {
    float all = 0.0F;
    float extra = 0.0F;
    void add(float beyond) {
      all += beyond;
      extra += std::min(0.0F, beyond);
    }
  };
  std::size_t lanes_;
  BoxBound bound_;
  float limit_ = 0.0F;
  std::vector<float> rows_;
  std::vector<float> rows_extra_;
  std::vector<float> frames_;
  std::vector<float> frames_extra_;
};

}  // namespace

struct FragmentIndex::Data : PreparedFragments {
  using PreparedFragments::PreparedFragments;
};

// One query.
class FragmentIndex::Search {
 public:
  Search(const Data& data, const Eigen::Ref<const Eigen::MatrixXd>& features, int count)
      : data_(data),
        rotated_(data.rotate(features, data.scaling)),
        rows_(rotated_, data.kernels),
        strips_(fine_frames(rotated_), -2.0F, data.kernels),
        coarse_strips_(data.grid.frames(screened(rotated_)), data.grid.factor(), data.kernels),
        count_(static_cast<std::size_t>(count)),
        rounding_(data.grid.rounding(
            1 + static_cast<int>(std::min(rotated_.rows(), kScreenedCoordinates)))),
        slack_(1e-6F * (data.largest_norm + rotated_.colwise().squaredNorm().maxCoeff())) {}

  void run_all(std::vector<int> candidates) {
    std::sort(candidates.begin(), candidates.end(), [&](int a, int b) {
      return frames_of(a) != frames_of(b) ? frames_of(a) > frames_of(b) : a < b;
    });
    for (std::size_t n = 0; n < candidates.size(); n += data_.lanes) align(group(candidates, n));
  }

  // Those first whose outlines are nearest, so that the limit is near the last one early; any order
  // is right.
  void run_pruned(std::vector<int> candidates) {
    fill_keys(candidates);
    const std::size_t begin = std::min(seed_count(candidates.size()), candidates.size());
    std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(begin),
                      candidates.end(), [&](int a, int b) { return is_before(a, b); });
    run_all({candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(begin)});
    const std::span<const int> others = std::span(candidates).subspan(begin);
    if (others.empty()) return;
    Rest rest(rotated_.cols(), longest(others), data_.lanes);
    costs_ = AlignedArray<float>(static_cast<std::size_t>(longest(others) + 2 * kFramePadding));
    BoxBounds bounds(data_, rotated_);
    std::vector<int> left;
    for (const std::vector<int>& one : by_group(others)) {
      bounds.fill(place(one[0]) / data_.lanes, limit());
      for (const int i : one) {
        const std::size_t lane = place(i) % data_.lanes;
        if (bounds.beyond(lane) > 0.0F) continue;
        if (!may_be_near(i, bounds.of(lane), limit(), rest)) continue;
        left.push_back(i);
        if (left.size() < data_.lanes) continue;
        align(left);
        left.clear();
      }
    }
    if (!left.empty()) align(left);
  }

  // Of the fragments, beside which all coordinates were compared, times those of the query.
  [[nodiscard]] double cells() const { return cells_; }

  // The nearest of what was aligned to the end.
  [[nodiscard]] std::vector<Neighbor> nearest() {
    std::sort(aligned_.begin(), aligned_.end(), [](const Neighbor& a, const Neighbor& b) {
      return a.mean_cost != b.mean_cost ? a.mean_cost < b.mean_cost : a.fragment < b.fragment;
    });
    aligned_.resize(std::min(aligned_.size(), count_));
    return aligned_;
  }

 private:
  [[nodiscard]] Index frames_of(int fragment) const {
    return data_.fragments[static_cast<std::size_t>(fragment)].cols();
  }
  [[nodiscard]] Index longest(std::span<const int> fragments) const {
    Index most = 0;
    for (const int i : fragments) most = std::max(most, frames_of(i));
    return most;
  }

  // No fragment of a dearer mean cell is among the nearest `count`, single precision included.
  [[nodiscard]] float limit() const {
    if (best_.size() < count_) return kUnreachable;
    return best_.back() * (1.0F + 1e-5F) + slack_;
  }

  // How many are aligned before anything is left out: of many a few groups.
  [[nodiscard]] std::size_t seed_count(std::size_t candidate_count) const {
    const std::size_t groups = std::clamp<std::size_t>(candidate_count / (12 * data_.lanes), 1, 3);
    return std::max(count_, groups * data_.lanes);
  }

  [[nodiscard]] std::span<const int> group(std::span<const int> fragments,
                                           std::size_t begin) const {
    return fragments.subspan(begin, std::min(data_.lanes, fragments.size() - begin));
  }

  [[nodiscard]] std::size_t place(int fragment) const {
    return data_.place[static_cast<std::size_t>(fragment)];
  }

  void fill_keys(std::span<const int> candidates) {
    keys_.resize(data_.fragments.size());
    const Eigen::VectorXf outline = outline_of(rotated_);
    for (const int i : candidates)
      keys_[static_cast<std::size_t>(i)] = (data_.outlines.col(i) - outline).squaredNorm();
  }

  [[nodiscard]] bool is_before(int a, int b) const {
    const float key_a = keys_[static_cast<std::size_t>(a)];
    const float key_b = keys_[static_cast<std::size_t>(b)];
    return key_a != key_b ? key_a < key_b : a < b;
  }

  // The candidates that share lanes, side by side; first the groups with the nearest outlines.
  [[nodiscard]] std::vector<std::vector<int>> by_group(std::span<const int> candidates) const {
    std::vector<std::vector<int>> groups(data_.groups.size());
    for (const int i : candidates) groups[place(i) / data_.lanes].push_back(i);
    std::erase_if(groups, [](const std::vector<int>& one) { return one.empty(); });
    const auto before = [&](int a, int b) { return is_before(a, b); };
    for (std::vector<int>& one : groups)
      std::iter_swap(one.begin(), std::min_element(one.begin(), one.end(), before));
    std::sort(groups.begin(), groups.end(),
              [&](const auto& a, const auto& b) { return before(a[0], b[0]); });
    return groups;
  }

  // Whether a path costs `most` a cell or less: by the leading coordinates, a fraction of the work,
  // then by all of them.
  //
  // On the grid distances d are at most (sqrt(d) + r)^2, r what rounding adds. For each r' in (0,
  // 1) that is at most d / (1 - r') + r^2 / r', and with r' = r / (sqrt(most) + r): a path that
  // costs `most` a cell or less costs (sqrt(most) + r)^2 or less there.
  [[nodiscard]] bool may_be_near(int fragment, const BoxBound& bound, float most, Rest& rest) {
    const auto n = static_cast<std::size_t>(fragment);
    const float root = std::sqrt(most) + rounding_;
    const float most_on_grid = root * root;
    rest.fill(bound, most_on_grid);
    if (!has_path(coarse_strips_, data_.coarse[n].view(), data_.kernels.coarse_excess_strip, rest,
                  most_on_grid))
      return false;
    rest.fill(bound, most);
    if (has_path(strips_, data_.packed[n].view(), data_.kernels.excess_strip, rest, most))
      return true;
    cells_ += static_cast<double>(rotated_.cols()) * static_cast<double>(frames_of(fragment));
    return false;
  }

  template <typename Value, typename Strip>
  [[nodiscard]] bool has_path(const PackedStrips<Value>& strips, const FrameRows<Value>& frames,
                              Strip excess_strip, const Rest& rest, float most) {
    float* cost = costs_.data() + kFramePadding;
    std::fill_n(costs_.data(), frames.count + 2 * kFramePadding, kUnreachable);
    cost[-1] = 0.0F;
    FrameRange live = {0, 0};
    for (int n = 0; n < strips.count(); ++n) {
      live = excess_strip(strips.view(n), frames, most, rest.view(n), live, cost);
      if (live.begin >= live.end) return false;
    }
    return live.end == frames.count;
  }

  void align(std::span<const int> fragments) {
    std::vector<const Eigen::MatrixXf*> side_by_side;
    for (const int i : fragments)
      side_by_side.push_back(&data_.rotated[static_cast<std::size_t>(i)]);
    const PackedLanes lanes(side_by_side, data_.kernels);
    const std::array<bool, kMostLanes> swapped = {};
    LaneDtw dtw(data_.kernels, lanes.frame_count());
    dtw.begin(rows_, lanes, swapped.data());
    while (dtw.advance()) {
    }
    for (std::size_t l = 0; l < fragments.size(); ++l) {
      const Index frames = frames_of(fragments[l]);
      cells_ += static_cast<double>(rotated_.cols()) * static_cast<double>(frames);
      const int last = static_cast<int>(frames) - 1;
      const auto lane = static_cast<int>(l);
      insert(fragments[l], dtw.cost(lane, last), dtw.length(lane, last));
    }
  }

  void insert(int fragment, float cost, int length) {
    const double whole = data_.scaling.unscaled_cost(cost);
    aligned_.push_back({fragment, whole, whole / length});
    const float mean_cost = cost / static_cast<float>(length);
    best_.insert(std::upper_bound(best_.begin(), best_.end(), mean_cost), mean_cost);
    if (best_.size() > count_) best_.pop_back();
  }

  const Data& data_;
  Eigen::MatrixXf rotated_;
  PackedRows rows_;
  PackedStrips<float> strips_;
  PackedStrips<int> coarse_strips_;  // `screened`
  std::size_t count_;
  float rounding_;             // what the grid adds to a distance
  float slack_;                // what single precision may be wrong by, a cell
  std::vector<float> keys_;    // what candidates are sorted by
  AlignedArray<float> costs_;  // of has_path
  std::vector<float> best_;    // the least mean costs so far, at most count_
  std::vector<Neighbor> aligned_;
  double cells_ = 0.0;
};

FragmentIndex::FragmentIndex(std::span<const Eigen::MatrixXd> fragments)
    : data_(std::make_unique<const Data>(fragments)) {}
FragmentIndex::~FragmentIndex() = default;
FragmentIndex::FragmentIndex(FragmentIndex&&) noexcept = default;
FragmentIndex& FragmentIndex::operator=(FragmentIndex&&) noexcept = default;

NearestFragments FragmentIndex::nearest(const Eigen::Ref<const Eigen::MatrixXd>& features,
                                        int count, std::span<const int> candidates,
                                        const NearestOptions& options) const {
  require_usable(count, candidates, data_->fragments.size());
  require_sequence(features, "nearest: features");
  require_same_rows(features.rows(), data_->fragments[0].rows(), "nearest: features");
  std::vector<int> all(candidates.begin(), candidates.end());
  if (all.empty()) {
    all.resize(data_->fragments.size());
    std::iota(all.begin(), all.end(), 0);
  }
  double frames = 0.0;
  for (const int i : all) {
    frames += static_cast<double>(data_->fragments[static_cast<std::size_t>(i)].cols());
  }
  Search search(*data_, features, count);
  if (options.prune) {
    search.run_pruned(std::move(all));
  } else {
    search.run_all(std::move(all));
  }
  return {search.nearest(), 1.0 - search.cells() / (frames * static_cast<double>(features.cols()))};
}

std::vector<Neighbor> nearest(const Eigen::Ref<const Eigen::MatrixXd>& features,
                              std::span<const Eigen::MatrixXd> fragments, int count,
                              std::span<const int> candidates) {
  return FragmentIndex(fragments).nearest(features, count, candidates).neighbors;
}

}  // namespace laban::align
