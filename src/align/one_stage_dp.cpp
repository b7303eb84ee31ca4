#include "laban/align/one_stage_dp.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/math/constants.h"

#include "align/lane_frames.h"
#include "align/local_distance.h"
#include "align/one_stage.h"

namespace laban::align {
namespace {

// Notation [Torresani06, eq. 8-11]       here (all counts from 0)
//   Y(p), T        input, its length      input.col(p), T
//   X_i(q), T_i    fragment i             fragments[i].col(q), its cols()
//   d(p, q, i)     local distance         one cell of a block of distances
//   w(n)           path (p, q, i)         never stored: a cell carries where its snippet began
//
// [Ney84]: with (entry frame, best finished snippet a frame) the chain of snippets is traced back
// in memory O(T + S).

// The best chain of snippets that ends at an input frame with a fragment's last frame.
struct Finished {
  double cost = math::kInfinity;  // from some common cost on
  int entry = 0;                  // first input frame of its last snippet
  int fragment = 0;
};

// The last snippet of each frame's best chain, so that the whole chain is known.
std::vector<Snippet> trace_back(const std::vector<Finished>& finished) {
  std::vector<Snippet> snippets;
  for (int end = static_cast<int>(finished.size()); end > 0;) {
    const Finished& last = finished[static_cast<std::size_t>(end - 1)];
    snippets.push_back({last.entry, end, last.fragment});
    end = last.entry;
  }
  std::reverse(snippets.begin(), snippets.end());
  return snippets;
}

void require_valid(const Eigen::Ref<const Eigen::MatrixXd>& input,
                   std::span<const Eigen::MatrixXd> fragments, const SegmentOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw base::Error(base::ErrorKind::kUsage, problems.front());
  require_sequence(input, "segment: input");
  if (fragments.empty()) {
    throw base::Error(base::ErrorKind::kData, "segment: no fragment, at least one is needed");
  }
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    const std::string place = "segment: fragment " + std::to_string(i);
    require_sequence(fragments[i], place);
    require_same_rows(fragments[i].rows(), input.rows(), place);
  }
}

}  // namespace

std::vector<std::string> SegmentOptions::problems() const {
  std::vector<std::string> found;
  if (!(snippet_cost >= 0.0) || snippet_cost == math::kInfinity) {
    found.push_back("SegmentOptions::snippet_cost = " + std::to_string(snippet_cost) +
                    " (must be finite and >= 0)");
  }
  if (slope_limit.has_value() && *slope_limit < 2) {
    found.push_back("SegmentOptions::slope_limit = " + std::to_string(*slope_limit) +
                    " (must be >= 2)");
  }
  return found;
}

// How a path may run through the fragments.
class OneStage::Steps {
 public:
  virtual ~Steps() = default;
  [[nodiscard]] virtual std::optional<Segmentation> segment(
      const Eigen::Ref<const Eigen::MatrixXd>& input, base::Progress* progress) const = 0;
};

// The paper's steps, in single precision: `lanes` fragments of about one length side by side, one
// cell a database frame, overwritten from input frame to input frame. Costs are kept from that of
// the best chain on, so that they stay small however long the input; what a snippet costs is said
// by its own alignment in double precision.
class OneStage::FreeSteps : public OneStage::Steps {
 public:
  FreeSteps(const Eigen::Ref<const Eigen::MatrixXd>& like,
            std::span<const Eigen::MatrixXd> fragments, double snippet_cost)
      : fragments_(fragments),
        scaling_(Scaling::of(fragments).covering(like)),
        snippet_cost_(snippet_cost),
        last_cell_(fragments.size()) {
    const std::vector<int> order = longest_first(fragments);
    const auto lanes = static_cast<std::size_t>(kernels_.lanes);
    for (std::size_t begin = 0; begin < order.size(); begin += lanes) {
      add_group(std::span(order).subspan(begin, std::min(lanes, order.size() - begin)));
    }
  }

  [[nodiscard]] std::optional<Segmentation> segment(const Eigen::Ref<const Eigen::MatrixXd>& input,
                                                    base::Progress* progress) const override {
    Segmentation result{trace_back(best_chains(input, progress))};
    for (Snippet& snippet : result.snippets) {
      const DtwCost own = dtw_cost(input.middleCols(snippet.begin, snippet.end - snippet.begin),
                                   fragments_[static_cast<std::size_t>(snippet.fragment)]);
      snippet.cost = own.cost;
      snippet.path_length = own.path_length;
      result.cost += own.cost + snippet_cost_;
    }
    return result;
  }

 private:
  // A block of distances takes kBlockFrames x 4 bytes a database frame, whose own features are read
  // once a block.
  static constexpr int kBlockFrames = 48;
  static constexpr float kHuge = 1e30F;  // no chain costs as much: no scaled value is beyond 1

  struct Group {
    std::size_t first_cell;
    PackedLanes frames;
  };

  // The cells of all groups, of the previous input frame.
  struct Cells {
    AlignedArray<float> cost;
    AlignedArray<int> entry;
  };

  void add_group(std::span<const int> fragments) {
    std::vector<Eigen::MatrixXf> scaled;
    for (const int i : fragments) {
      scaled.push_back(scaling_.apply(fragments_[static_cast<std::size_t>(i)]));
    }
    std::vector<const Eigen::MatrixXf*> lanes;
    for (std::size_t l = 0; l < fragments.size(); ++l) {
      lanes.push_back(&scaled[l]);
      const auto last = static_cast<std::size_t>(scaled[l].cols() - 1);
      last_cell_[static_cast<std::size_t>(fragments[l])] =
          cell_count_ + last * static_cast<std::size_t>(kernels_.lanes) + l;
    }
    groups_.push_back({cell_count_, PackedLanes(lanes, kernels_)});
    cell_count_ += static_cast<std::size_t>(groups_.back().frames.frame_count() * kernels_.lanes);
  }

  [[nodiscard]] std::vector<Finished> best_chains(const Eigen::Ref<const Eigen::MatrixXd>& input,
                                                  base::Progress* progress) const {
    const PackedRows rows(scaling_.apply(input), kernels_);
    Cells cells{AlignedArray<float>(cell_count_), AlignedArray<int>(cell_count_)};
    std::fill_n(cells.cost.data(), cell_count_, std::numeric_limits<float>::infinity());
    AlignedArray<float> distances(cell_count_ * kBlockFrames);
    std::vector<Finished> finished;
    float entering = 0.0F;  // the first snippet's own cost is the same for all chains
    for (int begin = 0; begin < rows.frame_count(); begin += kBlockFrames) {
      base::tell(progress, static_cast<double>(begin) / rows.frame_count());
      const int count = std::min(kBlockFrames, rows.frame_count() - begin);
      for (const Group& group : groups_) {
        kernels_.distances(rows.view(begin, count), group.frames.view(),
                           distances.data() + group.first_cell, cell_count_);
      }
      for (int p = begin; p < begin + count; ++p) {
        advance(distances.data() + static_cast<std::size_t>(p - begin) * cell_count_, p, entering,
                cells);
        finished.push_back(best_finished(cells));
        entering = entering_after(finished.back());
      }
      const auto least = static_cast<float>(finished.back().cost);
      kernels_.lower(cells.cost.data(), cell_count_, least);
      entering -= least;
    }
    return finished;
  }

  void advance(const float* distances, int frame, float entering, Cells& cells) const {
    for (const Group& group : groups_) {
      kernels_.one_stage_row(distances + group.first_cell, group.frames.frame_count(), entering,
                             frame, cells.cost.data() + group.first_cell,
                             cells.entry.data() + group.first_cell);
    }
  }

  [[nodiscard]] Finished best_finished(const Cells& cells) const {
    Finished best;
    for (std::size_t i = 0; i < last_cell_.size(); ++i) {
      const std::size_t cell = last_cell_[i];
      if (cells.cost[cell] < best.cost) {
        best = {cells.cost[cell], cells.entry[cell], static_cast<int>(i)};
      }
    }
    return best;
  }

  // Any finite snippet cost leaves a path: beyond kHuge it only forbids a second snippet.
  [[nodiscard]] float entering_after(const Finished& finished) const {
    const double scaled = finished.cost + snippet_cost_ * scaling_.factor * scaling_.factor;
    return static_cast<float>(std::min<double>(scaled, kHuge));
  }

  const LaneKernels& kernels_ = lane_kernels();
  std::span<const Eigen::MatrixXd> fragments_;
  Scaling scaling_;
  double snippet_cost_;
  std::vector<Group> groups_;
  std::size_t cell_count_ = 0;
  std::vector<std::size_t> last_cell_;  // of each fragment
};

// Steps under a slope limit s, in double precision. A cell has 2 s - 1 states: reached diagonally
// (or by entering), by k holds (p-1, q) in a row, or by k skips (p, q-1) in a row, k = 1 .. s - 1.
// Holds and skips begin after a diagonal step only, so every frame of the fragment meets at most s
// input frames, and every input frame at most s of the fragment's.
class OneStage::LimitedSteps : public OneStage::Steps {
 public:
  LimitedSteps(std::span<const Eigen::MatrixXd> fragments, double snippet_cost, int slope_limit)
      : snippet_cost_(snippet_cost),
        run_count_(static_cast<std::size_t>(slope_limit - 1)),
        state_count_(2 * run_count_ + 1) {
    Eigen::Index count = 0;
    for (const Eigen::MatrixXd& fragment : fragments) count += fragment.cols();
    frames_.resize(fragments[0].rows(), count);
    Eigen::Index begin = 0;
    for (const Eigen::MatrixXd& fragment : fragments) {
      frames_.middleCols(begin, fragment.cols()) = fragment;
      begin += fragment.cols();
      end_.push_back(static_cast<std::size_t>(begin));
    }
  }

  [[nodiscard]] std::optional<Segmentation> segment(const Eigen::Ref<const Eigen::MatrixXd>& input,
                                                    base::Progress* progress) const override {
    const int frame_count = static_cast<int>(input.cols());
    LocalDistance distance(input, frames_);
    Cells cells{std::vector<Cell>(end_.back() * state_count_), std::vector<Cell>(state_count_),
                std::vector<Cell>(state_count_)};
    std::vector<Finished> finished;
    std::vector<int> lengths;  // of the path of each frame's last snippet
    for (int begin = 0; begin < frame_count; begin += kBlockFrames) {
      base::tell(progress, static_cast<double>(begin) / frame_count);
      const int count = std::min(kBlockFrames, frame_count - begin);
      const Eigen::MatrixXd& block = distance.block(begin, count);
      for (int p = begin; p < begin + count; ++p) {
        const double before = p == 0 ? 0.0 : finished.back().cost;
        advance(Cell::entering(before + snippet_cost_, p), block.col(p - begin).data(), cells);
        Finished best;
        int length = 0;
        for (std::size_t i = 0; i < end_.size(); ++i) {
          const Cell cell = best_of(cells.all.data() + (end_[i] - 1) * state_count_);
          if (!(cell.cost < best.cost)) continue;
          best = {cell.cost, cell.entry, static_cast<int>(i)};
          length = cell.length;
        }
        finished.push_back(best);
        lengths.push_back(length);
      }
    }
    return with_costs(finished, lengths);
  }

 private:
  static constexpr int kBlockFrames = 32;

  // The best path to a cell: its cost from the input's first frame, and of its current snippet the
  // first input frame and the number of cells so far.
  struct Cell {
    double cost = math::kInfinity;
    int entry = 0;
    int length = 0;

    [[nodiscard]] static Cell entering(double cost, int frame) { return {cost, frame, 0}; }
  };

  struct Cells {
    std::vector<Cell> all;  // states of a database frame side by side
    std::vector<Cell> above;
    std::vector<Cell> diagonal;
  };

  void advance(const Cell& entering, const double* d, Cells& cells) const {
    std::size_t begin = 0;
    for (const std::size_t end : end_) {
      for (std::size_t column = begin; column < end; ++column) {
        advance_column(column, column == begin, entering, d[column], cells);
      }
      begin = end;
    }
  }

  void advance_column(std::size_t column, bool is_first, const Cell& entering, double distance,
                      Cells& cells) const {
    Cell* cell = cells.all.data() + column * state_count_;
    std::copy_n(cell, state_count_, cells.above.begin());
    const Cell* left = is_first ? nullptr : cell - state_count_;
    cell[0] = extended(is_first ? entering : best_of(cells.diagonal.data()), distance);
    for (std::size_t k = 0; k < run_count_; ++k) {
      const std::size_t before_skip = k == 0 ? 0 : run_count_ + k;
      cell[1 + k] = extended(cells.above[k], distance);
      cell[1 + run_count_ + k] = is_first ? Cell{} : extended(left[before_skip], distance);
    }
    cells.diagonal.swap(cells.above);
  }

  [[nodiscard]] static Cell extended(const Cell& cell, double distance) {
    return {cell.cost + distance, cell.entry, cell.length + 1};
  }

  [[nodiscard]] Cell best_of(const Cell* states) const {
    Cell best = states[0];
    for (std::size_t k = 1; k < state_count_; ++k) {
      if (states[k].cost < best.cost) best = states[k];
    }
    return best;
  }

  [[nodiscard]] std::optional<Segmentation> with_costs(const std::vector<Finished>& finished,
                                                       const std::vector<int>& lengths) const {
    if (finished.back().cost == math::kInfinity) return std::nullopt;
    Segmentation result{trace_back(finished), finished.back().cost};
    for (Snippet& snippet : result.snippets) {
      const auto last = static_cast<std::size_t>(snippet.end - 1);
      const double before =
          snippet.begin == 0 ? 0.0 : finished[static_cast<std::size_t>(snippet.begin - 1)].cost;
      // The difference of two sums may fall below 0 by round-off.
      snippet.cost = std::max(0.0, finished[last].cost - before - snippet_cost_);
      snippet.path_length = lengths[last];
    }
    return result;
  }

  double snippet_cost_;
  std::size_t run_count_;         // s - 1
  std::size_t state_count_;       // 2 s - 1
  Eigen::MatrixXd frames_;        // D x S
  std::vector<std::size_t> end_;  // of each fragment's columns
};

OneStage::OneStage(const Eigen::Ref<const Eigen::MatrixXd>& like,
                   std::span<const Eigen::MatrixXd> fragments, const SegmentOptions& options) {
  require_valid(like, fragments, options);
  if (options.slope_limit.has_value()) {
    steps_ = std::make_unique<LimitedSteps>(fragments, options.snippet_cost, *options.slope_limit);
  } else {
    steps_ = std::make_unique<FreeSteps>(like, fragments, options.snippet_cost);
  }
}

OneStage::~OneStage() = default;

std::optional<Segmentation> OneStage::segment(const Eigen::Ref<const Eigen::MatrixXd>& input,
                                              base::Progress* progress) const {
  return steps_->segment(input, progress);
}

std::optional<Segmentation> segment(const Eigen::Ref<const Eigen::MatrixXd>& input,
                                    std::span<const Eigen::MatrixXd> fragments,
                                    const SegmentOptions& options, base::Progress* progress) {
  return OneStage(input, fragments, options).segment(input, progress);
}

}  // namespace laban::align
