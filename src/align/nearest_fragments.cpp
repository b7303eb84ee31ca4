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
// Leading coordinates that are bounded on their own, by the boxes and by screening; the others are
// by their norm. Of joint angles 8 hold most of the variance, 20 nearly all.
constexpr Index kLeadingCoordinates = 20;
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

// What screening looks at first, then the rest: norm_behind, then all coordinates.
Eigen::MatrixXf screened_first(const Eigen::MatrixXf& rotated) {
  Eigen::MatrixXf values(rotated.rows() + 1, rotated.cols());
  values << norm_behind(rotated, kLeadingCoordinates), rotated;
  return values;
}

// Lower bounds, then upper bounds, a column a box.
Eigen::MatrixXf boxes_of(const Eigen::MatrixXf& rotated) {
  const Index leading = std::min(rotated.rows(), kLeadingCoordinates);
  Eigen::MatrixXf values(leading + 1, rotated.cols());
  values << rotated.topRows(leading), norm_behind(rotated, leading);
  Eigen::MatrixXf boxes(2 * values.rows(), box_count_for(values.cols()));
  for (Index n = 0; n < boxes.cols(); ++n) {
    const auto part =
        values.middleCols(n * kBoxFrames, frames_in_box(static_cast<int>(n), values.cols()));
    boxes.col(n) << part.rowwise().minCoeff(), part.rowwise().maxCoeff();
  }
  return boxes;
}

// `lanes` fragments' boxes side by side.
struct BoxGroup {
  int box_count = 0;  // of the longest
  AlignedArray<float> boxes;
  AlignedArray<int> frames;  // box_count x lanes
};

BoxGroup box_group(std::span<const Eigen::MatrixXf* const> rotated, std::size_t lanes) {
  // Behind a fragment's end there is nothing near anything: no scaled value is beyond 2.
  constexpr float kFar = 1e6F;
  BoxGroup group;
  for (const Eigen::MatrixXf* fragment : rotated) {
    group.box_count = std::max(group.box_count, box_count_for(fragment->cols()));
  }
  const auto height =
      static_cast<std::size_t>(2 * (std::min(rotated[0]->rows(), kLeadingCoordinates) + 1));
  const auto count = static_cast<std::size_t>(group.box_count);
  group.boxes = AlignedArray<float>(count * height * lanes);
  group.frames = AlignedArray<int>(count * lanes);
  std::fill_n(group.boxes.data(), count * height * lanes, kFar);
  for (std::size_t l = 0; l < rotated.size(); ++l) {
    const Eigen::MatrixXf boxes = boxes_of(*rotated[l]);
    for (std::size_t n = 0; n < static_cast<std::size_t>(boxes.size()); ++n) {
      group.boxes[n * lanes + l] = boxes.data()[n];
    }
    for (std::size_t n = 0; n < count; ++n) {
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
  std::vector<Eigen::MatrixXf> rotated;  // one a fragment, scaled, for lanes
  std::vector<PackedFrames> packed;      // screened_first, for alignments one at a time
  float largest_norm = 0.0F;             // squared, of all frames
  std::vector<BoxGroup> groups;          // fragments by falling length
  std::vector<int> order;                // fragment at each place, group * lanes + lane
  std::vector<std::size_t> place;        // of each fragment

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
      packed.emplace_back(screened_first(rotated.back()));
      largest_norm = std::max(largest_norm, rotated.back().colwise().squaredNorm().maxCoeff());
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
      group.push_back(&rotated[i]);
      if (group.size() < lanes && n + 1 < order.size()) continue;
      groups.push_back(box_group(group, lanes));
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
  float path_by_rows = 0.0F;   // sum of d(p, .), along the cheapest path through the boxes
  float path_by_boxes = 0.0F;  // sum of d(., q), likewise
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

  [[nodiscard]] float beyond(float limit) const {
    float row_extra = 0.0F;
    for (int n = 0; n < box_count_for(rows); ++n) {
      row_extra += static_cast<float>(frames_in_box(n, rows)) *
                   std::min(0.0F, of_row(n * kBoxFrames) - limit);
    }
    float frame_extra = 0.0F;
    for (int n = 0; n < box_count_for(frames); ++n) {
      frame_extra += static_cast<float>(frames_in_box(n, frames)) *
                     std::min(0.0F, of_frame(n * kBoxFrames) - limit);
    }
    return std::max(path_by_rows - limit * static_cast<float>(rows) + frame_extra,
                    path_by_boxes - limit * static_cast<float>(frames) + row_extra);
  }
};

// The bounds of all fragments with one query.
class BoxBounds {
 public:
  BoxBounds(const PreparedFragments& data, const Eigen::MatrixXf& rotated)
      : data_(data),
        rows_(rotated.cols()),
        boxes_(boxes_of(rotated)),
        group_at_(data.groups.size()) {
    std::size_t size = 0;
    for (std::size_t g = 0; g < group_at_.size(); ++g) {
      group_at_[g] = size;
      size += (row_boxes() + boxes_of_group(g) + 2) * data.lanes;
    }
    numbers_ = AlignedArray<float>(size);
  }

  // Of these fragments and what shares their lanes.
  void fill(std::span<const int> fragments) {
    std::vector<bool> wanted(data_.groups.size());
    for (const int i : fragments) {
      wanted[data_.place[static_cast<std::size_t>(i)] / data_.lanes] = true;
    }
    Scratch scratch(row_boxes(), boxes_of_group(0), data_.lanes);
    for (std::size_t n = 0; n < row_boxes(); ++n) {
      scratch.row_frames.push_back(frames_in_box(static_cast<int>(n), rows_));
    }
    for (std::size_t g = 0; g < wanted.size(); ++g) {
      if (wanted[g]) fill_group(g, scratch);
    }
  }

  [[nodiscard]] BoxBound of(int fragment) const {
    const std::size_t place = data_.place[static_cast<std::size_t>(fragment)];
    const std::size_t group = place / data_.lanes;
    const float* at = numbers_.data() + group_at_[group] + place % data_.lanes;
    BoxBound bound;
    bound.path_by_rows = at[0];
    bound.path_by_boxes = at[data_.lanes];
    bound.row_least = at + 2 * data_.lanes;
    bound.box_least = at + (2 + row_boxes()) * data_.lanes;
    bound.lanes = data_.lanes;
    bound.rows = rows_;
    bound.frames = data_.fragments[static_cast<std::size_t>(fragment)].cols();
    return bound;
  }

 private:
  // Room for the longest group.
  struct Scratch {
    AlignedArray<float> distances;
    AlignedArray<float> path;
    AlignedArray<float> ends;
    std::vector<int> row_frames;

    Scratch(std::size_t rows, std::size_t boxes, std::size_t lanes)
        : distances(rows * boxes * lanes),
          path(std::max(rows, boxes) * lanes),
          ends(boxes * lanes) {}
  };

  [[nodiscard]] std::size_t row_boxes() const { return static_cast<std::size_t>(boxes_.cols()); }
  [[nodiscard]] std::size_t boxes_of_group(std::size_t group) const {
    return static_cast<std::size_t>(data_.groups[group].box_count);
  }

  void fill_group(std::size_t number, Scratch& scratch) {
    const BoxGroup& group = data_.groups[number];
    const auto rows = static_cast<int>(row_boxes());
    const std::size_t lanes = data_.lanes;
    float* paths = numbers_.data() + group_at_[number];
    data_.kernels.box_distances(boxes_.data(), rows, group.boxes.data(), group.box_count,
                                static_cast<int>(boxes_.rows() / 2), scratch.distances.data(),
                                paths + 2 * lanes, paths + (2 + row_boxes()) * lanes);
    data_.kernels.path_by_boxes(scratch.distances.data(), group.frames.data(), rows,
                                group.box_count, scratch.path.data(), scratch.ends.data());
    data_.kernels.path_by_rows(scratch.distances.data(), scratch.row_frames.data(), rows,
                               group.box_count, scratch.path.data());
    for (std::size_t l = 0; l < lanes && number * lanes + l < data_.order.size(); ++l) {
      const auto fragment = static_cast<std::size_t>(data_.order[number * lanes + l]);
      const auto last =
          static_cast<std::size_t>(box_count_for(data_.fragments[fragment].cols()) - 1);
      paths[l] = scratch.path[last * lanes + l];
      paths[lanes + l] = scratch.ends[last * lanes + l];
    }
  }

  const PreparedFragments& data_;
  Index rows_;
  Eigen::MatrixXf boxes_;              // of the query
  std::vector<std::size_t> group_at_;  // in numbers_: by rows, by boxes, row_least, box_least
  AlignedArray<float> numbers_;
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
    return {frames_.data() + kFramePadding, frames_extra_.data() + kFramePadding,
            rows_.data() + first, rows_extra_.data() + first};
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
        strips_(screened_first(rotated_), data.kernels),
        count_(static_cast<std::size_t>(count)),
        slack_(1e-6F * (data.largest_norm + rotated_.colwise().squaredNorm().maxCoeff())) {}

  void run_all(std::vector<int> candidates) {
    std::sort(candidates.begin(), candidates.end(), [&](int a, int b) {
      return frames_of(a) != frames_of(b) ? frames_of(a) > frames_of(b) : a < b;
    });
    for (std::size_t n = 0; n < candidates.size(); n += data_.lanes) align(group(candidates, n));
  }

  // In the order of their bounds, so that the limit falls quickly.
  void run_pruned(std::vector<int> candidates) {
    BoxBounds bounds(data_, rotated_);
    bounds.fill(candidates);
    const std::size_t begin = take_nearest(bounds, candidates, seed_count(candidates.size()));
    for (std::size_t n = 0; n < begin; n += data_.lanes)
      align(group(std::span(candidates).first(begin), n));
    candidates.erase(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(begin));
    std::erase_if(candidates, [&](int i) { return bounds.of(i).beyond(limit()) > 0.0F; });
    take_nearest(bounds, candidates, candidates.size());
    Rest rest(rotated_.cols(), longest(candidates), data_.lanes);
    costs_ = AlignedArray<float>(static_cast<std::size_t>(longest(candidates) + 2 * kFramePadding));
    std::vector<int> left;
    for (const int i : candidates) {
      const BoxBound bound = bounds.of(i);
      const float most = limit();
      if (bound.beyond(most) > 0.0F) continue;
      rest.fill(bound, most);
      if (!may_be_near(i, rest, most)) continue;
      left.push_back(i);
      if (left.size() < data_.lanes) continue;
      align(left);
      left.clear();
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

  // How many are aligned before anything is left out: of many a few groups, so that the limit is
  // near the last one.
  [[nodiscard]] std::size_t seed_count(std::size_t candidate_count) const {
    const std::size_t groups = std::clamp<std::size_t>(candidate_count / (12 * data_.lanes), 1, 3);
    return std::max(count_, groups * data_.lanes);
  }

  [[nodiscard]] std::span<const int> group(std::span<const int> fragments,
                                           std::size_t begin) const {
    return fragments.subspan(begin, std::min(data_.lanes, fragments.size() - begin));
  }

  // Sorts those to the front of which a cell costs least along the cheapest path through the boxes;
  // any order is right, this one is quick. @returns how many were sorted, at most `count`.
  std::size_t take_nearest(const BoxBounds& bounds, std::vector<int>& candidates,
                           std::size_t count) {
    keys_.resize(data_.fragments.size());
    for (const int i : candidates) {
      const BoxBound bound = bounds.of(i);
      keys_[static_cast<std::size_t>(i)] = std::max(bound.path_by_rows, bound.path_by_boxes) /
                                           static_cast<float>(std::max(bound.rows, bound.frames));
    }
    count = std::min(count, candidates.size());
    std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count),
                      candidates.end(), [&](int a, int b) {
                        const float key_a = keys_[static_cast<std::size_t>(a)];
                        const float key_b = keys_[static_cast<std::size_t>(b)];
                        return key_a != key_b ? key_a < key_b : a < b;
                      });
    return count;
  }

  // Whether a path costs `most` a cell or less: by the leading coordinates, a third of the work,
  // then by all of them.
  [[nodiscard]] bool may_be_near(int fragment, const Rest& rest, float most) {
    const FrameRows frames = data_.packed[static_cast<std::size_t>(fragment)].view(0);
    const auto coordinates = static_cast<int>(rotated_.rows());
    const int screened = std::min(static_cast<int>(kLeadingCoordinates), coordinates);
    if (!has_path(frames, 0, 1 + screened, rest, most)) return false;
    if (has_path(data_.packed[static_cast<std::size_t>(fragment)].view(1), 1, coordinates, rest,
                 most))
      return true;
    cells_ += static_cast<double>(rotated_.cols()) * static_cast<double>(frames.count);
    return false;
  }

  // The same by `dimensions` rows of screened_first from `first` on, which `frames` are.
  [[nodiscard]] bool has_path(const FrameRows& frames, int first, int dimensions, const Rest& rest,
                              float most) {
    float* cost = costs_.data() + kFramePadding;
    std::fill_n(costs_.data(), frames.count + 2 * kFramePadding, kUnreachable);
    cost[-1] = 0.0F;
    FrameRange live = {0, 0};
    for (int n = 0; n < strips_.count(); ++n) {
      live = data_.kernels.excess_strip(strips_.view(n, first, dimensions), frames, most,
                                        rest.view(n), live, cost);
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
  PackedStrips strips_;  // screened_first
  std::size_t count_;
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
