#pragma once

#include <array>
#include <vector>

#include <Eigen/Dense>

#include "loop/body_track.h"
#include "loop/join_window.h"

namespace laban::loop {

/// Where the feet go over a seam.
struct FeetOverSeam {
  std::array<Eigen::Matrix3Xd, 2> goals;  ///< 3 x N, of the foot joints, metres
  double slide_m = 0.0;  ///< that both feet slide while they stand, which neither clip did
};

/// Leads the feet over a seam so that they make up for what the two motions are apart where they
/// swing, not where they stand (ours).
///
/// The toe of a foot takes, from frame to frame, the mean of both motions' own steps, each by its
/// share at that foot's seam. Such steps end beside the incoming foot; what is missing is handed
/// out over the overlap, most where the foot is fast in the motions that are played: the least
/// squares rebuilding of a path from steps [as Graphcut, eq. 14] with weights, of which those of a
/// standing foot may give least. A foot that stands all the time gives evenly.
/// @param outgoing, incoming  of the overlap, in one place in the world.
/// @param window  what was sewn of them; its feet keep their orientation.
/// @param pull_per_s  how fast a swinging foot goes back to where the window has it, >= 0: the
///                    more, the more a foot slides and the less legs differ from the blended ones.
[[nodiscard]] FeetOverSeam feet_over_seam(const BodyRows& rows,
                                          const std::vector<BodyFrame>& outgoing,
                                          const std::vector<BodyFrame>& incoming,
                                          const JoinedWindow& window, int blend_frames,
                                          double frame_rate_hz, double pull_per_s);

/// The outgoing motion's share of each foot's steps, from frame t to t + 1 of an overlap of N: N -
/// 1 each.
[[nodiscard]] std::array<Eigen::VectorXd, 2> step_shares(const BodyRows& rows,
                                                         const std::vector<int>& switch_frames,
                                                         int overlap_frames, int blend_frames);

/// Writes BodyFrame::added_steps of an overlap: what its toes step beyond both motions' own steps,
/// each by its share.
void note_added_steps(const BodyRows& rows, const std::vector<BodyFrame>& outgoing,
                      const std::vector<BodyFrame>& incoming,
                      const std::array<Eigen::VectorXd, 2>& outgoing_shares,
                      std::vector<BodyFrame>& frames);

}  // namespace laban::loop
