#include "laban/align/one_stage_dp.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>

#include "laban/base/error.h"

#include "align/local_distance.h"

namespace laban::align {
namespace {

// Notation [Torresani06, eq. 8-11]       here (all counts from 0)
//   Y(p), T        input, its length      input.col(p), T
//   X_i(q), T_i    fragment i             Database: frames.col(column(i, q)), length[i]
//   d(p, q, i)     local distance         d[column(i, q)]
//   w(n)           path (p, q, i)         never stored: a cell carries where its snippet began
//
// [Ney84]: with (entry frame, best finished snippet a frame) the chain of snippets is traced back
// in memory O(T + S).

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kBlockFrames = 32;   // input frames a product: S x 32 distances at a time
constexpr std::size_t kLanes = 4;  // fragments side by side: their recursions do not wait for
                                   // each other

// The best path to a cell: its cost from the input's first frame, and of its current snippet the
// first input frame (upper half) and the number of cells so far (lower half).
struct Cell {
  double cost = kInfinity;
  std::int64_t snippet = 0;

  [[nodiscard]] static Cell entering(double cost, int frame) {
    return {cost, static_cast<std::int64_t>(frame) << 32};
  }
  [[nodiscard]] int entry() const { return static_cast<int>(snippet >> 32); }
  [[nodiscard]] int length() const { return static_cast<int>(snippet & 0xffffffff); }
};

// The best chain of snippets that ends at an input frame with a fragment's last frame.
struct Finished {
  Cell cell;
  int fragment = 0;
};

// All fragments in groups of kLanes of about one length, frame q of a group's fragments side by
// side. Shorter fragments and empty lanes are padded with zeros: what the recursion makes of them
// is never looked at, as nothing flows back from behind a fragment's end.
struct Database {
  struct Group {
    std::size_t begin;   // first column / kLanes
    std::size_t length;  // of its longest fragment
  };
  Eigen::MatrixXd frames;           // D x (S + padding)
  std::vector<Group> groups;        //
  std::vector<std::size_t> length;  // T_i
  std::vector<std::size_t> first;   // column of a fragment's frame 0

  explicit Database(std::span<const Eigen::MatrixXd> fragments)
      : length(fragments.size()), first(fragments.size()) {
    std::vector<std::size_t> longest_first(fragments.size());
    std::iota(longest_first.begin(), longest_first.end(), std::size_t{0});
    std::stable_sort(longest_first.begin(), longest_first.end(), [&](std::size_t a, std::size_t b) {
      return fragments[a].cols() > fragments[b].cols();
    });
    std::size_t begin = 0;
    for (std::size_t n = 0; n < longest_first.size(); ++n) {
      const std::size_t i = longest_first[n];
      length[i] = static_cast<std::size_t>(fragments[i].cols());
      if (n % kLanes == 0) {
        groups.push_back({begin, length[i]});
        begin += length[i];
      }
      first[i] = groups.back().begin * kLanes + n % kLanes;
    }
    frames.setZero(fragments[0].rows(), static_cast<Eigen::Index>(begin * kLanes));
    for (std::size_t i = 0; i < fragments.size(); ++i) {
      for (std::size_t q = 0; q < length[i]; ++q) {
        frames.col(static_cast<Eigen::Index>(column(i, q))) =
            fragments[i].col(static_cast<Eigen::Index>(q));
      }
    }
  }

  [[nodiscard]] std::size_t column(std::size_t i, std::size_t q) const {
    return first[i] + q * kLanes;
  }
  [[nodiscard]] std::size_t last_column(std::size_t i) const { return column(i, length[i] - 1); }
};

// The paper's steps: one cell a database frame, overwritten from input frame to input frame.
class FreeSteps {
 public:
  explicit FreeSteps(const Database& database)
      : database_(database),
        cells_(static_cast<std::size_t>(database.frames.cols()) / kLanes, all_lanes(Cell{})) {}

  // Moves on by an input frame. `entering` begins a snippet at it, without its distance.
  void advance(const Cell& entering, const double* d) {
    for (const Database::Group& group : database_.groups) {
      advance_group(group, entering, d + group.begin * kLanes);
    }
  }

  // The best path to the end of a fragment at the present input frame.
  [[nodiscard]] Cell finished(std::size_t i) const {
    const std::size_t column = database_.last_column(i);
    const LaneCells& cells = cells_[column / kLanes];
    const std::size_t lane = column % kLanes;
    return {cells.cost[lane / kWidth][lane % kWidth], cells.snippet[lane / kWidth][lane % kWidth]};
  }

 private:
  // Vectors of the compiler (g++ and clang++): arithmetic, comparison and choice lane by lane. 16
  // bytes is what every x86-64 and AArch64 has; wider ones would be taken apart again.
  static constexpr std::size_t kWidth = 2;
  using Costs = double __attribute__((vector_size(kWidth * sizeof(double))));
  using Snippets = std::int64_t __attribute__((vector_size(kWidth * sizeof(std::int64_t))));
  struct LaneCells {
    std::array<Costs, kLanes / kWidth> cost;
    std::array<Snippets, kLanes / kWidth> snippet;
  };

  [[nodiscard]] static LaneCells all_lanes(const Cell& cell) {
    LaneCells cells;
    cells.cost.fill(Costs{} + cell.cost);
    cells.snippet.fill(Snippets{} + cell.snippet);
    return cells;
  }

  // The recursion of eq. 9-11 on kLanes fragments at once. A later predecessor is taken only if it
  // is cheaper, so ties go to the one named first.
  void advance_group(const Database::Group& group, const Cell& entering, const double* d) {
    LaneCells* cell = cells_.data() + group.begin;
    LaneCells diagonal = all_lanes(Cell{});
    LaneCells left = all_lanes(entering);
    for (std::size_t q = 0; q < group.length; ++q) {
      const LaneCells above = cell[q];
      for (std::size_t v = 0; v < kLanes / kWidth; ++v) {
        Costs distance;
        std::memcpy(&distance, d + q * kLanes + v * kWidth, sizeof distance);
        Costs cost = diagonal.cost[v];
        Snippets snippet = diagonal.snippet[v];
        const auto hold = above.cost[v] < cost;
        cost = hold ? above.cost[v] : cost;
        snippet = hold ? above.snippet[v] : snippet;
        const auto skip = left.cost[v] < cost;
        cost = skip ? left.cost[v] : cost;
        snippet = skip ? left.snippet[v] : snippet;
        left.cost[v] = cost + distance;
        left.snippet[v] = snippet + 1;
      }
      cell[q] = left;
      diagonal = above;
    }
  }

  const Database& database_;
  std::vector<LaneCells> cells_;  // of the previous input frame
};

// Steps under a slope limit s. A cell has 2 s - 1 states: reached diagonally (or by entering), by k
// holds (p-1, q) in a row, or by k skips (p, q-1) in a row, k = 1 .. s - 1. Holds and skips begin
// after a diagonal step only, so every frame of the fragment meets at most s input frames, and
// every input frame at most s of the fragment's.
class LimitedSteps {
 public:
  LimitedSteps(const Database& database, int slope_limit)
      : database_(database),
        run_count_(static_cast<std::size_t>(slope_limit - 1)),
        state_count_(2 * run_count_ + 1),
        cells_(state_count_ * static_cast<std::size_t>(database.frames.cols())),
        above_(state_count_),
        diagonal_(state_count_) {}

  void advance(const Cell& entering, const double* d) {
    for (std::size_t i = 0; i < database_.length.size(); ++i) advance_fragment(i, entering, d);
  }

  [[nodiscard]] Cell finished(std::size_t i) const {
    return best_of(cells_.data() + database_.last_column(i) * state_count_);
  }

 private:
  void advance_fragment(std::size_t i, const Cell& entering, const double* d) {
    for (std::size_t q = 0; q < database_.length[i]; ++q) {
      const std::size_t column = database_.column(i, q);
      Cell* cell = cells_.data() + column * state_count_;
      std::copy_n(cell, state_count_, above_.begin());
      const Cell* left = q == 0 ? nullptr : cell - kLanes * state_count_;
      cell[0] = extended(q == 0 ? entering : best_of(diagonal_.data()), d[column]);
      for (std::size_t k = 0; k < run_count_; ++k) {
        const std::size_t before_skip = k == 0 ? 0 : run_count_ + k;
        cell[1 + k] = extended(above_[k], d[column]);
        cell[1 + run_count_ + k] =
            left == nullptr ? Cell{} : extended(left[before_skip], d[column]);
      }
      diagonal_.swap(above_);
    }
  }

  [[nodiscard]] static Cell extended(const Cell& cell, double distance) {
    return {cell.cost + distance, cell.snippet + 1};
  }

  [[nodiscard]] Cell best_of(const Cell* states) const {
    Cell best = states[0];
    for (std::size_t k = 1; k < state_count_; ++k) {
      if (states[k].cost < best.cost) best = states[k];
    }
    return best;
  }

  const Database& database_;
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
  LocalDistance distance(input, database.frames);
  std::vector<Finished> finished(static_cast<std::size_t>(frame_count));
  double cost_before = 0.0;  // of the chain that ends before this frame
  for (int begin = 0; begin < frame_count; begin += kBlockFrames) {
    const int count = std::min(kBlockFrames, frame_count - begin);
    const Eigen::MatrixXd& block = distance.block(begin, count);
    for (int p = begin; p < begin + count; ++p) {
      steps.advance(Cell::entering(cost_before + snippet_cost, p), block.col(p - begin).data());
      Finished& best = finished[static_cast<std::size_t>(p)];
      for (std::size_t i = 0; i < database.length.size(); ++i) {
        const Cell cell = steps.finished(i);
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
