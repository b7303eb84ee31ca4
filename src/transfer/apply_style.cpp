#include "laban/transfer/apply_style.h"

#include <cmath>

#include "laban/base/error.h"
#include "laban/math/low_pass.h"

namespace laban::transfer {
namespace {

using base::Error;
using base::ErrorKind;

void check_input(const StyleModel& model, const motion::PoseMatrix& input) {
  if (std::abs(input.frame_rate_hz - model.frame_rate_hz()) > 1e-6 * model.frame_rate_hz()) {
    throw Error(ErrorKind::kData, "the input has " + std::to_string(input.frame_rate_hz) +
                                      " frames a second, the model " +
                                      std::to_string(model.frame_rate_hz()));
  }
  const int shortest = static_cast<int>(std::ceil(kShortestInputS * model.frame_rate_hz()));
  if (input.frame_count() < shortest) {
    throw Error(ErrorKind::kData, "the input has " + std::to_string(input.frame_count()) +
                                      " frames of motion; style transfer needs at least " +
                                      std::to_string(shortest) + " (a quarter of a second)");
  }
}

std::string known_contents(const StyleModel& model) {
  std::string list;
  for (const std::string& name : model.contents.names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

/// What becomes of one snippet before it is joined to the others.
struct Piece {
  AppliedSnippet report;
  motion::PoseMatrix pose;
  motion::FootContacts contacts;
};

/// Time warps for a blend at `alpha` in which no clip plays faster than `fastest` times: with
/// s = dq/dp and b beyond [0, 1], clip i plays at 1 / ((1 + b) s - b) where alpha = 1 + b, so
/// s >= (1 / fastest + b) / (1 + b); the same of clip j where alpha = -b.
align::TimeWarpOptions calm_warp(double alpha, double fastest) {
  const double beyond = std::max({0.0, -alpha, alpha - 1.0});
  align::TimeWarpOptions warp;
  warp.max_slope = std::min((1.0 + beyond) / (1.0 / fastest + beyond), align::kMaxWarpSlope);
  return warp;
}

/// Root mean square of the third differences of all angles, per second cubed.
double jerk_of(const motion::PoseMatrix& pose) {
  const Eigen::Index count = pose.angles.cols() - 3;
  if (count < 1) return 0.0;
  const auto& x = pose.angles;
  const double squares = (x.rightCols(count) - 3.0 * x.middleCols(2, count) +
                          3.0 * x.middleCols(1, count) - x.leftCols(count))
                             .squaredNorm();
  return std::sqrt(squares / static_cast<double>(count * x.rows())) *
         std::pow(pose.frame_rate_hz, 3);
}

motion::PoseMatrix smoothed(const motion::PoseMatrix& pose, double cutoff_hz) {
  motion::PoseMatrix smooth = pose;
  smooth.angles = math::low_pass(pose.angles, pose.frame_rate_hz, cutoff_hz);
  smooth.height = math::low_pass(pose.height, pose.frame_rate_hz, cutoff_hz);
  smooth.steps = math::low_pass(pose.steps, pose.frame_rate_hz, cutoff_hz);
  smooth.steps.col(0) = smooth.steps.col(std::min<Eigen::Index>(1, smooth.steps.cols() - 1));
  return smooth;
}

/// A blend without the jerks that quick play and extrapolation make of its parents' trembling:
/// smoothed no more than brings its jerk down to theirs (joins and held feet add to it), and no
/// further than movement itself goes (the observer looks at what is below 4 Hz).
motion::PoseMatrix calmed(motion::PoseMatrix pose, const motion::PoseMatrix& parent_i,
                          const motion::PoseMatrix& parent_j) {
  constexpr double kMostJerk = 1.0;
  const double most = kMostJerk * 0.5 * (jerk_of(parent_i) + jerk_of(parent_j));
  if (jerk_of(pose) <= most) return pose;
  for (const double cutoff_hz : {12.0, 10.0, 8.0, 7.0, 6.0, 5.0, 4.0}) {
    motion::PoseMatrix smooth = smoothed(pose, cutoff_hz);
    if (jerk_of(smooth) <= most || cutoff_hz == 4.0) return smooth;
  }
  return pose;
}

motion::FootContacts contacts_of(const motion::PoseMatrix& pose) {
  return motion::find_foot_contacts(pose).contacts;
}

Piece restyle(const StyleModel& model, const motion::PoseMatrix& input,
              const align::Snippet& snippet, const EffortTarget& target,
              const ApplyOptions& options) {
  Piece piece;
  AppliedSnippet& report = piece.report;
  const int group = model.contents.numbers[static_cast<std::size_t>(snippet.fragment)];
  report.begin = snippet.begin;
  report.end = snippet.end;
  report.fragment = snippet.fragment;
  report.content = model.contents.names[static_cast<std::size_t>(group)];
  report.match_cost = snippet.mean_cost();
  report.match_threshold = model.match_costs[static_cast<std::size_t>(group)].threshold;
  report.kept = report.match_cost > report.match_threshold;
  const motion::PoseMatrix own = input.slice(snippet.begin, snippet.end);
  report.before = effort::observe(effort::describe(own), model.observer, report.content);
  if (report.kept && options.strict) {
    throw Error(
        ErrorKind::kData,
        "input frames " + std::to_string(snippet.begin) + " to " + std::to_string(snippet.end) +
            " match no content of the model, which knows: " + known_contents(model) +
            "; add such fragments to its corpus, or leave --strict out to keep them as captured");
  }
  if (report.kept) {
    piece.pose = own;
    piece.contacts = contacts_of(own);
  } else {
    report.choice = search_blend(model, snippet.fragment, target, options.search);
    PlayedChoice played = play_choice(model, report.choice, options.fastest_play);
    piece.pose = std::move(played.pose);
    piece.contacts = std::move(played.contacts);
  }
  report.measured = effort::observe(effort::describe(piece.pose), model.observer, report.content);
  return piece;
}

/// Input frame of each output frame of a piece: along the warp between the two, or evenly where
/// their lengths are too different for one.
std::vector<double> source_frames_of(const motion::PoseMatrix& input, const Piece& piece) {
  const AppliedSnippet& report = piece.report;
  const int own_count = report.end - report.begin;
  const int count = piece.pose.frame_count();
  std::vector<double> frames(static_cast<std::size_t>(count));
  const bool warped = !report.kept && align::blendable(count, own_count);
  std::vector<align::WarpPoint> points;
  if (warped)
    points = align_pair(piece.pose, input.slice(report.begin, report.end)).warp().sample(0.0);
  for (int k = 0; k < count; ++k) {
    const auto cell = static_cast<std::size_t>(k);
    const double even = count > 1 ? static_cast<double>(k) * (own_count - 1) / (count - 1) : 0.0;
    frames[cell] = report.begin + (warped ? points[cell].q : even);
  }
  return frames;
}

}  // namespace

PlayedChoice play_choice(const StyleModel& model, const BlendChoice& choice, double fastest_play) {
  const motion::PoseMatrix& pose_i =
      model.fragments[static_cast<std::size_t>(choice.fragment_i)].pose;
  if (choice.is_seed()) return {pose_i, contacts_of(pose_i)};
  const motion::PoseMatrix& pose_j =
      model.fragments[static_cast<std::size_t>(choice.fragment_j)].pose;
  blend::Blend made =
      blend::blend(align_pair(pose_i, pose_j, calm_warp(choice.alpha, fastest_play)), choice.alpha);
  motion::FootContacts contacts =
      blend::blend_contacts(made, choice.alpha, contacts_of(pose_i), contacts_of(pose_j));
  return {calmed(std::move(made.pose), pose_i, pose_j), std::move(contacts)};
}

AppliedStyle apply_style(const StyleModel& model, const motion::PoseMatrix& input,
                         const EffortTarget& target, const ApplyOptions& options) {
  if (const auto problems = target.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  if (!(options.fastest_play > 1.0 && options.fastest_play <= align::kMaxWarpSlope)) {
    throw Error(ErrorKind::kUsage,
                "ApplyOptions::fastest_play = " + std::to_string(options.fastest_play) +
                    " (must be in (1, 4])");
  }
  check_input(model, input);
  const auto segmentation = align::segment_input(input, model.database, options.segmentation);
  if (!segmentation) {
    throw Error(ErrorKind::kData,
                "the input cannot be cut into fragments within the slope limit; leave --slope out");
  }
  AppliedStyle applied;
  std::vector<motion::PoseMatrix> parts;
  std::vector<motion::FootContacts> contacts;
  int frame = 0;
  for (const align::Snippet& snippet : segmentation->snippets) {
    Piece piece = restyle(model, input, snippet, target, options);
    piece.report.output_begin = frame;
    frame += piece.pose.frame_count();
    piece.report.output_end = frame;
    const std::vector<double> frames = source_frames_of(input, piece);
    applied.source_frames.insert(applied.source_frames.end(), frames.begin(), frames.end());
    applied.snippets.push_back(piece.report);
    parts.push_back(std::move(piece.pose));
    contacts.push_back(std::move(piece.contacts));
  }
  applied.pose = motion::concatenate(parts, options.join);
  applied.contacts = motion::concatenate(contacts);
  // Leg lengths of fragments are other people's; the motion goes back onto the input's body.
  applied.pose.leg_length_m = input.leg_length_m;
  return applied;
}

}  // namespace laban::transfer
