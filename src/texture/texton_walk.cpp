#include "laban/texture/texton_walk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/rotation.h"
#include "laban/texture/constrained_synthesis.h"

#include "texture/at.h"
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
constexpr double kStayS = 0.75;
// Shorter runs through a take count so many usual distances as they are shorter, in seconds.
constexpr double kRunS = 4.0;
// What a second left out at the end of a take counts, and one that was walked on once less than
// usual.
constexpr double kSecondLeftOut = 0.1;
constexpr double kSeldomSecond = 3.0;
constexpr double kMostSeldom = 2.0;  // an end that cannot be left well is not worth any cost
constexpr double kRestless = 2.0;
// What each visit more than usual of the seconds to come counts: or a walk turns in small circles.
constexpr double kRevisit = 3.0;
// A texton may take over from the one before so long before or after the cut.
constexpr double kHandoverS = 0.25;
// Poses that a joint tries to meet in, and how much farther than the best one so far a first look
// may find one.
constexpr int kDetours = 120;
constexpr double kScreenSlack = 2.0 * math::kDegree;
// What is repeated of the seconds to come, and left out of those just before, is counted so far.
constexpr double kAheadS = 2.0;
constexpr double kBehindS = 1.0;
constexpr int kMostCandidates = 32;
constexpr int kMostRows = 60;
constexpr int kEntriesOfALeave = 4;
// Changes of nearly the same cost are drawn from, or every walk would make the same.
constexpr double kAlike = 0.25;
// Joints may get so far from what they were seen to do; so much more costs as much as a usual
// distance, twice that four times as much.
constexpr double kFarTurn = 8.0 * math::kDegree;
constexpr double kFarTurnUnit = 1.5 * math::kDegree;
// Beside a frame that is to be met halfway no joint is farther from its own than half of what the
// two differ by. Where that is more, it may still have been seen there: each four degrees count as
// one.
constexpr double kFarHalfUnit = 4.0 * math::kDegree;

/// A change to another place of the corpus that could be made.
struct Crossing {
  int leave = 0;
  int enter = 0;
  double cost = 0.0;  ///< in usual distances
  MatrixXd meeting;   ///< d x 2, as of TextonChange; none: halfway
};

/// How far joints get from what they were seen to do while a crossing is made, radians, at most;
/// less than kFarTurn is told as 0.
struct FarTurns {
  std::array<double, motion::kStandardJointCount> of_joint{};

  [[nodiscard]] double largest() const {
    return *std::max_element(of_joint.begin(), of_joint.end());
  }
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
    if (first) {
      segment_ = drawn(segments_[at(*first)]);
      entered_ = segment(segment_).begin;
    } else {
      begin_a_take();
    }
  }

  [[nodiscard]] int texton() const noexcept { return segment(segment_).texton; }
  [[nodiscard]] int segment() const noexcept { return segment_; }
  [[nodiscard]] int entered() const noexcept { return entered_; }

  TextonChange next() {
    const TextonChange change = find_change();
    for (int block = entered_ / kIndexStride; block <= change.leave / kIndexStride; ++block) {
      ++visits_[at(block)];
    }
    if (!change.is_captured()) exit_.reset();
    if (change.is_captured() || change.entering != drawn_) drawn_.reset();
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

  /// Where a take begins, each as likely as it is long; after its first frames, if they are those
  /// of a body that falls into its pose.
  void begin_a_take() {
    const int any = rng_.index(static_cast<int>(texture_.observations.cols()));
    entered_ = texture_.takes[at(index_.take_of(any))].begin;
    segment_ = segment_of(entered_);
    const int last = entered_ + std::min(frames(kStayS), segment(segment_).length / 4);
    const int begin = entered_;
    while (entered_ < last && !index_.is_calm(entered_)) ++entered_;
    if (entered_ == last) entered_ = begin;
  }

  TextonChange find_change() {
    if (!exit_) exit_ = way_out(take_end(entered_));
    // A segment is not entered if the take is to be left before there was time to see it.
    if (exit_ && (exit_->leave < end_of(segment_) + frames(kStayS) || !follows(segment_))) {
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
    const int from = std::max(cut - frames(kHandoverS), entered_ + (cut - entered_) / 2);
    const int to = std::min(cut + frames(kHandoverS), cut + segment(segment_ + 1).length / 3);
    const int frame = index_.calmest(from, std::max(from, to) + 1);
    return {segment_, segment_ + 1, frame, frame, texture_.observations.middleCols(frame, 2),
            false};
  }

  [[nodiscard]] TextonChange crossed(const Crossing& crossing) const {
    const int entering = segment_of(crossing.enter);
    const int from = segment(segment_).texton;
    const int to = segment(entering).texton;
    const bool seen = from == to || texture_.transition_counts(from, to) > 0.0;
    return {segment_,
            entering,
            crossing.leave,
            crossing.enter,
            crossing.meeting.cols() > 0 ? crossing.meeting : halfway_of(crossing),
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
    const int leave = std::max(entered_, end_of(segment_) - 2);
    return crossed({leave, segment(drawn(others)).begin, 0.0, {}});
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
        best = {from + static_cast<int>(f), enter, 0.0, {}};
      }
    }
    if (best && far_turn(*best, halfway_of(*best)).largest() > kFarTurn) return std::nullopt;
    return best;
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
      const bool good = index_.is_calm(frame) && left_s >= 2.0 * kStayS &&
                        end_of(segment_of(frame)) - frame >= frames(kStayS);
      const double cost =
          kRevisit * revisits(frame, usual) + left_out_s(frame) + std::max(0.0, kRunS - left_s);
      costs[n] = good ? static_cast<float>(cost) : std::numeric_limits<float>::infinity();
    }
    return costs;
  }

  /// What it costs to leave the take at a frame: a short run, and what is left out.
  [[nodiscard]] double leaving_cost(int leave, int end, double usual) const {
    const double run_s = (leave - entered_) / texture_.frame_rate_hz;
    double seldom = 0.0;  // blocks, each by how much more often the rest was walked on
    for (int f = leave; f < end; f += kIndexStride) {
      seldom += std::clamp(1.0 + usual - visits_[at(f / kIndexStride)], 0.0, kMostSeldom);
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
    costs += (0.5F * largest_turns(features, index_.coarse_features()).array() -
              static_cast<float>(kFarTurn))
                 .cwiseMax(0.0F)
                 .matrix() /
             static_cast<float>(kFarHalfUnit);
    std::vector<Crossing> found;
    for (Index f = 0; f < costs.rows(); ++f) {
      const int leave = from + static_cast<int>(f) * stride;
      add_best(costs.row(f), leave, leaving_cost(leave, end, usual_visits), found);
    }
    return best_apart(std::move(found));
  }

  /// The cheapest frames to enter from one, none near another.
  void add_best(Eigen::RowVectorXf costs, int leave, double leaving,
                std::vector<Crossing>& found) const {
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
      found.push_back({leave,
                       entries[static_cast<std::size_t>(best)],
                       static_cast<double>(cost) + leaving,
                       {}});
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

  /// The same crossing at the nearest frames beside it.
  [[nodiscard]] Crossing refined(const Crossing& coarse, int end) const {
    constexpr int kReach = kIndexStride - 1;
    const Take& other = texture_.takes[at(index_.take_of(coarse.enter))];
    const int from = std::max(earliest_leave(), coarse.leave - kReach);
    const int to = std::min(end - 1, coarse.leave + kReach + 1);
    const int enter_from = std::max(other.begin, coarse.enter - kReach);
    const int enter_to = std::min(
        {other.begin + other.length - 1, coarse.enter + kReach + 1,
         std::max(coarse.enter + 1, end_of(segment_of(coarse.enter)) - frames(kStayS) + 1)});
    const MatrixXf d = squared_distances(index_.features(from, to - from),
                                         index_.features(enter_from, enter_to - enter_from));
    const double before = static_cast<double>(d(coarse.leave - from, coarse.enter - enter_from));
    Index f = 0;
    Index g = 0;
    const double after = static_cast<double>(d.minCoeff(&f, &g));
    const double usual = std::max(1e-9, index_.usual_distance());
    return {from + static_cast<int>(f),
            enter_from + static_cast<int>(g),
            coarse.cost + (std::sqrt(after) - std::sqrt(before)) / usual,
            {}};
  }

  /// Out of the take that ends before frame `end`, by one of the cheapest ways.
  std::optional<Crossing> way_out(int end) {
    std::vector<Crossing> ways;
    for (const Crossing& coarse : crossings(end)) ways.push_back(refined(coarse, end));
    std::stable_sort(ways.begin(), ways.end(),
                     [](const Crossing& a, const Crossing& b) { return a.cost < b.cost; });
    double least = math::kInfinity;
    std::vector<Crossing> looked_into;
    for (Crossing& way : ways) {
      if (way.cost > least + kAlike) break;  // nothing makes it cheaper
      way.meeting = halfway_of(way);
      take_detours(way);
      least = std::min(least, way.cost);
      looked_into.push_back(std::move(way));
    }
    if (looked_into.empty()) return std::nullopt;
    std::erase_if(looked_into, [&](const Crossing& way) { return way.cost > least + kAlike; });
    return looked_into[at(rng_.index(static_cast<int>(looked_into.size())))];
  }

  [[nodiscard]] static double far_cost(const FarTurns& turns) {
    const double beyond = turns.largest() - kFarTurn;
    return beyond <= 0.0 ? 0.0 : std::pow(beyond / kFarTurnUnit, 2);
  }

  /// Adds what it costs that joints are led far from what they were seen to do. Those are let meet
  /// in a pose that they were seen in, if that leads them less far.
  void take_detours(Crossing& way) const {
    FarTurns turns = far_turn(way, way.meeting);
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      double& least = turns.of_joint[static_cast<std::size_t>(s)];
      if (least <= kFarTurn) continue;
      const MatrixXd halfway = way.meeting;
      for (const Eigen::Quaterniond& seen : range_.some(s, kDetours)) {
        if (!may_lead_less_far(way, s, seen, least)) continue;
        const MatrixXd meeting = meeting_in(halfway, s, seen);
        const double turn = far_turn_of(way, meeting, s, least);
        if (turn >= least) continue;
        least = turn;
        way.meeting = meeting;
      }
    }
    way.cost += far_cost(turns);
  }

  /// A look at a few frames on either side, about where a fourth, half and three fourths of the way
  /// to a rotation are done.
  [[nodiscard]] bool may_lead_less_far(const Crossing& way, int joint,
                                       const Eigen::Quaterniond& rotation, double least) const {
    const int quarter = frames(0.2);
    for (int n = 1; n <= 3; ++n) {
      const int before = std::max(entered_, way.leave - (4 - n) * quarter);
      const int after = std::min(take_end(way.enter) - 1, way.enter + (4 - n) * quarter);
      for (const int frame : {before, after}) {
        const Eigen::Quaterniond between = joint_at(frame, joint).slerp(0.25 * n, rotation);
        if (range_.distance(joint, between) > least + kScreenSlack) return false;
      }
    }
    return true;
  }

  [[nodiscard]] Eigen::Quaterniond joint_at(int frame, int joint) const {
    const Index row = static_cast<Index>(3) * joint;
    return math::exp(texture_.observations.block<3, 1>(row, frame)
                         .cwiseQuotient(texture_.space.scale.segment<3>(row)));
  }

  /// Frames to meet in with one joint in another rotation, as fast as it would be.
  [[nodiscard]] MatrixXd meeting_in(MatrixXd meeting, int joint,
                                    const Eigen::Quaterniond& rotation) const {
    const Index row = static_cast<Index>(3) * joint;
    const auto scale = texture_.space.scale.segment<3>(row);
    const auto at_frame = [&](Index f) {
      return math::exp(meeting.block<3, 1>(row, f).cwiseQuotient(scale));
    };
    const Eigen::Quaterniond step = at_frame(0).conjugate() * at_frame(1);
    const Eigen::Vector3d first = math::log(rotation);
    meeting.block<3, 1>(row, 0) = first.cwiseProduct(scale);
    meeting.block<3, 1>(row, 1) =
        math::nearest_branch(math::log(rotation * step), first).cwiseProduct(scale);
    return meeting;
  }

  [[nodiscard]] FarTurns far_turn(const Crossing& way, const MatrixXd& meeting) const {
    FarTurns turns;
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      turns.of_joint[static_cast<std::size_t>(s)] = far_turn_of(way, meeting, s, math::kInfinity);
    }
    return turns;
  }

  /// Of one joint; stops at `enough`.
  [[nodiscard]] double far_turn_of(const Crossing& way, const MatrixXd& meeting, int joint,
                                   double enough) const {
    const MatrixXd& y = texture_.observations;
    const int fade = frames(kLongestFadeS) + 2;
    const int before = std::min(fade, way.leave + 2 - entered_);
    const int after = std::min(fade, take_end(way.enter) - way.enter);
    double farthest = 0.0;
    if (before >= kFewestConstrained) {
      farthest = farthest_turn(y.middleCols(way.leave + 2 - before, before), before - 2, meeting,
                               joint, enough);
    }
    if (after >= kFewestConstrained && farthest < enough) {
      farthest = std::max(farthest,
                          farthest_turn(y.middleCols(way.enter, after), 0, meeting, joint, enough));
    }
    return farthest;
  }

  /// @param y  frames of which those at `meets` and after it become `meeting`.
  [[nodiscard]] double farthest_turn(const Eigen::Ref<const MatrixXd>& y, int meets,
                                     const MatrixXd& meeting, int joint, double enough) const {
    constexpr int kEvery = 3;
    const Index row = static_cast<Index>(3) * joint;
    const auto scale = texture_.space.scale.segment<3>(row);
    const auto rotation = [&](const auto& column) {
      return math::exp(column.template segment<3>(row).cwiseQuotient(scale));
    };
    Eigen::Matrix3Xd ends = Eigen::Matrix3Xd::Zero(3, 4);
    const int side = meets == 0 ? 0 : 2;
    for (int f = 0; f < 2; ++f) {
      ends.col(side + f) =
          math::log(rotation(y.col(meets + f)).conjugate() * rotation(meeting.col(f)));
    }
    ends.col(side + 1) = math::nearest_branch(ends.col(side + 1), ends.col(side));
    if (ends.colwise().norm().maxCoeff() <= 0.5 * kFarTurn) return 0.0;
    const MatrixXd offsets =
        joint_offset_curve(texture_.frame_rate_hz, static_cast<int>(y.cols()), ends);
    double farthest = 0.0;
    for (Index f = 0; f < y.cols() && farthest < enough; f += kEvery) {
      const Eigen::Vector3d turn = offsets.col(f);
      if (turn.norm() <= std::max(farthest, kFarTurn)) continue;  // so near to its own frame
      const double distance = range_.distance(joint, rotation(y.col(f)) * math::exp(turn));
      farthest = std::max(farthest, distance);
    }
    return farthest <= kFarTurn ? 0.0 : farthest;
  }

  const MotionTexture& texture_;
  std::vector<std::vector<int>> segments_;  // of each texton
  PoseIndex index_;
  RotationRange range_;
  std::vector<int> visits_;  // of each kIndexStride frames of the corpus
  base::Rng rng_;
  int segment_ = 0;
  int entered_ = 0;
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
