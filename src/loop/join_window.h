#pragma once

#include <vector>

#include "laban/loop/graph_cut_seam.h"

#include "loop/body_track.h"

namespace laban::loop {

struct JoinWindowOptions {
  SeamMetric metric = SeamMetric::kDifference;
  int blend_frames = 25;
  bool poisson = true;
  double joint_weight = 0.01;
  double screening = 0.1;
};

/// N frames in which one motion becomes another: the first frame is the outgoing one's, the last
/// the incoming one's, exactly.
struct JoinedWindow {
  std::vector<BodyFrame> frames;
  std::vector<int> switch_frames;  ///< of each row, 1 .. N - 1
  double cut_cost = 0.0;
};

/// Share of the outgoing motion in a joint that switches between frames switch - 1 and switch: as
/// blend_weight, but of the fifth degree, whose acceleration does not leap where the blend begins
/// and ends.
[[nodiscard]] double outgoing_share(double frame, int switch_frame, int blend_frames);

/// Frames of the blend: those asked for, as far as the overlap has room on both sides of a seam.
[[nodiscard]] int blend_length(int overlap_frames, int blend_frames);

/// Cut, blend along the seam, Poisson smoothing (METHODS 3.2, 3.3) of an overlap.
/// @param outgoing, incoming  N frames each, N >= 4, in one place in the world.
[[nodiscard]] JoinedWindow join_window(const BodyRows& rows, const std::vector<BodyFrame>& outgoing,
                                       const std::vector<BodyFrame>& incoming,
                                       const JoinWindowOptions& options);

/// Plain cross-fade of the same frames, the whole body at once: what the seam is compared with.
[[nodiscard]] std::vector<BodyFrame> cross_fade(const std::vector<BodyFrame>& outgoing,
                                                const std::vector<BodyFrame>& incoming);

}  // namespace laban::loop
