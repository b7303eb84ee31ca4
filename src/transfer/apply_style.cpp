#include "laban/transfer/apply_style.h"

#include <cmath>

#include "laban/base/error.h"

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
