#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/base/progress.h"
#include "laban/manifold/cluster_figures.h"
#include "laban/manifold/grbf.h"
#include "laban/manifold/pose_vector.h"
#include "laban/manifold/som.h"
#include "laban/math/pca.h"
#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/stored_rig.h"

namespace laban::manifold {

/// How poses are laid out on the plane.
enum class MapKind {
  kSom,  ///< at their best-matching units
  kPca,  ///< by their first two principal components, scaled to the same plane
};

/// What cuts the plane into motion primitives.
enum class PrimitiveMethod { kKMeans, kFuzzyKMeans, kGaussianMixture };

[[nodiscard]] std::string_view name_of(MapKind kind);            ///< "som", "pca"
[[nodiscard]] std::string_view name_of(PrimitiveMethod method);  ///< "k-means", "fuzzy", "mixture"

/// Motion primitives: clusters of the training poses by their first principal components, and how
/// they follow each other. On the map's own coordinates a cluster would join what a fold of the map
/// has brought side by side, the left and the right step of a walk.
struct Primitives {
  PrimitiveMethod method = PrimitiveMethod::kFuzzyKMeans;
  Eigen::MatrixXd coordinates;  ///< C x K, principal coordinates of the centres, metres
  Eigen::Matrix2Xd centers;     ///< 2 x K, where the centres' poses lie on the map
  std::vector<int> labels;      ///< of each training frame
  Eigen::MatrixXd counts;       ///< K x K transitions from frame to frame, row = from

  [[nodiscard]] int count() const noexcept { return static_cast<int>(centers.cols()); }
};

/// The body that a manifold's motion is played on: that of the first capture.
struct ManifoldRig : motion::StoredRig {
  /// Joints that play no standard joint and move in the capture; their rotations are learnt too.
  std::vector<int> free_joints;
};

/// The plane of poses that captures have taught: map point -> pose, pose -> map point, primitives.
///
/// Map points run over [0, columns - 1] x [0, rows - 1] (x = column, y = row), whatever the kind.
struct PoseManifold {
  MapKind kind = MapKind::kSom;
  double frame_rate_hz = 0.0;
  SelfOrganizingMap som;  ///< 63 x nodes; its size is the plane's also for kPca, codebook empty
  /// Of the pose vectors: as many components as hold 95 % of the variance, 2 to 10 (fewer if there
  /// are no more).
  math::Pca pca;
  Region pca_region;  ///< principal coordinates that map to the plane's ends
  Grbf generator;     ///< map point -> pose channels (src/manifold/pose_channels.h)
  Primitives primitives;
  Eigen::Matrix2Xd points;       ///< 2 x N, the training frames on the map
  std::vector<int> take_begins;  ///< first frame of each take among them, ascending from 0
  ManifoldRig rig;
  std::string record_json = "{}";  ///< what made it: JSON object

  [[nodiscard]] Region region() const;
  /// Where a pose vector lies on the map: at the point within four nodes of its best-matching unit
  /// whose pose is nearest (ours: the paper's points are nodes, and a motion on them a staircase),
  /// or its principal coordinates clamped to the plane. @throws Error{kData} unless it has 63 rows.
  [[nodiscard]] Eigen::Vector2d place(const Eigen::Ref<const Eigen::VectorXd>& pose_vector) const;
  [[nodiscard]] Eigen::Matrix2Xd places(
      const Eigen::Ref<const Eigen::MatrixXd>& pose_vectors) const;
  /// The best-matching units' own places; as `places` for kPca.
  [[nodiscard]] Eigen::Matrix2Xd nodes(const Eigen::Ref<const Eigen::MatrixXd>& pose_vectors) const;
  /// Share of the training poses' variance that the first two principal components hold.
  [[nodiscard]] double plane_share() const;
  /// The primitive of a map point: that of the centre nearest to its pose.
  [[nodiscard]] int primitive_at(const Eigen::Vector2d& point) const;
};

/// A pose of the standard body, out of the map.
struct MapPose {
  Eigen::Matrix3Xd positions;                 ///< 3 x 21, metres, with the body's bone lengths
  std::vector<Eigen::Quaterniond> rotations;  ///< 21, model-from-joint
  Eigen::VectorXd channels;                   ///< all that the map says of the point
};

/// The pose at a map point: joint positions by the GRBF, brought to the standard body's bone
/// lengths by inverse kinematics. @throws Error{kNumeric} if the point is so far off that nothing
/// is finite.
[[nodiscard]] MapPose pose_at(const PoseManifold& manifold, const Eigen::Vector2d& point);

struct LearnOptions {
  MapKind kind = MapKind::kSom;
  SomOptions som;  ///< its rows and columns are the plane's also for kPca
  GrbfOptions grbf;
  PrimitiveMethod method = PrimitiveMethod::kFuzzyKMeans;
  std::optional<int> primitives;  ///< nullopt: at the elbow, among 1 .. most_primitives
  int most_primitives = 30;
  std::uint64_t seed = 1;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// One clustering among those compared.
struct ComparedClusters {
  PrimitiveMethod method = PrimitiveMethod::kKMeans;
  double objective = 0.0;  ///< inertia, fuzzy objective, or mean log-likelihood
  ClusterFigures figures;
};

struct LearnReport {
  MapErrors map;                          ///< zero for kPca
  double reconstruction_m = 0.0;          ///< mean joint error of pose_at over the training frames
  double explained_share = 0.0;           ///< of the variance, by two principal components
  std::vector<double> elbow_errors;       ///< empty if the number of primitives was given
  std::vector<ComparedClusters> methods;  ///< all three, at that number
};

struct LearnedManifold {
  PoseManifold manifold;
  LearnReport report;
};

/// Learns the plane of poses from captures [Manifold]. Captures on another rig or at another rate
/// than the first are brought to the first's.
///
/// @param captures  without T-pose frame, as motion::find_capture gives them; at least one.
/// @throws Error{kUsage} if `options` has problems, there is no capture or the work is stopped.
[[nodiscard]] LearnedManifold learn_manifold(std::span<const motion::Capture> captures,
                                             const LearnOptions& options = {},
                                             base::Progress* progress = nullptr);

/// Mean joint error, metres, of the poses that the map gives back for a motion: each frame's place
/// on the map, and the pose there.
[[nodiscard]] double reconstruction_error_m(const PoseManifold& manifold,
                                            const motion::PoseMatrix& pose);

}  // namespace laban::manifold
