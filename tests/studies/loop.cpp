// Seams of ten captures of different kinds, by graph cut and by plain cross-fading, of the same
// overlaps and of the clip's last frames with its first: foot skate, distance to the nearest
// captured frame, speed and acceleration, with the capture on both sides; "held" is with the feet
// held as loops hold them, "4 cut, held" what is played. Then 1700 frames of each:
// how much of the clip they use, and what their seams and turns look like.
//
// Usage: loop_study [CLIP...]; without clips those of $LABAN_DATA named below.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/loop/endless_loop.h"
#include "laban/math/rotation.h"
#include "laban/math/statistics.h"
#include "laban/motion/motion_quality.h"

#include "loop/foot_slack.h"
#include "loop/held_feet.h"
#include "loop/join_window.h"
#include "loop/seam_search.h"

namespace laban::loop {
namespace {

const std::vector<std::string> kClips = {"cmu_clips/walk_07_01.bvh",
                                         "cmu_clips/walk_08_01.bvh",
                                         "cmu_dance/salsa_01.bvh",
                                         "cmu_clips/ballet_05_02_expressive_arms_pirouette.bvh",
                                         "cmu_clips/kungfu_135_07_one_kick_209f_60fps.bvh",
                                         "cmu_clips/kungfu_135_07_mawashigeri_209f_30fps.bvh",
                                         "bandai1/dataset-1_bow_normal_001.bvh",
                                         "bandai1/dataset-1_byebye_normal_001.bvh",
                                         "cmu_dance/indian_04.bvh",
                                         "hdm05/HDM_bd_squat1Reps_001_120.amc"};

using Frames = std::vector<BodyFrame>;

/// Joints as seen from the body: above the hips, in its heading, metres.
Eigen::Matrix3Xd from_the_body(const BodyRows& rows, const BodyFrame& frame) {
  Eigen::Matrix3Xd points = positions(rows, frame)(Eigen::all, rows.points);
  points.colwise() -= Eigen::Vector3d(frame.hips.x(), 0.0, frame.hips.z());
  return math::yaw_rotation(-math::heading_of(frame.rotations[0])).toRotationMatrix() * points;
}

struct Figures {
  double skate_cm = 0.0;
  double nearest_cm = 0.0;
  double speed = 0.0;  // in captured 99th percentiles, greatest of the overlap
  double acceleration = 0.0;

  void add(const Figures& other, double share) {
    skate_cm += share * other.skate_cm;
    nearest_cm += share * other.nearest_cm;
    speed = std::max(speed, other.speed);
    acceleration = std::max(acceleration, other.acceleration);
  }
};

struct Study {
  motion::Capture capture;
  BodyRows rows;
  motion::FoundContacts contacts;
  Frames frames;
  UsualMotion usual;
  MotionRates captured;
  std::vector<Eigen::Matrix3Xd> poses;

  explicit Study(motion::Capture given)
      : capture(std::move(given)),
        rows(capture.clip.skeleton(), capture.humanoid),
        contacts(motion::find_foot_contacts(capture.clip, capture.humanoid)),
        frames(to_body_frames(capture.clip, rows, contacts.contacts)),
        usual(usual_motion(rows, frames, rate())),
        captured(motion_rates(rows, frames, rate())) {
    for (const BodyFrame& frame : frames) poses.push_back(from_the_body(rows, frame));
  }

  [[nodiscard]] double rate() const { return capture.clip.frame_rate_hz(); }

  /// Figures of `overlap`, put where `seam` belongs, the capture on both sides.
  [[nodiscard]] Figures measure(const SewnSeam& seam, const Frames& overlap, bool hold) const {
    const FoundSeam& at = seam.found;
    Frames played(frames.begin(), frames.begin() + at.out_begin);
    const auto first = played.size();
    played.insert(played.end(), overlap.begin(), overlap.end());
    const int in_end = at.in_begin + at.frames;
    for (int f = in_end; f < static_cast<int>(frames.size()); ++f) {
      played.push_back(frames[static_cast<std::size_t>(f)]);
      played.back().move(seam.outgoing_from_incoming);
    }
    if (hold && contacts.floor) {
      played = hold_feet(played, rows, capture, *contacts.floor,
                         {static_cast<int>(first) + seam.join}, false)
                   .frames;
    }
    return figures_of(played, first, overlap.size());
  }

 private:
  [[nodiscard]] Figures figures_of(const Frames& played, std::size_t first,
                                   std::size_t count) const {
    Figures figures;
    const auto begin = played.begin() + static_cast<std::ptrdiff_t>(first);
    const Frames overlap(begin, begin + static_cast<std::ptrdiff_t>(count));
    figures.skate_cm =
        motion::measure_quality(to_clip(overlap, rows, capture.clip), capture.humanoid,
                                contacts.floor.value_or(motion::FootFloor{}))
            .foot_skate_cm;
    for (const BodyFrame& frame : overlap) {
      const Eigen::Matrix3Xd pose = from_the_body(rows, frame);
      double least = 1e9;
      for (const Eigen::Matrix3Xd& taken : poses) least = std::min(least, (pose - taken).norm());
      figures.nearest_cm +=
          100.0 * least / std::sqrt(static_cast<double>(pose.cols())) / static_cast<double>(count);
    }
    const MotionRates rates = motion_rates(rows, played, rate());
    const auto largest = [&](const std::vector<double>& values) {
      const auto from = values.begin() + static_cast<std::ptrdiff_t>(first);
      return *std::max_element(from, from + static_cast<std::ptrdiff_t>(count));
    };
    figures.speed = largest(rates.speed_m_s) / usual.speed_m_s;
    figures.acceleration = largest(rates.acceleration_m_s2) / usual.acceleration_m_s2;
    return figures;
  }
};

void print(const char* method, const Figures& figures) {
  std::printf("  %-22s skate %6.3f cm   nearest %6.2f cm   speed %5.2f   acceleration %5.2f\n",
              method, figures.skate_cm, figures.nearest_cm, figures.speed, figures.acceleration);
}

/// The last frames of the clip over its first ones, as long as the overlap of a seam.
SewnSeam ends_of(const Study& study, int overlap) {
  SewnSeam ends;
  ends.found.out_begin = static_cast<int>(study.frames.size()) - overlap;
  ends.found.frames = overlap;
  ends.found.played_frames = overlap;
  ends.join = overlap / 2;
  const Frames outgoing(study.frames.end() - overlap, study.frames.end());
  Frames incoming(study.frames.begin(), study.frames.begin() + overlap);
  ends.outgoing_from_incoming = align_overlap(study.rows, outgoing, incoming);
  for (BodyFrame& frame : incoming) frame.move(ends.outgoing_from_incoming);
  ends.frames = cross_fade(outgoing, incoming);
  return ends;
}

/// A cross-fade that can be held as a seam is.
Frames noted_fade(const BodyRows& rows, const Frames& outgoing, const Frames& incoming) {
  Frames faded = cross_fade(outgoing, incoming);
  Eigen::VectorXd shares(std::ssize(faded) - 1);
  for (Eigen::Index t = 0; t < shares.size(); ++t) {
    shares[t] = blend_weight(static_cast<double>(t) - 0.5, static_cast<double>(shares.size()));
  }
  note_added_steps(rows, outgoing, incoming, {shares, shares}, faded);
  return faded;
}

struct Totals {
  std::map<std::string, Figures> mean;
  int clips = 0;
  // Clips on which the seam as it is played has no more than a method.
  std::map<std::string, int> skate_no_more;
  std::map<std::string, int> no_farther;
};

void study_seams(const Study& study, const SeamOptions& options, Totals& totals) {
  const SeamTask task{study.rows,  study.frames,  study.frames,        study.rate(),
                      study.usual, study.capture, study.contacts.floor};
  const std::vector<SewnSeam> seams = find_seams(task, options, 3);
  const double share = 1.0 / static_cast<double>(seams.size());
  std::map<std::string, Figures> figures;
  const SewnSeam ends = ends_of(study, seams.front().found.frames);
  figures["0 cross-fade of ends"].add(study.measure(ends, ends.frames, false), 1.0);
  for (const SewnSeam& seam : seams) {
    const auto out = study.frames.begin() + seam.found.out_begin;
    const auto in = study.frames.begin() + seam.found.in_begin;
    const Frames outgoing(out, out + seam.found.frames);
    Frames incoming(in, in + seam.found.frames);
    for (BodyFrame& frame : incoming) frame.move(seam.outgoing_from_incoming);
    const Frames faded = noted_fade(study.rows, outgoing, incoming);
    SewnSeam middle = seam;
    middle.join = seam.found.frames / 2;
    figures["1 cross-fade"].add(study.measure(middle, faded, false), share);
    figures["2 cross-fade, held"].add(study.measure(middle, faded, true), share);
    figures["3 cut"].add(study.measure(seam, seam.frames, false), share);
    figures["4 cut, held"].add(study.measure(seam, seam.frames, true), share);
  }
  const Figures played = figures["4 cut, held"];
  for (const auto& [name, value] : figures) {
    print(name.c_str(), value);
    totals.skate_no_more[name] += played.skate_cm <= value.skate_cm ? 1 : 0;
    totals.no_farther[name] += played.nearest_cm <= value.nearest_cm ? 1 : 0;
    totals.mean[name].skate_cm += value.skate_cm;
    totals.mean[name].nearest_cm += value.nearest_cm;
    totals.mean[name].speed += value.speed;
    totals.mean[name].acceleration += value.acceleration;
  }
  ++totals.clips;
}

/// Greatest rate within two frames of a seam's overlap and of each turn, and skate of all.
void study_output(const Study& study) {
  EndlessLoop endless(study.capture, {});
  constexpr int kFrames = 1700;
  const LoopedClip looped = endless.next(kFrames);
  std::map<int, int> shown;
  int most = 0;
  for (const double f : looped.source_frames) {
    most = std::max(most, ++shown[static_cast<int>(std::lround(f))]);
  }
  const Frames played =
      to_body_frames(looped.clip, study.rows, {study.rate(), Eigen::Matrix4Xd::Zero(4, kFrames)});
  const MotionRates rates = motion_rates(study.rows, played, study.rate());
  double seam_speed = 0.0;
  double seam_acceleration = 0.0;
  double turn_acceleration = 0.0;
  int seams = 0;
  const auto largest = [&](const std::vector<double>& values, std::int64_t begin,
                           std::int64_t end) {
    double found = 0.0;
    for (auto f = std::max<std::int64_t>(1, begin - 2);
         f < std::min<std::int64_t>(kFrames - 1, end + 2); ++f) {
      found = std::max(found, values[static_cast<std::size_t>(f)]);
    }
    return found;
  };
  for (std::size_t p = 0; p < looped.parts.size(); ++p) {
    const LoopPart& part = looped.parts[p];
    if (part.step == LoopStep::kSeam) {
      ++seams;
      seam_speed = std::max(seam_speed, largest(rates.speed_m_s, part.begin, part.end));
      seam_acceleration =
          std::max(seam_acceleration, largest(rates.acceleration_m_s2, part.begin, part.end));
    } else if (p + 1 < looped.parts.size() && looped.parts[p + 1].step != LoopStep::kSeam) {
      // A turn in fast motion is as fast: beside what the capture does there.
      const auto around = static_cast<std::int64_t>(0.2 * study.rate());
      double captured = study.usual.acceleration_m_s2;
      // A turn plays its frames at half the speed.
      for (auto f = std::max<std::int64_t>(0, part.end - 2 * around);
           f < std::min<std::int64_t>(kFrames, part.end + 2 * around); ++f) {
        const auto source = static_cast<std::size_t>(
            std::clamp(std::lround(looped.source_frames[static_cast<std::size_t>(f)]), 0L,
                       std::ssize(study.frames) - 1));
        captured = std::max(captured, study.captured.acceleration_m_s2[source]);
      }
      const double made = largest(rates.acceleration_m_s2, part.end - around, part.end + around);
      turn_acceleration =
          std::max(turn_acceleration, made / captured * study.usual.acceleration_m_s2);
    }
  }
  const auto quality = [&](const motion::Clip& clip) {
    return motion::measure_quality(clip, study.capture.humanoid,
                                   study.contacts.floor.value_or(motion::FootFloor{}))
        .foot_skate_cm;
  };
  std::printf(
      "  1700 frames: %.0f %% used, most %d of %.1f; %d seams, speed %.2f, acceleration %.2f; "
      "turns %zu points, acceleration %.2f; skate %.3f, captured %.3f cm\n",
      100.0 * static_cast<double>(shown.size()) / static_cast<double>(study.frames.size()), most,
      3.0 * kFrames / static_cast<double>(study.frames.size()), seams,
      seam_speed / study.usual.speed_m_s, seam_acceleration / study.usual.acceleration_m_s2,
      endless.turning().points.size(), turn_acceleration / study.usual.acceleration_m_s2,
      quality(looped.clip), quality(study.capture.clip));
  const SeamlessLoop round = seamless_loop(study.capture);
  std::printf("  seamless: %d frames, %s; skate %.3f\n", round.clip.frame_count(),
              round.closed ? "closed" : "travels", quality(round.clip));
}

int run(int argc, char** argv) {
  std::vector<std::filesystem::path> clips(argv + 1, argv + argc);
  const char* data = std::getenv("LABAN_DATA");
  if (clips.empty() && data != nullptr) {
    for (const std::string& clip : kClips) clips.push_back(std::filesystem::path(data) / clip);
  }
  if (clips.empty()) {
    std::fprintf(stderr, "loop_study: name clips or set LABAN_DATA\n");
    return 2;
  }
  SeamOptions options;
  if (const char* weight = std::getenv("JOINT_WEIGHT")) options.joint_weight = std::atof(weight);
  if (const char* blend = std::getenv("BLEND_FRAMES")) options.blend_frames = std::atoi(blend);
  if (const char* screening = std::getenv("SCREENING")) options.screening = std::atof(screening);
  if (std::getenv("NO_POISSON") != nullptr) options.poisson = false;
  if (std::getenv("GRADIENT") != nullptr) options.metric = SeamMetric::kGradient;
  Totals totals;
  for (const auto& path : clips) {
    const motion::Capture given = motion::find_capture(io::read_clip(path).clip);
    const Study study(flowing(given, first_flowing_frame(given.clip, given.humanoid)));
    std::printf("%s: %zu frames at %g Hz\n", path.stem().c_str(), study.frames.size(),
                study.rate());
    study_seams(study, options, totals);
    study_output(study);
  }
  std::printf("mean of %d clips\n", totals.clips);
  for (auto& [name, value] : totals.mean) {
    const double n = totals.clips;
    print(name.c_str(),
          {value.skate_cm / n, value.nearest_cm / n, value.speed / n, value.acceleration / n});
    std::printf("  %-22s a held cut slides no more on %d, is no farther on %d of %d clips\n", "",
                totals.skate_no_more[name], totals.no_farther[name], totals.clips);
  }
  return 0;
}

}  // namespace
}  // namespace laban::loop

int main(int argc, char** argv) {
  try {
    return laban::loop::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "loop_study: %s\n", error.what());
    return 1;
  }
}
