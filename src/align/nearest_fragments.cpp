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

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Leading coordinates that are bounded on their own, by the boxes and by screening; the others are
// by their norm. Of joint angles 8 hold most of the variance, 20 nearly all.
constexpr Index kBoxCoordinates = 8;
constexpr Index kScreenCoordinates = 20;
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

// The leading coordinates of each frame, and the norm of all others (whose difference is at most
// the others' distance): distances of these are never greater than those of the frames.
Eigen::MatrixXf bounded_values(const Eigen::MatrixXf& rotated, Index coordinates) {
  const Index leading = std::min(rotated.rows(), coordinates);
  Eigen::MatrixXf values(leading + 1, rotated.cols());
  values.topRows(leading) = rotated.topRows(leading);
  values.row(leading) = rotated.bottomRows(rotated.rows() - leading).colwise().norm();
  return values;
}

// Lower bounds, then upper bounds, a column a box.
Eigen::MatrixXf boxes_of(const Eigen::MatrixXf& rotated) {
  const Eigen::MatrixXf values = bounded_values(rotated, kBoxCoordinates);
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
      static_cast<std::size_t>(2 * (std::min(rotated[0]->rows(), kBoxCoordinates) + 1));
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

}  // namespace

struct FragmentIndex::Data {
  const LaneKernels& kernels = lane_kernels();
  std::size_t lanes = static_cast<std::size_t>(kernels.lanes);
  std::span<const Eigen::MatrixXd> fragments;
  Scaling scaling;
  Eigen::MatrixXd axes;                  // D x D
  std::vector<Eigen::MatrixXf> rotated;  // one a fragment, scaled
  std::vector<Eigen::MatrixXf> bounded;  // what screening sees of them
  float largest_norm = 0.0F;             // squared, of all frames
  std::vector<BoxGroup> groups;          // fragments by falling length
  std::vector<int> order;                // fragment at each place, group * lanes + lane
  std::vector<std::size_t> place;        // of each fragment

  explicit Data(std::span<const Eigen::MatrixXd> all) : fragments(all) {
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
      bounded.push_back(bounded_values(rotated.back(), kScreenCoordinates));
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

namespace {

// A lower bound of what an alignment of N query frames with M fragment frames costs beyond `limit`
// a cell. A path has a cell a query frame at least, and each further cell is the first of a
// fragment frame (and the other way round). So it costs more than `limit` a cell if
//
//   sum over frames p of (d(p, .) - limit) + sum over frames q of min(0, d(., q) - limit) > 0,
//
// where the first sum is at least the cheapest monotone path's through the boxes. The greater of
// both ways round counts.
struct BoundParts {
  double path_by_rows = 0.0;     // sum of d(p, .), along the cheapest path through the boxes
  double path_by_boxes = 0.0;    // sum of d(., q), likewise
  std::vector<float> row_least;  // d(p, .), a row box
  std::vector<float> box_least;  // d(., q), a fragment's box

  // sum over the frames behind box n - 1 of d - limit, and of min(0, d - limit).
  struct Rest {
    double all = 0.0;
    double extra = 0.0;
  };
  static Rest rest_from(int n, const std::vector<float>& least, Index frames, float limit) {
    Rest rest;
    for (; n < static_cast<int>(least.size()); ++n) {
      const double beyond = least[static_cast<std::size_t>(n)] - limit;
      rest.all += frames_in_box(n, frames) * beyond;
      rest.extra += frames_in_box(n, frames) * std::min(0.0, beyond);
    }
    return rest;
  }

  [[nodiscard]] double beyond(float limit, Index rows, Index frames) const {
    const double by_rows = path_by_rows - static_cast<double>(limit) * static_cast<double>(rows) +
                           rest_from(0, box_least, frames, limit).extra;
    const double by_boxes = path_by_boxes -
                            static_cast<double>(limit) * static_cast<double>(frames) +
                            rest_from(0, row_least, rows, limit).extra;
    return std::max(by_rows, by_boxes);
  }
};

}  // namespace

// One query.
class FragmentIndex::Search {
 public:
  Search(const Data& data, const Eigen::Ref<const Eigen::MatrixXd>& features, int count)
      : data_(data),
        rotated_(data.rotate(features, data.scaling)),
        bounded_(bounded_values(rotated_, kScreenCoordinates)),
        rows_(rotated_, data.kernels),
        bounded_rows_(bounded_, data.kernels),
        count_(static_cast<std::size_t>(count)),
        slack_(1e-6F * (data.largest_norm + rotated_.colwise().squaredNorm().maxCoeff())) {}

  // Aligns with the candidates. Pruning: in the order of their bounds, `lanes` of those that the
  // bounds leave at a time, so that the limit falls quickly.
  void run(std::vector<int> candidates, bool prune) {
    if (!prune) {
      sort_by_length(candidates);
      return for_each_group(candidates, [&](std::span<const int> group) { align(group, false); });
    }
    bound(candidates);
    sort_by_bound(candidates);
    std::vector<int> left;
    for (std::size_t begin = 0; begin < candidates.size();) {
      std::vector<int> batch;
      const std::size_t most = begin == 0 ? data_.lanes : kBatchGroups * data_.lanes;
      for (; begin < candidates.size() && batch.size() < most; ++begin) {
        if (!excluded(candidates[begin])) batch.push_back(candidates[begin]);
      }
      sort_by_length(batch);
      for_each_group(batch, [&](std::span<const int> group) { screen(group, left); });
      const std::size_t whole =
          begin < candidates.size() ? left.size() / data_.lanes * data_.lanes : left.size();
      const std::vector<int> now(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(whole));
      left.erase(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(whole));
      for_each_group(now, [&](std::span<const int> group) { align(group, true); });
    }
  }

  // Frames of the fragments beside which a cell was computed, times those of the query.
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

  // No fragment of a dearer mean cell is among the nearest `count`, single precision included.
  [[nodiscard]] float limit() const {
    if (best_.size() < count_) return kInfinity;
    return best_.back() * (1.0F + 1e-5F) + slack_;
  }

  void bound(const std::vector<int>& candidates) {
    bounds_.resize(data_.fragments.size());
    std::vector<bool> wanted(data_.groups.size());
    for (const int i : candidates) {
      wanted[data_.place[static_cast<std::size_t>(i)] / data_.lanes] = true;
    }
    const Eigen::MatrixXf boxes = boxes_of(rotated_);
    const auto most_boxes = static_cast<std::size_t>(data_.groups[0].box_count);
    BoundScratch scratch(static_cast<std::size_t>(boxes.cols()), most_boxes, data_.lanes);
    for (int n = 0; n < boxes.cols(); ++n) {
      scratch.row_frames.push_back(frames_in_box(n, rotated_.cols()));
    }
    for (std::size_t g = 0; g < data_.groups.size(); ++g) {
      if (wanted[g]) bound_group(g, boxes, scratch);
    }
  }

  // Room for the longest group.
  struct BoundScratch {
    AlignedArray<float> distances;
    AlignedArray<float> row_least;
    AlignedArray<float> box_least;
    AlignedArray<float> path;
    AlignedArray<float> ends;
    std::vector<int> row_frames;

    BoundScratch(std::size_t rows, std::size_t boxes, std::size_t lanes)
        : distances(rows * boxes * lanes),
          row_least(rows * lanes),
          box_least(boxes * lanes),
          path(std::max(rows, boxes) * lanes),
          ends(boxes * lanes) {}
  };

  void bound_group(std::size_t number, const Eigen::MatrixXf& query, BoundScratch& scratch) {
    const BoxGroup& group = data_.groups[number];
    const auto rows = static_cast<int>(query.cols());
    const std::size_t lanes = data_.lanes;
    data_.kernels.box_distances(query.data(), rows, group.boxes.data(), group.box_count,
                                static_cast<int>(query.rows() / 2), scratch.distances.data(),
                                scratch.row_least.data(), scratch.box_least.data());
    data_.kernels.path_by_boxes(scratch.distances.data(), group.frames.data(), rows,
                                group.box_count, scratch.path.data(), scratch.ends.data());
    data_.kernels.path_by_rows(scratch.distances.data(), scratch.row_frames.data(), rows,
                               group.box_count, scratch.path.data());
    for (std::size_t l = 0; l < lanes && number * lanes + l < data_.order.size(); ++l) {
      const int fragment = data_.order[number * lanes + l];
      BoundParts& parts = bounds_[static_cast<std::size_t>(fragment)];
      const auto boxes = static_cast<std::size_t>(box_count_for(frames_of(fragment)));
      parts.path_by_rows = scratch.path[(boxes - 1) * lanes + l];
      parts.path_by_boxes = scratch.ends[(boxes - 1) * lanes + l];
      parts.row_least.resize(static_cast<std::size_t>(rows));
      for (std::size_t n = 0; n < parts.row_least.size(); ++n) {
        parts.row_least[n] = scratch.row_least[n * lanes + l];
      }
      parts.box_least.resize(boxes);
      for (std::size_t n = 0; n < boxes; ++n) {
        parts.box_least[n] = scratch.box_least[n * lanes + l];
      }
    }
  }

  // By what a cell costs at least along the cheapest path; any order is right, this one is quick.
  void sort_by_bound(std::vector<int>& candidates) const {
    std::vector<double> key(data_.fragments.size());
    for (const int i : candidates) {
      const BoundParts& parts = bounds_[static_cast<std::size_t>(i)];
      key[static_cast<std::size_t>(i)] =
          std::max(parts.path_by_rows, parts.path_by_boxes) /
          static_cast<double>(std::max(rotated_.cols(), frames_of(i)));
    }
    std::sort(candidates.begin(), candidates.end(), [&](int a, int b) {
      const double key_a = key[static_cast<std::size_t>(a)];
      const double key_b = key[static_cast<std::size_t>(b)];
      return key_a != key_b ? key_a < key_b : a < b;
    });
  }

  [[nodiscard]] bool excluded(int fragment) const {
    const float most = limit();
    return most < kInfinity && bounds_[static_cast<std::size_t>(fragment)].beyond(
                                   most, rotated_.cols(), frames_of(fragment)) > 0.0;
  }

  void sort_by_length(std::vector<int>& fragments) const {
    std::sort(fragments.begin(), fragments.end(), [&](int a, int b) {
      return frames_of(a) != frames_of(b) ? frames_of(a) > frames_of(b) : a < b;
    });
  }

  template <typename Work>
  void for_each_group(std::span<const int> fragments, const Work& work) const {
    for (std::size_t begin = 0; begin < fragments.size(); begin += data_.lanes) {
      work(fragments.subspan(begin, std::min(data_.lanes, fragments.size() - begin)));
    }
  }

  [[nodiscard]] PackedLanes packed(std::span<const int> fragments,
                                   const std::vector<Eigen::MatrixXf>& values) const {
    std::vector<const Eigen::MatrixXf*> lanes;
    for (const int i : fragments) lanes.push_back(&values[static_cast<std::size_t>(i)]);
    return {lanes, data_.kernels};
  }

  // Aligns the bounded values alone, a fifth of the work, and keeps those that may be near.
  void screen(std::span<const int> fragments, std::vector<int>& left) {
    const float most = limit();
    if (!(most < kInfinity)) {
      left.insert(left.end(), fragments.begin(), fragments.end());
      return;
    }
    const PackedLanes lanes = packed(fragments, data_.bounded);
    const GroupRest rest = rest_of(fragments, lanes.frame_count(), most);
    const auto cell_count = static_cast<std::size_t>(lanes.frame_count()) * data_.lanes;
    AlignedArray<float> cost(cell_count);
    const AlignedArray<int> no_length(cell_count);
    const int row_count = bounded_rows_.frame_count();
    for (int frame = 0; frame < row_count;) {
      const int count = std::min(kMostStripRows, row_count - frame);
      data_.kernels.excess_strip(bounded_rows_.view(frame, count), lanes.view(), frame == 0, most,
                                 cost.data());
      frame += count;
      if (all_beyond(cost.data(), no_length.data(), frame, rest, fragments, most)) return;
    }
    for (std::size_t l = 0; l < fragments.size(); ++l) {
      const auto last = static_cast<std::size_t>(frames_of(fragments[l]) - 1);
      if (!(cost[last * data_.lanes + l] > 0.0F)) left.push_back(fragments[l]);
    }
  }

  void align(std::span<const int> fragments, bool prune) {
    const PackedLanes lanes = packed(fragments, data_.rotated);
    const float most = prune ? limit() : kInfinity;
    const GroupRest rest =
        most < kInfinity ? rest_of(fragments, lanes.frame_count(), most) : GroupRest{};
    const std::array<bool, kMostLanes> swapped = {};
    LaneDtw dtw(data_.kernels, lanes.frame_count());
    dtw.begin(rows_, lanes, swapped.data());
    bool hopeless = false;
    do {
      hopeless = most < kInfinity &&
                 all_beyond(dtw.costs(), dtw.lengths(), dtw.frame(), rest, fragments, most);
    } while (!hopeless && dtw.advance());
    for (std::size_t l = 0; l < fragments.size(); ++l) {
      const Index frames = frames_of(fragments[l]);
      cells_ += static_cast<double>(dtw.frame()) * static_cast<double>(frames);
      if (hopeless) continue;
      const int last = static_cast<int>(frames) - 1;
      const auto lane = static_cast<int>(l);
      insert(fragments[l], dtw.cost(lane, last), dtw.length(lane, last));
    }
  }

  // What the fragment's frames behind each one cost at least beyond the limit (see BoundParts).
  struct GroupRest {
    int padded_count = 0;
    AlignedArray<float> frames;
    AlignedArray<float> frames_extra;
    std::array<int, kMostLanes> frame_count = {};
  };

  [[nodiscard]] GroupRest rest_of(std::span<const int> fragments, int frame_count,
                                  float most) const {
    const std::size_t lanes = data_.lanes;
    GroupRest rest{frame_count, AlignedArray<float>(static_cast<std::size_t>(frame_count) * lanes),
                   AlignedArray<float>(static_cast<std::size_t>(frame_count) * lanes)};
    for (std::size_t l = 0; l < fragments.size(); ++l) {
      const std::vector<float>& least = bounds_[static_cast<std::size_t>(fragments[l])].box_least;
      rest.frame_count[l] = static_cast<int>(frames_of(fragments[l]));
      float all = 0.0F;
      float extra = 0.0F;
      for (int q = rest.frame_count[l] - 1; q >= 0; --q) {
        const auto cell = static_cast<std::size_t>(q) * lanes + l;
        rest.frames[cell] = all;
        rest.frames_extra[cell] = extra;
        const float beyond = least[static_cast<std::size_t>(q / kBoxFrames)] - most;
        all += beyond;
        extra += std::min(0.0F, beyond);
      }
    }
    return rest;
  }

  // No path through what is done and what is left stays within `most` a cell, in any lane.
  [[nodiscard]] bool all_beyond(const float* cost, const int* length, int frame,
                                const GroupRest& rest, std::span<const int> fragments,
                                float most) const {
    static_assert(kMostStripRows % kBoxFrames == 0, "a strip ends where a box does");
    std::array<float, kMostLanes> rows = {};
    std::array<float, kMostLanes> rows_extra = {};
    for (std::size_t l = 0; l < fragments.size(); ++l) {
      const auto& bounds = bounds_[static_cast<std::size_t>(fragments[l])];
      const BoundParts::Rest left =
          BoundParts::rest_from(box_count_for(frame), bounds.row_least, rotated_.cols(), most);
      rows[l] = static_cast<float>(left.all);
      rows_extra[l] = static_cast<float>(left.extra);
    }
    std::array<float, kMostLanes> bound = {};
    data_.kernels.strip_bound(cost, length, rest.frames.data(), rest.frames_extra.data(),
                              rows.data(), rows_extra.data(), most, rest.padded_count,
                              rest.frame_count.data(), bound.data());
    return std::all_of(bound.begin(), bound.begin() + static_cast<std::ptrdiff_t>(fragments.size()),
                       [](float beyond) { return beyond > 0.0F; });
  }

  void insert(int fragment, float cost, int length) {
    const double whole = data_.scaling.unscaled_cost(cost);
    aligned_.push_back({fragment, whole, whole / length});
    const float mean_cost = cost / static_cast<float>(length);
    best_.insert(std::upper_bound(best_.begin(), best_.end(), mean_cost), mean_cost);
    if (best_.size() > count_) best_.pop_back();
  }

  static constexpr std::size_t kBatchGroups = 4;

  const Data& data_;
  Eigen::MatrixXf rotated_;
  Eigen::MatrixXf bounded_;
  PackedRows rows_;
  PackedRows bounded_rows_;
  std::size_t count_;
  float slack_;  // what single precision may be wrong by, a cell
  std::vector<BoundParts> bounds_;
  std::vector<float> best_;  // the least mean costs so far, at most count_
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
  search.run(std::move(all), options.prune);
  return {search.nearest(), 1.0 - search.cells() / (frames * static_cast<double>(features.cols()))};
}

std::vector<Neighbor> nearest(const Eigen::Ref<const Eigen::MatrixXd>& features,
                              std::span<const Eigen::MatrixXd> fragments, int count,
                              std::span<const int> candidates) {
  return FragmentIndex(fragments).nearest(features, count, candidates).neighbors;
}

}  // namespace laban::align
