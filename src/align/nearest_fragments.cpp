#include "laban/align/nearest_fragments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>

#include "laban/base/error.h"

#include "align/box_bounds.h"
#include "align/lane_frames.h"
#include "align/local_distance.h"

namespace laban::align {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;

// With the norm of the others 14 pairs.
constexpr Index kScreenedCoordinates = 27;
static_assert(kScreenedCoordinates < CoarseGrid::kMostDimensions);
constexpr Index kMostAxisFrames = 20000;  // the axes need not be exact to be axes

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

// What screening looks at.
Eigen::MatrixXf screened(const Eigen::MatrixXf& rotated) {
  return leading_and_norm(rotated, kScreenedCoordinates);
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
  Eigen::MatrixXf outlines;            // a column a fragment
  float largest_norm = 0.0F;           // squared, of all frames
  std::vector<int> order;              // fragment at each place, group * lanes + lane
  std::vector<std::size_t> place;      // of each fragment
  std::vector<PackedFrames> coarse;    // of the fragment at each place, `screened`, on the grid
  std::optional<FragmentBoxes> boxes;  // likewise

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
    add_in_order();
  }

  [[nodiscard]] Eigen::MatrixXf rotate(const Eigen::Ref<const Eigen::MatrixXd>& sequence,
                                       const Scaling& scale) const {
    return (axes * ((sequence.colwise() - scale.center) * scale.factor)).cast<float>();
  }

  // Groups are of `lanes` neighbours by falling length.
  void add_in_order() {
    order = longest_first(fragments);
    place.resize(order.size());
    std::vector<const Eigen::MatrixXf*> in_order;
    for (std::size_t n = 0; n < order.size(); ++n) {
      const auto i = static_cast<std::size_t>(order[n]);
      place[i] = n;
      in_order.push_back(&rotated[i]);
      coarse.emplace_back(grid.frames(screened(rotated[i])));
    }
    boxes.emplace(in_order, grid, kernels);
  }
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
  [[nodiscard]] friend bool operator<(const Likely& a, const Likely& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.fragment < b.fragment;
  }
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
    costs_ = AlignedArray<float>(static_cast<std::size_t>(longest(others) + 2 * kFramePadding));
    BoxBounds bounds(*data_.boxes, rotated_);
    std::vector<int> left;
    const std::vector<std::size_t> places = places_of(others);
    for (auto begin = places.begin(); begin != places.end();) {
      const std::size_t group = *begin / data_.lanes;
      const auto end = std::partition_point(
          begin, places.end(), [&](std::size_t place) { return place / data_.lanes == group; });
      bounds.fill(group, limit());
      for (const std::size_t place : within(bounds, {begin, end})) {
        if (!may_be_near(place, bounds)) continue;
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
    std::vector<std::size_t> asked(data_.order.size());
    for (const int i : candidates) ++asked[data_.place[static_cast<std::size_t>(i)]];
    std::vector<std::size_t> places;
    places.reserve(candidates.size());
    for (std::size_t place = 0; place < asked.size(); ++place)
      places.insert(places.end(), asked[place], place);
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
  [[nodiscard]] bool may_be_near(std::size_t place, BoxBounds& bounds) {
    const float root = std::sqrt(limit()) + rounding_;
    const float most = root * root;
    bounds.fill_rest(place % data_.lanes, most);
    const FrameRows frames = data_.coarse[place].view();
    float* cost = costs_.data() + kFramePadding;
    std::fill_n(costs_.data(), frames.count + 2 * kFramePadding, kUnreachable);
    cost[-1] = 0.0F;
    FrameRange live = {0, 0};
    for (int n = 0; n < strips_.count(); ++n) {
      live = data_.kernels.excess_strip(strips_.view(n), frames, most, bounds.rest(n), live, cost);
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
