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

// Leading coordinates amid each box: sketches are aligned in a hundredth of the time, and those of
// near sequences are near.
Eigen::MatrixXf sketch_of(const Eigen::MatrixXf& rotated) {
  const Index leading = std::min(rotated.rows(), kLeadingCoordinates);
  Eigen::MatrixXf sketch(leading, box_count_for(rotated.cols()));
  for (Index n = 0; n < sketch.cols(); ++n) {
    const Index frame = std::min(n * kBoxFrames + kBoxFrames / 2, rotated.cols() - 1);
    sketch.col(n) = rotated.col(frame).head(leading);
  }
  return sketch;
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
  Eigen::MatrixXd axes;                  // D x D
  std::vector<Eigen::MatrixXf> rotated;  // one a fragment, scaled
  CoarseGrid grid;
  std::vector<Eigen::MatrixXf> sketches;
  Eigen::MatrixXf outlines;          // a column a fragment
  float largest_norm = 0.0F;         // squared, of all frames
  std::vector<BoxGroup> groups;      // fragments by falling length
  std::vector<int> order;            // fragment at each place, group * lanes + lane
  std::vector<Index> frames_at;      // of the fragment at each place
  std::vector<PackedFrames> coarse;  // likewise, `screened`, on the grid
  std::vector<std::size_t> place;    // of each fragment

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
      largest_norm = std::max(largest_norm, rotated.back().colwise().squaredNorm().maxCoeff());
    }
    grid = CoarseGrid(std::sqrt(largest_norm));
    outlines.resize(outline_of(rotated[0]).size(), static_cast<Index>(rotated.size()));
    for (std::size_t i = 0; i < rotated.size(); ++i) {
      outlines.col(static_cast<Index>(i)) = outline_of(rotated[i]);
      sketches.push_back(sketch_of(rotated[i]));
    }
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
      coarse.emplace_back(grid.frames(screened(rotated[i])));
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
        strip_(kStripBands * lanes),
        rows_((static_cast<std::size_t>(rows) + strip_ - 1) / strip_ * strip_),
        frames_(static_cast<std::size_t>(most_frames + 2 * kFramePadding)) {}

  void fill(const BoxBound& bound, float limit) {
    bound_ = bound;
    limit_ = limit;
    frames_.fill(bound.box_least, lanes_, bound.frames, limit, kFramePadding);
    rows_.fill(bound.row_least, lanes_, bound.rows, limit, 0);
    std::reverse(rows_.all.begin(), rows_.all.end());
    std::reverse(rows_.extra.begin(), rows_.extra.end());
  }

  // For the rows of strip n.
  [[nodiscard]] RestOfPath view(int n) const {
    const std::size_t begin = static_cast<std::size_t>(n) * strip_;
    const std::size_t end = std::min(begin + strip_, static_cast<std::size_t>(bound_.rows));
    const std::size_t behind = static_cast<std::size_t>(bound_.rows) - end;
    const std::size_t last = rows_.all.size() - begin - strip_;
    return {frames_.all.data() + kFramePadding,
            frames_.extra.data() + kFramePadding,
            rows_.all.data() + last,
            rows_.extra.data() + last,
            bound_.rest_by_rows + (end + lanes_ - 1) / lanes_ * bound_.box_count * lanes_,
            -limit_ * static_cast<float>(behind)};
  }

 private:
  // Of each frame of a sequence, over all behind it: sums of least distances less the limit, and of
  // those below 0.
  struct Sums {
    explicit Sums(std::size_t size) : all(size + kBoxFrames), extra(all.size()) {}

    // Frame 0 at `first`. Behind the last one there is no path.
    void fill(const float* least, std::size_t lanes, Index count, float limit, Index first) {
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

    std::vector<float> all;
    std::vector<float> extra;
  };

  std::size_t lanes_;
  std::size_t strip_;  // rows of one
  BoxBound bound_;
  float limit_ = 0.0F;
  Sums rows_;  // the last row first
  Sums frames_;
};

struct PathCost {
  float cost = 0.0F;
  int length = 0;
  [[nodiscard]] float mean() const { return cost / static_cast<float>(length); }
};

// Of the alignments of a sequence with at most `lanes` others, side by side.
std::vector<PathCost> path_costs(const PackedRows& rows,
                                 std::span<const Eigen::MatrixXf* const> sequences,
                                 const LaneKernels& kernels) {
  const PackedLanes lanes(sequences, kernels);
  const std::array<bool, kMostLanes> swapped = {};
  LaneDtw dtw(kernels, lanes.frame_count());
  dtw.begin(rows, lanes, swapped.data());
  while (dtw.advance()) {
  }
  std::vector<PathCost> costs;
  for (std::size_t l = 0; l < sequences.size(); ++l) {
    const int last = static_cast<int>(sequences[l]->cols()) - 1;
    const auto lane = static_cast<int>(l);
    costs.push_back({dtw.cost(lane, last), dtw.length(lane, last)});
  }
  return costs;
}

// A fragment and how far it is likely to be; the lowest index first of equally far ones.
struct Likely {
  float distance = 0.0F;
  int fragment = 0;
  [[nodiscard]] friend auto operator<=>(const Likely&, const Likely&) = default;
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
        strips_(data.grid.frames(screened(rotated_)), data.grid.factor(), data.kernels),
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

  // Those first that are likely to be nearest, so that the limit is near the last one early; any
  // order is right.
  void run_pruned(std::vector<int> candidates) {
    const std::size_t seeds = move_likely_first(candidates);
    run_all({candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(seeds)});
    const std::span<const int> others = std::span(candidates).subspan(seeds);
    if (others.empty()) return;
    Rest rest(rotated_.cols(), longest(others), data_.lanes);
    costs_ = AlignedArray<float>(static_cast<std::size_t>(longest(others) + 2 * kFramePadding));
    BoxBounds bounds(data_, rotated_);
    std::vector<int> left;
    const std::vector<std::size_t> places = places_of(others);
    for (auto begin = places.begin(); begin != places.end();) {
      const std::size_t group = *begin / data_.lanes;
      const auto end = std::partition_point(
          begin, places.end(), [&](std::size_t place) { return place / data_.lanes == group; });
      bounds.fill(group, limit());
      for (const std::size_t place : within(bounds, {begin, end})) {
        if (!may_be_near(place, bounds.of(place % data_.lanes), rest)) continue;
        left.push_back(data_.order[place]);
        if (left.size() < data_.lanes) continue;
        align(left);
        left.clear();
      }
      begin = end;
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

  [[nodiscard]] std::span<const int> group(std::span<const int> fragments,
                                           std::size_t begin) const {
    return fragments.subspan(begin, std::min(data_.lanes, fragments.size() - begin));
  }

  // Of the candidates whose outlines are nearest those whose sketches are.
  // @returns how many they are: at least `count` if there are as many.
  [[nodiscard]] std::size_t move_likely_first(std::vector<int>& candidates) const {
    constexpr std::size_t kSketchedGroups = 12;
    const std::size_t groups = std::max<std::size_t>((count_ + data_.lanes - 1) / data_.lanes, 2);
    const std::size_t seeds = std::min(groups * data_.lanes, candidates.size());
    const std::size_t sketched =
        std::min(std::max(groups, kSketchedGroups) * data_.lanes, candidates.size());
    std::vector<Likely> likely = by_outline(candidates);
    const auto end_of = [&](std::size_t n) {
      return likely.begin() + static_cast<std::ptrdiff_t>(n);
    };
    std::nth_element(likely.begin(), end_of(sketched), likely.end());
    look_at_sketches(std::span(likely).first(sketched));
    std::nth_element(likely.begin(), end_of(seeds), end_of(sketched));
    std::transform(likely.begin(), likely.end(), candidates.begin(),
                   [](const Likely& one) { return one.fragment; });
    return seeds;
  }

  [[nodiscard]] std::vector<Likely> by_outline(std::span<const int> candidates) const {
    const Eigen::VectorXf outline = outline_of(rotated_);
    std::vector<Likely> likely;
    likely.reserve(candidates.size());
    for (const int i : candidates)
      likely.push_back({(data_.outlines.col(i) - outline).squaredNorm(), i});
    return likely;
  }

  void look_at_sketches(std::span<Likely> likely) const {
    const PackedRows rows(sketch_of(rotated_), data_.kernels);
    for (std::size_t n = 0; n < likely.size(); n += data_.lanes) {
      const std::span<Likely> some = likely.subspan(n, std::min(data_.lanes, likely.size() - n));
      std::vector<const Eigen::MatrixXf*> side_by_side;
      for (const Likely& one : some)
        side_by_side.push_back(&data_.sketches[static_cast<std::size_t>(one.fragment)]);
      const std::vector<PathCost> costs = path_costs(rows, side_by_side, data_.kernels);
      for (std::size_t l = 0; l < some.size(); ++l) some[l].distance = costs[l].mean();
    }
  }

  // In order, so that those that share lanes are side by side.
  [[nodiscard]] std::vector<std::size_t> places_of(std::span<const int> candidates) const {
    std::vector<char> is_candidate(data_.order.size());
    for (const int i : candidates) is_candidate[data_.place[static_cast<std::size_t>(i)]] = 1;
    std::vector<std::size_t> places;
    places.reserve(candidates.size());
    for (std::size_t place = 0; place < is_candidate.size(); ++place)
      if (is_candidate[place] != 0) places.push_back(place);
    return places;
  }

  // Those of a group that its bounds let through. They are soon read from memory.
  [[nodiscard]] std::vector<std::size_t> within(const BoxBounds& bounds,
                                                std::span<const std::size_t> places) const {
    std::vector<std::size_t> some;
    for (const std::size_t place : places) {
      if (bounds.beyond(place % data_.lanes) > 0.0F) continue;
      some.push_back(place);
      data_.coarse[place].prefetch();
    }
    return some;
  }

  // Whether a path costs the limit a cell or less by the leading coordinates on the grid.
  //
  // There distances d are at most (sqrt(d) + r)^2, r what rounding adds. For each r' in (0, 1) that
  // is at most d / (1 - r') + r^2 / r', and with r' = r / (sqrt(limit) + r): a path that costs the
  // limit a cell or less costs (sqrt(limit) + r)^2 or less on the grid.
  [[nodiscard]] bool may_be_near(std::size_t place, const BoxBound& bound, Rest& rest) {
    const float root = std::sqrt(limit()) + rounding_;
    const float most = root * root;
    rest.fill(bound, most);
    const FrameRows frames = data_.coarse[place].view();
    float* cost = costs_.data() + kFramePadding;
    std::fill_n(costs_.data(), frames.count + 2 * kFramePadding, kUnreachable);
    cost[-1] = 0.0F;
    FrameRange live = {0, 0};
    for (int n = 0; n < strips_.count(); ++n) {
      live = data_.kernels.excess_strip(strips_.view(n), frames, most, rest.view(n), live, cost);
      if (live.begin >= live.end) return false;
    }
    return live.end == frames.count;
  }

  void align(std::span<const int> fragments) {
    std::vector<const Eigen::MatrixXf*> side_by_side;
    for (const int i : fragments)
      side_by_side.push_back(&data_.rotated[static_cast<std::size_t>(i)]);
    const std::vector<PathCost> costs = path_costs(rows_, side_by_side, data_.kernels);
    for (std::size_t l = 0; l < fragments.size(); ++l) {
      cells_ += static_cast<double>(rotated_.cols()) * static_cast<double>(frames_of(fragments[l]));
      insert(fragments[l], costs[l]);
    }
  }

  void insert(int fragment, const PathCost& found) {
    const double cost = data_.scaling.unscaled_cost(found.cost);
    aligned_.push_back({fragment, cost, cost / found.length});
    best_.insert(std::upper_bound(best_.begin(), best_.end(), found.mean()), found.mean());
    if (best_.size() > count_) best_.pop_back();
  }

  const Data& data_;
  Eigen::MatrixXf rotated_;
  PackedRows rows_;
  PackedStrips strips_;  // `screened`
  std::size_t count_;
  float rounding_;             // what the grid adds to a distance
  float slack_;                // what single precision may be wrong by, a cell
  AlignedArray<float> costs_;  // of may_be_near
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
