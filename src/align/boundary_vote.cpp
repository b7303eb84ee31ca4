#include "align/boundary_vote.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "laban/align/dtw.h"

#include "align/local_distance.h"

namespace laban::align {
namespace {

// A path as cheap as this fits perfectly: what is below is round-off.
constexpr double kNoCost = 1e-9;

// Cost of the cheapest path of every prefix of x to the whole of y, as dtw's.
std::vector<double> prefix_costs(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  constexpr int kBlockFrames = 32;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  LocalDistance distance(x, y);
  std::vector<double> cells(static_cast<std::size_t>(y.cols()), kInfinity);
  std::vector<double> costs;
  for (int begin = 0; begin < x.cols(); begin += kBlockFrames) {
    const int count = std::min(kBlockFrames, static_cast<int>(x.cols()) - begin);
    const Eigen::MatrixXd& block = distance.block(begin, count);
    for (int p = 0; p < count; ++p) {
      double diagonal = begin + p == 0 ? 0.0 : kInfinity;
      double left = kInfinity;
      for (std::size_t q = 0; q < cells.size(); ++q) {
        const double above = cells[q];
        left = std::min({diagonal, above, left}) + block(static_cast<Eigen::Index>(q), p);
        cells[q] = left;
        diagonal = above;
      }
      costs.push_back(left);
    }
  }
  return costs;
}

// Every stride-th frame from `first` on, forward or backward, `count` of them.
Eigen::MatrixXd every(const Eigen::MatrixXd& frames, int first, int stride, int count) {
  return frames(Eigen::all, Eigen::seqN(first, count, stride));
}

// What the snippet on one side of a boundary costs at each place of it.
struct Side {
  std::vector<double> votes;  // weighted mean of the voters' costs
  std::vector<double> own;    // cost of the snippet's own fragment
};

class Voting {
 public:
  Voting(const Eigen::MatrixXd& input, std::span<const Eigen::MatrixXd> fragments,
         std::span<const int> groups, const BoundaryVote& vote)
      : input_(input), fragments_(fragments), groups_(groups), vote_(vote) {}

  // Where the boundary between two neighbours should be. Looked at are the frames a multiple of the
  // stride away from where it is; each snippet keeps its outermost one.
  [[nodiscard]] int boundary(const Snippet& before, const Snippet& after) const {
    const int stride = vote_.stride;
    const int now_before = (before.end - 1 - before.begin) / stride + 1;  // frames on either side
    const int now_after = (after.end - 1 - after.begin) / stride + 1;
    const int most = vote_.reach_frames / stride;
    const int earlier = std::min(most, now_before - 1);
    const int later = std::min(most, now_after - 1);
    const Eigen::MatrixXd forward =
        every(input_, before.end - 1 - (now_before - 1) * stride, stride, now_before + later);
    const Eigen::MatrixXd backward =
        every(input_, after.begin + (now_after - 1) * stride, -stride, now_after + earlier);
    const Side ended = side(forward, before, false, now_before - earlier, now_before);
    const Side begun = side(backward, after, true, now_after - later, now_after);
    const auto sum_at = [&](int shift, std::vector<double> Side::*costs) {
      const int in_ended = earlier + shift;
      const int in_begun = later - shift;
      return (ended.*costs)[static_cast<std::size_t>(in_ended)] +
             (begun.*costs)[static_cast<std::size_t>(in_begun)];
    };
    const double motion_cost = vote_.stillness * sum_at(0, &Side::votes) / (now_before + now_after);
    const auto cost_at = [&](int shift) {
      return sum_at(shift, &Side::votes) + motion_cost * speed_at(after.begin + shift * stride);
    };
    const double most_own = (1.0 + vote_.most_rise) * sum_at(0, &Side::own);
    int best = 0;
    for (int shift = -earlier; shift <= later; ++shift) {
      if (sum_at(shift, &Side::own) > most_own) continue;
      if (cost_at(shift) < cost_at(best)) best = shift;
    }
    return after.begin + best * stride;
  }

  [[nodiscard]] int group_of(const Snippet& snippet) const {
    return groups_[static_cast<std::size_t>(snippet.fragment)];
  }

 private:
  // How fast the input moves before and after a boundary; what lies right at it may be a jump.
  [[nodiscard]] double speed_at(int boundary) const {
    if (vote_.speed.empty()) return 0.0;
    const int last = static_cast<int>(vote_.speed.size()) - 1;
    const int before = std::clamp(boundary - vote_.stride, 0, last);
    const int after = std::clamp(boundary + vote_.stride, 0, last);
    return 0.5 * (vote_.speed[static_cast<std::size_t>(before)] +
                  vote_.speed[static_cast<std::size_t>(after)]);
  }

  // One side of a boundary: of the prefixes of its frames from `least` frames on. The voters are
  // the fragments that are nearest to the snippet as it stands, its first `now` frames.
  [[nodiscard]] Side side(const Eigen::MatrixXd& frames, const Snippet& snippet, bool backward,
                          int least, int now) const {
    Side result;
    std::vector<std::vector<double>> costs;
    for (std::size_t i = 0; i < fragments_.size(); ++i) {
      if (groups_[i] != group_of(snippet)) continue;
      costs.push_back(prefix_costs(frames, thinned(fragments_[i], backward)));
      if (static_cast<int>(i) == snippet.fragment)
        result.own.assign(costs.back().begin() + least - 1, costs.back().end());
    }
    const auto at = static_cast<std::size_t>(now - 1);
    std::stable_sort(costs.begin(), costs.end(),
                     [at](const auto& a, const auto& b) { return a[at] < b[at]; });
    costs.resize(std::min(costs.size(), static_cast<std::size_t>(vote_.voters)));
    std::vector<double> weights;
    for (const std::vector<double>& own : costs) {
      const double cost = std::max(own[at], kNoCost);
      weights.push_back(1.0 / (cost * cost));
    }
    const double whole = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (auto n = static_cast<std::size_t>(least - 1); n < static_cast<std::size_t>(frames.cols());
         ++n) {
      double sum = 0.0;
      for (std::size_t k = 0; k < costs.size(); ++k) sum += weights[k] * costs[k][n];
      result.votes.push_back(sum / whole);
    }
    return result;
  }

  // Every stride-th frame of a fragment, in the direction it is played in.
  [[nodiscard]] Eigen::MatrixXd thinned(const Eigen::MatrixXd& fragment, bool backward) const {
    const int stride = vote_.stride;
    const int count = (static_cast<int>(fragment.cols()) + stride - 1) / stride;
    return backward ? every(fragment, (count - 1) * stride, -stride, count)
                    : every(fragment, 0, stride, count);
  }

  const Eigen::MatrixXd& input_;
  std::span<const Eigen::MatrixXd> fragments_;
  std::span<const int> groups_;
  const BoundaryVote& vote_;
};

}  // namespace

void vote_on_boundaries(const Eigen::MatrixXd& input, std::span<const Eigen::MatrixXd> fragments,
                        std::span<const int> groups, const BoundaryVote& vote,
                        std::vector<Snippet>& snippets, base::Progress* progress) {
  const Voting voting(input, fragments, groups, vote);
  bool moved = false;
  for (std::size_t n = 1; n < snippets.size(); ++n) {
    base::tell(progress, static_cast<double>(n) / static_cast<double>(snippets.size()));
    Snippet& before = snippets[n - 1];
    Snippet& after = snippets[n];
    if (voting.group_of(before) == voting.group_of(after)) continue;
    const int boundary = voting.boundary(before, after);
    moved = moved || boundary != after.begin;
    before.end = boundary;
    after.begin = boundary;
  }
  if (!moved) return;
  for (Snippet& snippet : snippets) {
    const DtwCost own = dtw_cost(input.middleCols(snippet.begin, snippet.end - snippet.begin),
                                 fragments[static_cast<std::size_t>(snippet.fragment)]);
    snippet.cost = own.cost;
    snippet.path_length = own.path_length;
  }
}

}  // namespace laban::align
