#include "laban/texture/texton_walk.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/rotation.h"

#include "texture/pose_index.h"
#include "texture/pose_join.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

// The shortest stay in a segment, where it is long enough: joins on either side of it need room.
constexpr double kStayS = 0.5;
// How long before its end a take may be left.
constexpr double kTailS = 5.0;
// What is repeated of the seconds to come, and left out of those just before, is counted so far.
constexpr double kAheadS = 2.0;
constexpr double kBehindS = 1.0;
constexpr int kMostRevisits = 3;
constexpr int kMostCandidates = 24;
constexpr int kPairsSorted = 4000;
// Changes of nearly the same cost are drawn from, or every walk would make the same.
constexpr double kAlike = 0.25;
// Joints may get so far from what they were seen to do; each two degrees beyond cost as much as a
// usual distance.
constexpr double kFarTurn = 10.0 * math::kDegree;
constexpr double kFarTurnUnit = 2.0 * math::kDegree;

std::size_t at(int index) {
  return static_cast<std::size_t>(index);
}

/// A change to another place of the corpus that could be made.
struct Crossing {
  int leave = 0;
  int enter = 0;
  double cost = 0.0;  ///< in usual distances
};

}  // namespace

class TextonWalk::Impl {
 public:
  Impl(const MotionTexture& texture, std::optional<int> first, base::Rng rng)
      : texture_(texture),
        segments_(at(texture.texton_count())),
        index_(texture),
        range_(texture),
        visits_(static_cast<std::size_t>(texture.observations.cols() / kIndexStride + 1), 0),
        rng_(rng) {
    if (texture.segments.empty()) {
      throw Error(ErrorKind::kUsage, "a walk needs a texture with at least one segment");
    }
    for (int s = 0; s < static_cast<int>(texture.segments.size()); ++s) {
      segments_[at(segment(s).texton)].push_back(s);
    }
    if (first &&
        (*first < 0 || *first >= texture.texton_count() || segments_[at(*first)].empty())) {
      throw Error(ErrorKind::kUsage, "there is no texton " + std::to_string(*first) +
                                         " with a segment; there are 0 to " +
                                         std::to_string(texture.texton_count() - 1));
    }
    segment_ = first ? drawn(segments_[at(*first)])
                     : rng_.index(static_cast<int>(texture.segments.size()));
    entered_ = segment(segment_).begin;
  }

  [[nodiscard]] int texton() const noexcept { return segment(segment_).texton; }
  [[nodiscard]] int segment() const noexcept { return segment_; }
  [[nodiscard]] int entered() const noexcept { return entered_; }

  TextonChange next() {
    const TextonChange change = find_change();
    for (int block = entered_ / kIndexStride; block <= change.leave / kIndexStride; ++block) {
      ++visits_[at(block)];
    }
    segment_ = change.entering;
    entered_ = change.enter;
    return change;
  }

 private:
  [[nodiscard]] const Segment& segment(int s) const { return texture_.segments[at(s)]; }
  [[nodiscard]] int end_of(int s) const { return segment(s).begin + segment(s).length; }
  [[nodiscard]] int frames(double seconds) const {
    return static_cast<int>(std::lround(seconds * texture_.frame_rate_hz));
  }
  [[nodiscard]] int drawn(const std::vector<int>& list) {
    return list[at(rng_.index(static_cast<int>(list.size())))];
  }
  [[nodiscard]] int take_end(int frame) const {
    const Take& take = texture_.takes[at(index_.take_of(frame))];
    return take.begin + take.length;
  }
  [[nodiscard]] int segment_of(int frame) const {
    const auto after =
        std::upper_bound(texture_.segments.begin(), texture_.segments.end(), frame,
                         [](int value, const Segment& one) { return value < one.begin; });
    return static_cast<int>(after - texture_.segments.begin()) - 1;
  }
  /// Whether the next segment follows this one in the same take.
  [[nodiscard]] bool follows(int s) const { return end_of(s) < take_end(segment(s).begin); }
  [[nodiscard]] int earliest_leave() const {
    return entered_ + std::max(3, std::min(frames(kStayS), (end_of(segment_) - entered_) / 2));
  }

  TextonChange find_change() {
    const int end = take_end(entered_);
    if (end - entered_ <= frames(kTailS)) {
      const auto exit = way_out(end);
      if (exit && (exit->leave < end_of(segment_) || !follows(segment_))) return crossed(*exit);
    }
    const std::optional<int> change = drawn_change();
    if (change && *change != segment_) {
      if (const auto crossing = way_to(*change)) return crossed(*crossing);
    }
    if (change && follows(segment_)) return captured_change();
    if (const auto exit = way_out(end)) return crossed(*exit);
    if (follows(segment_)) return captured_change();
    return begun_anew();
  }

  [[nodiscard]] TextonChange captured_change() const {
    const int next = segment(segment_ + 1).begin;
    return {segment_, segment_ + 1, next, next, false};
  }

  [[nodiscard]] TextonChange crossed(const Crossing& crossing) const {
    const int entering = segment_of(crossing.enter);
    const int leaving = segment_of(crossing.leave);
    const bool seen = texture_.transition_counts(segment(leaving).texton,
                                                 segment(entering).texton) > 0.0;
    return {segment_, entering, crossing.leave, crossing.enter, !seen};
  }

  /// Where no frame fits: from the end of what there is to the beginning of any segment.
  [[nodiscard]] TextonChange begun_anew() {
    std::vector<int> others;
    for (int s = 0; s < static_cast<int>(texture_.segments.size()); ++s) {
      if (segment(s).length >= 2) others.push_back(s);
    }
    if (others.empty()) {
      throw Error(ErrorKind::kData,
                  "no segment of two frames to go on with from texton " + std::to_string(texton()));
    }
    const int entering = drawn(others);
    return {segment_, entering, std::max(entered_, end_of(segment_) - 2), segment(entering).begin,
            texture_.transition_counts(texton(), segment(entering).texton) == 0.0};
  }

  /// A segment from which the corpus went on, each of the texton's as likely as any other: that is
  /// the row of M. None where nothing is known to follow, or nothing but the texton itself and a
  /// take ended with it.
  std::optional<int> drawn_change() {
    std::vector<int> known;
    bool only_itself = true;
    int ends = 0;
    for (const int s : segments_[at(texton())]) {
      if (!follows(s)) {
        ++ends;
        continue;
      }
      only_itself = only_itself && segment(s + 1).texton == texton();
      known.push_back(s);
    }
    if (known.empty()) return std::nullopt;
    const int choices = static_cast<int>(known.size()) + (only_itself ? ends : 0);
    const int n = rng_.index(choices);
    if (n >= static_cast<int>(known.size())) return std::nullopt;
    return known[at(n)];
  }

  /// From this segment to where another one of its texton went on, if that is near enough.
  std::optional<Crossing> way_to(int other) const {
    const int from = earliest_leave();
    const int to = std::min(end_of(segment_), take_end(entered_) - 1);
    const int enter_from = segment(other).begin + segment(other).length / 2;
    const int enter_to = std::min(segment(other + 1).begin + segment(other + 1).length / 3,
                                  take_end(enter_from) - 1);
    if (from >= to || enter_from >= enter_to) return std::nullopt;
    const MatrixXf d = squared_distances(index_.features(from, to - from),
                                         index_.features(enter_from, enter_to - enter_from));
    std::optional<Crossing> best;
    double least = index_.usual_distance();
    for (Index g = 0; g < d.cols(); ++g) {
      const int enter = enter_from + static_cast<int>(g);
      if (end_of(segment_of(enter)) - enter < frames(kStayS)) continue;
      for (Index f = 0; f < d.rows(); ++f) {
        const double distance = std::sqrt(static_cast<double>(d(f, g)));
        if (distance > least) continue;
        least = distance;
        best = {from + static_cast<int>(f), enter, 0.0};
      }
    }
    if (best && far_turn(*best) > kFarTurn) return std::nullopt;
    return best;
  }

  /// How much of the coming seconds was walked on before, 0 to kMostRevisits, beside the least
  /// visited place of the corpus.
  [[nodiscard]] double revisits(int enter, int least) const {
    const int last = std::min(enter + frames(kAheadS), take_end(enter)) / kIndexStride;
    double sum = 0.0;
    int count = 0;
    for (int block = enter / kIndexStride; block <= last; ++block, ++count) {
      sum += std::min(kMostRevisits, visits_[at(block)] - least);
    }
    return sum / std::max(1, count);
  }

  /// Seconds just before a frame that were visited less than the frame itself: they would be left
  /// out once more.
  [[nodiscard]] double left_out_s(int enter) const {
    const int begin = texture_.takes[at(index_.take_of(enter))].begin;
    const int here = visits_[at(enter / kIndexStride)];
    int frame = enter;
    while (frame > begin && enter - frame < frames(kBehindS) &&
           visits_[at(std::max(begin, frame - kIndexStride) / kIndexStride)] <= here) {
      frame -= kIndexStride;
    }
    return (enter - std::max(begin, frame)) / texture_.frame_rate_hz;
  }

  /// What it costs to enter each coarse frame; infinite where nothing is worth entering.
  [[nodiscard]] Eigen::VectorXf entry_costs() const {
    const std::vector<int>& entries = index_.coarse_frames();
    const int least = *std::min_element(visits_.begin(), visits_.end());
    Eigen::VectorXf costs(std::ssize(entries));
    for (Index n = 0; n < costs.size(); ++n) {
      const int frame = entries[static_cast<std::size_t>(n)];
      const bool good = index_.is_calm(frame) &&
                        end_of(segment_of(frame)) - frame >= frames(kStayS) &&
                        take_end(frame) - frame >= texture_.min_frames;
      costs[n] = good ? static_cast<float>(revisits(frame, least) + left_out_s(frame))
                      : std::numeric_limits<float>::infinity();
    }
    return costs;
  }

  /// The best places to leave the rest of the take for any other, before its `end`.
  [[nodiscard]] std::vector<Crossing> crossings(int end) const {
    const int from = earliest_leave();
    const int count = end - 1 - from;
    if (count < 1 || index_.coarse_frames().empty()) return {};
    const Eigen::VectorXf entries = entry_costs();
    MatrixXf costs = squared_distances(index_.features(from, count, kIndexStride),
                                       index_.coarse_features());
    const auto usual = static_cast<float>(std::max(1e-9, index_.usual_distance()));
    costs = costs.cwiseSqrt() / usual;
    costs.rowwise() += entries.transpose();
    std::vector<Crossing> found;
    const int second = frames(1.0);
    for (Index f = 0; f < costs.rows(); ++f) {
      const int leave = from + static_cast<int>(f) * kIndexStride;
      const double lost = (end - leave) / texture_.frame_rate_hz + (index_.is_calm(leave) ? 0 : 2);
      for (Index g = 0; g < costs.cols(); ++g) {
        const int enter = index_.coarse_frames()[static_cast<std::size_t>(g)];
        if (std::abs(enter - leave) < second || !std::isfinite(costs(f, g))) continue;
        found.push_back({leave, enter, static_cast<double>(costs(f, g)) + lost});
      }
    }
    return best_apart(std::move(found));
  }

  /// The cheapest ones, none near a cheaper one.
  [[nodiscard]] static std::vector<Crossing> best_apart(std::vector<Crossing> all) {
    const auto sorted = std::min<std::size_t>(all.size(), kPairsSorted);
    std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(sorted), all.end(),
                      [](const Crossing& a, const Crossing& b) { return a.cost < b.cost; });
    all.resize(sorted);
    std::vector<Crossing> kept;
    for (const Crossing& one : all) {
      if (static_cast<int>(kept.size()) >= kMostCandidates) break;
      const auto near = [&](const Crossing& other) {
        return std::abs(one.leave - other.leave) + std::abs(one.enter - other.enter) <=
               3 * kIndexStride;
      };
      if (std::none_of(kept.begin(), kept.end(), near)) kept.push_back(one);
    }
    return kept;
  }

  /// The same crossing at the nearest frames beside it.
  [[nodiscard]] Crossing refined(const Crossing& coarse, int end) const {
    constexpr int kReach = kIndexStride - 1;
    const Take& other = texture_.takes[at(index_.take_of(coarse.enter))];
    const int from = std::max(earliest_leave(), coarse.leave - kReach);
    const int to = std::min(end - 1, coarse.leave + kReach + 1);
    const int enter_from = std::max(other.begin, coarse.enter - kReach);
    const int enter_to =
        std::min(other.begin + other.length - 1, coarse.enter + kReach + 1);
    const MatrixXf d = squared_distances(index_.features(from, to - from),
                                         index_.features(enter_from, enter_to - enter_from));
    const double before =
        static_cast<double>(d(coarse.leave - from, coarse.enter - enter_from));
    Index f = 0;
    Index g = 0;
    const double after = static_cast<double>(d.minCoeff(&f, &g));
    const double usual = std::max(1e-9, index_.usual_distance());
    return {from + static_cast<int>(f), enter_from + static_cast<int>(g),
            coarse.cost + (std::sqrt(after) - std::sqrt(before)) / usual};
  }

  /// Out of the take that ends before frame `end`, by one of the cheapest ways.
  std::optional<Crossing> way_out(int end) {
    std::vector<Crossing> ways;
    double least = math::kInfinity;
    for (const Crossing& coarse : crossings(end)) {
      Crossing way = refined(coarse, end);
      way.cost += std::max(0.0, far_turn(way) - kFarTurn) / kFarTurnUnit;
      least = std::min(least, way.cost);
      ways.push_back(way);
    }
    std::erase_if(ways, [&](const Crossing& way) { return way.cost > least + kAlike; });
    if (ways.empty()) return std::nullopt;
    return ways[at(rng_.index(static_cast<int>(ways.size())))];
  }

  /// How far any joint gets from what it was seen to do while a crossing is made, radians, at most:
  /// less than 2 kFarTurn / 2 is not looked into.
  [[nodiscard]] double far_turn(const Crossing& way) const {
    const MatrixXd& y = texture_.observations;
    const MatrixXd half = 0.5 * offsets_between(texture_.space, y.middleCols(way.leave, 2),
                                                y.middleCols(way.enter, 2));
    const MatrixXd none = MatrixXd::Zero(y.rows(), 2);
    const int before = std::min(frames(kBehindS), way.leave + 2 - entered_);
    const int after = std::min(frames(kBehindS), take_end(way.enter) - way.enter);
    double farthest = 0.0;
    if (before >= 4) {
      farthest = farthest_turn(y.middleCols(way.leave + 2 - before, before),
                               offset_curve(texture_, before, none, half));
    }
    if (after >= 4) {
      farthest = std::max(farthest, farthest_turn(y.middleCols(way.enter, after),
                                                  offset_curve(texture_, after, -half, none)));
    }
    return farthest;
  }

  [[nodiscard]] double farthest_turn(const Eigen::Ref<const MatrixXd>& y,
                                     const MatrixXd& offsets) const {
    constexpr int kEvery = 3;
    double farthest = 0.0;
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      const Index row = static_cast<Index>(3) * s;
      const auto scale = texture_.space.scale.segment<3>(row);
      for (Index f = 0; f < y.cols(); f += kEvery) {
        const Eigen::Vector3d turn = offsets.block<3, 1>(row, f).cwiseQuotient(scale);
        if (turn.norm() <= std::max(farthest, kFarTurn)) continue;  // so near to its own frame
        const Eigen::Quaterniond turned =
            math::exp(y.block<3, 1>(row, f).cwiseQuotient(scale)) * math::exp(turn);
        farthest = std::max(farthest, range_.distance(s, turned));
      }
    }
    return farthest;
  }

  const MotionTexture& texture_;
  std::vector<std::vector<int>> segments_;  // of each texton
  PoseIndex index_;
  RotationRange range_;
  std::vector<int> visits_;  // of each kIndexStride frames of the corpus
  base::Rng rng_;
  int segment_ = 0;
  int entered_ = 0;
};

TextonWalk::TextonWalk(const MotionTexture& texture, std::optional<int> first, base::Rng rng)
    : impl_(std::make_unique<Impl>(texture, first, rng)) {}
TextonWalk::TextonWalk(TextonWalk&&) noexcept = default;
TextonWalk& TextonWalk::operator=(TextonWalk&&) noexcept = default;
TextonWalk::~TextonWalk() = default;

int TextonWalk::texton() const noexcept {
  return impl_->texton();
}
int TextonWalk::segment() const noexcept {
  return impl_->segment();
}
int TextonWalk::entered() const noexcept {
  return impl_->entered();
}
TextonChange TextonWalk::next() {
  return impl_->next();
}

}  // namespace laban::texture
