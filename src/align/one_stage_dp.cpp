#include "laban/align/one_stage_dp.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "laban/base/error.h"

#include "align/local_distance.h"

namespace laban::align {
namespace {

// Notation [Torresani06, eq. 8-11]       here (all counts from 0)
//   Y(p), T        input, its length      input.col(p), T
//   X_i(q), T_i    fragment i             frames.col(offset[i] + q), offset[i + 1] - offset[i]
//   d(p, q, i)     local distance         d[offset[i] + q]
//   w(n)           path (p, q, i)         never stored: a cell carries where its snippet began
//
// [Ney84]: with (entry frame, best finished snippet a frame) the chain of snippets is traced back
// in memory O(T + S).

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kBlockFrames = 32;  // input frames a product: S x 16 distances at a time

// The best path to a cell: its cost from the input's first frame, and of its current snippet the
// first input frame and the number of cells so far, in one word that a conditional move can carry.
struct Cell {
  double cost = kInfinity;
  std::uint64_t snippet = 0;

  [[nodiscard]] static Cell entering(double cost, int frame) {
    return {cost, static_cast<std::uint64_t>(frame) << 32};
  }
  [[nodiscard]] int entry() const { return static_cast<int>(snippet >> 32); }
  [[nodiscard]] int length() const { return static_cast<int>(snippet & 0xffffffffU); }
};

// The best chain of snippets that ends at an input frame with a fragment's last frame.
struct Finished {
  Cell cell;
  int fragment = 0;
};

[[nodiscard]] inline Cell extended(const Cell& cell, double distance) {
  return {cell.cost + distance, cell.snippet + 1};
}

// `b` only if it is cheaper: the earlier named wins a tie. No branch: on real distances one would
// be mispredicted about every third time.
[[nodiscard]] inline Cell cheaper(const Cell& a, const Cell& b) {
  const bool second = b.cost < a.cost;
  return {second ? b.cost : a.cost, second ? b.snippet : a.snippet};
}

// All fragments end to end.
struct Database {
  Eigen::MatrixXd frames;           // D x S
  std::vector<std::size_t> offset;  // fragment i is frames [offset[i], offset[i + 1])

  explicit Database(std::span<const Eigen::MatrixXd> fragments) : offset{0} {
    for (const Eigen::MatrixXd& fragment : fragments) {
      offset.push_back(offset.back() + static_cast<std::size_t>(fragment.cols()));
    }
    frames.resize(fragments[0].rows(), static_cast<Eigen::Index>(offset.back()));
    for (std::size_t i = 0; i < fragments.size(); ++i) {
      frames.middleCols(static_cast<Eigen::Index>(offset[i]), fragments[i].cols()) = fragments[i];
    }
  }
};

// The paper's steps: one cell a database frame, overwritten from input frame to input frame.
class FreeSteps {
 public:
  explicit FreeSteps(const Database& database)
      : offset_(database.offset), cells_(database.offset.back()) {}

  // Moves fragment i on by an input frame. `entering` begins a snippet at it, without its distance.
  // Returns the cell of the fragment's last frame.
  const Cell& advance(std::size_t i, const Cell& entering, const double* d) {
    Cell* cell = cells_.data() + offset_[i];
    const std::size_t length = offset_[i + 1] - offset_[i];
    Cell diagonal = cell[0];
    Cell left = extended(cheaper(cell[0], entering), d[0]);
    cell[0] = left;
    for (std::size_t q = 1; q < length; ++q) {
      const Cell above = cell[q];
      left = extended(cheaper(cheaper(diagonal, above), left), d[q]);
      cell[q] = left;
      diagonal = above;
    }
    return cell[length - 1];
  }

 private:
  const std::vector<std::size_t>& offset_;
  std::vector<Cell> cells_;  // S, of the previous input frame
};

// Steps under a slope limit s. A cell has 2 s - 1 states: reached diagonally (or by entering), by k
// holds (p-1, q) in a row, or by k skips (p, q-1) in a row, k = 1 .. s - 1. Holds and skips begin
// after a diagonal step only, so every frame of the fragment meets at most s input frames, and
// every input frame at most s of the fragment's.
class LimitedSteps {
 public:
  LimitedSteps(const Database& database, int slope_limit)
      : offset_(database.offset),
        run_count_(static_cast<std::size_t>(slope_limit - 1)),
        state_count_(2 * run_count_ + 1),
        cells_(state_count_ * database.offset.back()),
        above_(state_count_),
        diagonal_(state_count_) {}

  Cell advance(std::size_t i, const Cell& entering, const double* d) {
    const std::size_t length = offset_[i + 1] - offset_[i];
    for (std::size_t q = 0; q < length; ++q) {
      Cell* cell = cells_.data() + (offset_[i] + q) * state_count_;
      std::copy_n(cell, state_count_, above_.begin());
      cell[0] = extended(q == 0 ? entering : best_of(diagonal_.data()), d[q]);
      const Cell* left = q == 0 ? nullptr : cell - state_count_;
      for (std::size_t k = 0; k < run_count_; ++k) {
        const std::size_t before_hold = k == 0 ? 0 : k;
        const std::size_t before_skip = k == 0 ? 0 : run_count_ + k;
        cell[1 + k] = extended(above_[before_hold], d[q]);
        cell[1 + run_count_ + k] = left == nullptr ? Cell{} : extended(left[before_skip], d[q]);
      }
      diagonal_.swap(above_);
    }
    return best_of(cells_.data() + (offset_[i + 1] - 1) * state_count_);
  }

 private:
  [[nodiscard]] Cell best_of(const Cell* states) const {
    Cell best = states[0];
    for (std::size_t k = 1; k < state_count_; ++k) {
      if (states[k].cost < best.cost) best = states[k];
    }
    return best;
  }

  const std::vector<std::size_t>& offset_;
  std::size_t run_count_;    // s - 1
  std::size_t state_count_;  // 2 s - 1
  std::vector<Cell> cells_;  // states of a database frame side by side
  std::vector<Cell> above_;
  std::vector<Cell> diagonal_;
};

// The best finished snippet at every input frame.
template <typename Steps>
std::vector<Finished> run(const Eigen::Ref<const Eigen::MatrixXd>& input, const Database& database,
                          double snippet_cost, Steps steps) {
  const int frame_count = static_cast<int>(input.cols());
  const std::size_t fragment_count = database.offset.size() - 1;
  const Eigen::Ref<const Eigen::MatrixXd> frames = database.frames;
  LocalDistance distance(input, frames);
  std::vector<Finished> finished(static_cast<std::size_t>(frame_count));
  double cost_before = 0.0;  // of the chain that ends before this frame
  for (int begin = 0; begin < frame_count; begin += kBlockFrames) {
    const int count = std::min(kBlockFrames, frame_count - begin);
    const Eigen::MatrixXd& block = distance.block(begin, count);
    for (int p = begin; p < begin + count; ++p) {
      const double* d = block.col(p - begin).data();
      const Cell entering = Cell::entering(cost_before + snippet_cost, p);
      Finished& best = finished[static_cast<std::size_t>(p)];
      for (std::size_t i = 0; i < fragment_count; ++i) {
        const Cell cell = steps.advance(i, entering, d + database.offset[i]);
        if (cell.cost < best.cell.cost) best = {cell, static_cast<int>(i)};
      }
      cost_before = best.cell.cost;
    }
  }
  return finished;
}

std::optional<Segmentation> trace_back(const std::vector<Finished>& finished, double snippet_cost) {
  if (finished.back().cell.cost == kInfinity) return std::nullopt;
  Segmentation result;
  result.cost = finished.back().cell.cost;
  for (int end = static_cast<int>(finished.size()); end > 0;) {
    const Finished& last = finished[static_cast<std::size_t>(end - 1)];
    const int begin = last.cell.entry();
    const double before =
        begin == 0 ? 0.0 : finished[static_cast<std::size_t>(begin - 1)].cell.cost;
    // The difference of two sums may fall below 0 by round-off.
    const double cost = std::max(0.0, last.cell.cost - before - snippet_cost);
    result.snippets.push_back({begin, end, last.fragment, cost, last.cell.length()});
    end = begin;
  }
  std::reverse(result.snippets.begin(), result.snippets.end());
  return result;
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
  if (!(snippet_cost >= 0.0) || snippet_cost == kInfinity) {
    found.push_back("SegmentOptions::snippet_cost = " + std::to_string(snippet_cost) +
                    " (must be finite and >= 0)");
  }
  if (slope_limit.has_value() && *slope_limit < 2) {
    found.push_back("SegmentOptions::slope_limit = " + std::to_string(*slope_limit) +
                    " (must be >= 2)");
  }
  return found;
}

std::optional<Segmentation> segment(const Eigen::Ref<const Eigen::MatrixXd>& input,
                                    std::span<const Eigen::MatrixXd> fragments,
                                    const SegmentOptions& options) {
  require_valid(input, fragments, options);
  const Database database(fragments);
  const std::vector<Finished> finished =
      options.slope_limit.has_value()
          ? run(input, database, options.snippet_cost, LimitedSteps(database, *options.slope_limit))
          : run(input, database, options.snippet_cost, FreeSteps(database));
  return trace_back(finished, options.snippet_cost);
}

}  // namespace laban::align
