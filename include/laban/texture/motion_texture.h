#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/motion/pose_matrix.h"
#include "laban/motion/stored_rig.h"
#include "laban/texture/linear_dynamics.h"
#include "laban/texture/observation_space.h"

namespace laban::texture {

/// A motion texton [Li02]: a linear dynamic system and how its states are observed,
/// y = mean + basis x (eq. 11).
struct Texton {
  Eigen::VectorXd mean;              ///< d, pooled over the texton's segments
  Eigen::MatrixXd basis;             ///< d x m, orthonormal columns, the paper's C
  LinearDynamics dynamics;           ///< of the m states x = basis' (y - mean)
  double residual_variance = 0.0;    ///< s^2 of each of the d - m directions outside the basis
  Eigen::VectorXd start_mean;        ///< 2 m, of (x_t, x_{t+1}) over the texton's segments
  Eigen::MatrixXd start_covariance;  ///< 2 m x 2 m, positive definite

  [[nodiscard]] int dimension() const noexcept { return dynamics.dimension(); }
};

/// Frames [begin, begin + length) of the corpus, all of one take, that one texton explains.
struct Segment {
  int begin = 0;  ///< frame among MotionTexture::observations
  int length = 0;
  int texton = 0;
};

/// A capture that the texture was learnt from.
struct Take {
  std::string name;  ///< file as it was given
  int begin = 0;     ///< first frame among MotionTexture::observations
  int length = 0;
  /// Frame of the file at which the take begins (after a T-pose) and frames of the file for each of
  /// the take's: file frame = first_file_frame + file_frames_per_frame * (frame - begin).
  int first_file_frame = 0;
  double file_frames_per_frame = 1.0;
};

/// The body that a texture's motion is played on: that of the first capture.
using TextureRig = motion::StoredRig;

/// The same poses raised or lowered so that, on the rig, they stand on its floor: captures put
/// their floor off by centimetres, and motion put together from several would float here and sink
/// there. As they are if nothing stands in them, or the rig's floor is not known.
[[nodiscard]] motion::PoseMatrix standing_on_floor(const TextureRig& rig, motion::PoseMatrix pose);

/// What hours of capture teach [Li02]: textons, which follows which, and the motion itself.
///
/// Invariant: takes follow each other without gap from 0 to the last observation; segments do too,
/// each at least min_frames long unless its whole take is shorter, none across takes.
struct MotionTexture {
  ObservationSpace space;
  double frame_rate_hz = 0.0;
  double leg_length_m = 0.0;     ///< of the rig
  int min_frames = 60;           ///< T_min
  Eigen::MatrixXd observations;  ///< d x N, all takes one after the other
  std::vector<Take> takes;
  std::vector<Segment> segments;
  std::vector<Texton> textons;
  Eigen::MatrixXd transition_counts;  ///< Nt x Nt, row = from; none across takes
  TextureRig rig;
  std::string record_json = "{}";  ///< what made it: options, seed, files, likelihood of each round

  [[nodiscard]] int texton_count() const noexcept { return static_cast<int>(textons.size()); }
};

/// Numbers of the segments of a texton, in order: their first two frames are its start poses.
[[nodiscard]] std::vector<int> segments_of(const MotionTexture& texture, int texton);

/// Observations of a segment, d x length.
[[nodiscard]] inline auto segment_observations(const MotionTexture& texture,
                                               const Segment& segment) {
  return texture.observations.middleCols(segment.begin, segment.length);
}

/// How far the first two frames of a segment are from two others, in observation units.
/// @param frames  d x 2.
[[nodiscard]] double pose_distance(const MotionTexture& texture, const Segment& segment,
                                   const Eigen::Ref<const Eigen::MatrixXd>& frames);

/// Nt x Nt transition matrix M: rows of counts over their sum; a row of zeros has no successor.
[[nodiscard]] Eigen::MatrixXd transition_matrix(const MotionTexture& texture);

}  // namespace laban::texture
