#pragma once

#include <vector>

#include <Eigen/Dense>

#include "loop/join_window.h"
#include "loop/sewn_seam.h"

namespace laban::loop {

/// A seam while it is looked for.
struct SeamCandidate {
  SewnSeam seam;
  std::vector<BodyFrame> outgoing, incoming;  ///< of the overlap, in the outgoing clip's place
  JoinedWindow window;
  int blend_frames = 0;
};

/// How a seam looks once it is played.
struct SeamFigures {
  double skate_cm = 0.0;    ///< motion::foot_skate_cm
  double nearest_cm = 0.0;  ///< mean over frames of the rms distance of the standard joints to the
                            ///< nearest captured frame, as seen from the body
  /// Greatest rms speed or acceleration in the overlap and two frames on either side, in the
  /// captures' 99th percentiles.
  double rate_ratio = 0.0;
};

/// Judges seams among their captured frames.
class SeamJudge {
 public:
  /// The task must outlive this.
  explicit SeamJudge(const SeamTask& task);

  /// @param held  with the feet held as one capture's (hold_feet).
  [[nodiscard]] SeamFigures figures(const SewnSeam& seam, bool held) const;

 private:
  [[nodiscard]] double nearest_cm(const BodyFrame& frame) const;

  const SeamTask& task_;
  Eigen::MatrixXf captured_;  // a column a frame
};

/// Leads the feet over a seam (feet_over_seam), the hips above them, and plays it slower where it
/// would be too quick.
///
/// How far feet are led, and how long the blend is, is tried: led all the way they slide least but
/// bend the legs most; a quick blend stays with the captures but moves more at once, one over the
/// whole overlap drifts. Skate and distance to the captures are each weighed in what a plain
/// cross-fade of the same frames has, and the worse of the two counts, so that neither is bought
/// with the other; among those better in both, skate is weighed in that of the fade with its feet
/// held. Only where none is better than the fade are feet that are not held in the overlap tried:
/// they slide more and stay nearer to the captures. Where some are within the captures' rates those
/// go before, else the least quick.
void lead_feet(const SeamTask& task, const SeamJudge& judge, const JoinWindowOptions& options,
               SeamCandidate& candidate);

}  // namespace laban::loop
