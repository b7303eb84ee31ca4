#include "laban/align/dtw.h"

#include <algorithm>
#include <cstdint>

#include "laban/math/constants.h"

#include "align/local_distance.h"

namespace laban::align {
namespace {

// Notation [Torresani06, eq. 3-5]      here (frames count from 0)
//   X_i(p), X_j(q)   pose vectors      x.col(p), y.col(q)
//   d(p, q)          local distance    d[q], one column of a block a frame p
//   w(n)             path              DtwResult::path
//
// g(p, q) = d(p, q) + min{ g(p-1, q-1), g(p-1, q), g(p, q-1) },  g(0, 0) = d(0, 0).

constexpr int kBlockFrames = 32;  // a block of distances stays in the second-level cache

enum class Step : std::uint8_t { kDiagonal, kAdvanceP, kAdvanceQ };

void require_pair(const Eigen::Ref<const Eigen::MatrixXd>& x,
                  const Eigen::Ref<const Eigen::MatrixXd>& y) {
  require_sequence(x, "dtw: first sequence");
  require_sequence(y, "dtw: second sequence");
  require_same_rows(y.rows(), x.rows(), "dtw: second sequence");
}

// Calls row(p, d) for p = 0 .. N-1, d pointing to the M distances of frame p.
template <typename Row>
void for_each_row(const Eigen::Ref<const Eigen::MatrixXd>& x,
                  const Eigen::Ref<const Eigen::MatrixXd>& y, const Row& row) {
  LocalDistance distance(x, y);
  const int n = static_cast<int>(x.cols());
  for (int begin = 0; begin < n; begin += kBlockFrames) {
    const int count = std::min(kBlockFrames, n - begin);
    const Eigen::MatrixXd& block = distance.block(begin, count);
    for (int b = 0; b < count; ++b) {
      row(begin + b, block.col(b).data());
    }
  }
}

std::vector<FramePair> trace_back(const std::vector<Step>& steps, int n, int m) {
  std::vector<FramePair> path;
  FramePair cell{n - 1, m - 1};
  path.push_back(cell);
  while (cell.p > 0 || cell.q > 0) {
    const Step step = steps[static_cast<std::size_t>(cell.p) * static_cast<std::size_t>(m) +
                            static_cast<std::size_t>(cell.q)];
    cell.p -= step == Step::kAdvanceQ ? 0 : 1;
    cell.q -= step == Step::kAdvanceP ? 0 : 1;
    path.push_back(cell);
  }
  std::reverse(path.begin(), path.end());
  return path;
}

// Sum and number of cells of the best path to a cell.
struct Partial {
  double cost = math::kInfinity;
  std::int64_t length = 0;
};

// `b` only if it is cheaper, without a branch: on real distances one would be mispredicted often.
[[nodiscard]] inline Partial cheaper(const Partial& a, const Partial& b) {
  const bool second = b.cost < a.cost;
  return {second ? b.cost : a.cost, second ? b.length : a.length};
}

// Rows run over x, so the memory is that of y. `transposed`: the caller swapped the sequences, and
// ties between the two straight steps go the other way round.
DtwCost cost_by_rows(const Eigen::Ref<const Eigen::MatrixXd>& x,
                     const Eigen::Ref<const Eigen::MatrixXd>& y, bool transposed) {
  const auto m = static_cast<std::size_t>(y.cols());
  std::vector<Partial> g(m);  // of the previous frame p right of q, of this one left of it
  for_each_row(x, y, [&](int p, const double* d) {
    Partial diagonal = p == 0 ? Partial{0.0, 0} : Partial{};
    Partial left;
    for (std::size_t q = 0; q < m; ++q) {
      const Partial above = g[q];
      const Partial best = transposed ? cheaper(cheaper(diagonal, left), above)
                                      : cheaper(cheaper(diagonal, above), left);
      left = {best.cost + d[q], best.length + 1};
      g[q] = left;
      diagonal = above;
    }
  });
  return {g.back().cost, static_cast<int>(g.back().length)};
}

}  // namespace

DtwResult dtw(const Eigen::Ref<const Eigen::MatrixXd>& x,
              const Eigen::Ref<const Eigen::MatrixXd>& y) {
  require_pair(x, y);
  const auto n = static_cast<std::size_t>(x.cols());
  const auto m = static_cast<std::size_t>(y.cols());
  std::vector<double> g(m, math::kInfinity);  // of frame p - 1 right of q, of frame p left of it
  std::vector<Step> steps(n * m);
  for_each_row(x, y, [&](int p, const double* d) {
    double diagonal = p == 0 ? 0.0 : math::kInfinity;
    double left = math::kInfinity;
    Step* step = steps.data() + static_cast<std::size_t>(p) * m;
    for (std::size_t q = 0; q < m; ++q) {
      const double above = g[q];
      double best = diagonal;
      step[q] = Step::kDiagonal;
      if (above < best) {
        best = above;
        step[q] = Step::kAdvanceP;
      }
      if (left < best) {
        best = left;
        step[q] = Step::kAdvanceQ;
      }
      left = best + d[q];
      g[q] = left;
      diagonal = above;
    }
  });
  return {g.back(), trace_back(steps, static_cast<int>(n), static_cast<int>(m))};
}

DtwCost dtw_cost(const Eigen::Ref<const Eigen::MatrixXd>& x,
                 const Eigen::Ref<const Eigen::MatrixXd>& y) {
  require_pair(x, y);
  return y.cols() <= x.cols() ? cost_by_rows(x, y, false) : cost_by_rows(y, x, true);
}

}  // namespace laban::align
