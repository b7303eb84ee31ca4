#include "laban/texture/texton_walk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/rotation.h"
#include "laban/texture/constrained_synthesis.h"

#include "texture/at.h"
#include "texture/joint_detour.h"
#include "texture/pose_index.h"
#include "texture/pose_join.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::Quaterniond;

// The shortest stay in a segment, where it is long enough: joins on either side of it need room.
constexpr double kStayS = 0.75;
// Shorter runs through a take count so many usual distances as they are shorter, in seconds.
constexpr double kRunS = 4.0;
// What a second left out at the end of a take counts, and each time that it was walked on less
// than usual: an end is the more seldom walked on the more it costs to come back from there.
constexpr double kSecondLeftOut = 0.1;
constexpr double kSeldomSecond = 3.0;
constexpr double kRestless = 2.0;
// What each visit more than usual of the seconds to come counts: or a walk turns in small circles.
constexpr double kRevisit = 3.0;
// A texton may take over from the one before so long before or after the cut.
constexpr double kHandoverS = 0.25;
// What is repeated of the seconds to come, and left out of those just before, is counted so far.
constexpr double kAheadS = 2.0;
constexpr double kBehindS = 1.0;
constexpr int kMostCandidates = 400;
// So many crossings are looked into in vain once one is found that leads no joint far.
constexpr int kMostInVain = 24;
constexpr int kMostRows = 60;
constexpr int kEntriesOfALeave = 24;
// Changes of nearly the same cost are drawn from, or every walk would make the same.
constexpr double kAlike = 0.25;
// Joints may get so far from what they were seen to do; so much more costs as much as a usual
// distance, twice that four times as much.
constexpr double kFarTurn = 8.0 * math::kDegree;
constexpr double kFarTurnUnit = 1.0 * math::kDegree;
// A take is left well by turns that cost no more than a usual distance. Frames so far apart, from
// the end, are looked at for how well it can be left there, each with so many that are nearest.
constexpr double kLeftWell = 1.0;
constexpr int kBackStride = 2 * kIndexStride;
constexpr int kBackEntries = 40;
// Beside a frame that is to be met halfway no joint is farther from its own than half of what the
// two differ by. Where that is more, it may still have been seen there: each four degrees count as
// one.
constexpr double kFarHalfUnit = 4.0 * math::kDegree;

/// A change to another place of the corpus that could be made.
struct Crossing {
  int leave = 0;
  int enter = 0;
  double cost = 0.0;   ///< in usual distances
  double guess = 0.0;  ///< what of it is guessed of how far joints are led from all they did
};

/// How motion became that of the corpus.
struct Incoming {
  MatrixXd meeting;
  std::vector<JointDetour> detours;
};

/// Frames of the corpus that are walked on from `entered`.
struct Stretch {
  int entered = 0;
  int settled = 0;                                  ///< from this frame on no joint is on a detour
  std::optional<Incoming> incoming = std::nullopt;  ///< none: as captured
};

/// One joint around a crossing. Two frames are where the motions meet.
struct JoinedJoint {
  std::vector<Quaterniond> captured;  ///< to the second that meets as left, from there as entered
  std::vector<Quaterniond> joined;    ///< going to meet halfway and on from there
  int meets = 0;                      ///< the first frame where they meet
};

}  // namespace

class TextonWalk::Impl {
 public:
  Impl(const MotionTexture& texture, std::optional<int> first, base::Rng rng)
      : texture_(texture),
        segments_(at(texture.texton_count())),
        index_(texture),
        range_(texture),
        detours_(texture, range_),
        costs_back_(texture.takes.size()),
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
    if (first) {
      segment_ = drawn(segments_[at(*first)]);
      run_.entered = segment(segment_).begin;
    } else {
      begin_a_take();
    }
  }

  [[nodiscard]] int texton() const noexcept { return segment(segment_).texton; }
  [[nodiscard]] int segment() const noexcept { return segment_; }
  [[nodiscard]] int entered() const noexcept { return run_.entered; }

  TextonChange next() {
    const TextonChange change = find_change();
    for (int block = run_.entered / kIndexStride; block <= change.leave / kIndexStride; ++block) {
      ++visits_[at(block)];
    }
    if (!change.is_captured()) exit_.reset();
    run_ = {change.enter, change.enter};
    if (!change.is_captured()) run_.incoming = Incoming{change.meeting, change.detours};
    for (const JointDetour& detour : change.detours) {
      run_.settled =
          std::max(run_.settled, change.enter + static_cast<int>(detour.entering.cols()));
    }
    if (change.is_captured() || change.entering != drawn_) drawn_.reset();
    segment_ = change.entering;
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
    const int stay = std::max(3, std::min(frames(kStayS), (end_of(segment_) - run_.entered) / 2));
    return std::max(run_.entered + stay, run_.settled + 3);
  }

  /// Where a take begins, each as likely as it is long; after its first frames, if they are those
  /// of a body that falls into its pose.
  void begin_a_take() {
    const int any = rng_.index(static_cast<int>(texture_.observations.cols()));
    run_.entered = texture_.takes[at(index_.take_of(any))].begin;
    segment_ = segment_of(run_.entered);
    const int last = run_.entered + std::min(frames(kStayS), segment(segment_).length / 4);
    const int begin = run_.entered;
    while (run_.entered < last && !index_.is_calm(run_.entered)) ++run_.entered;
    if (run_.entered == last) run_.entered = begin;
  }

  TextonChange find_change() {
    if (!exit_) exit_ = way_out(take_end(run_.entered));
    // A segment is not entered if the take is to be left before there was time to see it.
    if (exit_ && (exit_->leave < end_of(segment_) + frames(kLongestFadeS) || !follows(segment_))) {
      return crossed(*exit_);
    }
    // Come here to go on as this segment did, it does not draw again.
    if (drawn_ == segment_) return captured_change();
    drawn_ = drawn_change();
    if (drawn_ && *drawn_ != segment_) {
      if (const auto crossing = way_to(*drawn_)) return crossed(*crossing);
    }
    return follows(segment_) ? captured_change() : begun_anew();
  }

  /// As the capture goes on. Cuts lie where the motion changes, often in its sharpest moments; the
  /// one texton takes over from the other at the calmest frame near by.
  [[nodiscard]] TextonChange captured_change() const {
    const int cut = segment(segment_ + 1).begin;
    const int from =
        std::max({cut - frames(kHandoverS), run_.entered + (cut - run_.entered) / 2, run_.settled});
    const int to = std::min(cut + frames(kHandoverS), cut + segment(segment_ + 1).length / 3);
    const int frame = index_.calmest(from, std::max(from, to) + 1);
    return {segment_, segment_ + 1, frame, frame, texture_.observations.middleCols(frame, 2),
            {},       false};
  }

  [[nodiscard]] TextonChange crossed(const Crossing& crossing) {
    const int entering = segment_of(crossing.enter);
    const int from = segment(segment_).texton;
    const int to = segment(entering).texton;
    const bool seen = from == to || texture_.transition_counts(from, to) > 0.0;
    return {segment_,
            entering,
            crossing.leave,
            crossing.enter,
            halfway_of(crossing),
            detours_of(run_, crossing).taken,
            !seen};
  }

  [[nodiscard]] MatrixXd halfway_of(const Crossing& crossing) const {
    const MatrixXd& y = texture_.observations;
    return halfway(texture_.space, y.middleCols(crossing.leave, 2),
                   y.middleCols(crossing.enter, 2));
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
    const int leave = std::max(run_.entered, end_of(segment_) - 2);
    return crossed({leave, segment(drawn(others)).begin, 0.0});
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
    const int to = std::min(end_of(segment_), take_end(run_.entered) - 1);
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
    if (best && is_led_far(*best)) return std::nullopt;
    return best;
  }

  /// Whether a walk that enters here has time to see the segment and to leave the take after it.
  [[nodiscard]] bool is_entry(int frame) const {
    return index_.is_calm(frame) && take_end(frame) - frame >= frames(2.0 * kStayS) &&
           end_of(segment_of(frame)) - frame >= frames(kStayS);
  }

  /// What it will cost, sooner or later, to come back from where a crossing leads: poses there may
  /// be near each other but far from all else.
  [[nodiscard]] double cost_back(int enter) {
    const int number = index_.take_of(enter);
    std::optional<std::vector<double>>& costs = costs_back_[at(number)];
    if (!costs) costs = costs_back(texture_.takes[at(number)]);
    const int left = take_end(enter) - 2 - (enter + frames(kStayS));
    const int n = std::max(0, left) / kBackStride;
    return n < std::ssize(*costs) ? (*costs)[at(n)] : 0.0;
  }

  /// What turns cost at least on a way from a take to its first half or to another take, of those
  /// that begin at n kBackStride frames before its end or later. Frames before all of these can be
  /// left well.
  [[nodiscard]] std::vector<double> costs_back(const Take& take) {
    const int middle = take.begin + take.length / 2;
    std::vector<Index> entries;
    for (Index n = 0; n < index_.coarse_features().cols(); ++n) {
      const int enter = index_.coarse_frames()[static_cast<std::size_t>(n)];
      const bool own = enter >= take.begin && enter < take.begin + take.length;
      const bool leads_on = own ? enter < middle : take_end(enter) - enter >= frames(kRunS);
      if (leads_on && is_entry(enter)) entries.push_back(n);
    }
    const MatrixXf features = index_.coarse_features()(Eigen::all, entries);
    std::vector<double> costs;
    double least = math::kInfinity;
    for (int leave = take.begin + take.length - 2; leave > middle; leave -= kBackStride) {
      for (const Index n : nearest(features, index_.features(leave, 1))) {
        const Index entry = entries[static_cast<std::size_t>(n)];
        const int enter = index_.coarse_frames()[static_cast<std::size_t>(entry)];
        const Detours turns = detours_of({take.begin}, {leave, enter}, far_turn_costing(least));
        least = std::min(least, far_cost(turns.farthest));
        if (least <= kLeftWell) return costs;
      }
      costs.push_back(least);
    }
    return costs;
  }

  /// The kBackEntries columns nearest to one, the nearest first.
  [[nodiscard]] static std::vector<Index> nearest(const MatrixXf& columns, const MatrixXf& one) {
    const Eigen::VectorXf distances = squared_distances(columns, one);
    std::vector<Index> order(static_cast<std::size_t>(columns.cols()));
    std::iota(order.begin(), order.end(), Index{0});
    const auto count = std::min<std::ptrdiff_t>(kBackEntries, std::ssize(order));
    std::partial_sort(order.begin(), order.begin() + count, order.end(),
                      [&](Index a, Index b) { return distances[a] < distances[b]; });
    order.resize(static_cast<std::size_t>(count));
    return order;
  }

  /// How much more often than all of the corpus the seconds to come were walked on.
  [[nodiscard]] double revisits(int enter, double usual) const {
    const int last = std::min(enter + frames(kAheadS), take_end(enter)) / kIndexStride;
    double sum = 0.0;
    int count = 0;
    for (int block = enter / kIndexStride; block <= last; ++block, ++count) {
      sum += visits_[at(block)] - usual;
    }
    return std::max(0.0, sum / std::max(1, count));
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
  [[nodiscard]] Eigen::RowVectorXf entry_costs(double usual) const {
    const std::vector<int>& entries = index_.coarse_frames();
    Eigen::RowVectorXf costs(std::ssize(entries));
    for (Index n = 0; n < costs.size(); ++n) {
      const int frame = entries[static_cast<std::size_t>(n)];
      const double left_s = (take_end(frame) - frame) / texture_.frame_rate_hz;
      const bool good = is_entry(frame);
      const double cost =
          kRevisit * revisits(frame, usual) + left_out_s(frame) + std::max(0.0, kRunS - left_s);
      costs[n] = good ? static_cast<float>(cost) : std::numeric_limits<float>::infinity();
    }
    return costs;
  }

  /// What it costs to leave the take at a frame: a short run, and what is left out.
  [[nodiscard]] double leaving_cost(int leave, int end, double usual) const {
    const double run_s = (leave - run_.entered) / texture_.frame_rate_hz;
    double seldom = 0.0;  // blocks, each by how much more often the rest was walked on
    for (int f = leave; f < end; f += kIndexStride) {
      seldom += std::max(0.0, 1.0 + usual - visits_[at(f / kIndexStride)]);
    }
    return kSecondLeftOut * (end - leave) / texture_.frame_rate_hz +
           kSeldomSecond * seldom * kIndexStride / texture_.frame_rate_hz +
           std::max(0.0, kRunS - run_s) + (index_.is_calm(leave) ? 0.0 : kRestless);
  }

  /// The best places to leave the rest of the take for any other, before its `end`.
  [[nodiscard]] std::vector<Crossing> crossings(int end) const {
    const int from = earliest_leave();
    const int count = end - 1 - from;
    if (count < 1 || index_.coarse_frames().empty()) return {};
    double usual_visits = 0.0;
    for (const int visits : visits_) usual_visits += visits;
    usual_visits /= static_cast<double>(visits_.size());
    const Eigen::RowVectorXf entries = entry_costs(usual_visits);
    const int stride = std::max(kIndexStride, count / kMostRows);
    const MatrixXf features = index_.features(from, count, stride);
    const auto usual = static_cast<float>(std::max(1e-9, index_.usual_distance()));
    MatrixXf costs = squared_distances(features, index_.coarse_features()).cwiseSqrt() / usual;
    costs.rowwise() += entries;
    const MatrixXf guesses = (0.5F * largest_turns(features, index_.coarse_features()).array() -
                              static_cast<float>(kFarTurn))
                                 .cwiseMax(0.0F)
                                 .matrix() /
                             static_cast<float>(kFarHalfUnit);
    std::vector<Crossing> found;
    for (Index f = 0; f < costs.rows(); ++f) {
      const int leave = from + static_cast<int>(f) * stride;
      add_best(costs.row(f) + guesses.row(f), guesses.row(f), leave,
               leaving_cost(leave, end, usual_visits), found);
    }
    return best_apart(std::move(found));
  }

  /// The cheapest frames to enter from one, none near another.
  void add_best(Eigen::RowVectorXf costs, const Eigen::RowVectorXf& guesses, int leave,
                double leaving, std::vector<Crossing>& found) const {
    const std::vector<int>& entries = index_.coarse_frames();
    const int second = frames(1.0);
    for (Index n = 0; n < costs.size(); ++n) {
      if (std::abs(entries[static_cast<std::size_t>(n)] - leave) < second) {
        costs[n] = std::numeric_limits<float>::infinity();
      }
    }
    for (int k = 0; k < kEntriesOfALeave; ++k) {
      Index best = 0;
      const float cost = costs.minCoeff(&best);
      if (!std::isfinite(cost)) return;
      found.push_back({leave, entries[static_cast<std::size_t>(best)],
                       static_cast<double>(cost) + leaving, static_cast<double>(guesses[best])});
      const Index first = std::max<Index>(0, best - 3);
      costs.segment(first, std::min<Index>(costs.size() - first, 7))
          .setConstant(std::numeric_limits<float>::infinity());
    }
  }

  /// The cheapest ones, none near a cheaper one.
  [[nodiscard]] static std::vector<Crossing> best_apart(std::vector<Crossing> all) {
    std::stable_sort(all.begin(), all.end(),
                     [](const Crossing& a, const Crossing& b) { return a.cost < b.cost; });
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

  [[nodiscard]] bool is_as_calm(int frame, int other) const {
    return index_.is_calm(frame) || !index_.is_calm(other);
  }

  /// The same crossing at the nearest frames beside it that are as calm.
  [[nodiscard]] Crossing refined(const Crossing& coarse, int end) const {
    constexpr int kReach = kIndexStride - 1;
    constexpr float kNever = 1e9F;
    const Take& other = texture_.takes[at(index_.take_of(coarse.enter))];
    const int from = std::max(earliest_leave(), coarse.leave - kReach);
    const int to = std::min(end - 1, coarse.leave + kReach + 1);
    const int enter_from =
        std::max({other.begin, coarse.enter - kReach, segment(segment_of(coarse.enter)).begin});
    const int enter_to = std::min(
        {other.begin + other.length - 1, coarse.enter + kReach + 1,
         std::max(coarse.enter + 1, end_of(segment_of(coarse.enter)) - frames(kStayS) + 1)});
    MatrixXf d = squared_distances(index_.features(from, to - from),
                                   index_.features(enter_from, enter_to - enter_from));
    for (Index f = 0; f < d.rows(); ++f) {
      if (!is_as_calm(from + static_cast<int>(f), coarse.leave)) d.row(f).setConstant(kNever);
    }
    for (Index g = 0; g < d.cols(); ++g) {
      if (!is_as_calm(enter_from + static_cast<int>(g), coarse.enter)) d.col(g).setConstant(kNever);
    }
    const double before = static_cast<double>(d(coarse.leave - from, coarse.enter - enter_from));
    Index f = 0;
    Index g = 0;
    const double after = static_cast<double>(d.minCoeff(&f, &g));
    const double usual = std::max(1e-9, index_.usual_distance());
    return {from + static_cast<int>(f), enter_from + static_cast<int>(g),
            coarse.cost - coarse.guess + (std::sqrt(after) - std::sqrt(before)) / usual};
  }

  /// Out of the take that ends before frame `end`, by one of the cheapest ways.
  std::optional<Crossing> way_out(int end) {
    double least = math::kInfinity;
    bool leads_well = false;
    int in_vain = 0;
    std::vector<Crossing> looked_into;
    for (const Crossing& coarse : crossings(end)) {
      if (leads_well && in_vain >= kMostInVain) break;
      if (coarse.cost - coarse.guess > least + kAlike) continue;  // nothing makes it much cheaper
      Crossing way = refined(coarse, end);
      way.cost += cost_back(way.enter);
      const double enough = far_turn_costing(least + kAlike - way.cost);
      const double turns = far_cost(detours_of(run_, way, enough).farthest);
      way.cost += turns;
      in_vain = way.cost < least ? 0 : in_vain + 1;
      if (way.cost < least) leads_well = turns <= kLeftWell;
      least = std::min(least, way.cost);
      looked_into.push_back(way);
    }
    if (looked_into.empty()) return std::nullopt;
    std::erase_if(looked_into, [&](const Crossing& way) { return way.cost > least + kAlike; });
    return looked_into[at(rng_.index(static_cast<int>(looked_into.size())))];
  }

  [[nodiscard]] static double far_cost(double farthest) {
    return std::pow(std::max(0.0, farthest - kFarTurn) / kFarTurnUnit, 2);
  }

  /// The turn from which on far_cost is more than `cost`.
  [[nodiscard]] static double far_turn_costing(double cost) {
    return kFarTurn + kFarTurnUnit * std::sqrt(std::max(0.0, cost));
  }

  struct Detours {
    std::vector<JointDetour> taken;
    double farthest = 0.0;  // from what joints were seen to do; less than kFarTurn is told as 0
  };

  /// How joints that would get far from what they were seen to do get around that, where that
  /// leads them less far.
  /// @param enough  looks no further once a joint is led so far whatever is done, radians.
  [[nodiscard]] Detours detours_of(const Stretch& run, const Crossing& way,
                                   double enough = math::kInfinity) {
    struct FarJoint {
      int joint;
      double turn;
      JoinedJoint plain;
    };
    const MatrixXd meeting = halfway_of(way);
    std::vector<FarJoint> far;
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      std::optional<JoinedJoint> plain = joined(run, way, meeting, s);
      if (!plain) continue;
      const double turn = farthest_turn(s, *plain, {});
      if (turn > kFarTurn) far.push_back({s, turn, std::move(*plain)});
    }
    std::stable_sort(far.begin(), far.end(),
                     [](const FarJoint& a, const FarJoint& b) { return a.turn > b.turn; });
    Detours found;
    for (const FarJoint& one : far) {
      if (found.farthest >= enough) break;
      double turn = one.turn;
      std::optional<JointDetour> detour = detour_of(run, way, one.joint, one.plain, turn);
      if (detour) found.taken.push_back(std::move(*detour));
      found.farthest = std::max(found.farthest, turn);
    }
    return found;
  }

  /// @param turn  how far the joint is led without a detour; becomes how far with it.
  /// @returns none if it leads no less far.
  [[nodiscard]] std::optional<JointDetour> detour_of(const Stretch& run, const Crossing& way,
                                                     int joint, const JoinedJoint& plain,
                                                     double& turn) {
    const auto count = static_cast<int>(plain.joined.size());
    const int from = std::max(0, run.settled - (way.leave - plain.meets));
    const int room =
        std::min(end_of(segment_of(way.enter)) - way.enter, (take_end(way.enter) - way.enter) / 2);
    const int end = std::min(count, plain.meets + room);
    if (end <= from) return std::nullopt;
    const auto around =
        detours_.around(joint, std::span(plain.joined).subspan(at(from), at(end - from)), kFarTurn);
    if (!around) return std::nullopt;
    Matrix3Xd turns = Matrix3Xd::Zero(3, count);
    turns.middleCols(from, end - from) = *around;
    const double with = farthest_turn(joint, plain, turns);
    if (with >= turn) return std::nullopt;
    turn = with;
    return JointDetour{joint, turns.leftCols(plain.meets + 2),
                       turns.middleCols(plain.meets, end - plain.meets)};
  }

  [[nodiscard]] bool is_led_far(const Crossing& way) const {
    const MatrixXd meeting = halfway_of(way);
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      const auto plain = joined(run_, way, meeting, s);
      if (plain && farthest_turn(s, *plain, {}) > kFarTurn) return true;
    }
    return false;
  }

  [[nodiscard]] Quaterniond joint_at(const MatrixXd& y, Index frame, int joint) const {
    const Index row = static_cast<Index>(3) * joint;
    return math::exp(y.block<3, 1>(row, frame).cwiseQuotient(texture_.space.scale.segment<3>(row)));
  }

  /// How a joint of two frames of the corpus becomes that of two others: 3 x 2.
  [[nodiscard]] Matrix3Xd turns_to(const MatrixXd& meeting, int frame, int joint) const {
    Matrix3Xd turns(3, 2);
    for (int n = 0; n < 2; ++n) {
      turns.col(n) = math::log(joint_at(texture_.observations, frame + n, joint).conjugate() *
                               joint_at(meeting, n, joint));
    }
    turns.col(1) = math::nearest_branch(turns.col(1), turns.col(0));
    return turns;
  }

  /// None if the joint stays near to what it was captured as.
  [[nodiscard]] std::optional<JoinedJoint> joined(const Stretch& run, const Crossing& way,
                                                  const MatrixXd& meeting, int joint) const {
    const int fade = frames(kLongestFadeS) + 2;
    const int before = std::max(2, std::min(fade, way.leave + 2 - run.entered));
    const int after = std::min(fade, take_end(way.enter) - way.enter);
    Eigen::Matrix<double, 3, 4> leaving = Eigen::Matrix<double, 3, 4>::Zero();
    Eigen::Matrix<double, 3, 4> entering = leaving;
    leaving.rightCols(2) = turns_to(meeting, way.leave, joint);
    entering.leftCols(2) = turns_to(meeting, way.enter, joint);
    const double largest =
        std::max(leaving.colwise().norm().maxCoeff(), entering.colwise().norm().maxCoeff());
    if (largest <= 0.5 * kFarTurn) return std::nullopt;
    Matrix3Xd earlier;
    if (run.incoming) {
      leaving.leftCols(2) = turns_to(run.incoming->meeting, run.entered, joint);
      for (const JointDetour& one : run.incoming->detours) {
        if (one.joint == joint) earlier = one.entering;
      }
    }
    const int length = run.incoming ? way.leave + 2 - run.entered : before;
    JoinedJoint found;
    found.meets = before - 2;
    add(found, joint, way.leave + 2, joint_curve(length, leaving).rightCols(before));
    const int begin = way.leave + 2 - before;
    for (Index f = begin - run.entered; f < std::min<Index>(earlier.cols(), length); ++f) {
      Quaterniond& rotation = found.joined[at(f - (begin - run.entered))];
      rotation = rotation * math::exp(earlier.col(f));
    }
    const Matrix3Xd curve = joint_curve(after, entering);
    add(found, joint, way.enter + after, curve.rightCols(std::max(0, after - 2)));
    return found;
  }

  /// As many offsets as `length`. Where there is no time to ease, those of the end that is joined
  /// hold all along.
  [[nodiscard]] Matrix3Xd joint_curve(int length, const Eigen::Matrix<double, 3, 4>& ends) const {
    if (length >= kFewestConstrained)
      return joint_offset_curve(texture_.frame_rate_hz, length, ends);
    const bool joins_at_end = ends.leftCols(2).isZero();
    Matrix3Xd held(3, std::max(0, length));
    for (Index f = 0; f < held.cols(); ++f) {
      held.col(f) = joins_at_end ? ends.col(std::clamp<Index>(f - held.cols() + 4, 2, 3))
                                 : ends.col(std::min<Index>(f, 1));
    }
    return held;
  }

  /// Adds the frames before `end`, as many as there are offsets.
  void add(JoinedJoint& to, int joint, int end, const Matrix3Xd& offsets) const {
    for (Index f = 0; f < offsets.cols(); ++f) {
      const Quaterniond captured = joint_at(texture_.observations, end - offsets.cols() + f, joint);
      to.captured.push_back(captured);
      to.joined.push_back(captured * math::exp(offsets.col(f)));
    }
  }

  /// @param turns  on top, one a frame, or none.
  [[nodiscard]] double farthest_turn(int joint, const JoinedJoint& around,
                                     const Matrix3Xd& turns) const {
    double farthest = 0.0;
    for (std::size_t f = 0; f < around.joined.size(); ++f) {
      Quaterniond rotation = around.joined[f];
      if (turns.cols() > 0) rotation = rotation * math::exp(turns.col(static_cast<Index>(f)));
      // No farther than it is from its own frame.
      if (math::angle_between(rotation, around.captured[f]) <= std::max(farthest, kFarTurn)) {
        continue;
      }
      farthest = std::max(farthest, range_.distance(joint, rotation));
    }
    return farthest <= kFarTurn ? 0.0 : farthest;
  }

  const MotionTexture& texture_;
  std::vector<std::vector<int>> segments_;  // of each texton
  PoseIndex index_;
  RotationRange range_;
  JointDetours detours_;
  std::vector<std::optional<std::vector<double>>> costs_back_;  // of each take, once asked for
  std::vector<int> visits_;  // of each kIndexStride frames of the corpus
  base::Rng rng_;
  int segment_ = 0;
  Stretch run_;
  std::optional<int> drawn_;      // the segment from which the corpus went on as drawn
  std::optional<Crossing> exit_;  // by which the take now walked on is to be left
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
