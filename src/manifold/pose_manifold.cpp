#include "laban/manifold/pose_manifold.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "laban/base/error.h"
#include "laban/manifold/fuzzy_k_means.h"
#include "laban/manifold/gaussian_mixture.h"
#include "laban/manifold/k_means.h"
#include "laban/manifold/markov_chain.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/inverse_kinematics.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/motion/standard_body.h"

#include "manifold/pose_channels.h"
#include "manifold/solve_pose.h"

namespace laban::manifold {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::Matrix2Xd;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using motion::kStandardJointCount;

// A joint that turns less than this in a whole capture stands still, radians.
constexpr double kStillAngle = 1e-3;

// ---- captures, brought to one rig and rate ----

bool same_skeleton(const motion::Skeleton& a, const motion::Skeleton& b) {
  constexpr double kSameOffset = 1e-6;  // metres
  if (a.joint_count() != b.joint_count()) return false;
  for (int j = 0; j < a.joint_count(); ++j) {
    if (a.joint(j).name != b.joint(j).name || a.joint(j).parent != b.joint(j).parent) return false;
    // The root's offset is replaced by its position.
    if (j > 0 && (a.joint(j).rest_offset - b.joint(j).rest_offset).norm() > kSameOffset) {
      return false;
    }
  }
  return true;
}

std::vector<motion::Clip> clips_on_first_rig(std::span<const motion::Capture> captures) {
  const motion::Capture& first = captures.front();
  std::vector<motion::Clip> clips;
  for (const motion::Capture& capture : captures) {
    motion::Clip clip = motion::resample(capture.clip, first.clip.frame_rate_hz());
    if (!same_skeleton(clip.skeleton(), first.clip.skeleton())) {
      clip = motion::from_pose_matrix(motion::to_pose_matrix(clip, capture.humanoid),
                                      first.humanoid, first.clip.slice(0, 1));
    }
    clips.push_back(std::move(clip));
  }
  return clips;
}

std::vector<int> find_free_joints(const std::vector<motion::Clip>& clips,
                                  const motion::Humanoid& humanoid) {
  std::vector<int> found;
  for (int j = 0; j < clips.front().joint_count(); ++j) {
    if (humanoid.played_by(j)) continue;
    const Eigen::Quaterniond& first = clips.front().rotation(0, j);
    const bool moves = std::any_of(clips.begin(), clips.end(), [&](const motion::Clip& clip) {
      for (int f = 0; f < clip.frame_count(); ++f) {
        if (math::angle_between(first, clip.rotation(f, j)) > kStillAngle) return true;
      }
      return false;
    });
    if (moves) found.push_back(j);
  }
  return found;
}

// ---- what is learnt of each frame ----

/// Velocities of the columns, central differences, one-sided at the ends; 0 for one frame.
MatrixXd velocities(const MatrixXd& x, double rate_hz) {
  MatrixXd v = MatrixXd::Zero(x.rows(), x.cols());
  for (Index f = 0; f < x.cols() && x.cols() > 1; ++f) {
    const Index before = std::max<Index>(0, f - 1);
    const Index after = std::min<Index>(x.cols() - 1, f + 1);
    v.col(f) = (x.col(after) - x.col(before)) * (rate_hz / static_cast<double>(after - before));
  }
  return v;
}

MatrixXd channels_of(const motion::Clip& clip, const ManifoldRig& rig) {
  const motion::PoseMatrix pose = motion::to_pose_matrix(clip, rig.humanoid);
  const Index frames = pose.frame_count();
  MatrixXd channels(channel_count(static_cast<int>(rig.free_joints.size())), frames);
  const MatrixXd vectors = pose_vectors(pose);
  const MatrixXd speeds = velocities(vectors, pose.frame_rate_hz);
  channels.topRows(kPoseRowCount) = vectors;
  channels.middleRows(kVelocityRow, kPoseRowCount) = speeds;
  const Eigen::VectorXd still = Eigen::VectorXd::Zero(kPoseRowCount);
  for (Index f = 0; f < frames; ++f)
    channels(kSpeedRow, f) = mean_joint_distance(speeds.col(f), still);
  channels.middleRows(kStepRow, 3) = pose.steps * pose.frame_rate_hz;
  channels.middleRows(kContactRow, 4) =
      motion::find_foot_contacts(clip, rig.humanoid).contacts.share;
  for (Index f = 0; f < frames; ++f) {
    std::vector<Eigen::Quaterniond> model(kStandardJointCount);
    for (int s = 0; s < kStandardJointCount; ++s) {
      const auto cell = static_cast<std::size_t>(s);
      const int parent = motion::kStandardParents[cell];
      const Eigen::Quaterniond local = math::exp(pose.angles.block<3, 1>(3 * s, f));
      model[cell] = parent < 0 ? local : model[static_cast<std::size_t>(parent)] * local;
      channels.block<6, 1>(kRotationRow + 6 * s, f) = two_axes(model[cell]);
    }
    for (std::size_t e = 0; e < rig.free_joints.size(); ++e) {
      channels.block<6, 1>(kFreeJointRow + 6 * static_cast<int>(e), f) =
          two_axes(clip.rotation(static_cast<int>(f), rig.free_joints[e]));
    }
  }
  return channels;
}

// ---- the plane ----

/// Ends of the principal coordinates, with a margin so that the outermost poses have neighbours.
Region region_around(const MatrixXd& coordinates) {
  constexpr double kMargin = 0.05;
  Region region;
  for (int axis = 0; axis < 2; ++axis) {
    const bool has = axis < coordinates.rows();
    const double low = has ? coordinates.row(axis).minCoeff() : 0.0;
    const double high = has ? coordinates.row(axis).maxCoeff() : 0.0;
    // One pose alone: any plane around it.
    const double span = high > low ? high - low : 1.0;
    region.low[axis] = low - kMargin * span;
    region.high[axis] = high + kMargin * span;
  }
  return region;
}

/// The point near `node` whose pose comes nearest to a vector, by Gauss-Newton steps on the
/// generator: between nodes, so that a motion is a smooth way over the map and not a staircase.
/// Only steps that come nearer are taken, and none farther from the node than units lie from each
/// other.
Vector2d between_nodes(const Grbf& generator, const Vector2d& node,
                       const Eigen::Ref<const Eigen::VectorXd>& vector) {
  constexpr int kSteps = 8;
  constexpr double kReach = 4.0;     // nodes
  constexpr double kProbe = 1e-3;    // nodes, of the differences
  constexpr double kRest = 1e-3;     // nodes; a step below it is the last
  constexpr double kDamping = 1e-6;  // square metres a square node: flat places keep the node
  const Region& plane = generator.region();
  const Vector2d low = (node.array() - kReach).matrix().cwiseMax(plane.low);
  const Vector2d high = (node.array() + kReach).matrix().cwiseMin(plane.high);
  Vector2d point = node;
  Vector2d best = node;
  double least = std::numeric_limits<double>::infinity();
  for (int step = 0; step < kSteps; ++step) {
    Matrix2Xd probes(2, 3);
    probes << point, point, point;
    probes(0, 1) += kProbe;
    probes(1, 2) += kProbe;
    const MatrixXd poses = generator.at_all(probes, kPoseRowCount);
    const Eigen::VectorXd left = vector - poses.col(0);
    const double distance = left.squaredNorm();
    if (distance >= least) {  // too far: half-way back
      point = 0.5 * (point + best);
      continue;
    }
    least = distance;
    best = point;
    Eigen::Matrix<double, Eigen::Dynamic, 2> slopes(kPoseRowCount, 2);
    slopes << poses.col(1) - poses.col(0), poses.col(2) - poses.col(0);
    slopes /= kProbe;
    Eigen::Matrix2d normal = slopes.transpose() * slopes;
    normal.diagonal().array() += kDamping;
    const Vector2d target = point + normal.ldlt().solve(slopes.transpose() * left);
    point = target.cwiseMax(low).cwiseMin(high);
    if ((point - best).norm() < kRest) break;
  }
  return best;
}

/// Fits the generator and lays the frames between nodes by it, in turn.
void fit_generator(PoseManifold& manifold, const MatrixXd& channels, const GrbfOptions& options) {
  constexpr int kRounds = 2;
  const MatrixXd vectors = channels.topRows(kPoseRowCount);
  manifold.points = manifold.nodes(vectors);
  manifold.generator = fit_grbf(manifold.points, channels, manifold.region(), options);
  if (manifold.kind != MapKind::kSom) return;
  for (int round = 0; round < kRounds; ++round) {
    manifold.points = manifold.places(vectors);
    manifold.generator = fit_grbf(manifold.points, channels, manifold.region(), options);
  }
  manifold.points = manifold.places(vectors);
}

// ---- primitives ----

struct Clustering {
  PrimitiveMethod method;
  MatrixXd centers;
  std::vector<int> labels;
  double objective;
};

std::vector<Clustering> all_clusterings(const MatrixXd& points, int clusters, base::Rng& rng) {
  KMeansOptions options;
  options.clusters = clusters;
  const KMeans hard = k_means(points, options, rng);
  const FuzzyKMeans fuzzy = fuzzy_k_means(points, hard.centers);
  MixtureSearchOptions search;
  search.em.floor = 1e-4;  // a centimetre: poses are no surer than that
  const GaussianMixture mixture = best_gaussian_mixture(points, hard.labels, search, rng);
  return {{PrimitiveMethod::kKMeans, hard.centers, hard.labels, hard.inertia},
          {PrimitiveMethod::kFuzzyKMeans, fuzzy.centers, hard_labels(fuzzy.memberships),
           fuzzy.objective},
          {PrimitiveMethod::kGaussianMixture, mixture.means, hard_labels(mixture.responsibilities),
           mixture.mean_log_likelihood}};
}

/// Labels cut into takes: a take ends where the next begins.
std::vector<std::vector<int>> by_take(const std::vector<int>& labels,
                                      const std::vector<int>& take_begins) {
  std::vector<std::vector<int>> takes;
  for (std::size_t t = 0; t < take_begins.size(); ++t) {
    const auto end = t + 1 < take_begins.size() ? take_begins[t + 1] : std::ssize(labels);
    takes.emplace_back(labels.begin() + take_begins[t], labels.begin() + end);
  }
  return takes;
}

Primitives make_primitives(const Clustering& clustering, const PoseManifold& manifold) {
  Primitives primitives;
  primitives.method = clustering.method;
  primitives.coordinates = clustering.centers;
  primitives.centers = manifold.places(manifold.pca.reconstruct(clustering.centers));
  primitives.labels = clustering.labels;
  primitives.counts = count_transitions(by_take(primitives.labels, manifold.take_begins),
                                        static_cast<int>(clustering.centers.cols()));
  return primitives;
}

Primitives find_primitives(const MatrixXd& coordinates, const PoseManifold& manifold,
                           const LearnOptions& options, LearnReport& report) {
  base::Rng rng(options.seed);
  int clusters = options.primitives.value_or(1);
  if (!options.primitives) {
    const ElbowCurve elbow = find_elbow(coordinates, options.most_primitives, {}, rng);
    report.elbow_errors = elbow.errors;
    clusters = elbow.clusters;
  }
  Primitives primitives;
  for (const Clustering& clustering : all_clusterings(coordinates, clusters, rng)) {
    report.methods.push_back({clustering.method, clustering.objective,
                              cluster_figures(coordinates, clustering.centers, clustering.labels)});
    if (clustering.method == options.method) primitives = make_primitives(clustering, manifold);
  }
  return primitives;
}

/// Principal components for 95 % of the variance, at least the plane of the first two.
math::Pca fit_components(const MatrixXd& vectors) {
  constexpr double kShare = 0.98;
  constexpr int kMost = 10;
  math::Pca pca = math::fit_pca(vectors, kMost);
  Index kept = std::min<Index>(2, pca.basis.cols());
  while (kept < pca.basis.cols() && pca.variance.head(kept).sum() < kShare * pca.total_variance) {
    ++kept;
  }
  pca.basis = pca.basis.leftCols(kept).eval();
  pca.variance = pca.variance.head(kept).eval();
  return pca;
}

// ---- poses ----

/// Whether positions say nothing of the joint's rotation: it ends a chain.
bool is_leaf(std::size_t s) {
  const auto& parents = motion::kStandardParents;
  return std::find(parents.begin(), parents.end(), static_cast<int>(s)) == parents.end();
}

ManifoldRig make_rig(const std::vector<motion::Clip>& clips, const motion::Humanoid& humanoid) {
  return {{clips.front().slice(0, 1), humanoid,
           motion::find_foot_contacts(clips.front(), humanoid).floor},
          find_free_joints(clips, humanoid)};
}

}  // namespace

std::string_view name_of(MapKind kind) {
  return kind == MapKind::kSom ? "som" : "pca";
}

std::string_view name_of(PrimitiveMethod method) {
  switch (method) {
    case PrimitiveMethod::kKMeans:
      return "k-means";
    case PrimitiveMethod::kFuzzyKMeans:
      return "fuzzy";
    case PrimitiveMethod::kGaussianMixture:
      return "mixture";
  }
  return "";
}

Region PoseManifold::region() const {
  return {Vector2d::Zero(), Vector2d(som.columns - 1.0, som.rows - 1.0)};
}

Matrix2Xd PoseManifold::places(const Eigen::Ref<const MatrixXd>& vectors) const {
  Matrix2Xd found = nodes(vectors);
  if (kind != MapKind::kSom) return found;
  for (Index n = 0; n < found.cols(); ++n) {
    found.col(n) = between_nodes(generator, found.col(n), vectors.col(n));
  }
  return found;
}

Matrix2Xd PoseManifold::nodes(const Eigen::Ref<const MatrixXd>& vectors) const {
  Matrix2Xd found(2, vectors.cols());
  if (kind == MapKind::kSom) {
    const std::vector<int> units = best_matching_units(som, vectors).first;
    for (Index n = 0; n < found.cols(); ++n) {
      found.col(n) = som.position(units[static_cast<std::size_t>(n)]);
    }
    return found;
  }
  Matrix2Xd coordinates = Matrix2Xd::Zero(2, vectors.cols());
  const Index axes = std::min(2, pca.component_count());
  coordinates.topRows(axes) = pca.transform(vectors).topRows(axes);
  const Region plane = region();
  const Eigen::Array2d scale = plane.high.array() / (pca_region.high - pca_region.low).array();
  for (Index n = 0; n < found.cols(); ++n) {
    const Vector2d scaled = ((coordinates.col(n) - pca_region.low).array() * scale).matrix();
    found.col(n) = scaled.cwiseMax(plane.low).cwiseMin(plane.high);
  }
  return found;
}

Vector2d PoseManifold::place(const Eigen::Ref<const Eigen::VectorXd>& pose_vector) const {
  return places(pose_vector).col(0);
}

double PoseManifold::plane_share() const {
  if (!(pca.total_variance > 0.0)) return 1.0;
  return std::min(1.0,
                  pca.variance.head(std::min(2, pca.component_count())).sum() / pca.total_variance);
}

int PoseManifold::primitive_at(const Vector2d& point) const {
  const Eigen::VectorXd here = pca.transform(generator.at(point, kPoseRowCount));
  Index nearest = 0;
  (primitives.coordinates.colwise() - here).colwise().squaredNorm().minCoeff(&nearest);
  return static_cast<int>(nearest);
}

Eigen::Quaterniond turned_towards(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b,
                                  double most) {
  const double angle = math::angle_between(a, b);
  return angle <= most ? b : a.slerp(most / angle, b).normalized();
}

// A bone may swing this much faster than it turns about itself.
constexpr double kSwingsATurn = 4.0;

MapPose solve_pose(Eigen::VectorXd channels, const MapPose* before, double most_turn) {
  if (!channels.allFinite()) {
    throw Error(ErrorKind::kNumeric, "pose_at: nothing is known so far off the map");
  }
  MapPose pose;
  pose.channels = std::move(channels);
  std::vector<Eigen::Quaterniond> wanted(kStandardJointCount);
  std::vector<Eigen::Quaterniond> guide(kStandardJointCount);
  for (std::size_t s = 0; s < wanted.size(); ++s) {
    wanted[s] = from_two_axes(pose.channels.segment<6>(kRotationRow + 6 * static_cast<int>(s)));
    guide[s] =
        before == nullptr ? wanted[s] : turned_towards(before->rotations[s], wanted[s], most_turn);
  }
  const Eigen::Map<const Eigen::Matrix3Xd> places(pose.channels.data(), 3, kStandardJointCount);
  const motion::Skeleton& body = *motion::standard_skeleton();
  pose.rotations = motion::rotations_from_positions(body, places, guide);
  for (std::size_t s = 1; s < wanted.size() && before != nullptr; ++s) {
    const auto parent = static_cast<std::size_t>(motion::kStandardParents[s]);
    const Eigen::Quaterniond was = before->rotations[parent].conjugate() * before->rotations[s];
    const Eigen::Quaterniond local =
        pose.rotations[parent].conjugate() * (is_leaf(s) ? wanted[s] : pose.rotations[s]);
    const double most = is_leaf(s) ? most_turn : kSwingsATurn * most_turn;
    pose.rotations[s] = (pose.rotations[parent] * turned_towards(was, local, most)).normalized();
  }
  pose.positions.resize(3, kStandardJointCount);
  pose.positions.col(0) = places.col(0);
  for (int s = 1; s < kStandardJointCount; ++s) {
    const int parent = motion::kStandardParents[static_cast<std::size_t>(s)];
    pose.positions.col(s) =
        pose.positions.col(parent) +
        pose.rotations[static_cast<std::size_t>(parent)] * body.joint(s).rest_offset;
  }
  return pose;
}

MapPose pose_at(const PoseManifold& manifold, const Vector2d& point) {
  return solve_pose(manifold.generator.at(point), nullptr);
}

std::vector<std::string> LearnOptions::problems() const {
  std::vector<std::string> found = som.problems();
  for (const std::string& problem : grbf.problems()) found.push_back(problem);
  if (primitives && *primitives < 1) {
    found.push_back("LearnOptions::primitives = " + std::to_string(*primitives) +
                    " (must be >= 1)");
  }
  if (most_primitives < 1) {
    found.push_back("LearnOptions::most_primitives = " + std::to_string(most_primitives) +
                    " (must be >= 1)");
  }
  return found;
}

LearnedManifold learn_manifold(std::span<const motion::Capture> captures,
                               const LearnOptions& options, base::Progress* progress) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  if (captures.empty()) throw Error(ErrorKind::kUsage, "learn_manifold: there is no capture");
  const std::vector<motion::Clip> clips = clips_on_first_rig(captures);
  ManifoldRig rig = make_rig(clips, captures.front().humanoid);
  MatrixXd channels;
  std::vector<int> take_begins;
  for (const motion::Clip& clip : clips) {
    const MatrixXd more = channels_of(clip, rig);
    take_begins.push_back(static_cast<int>(channels.cols()));
    channels.conservativeResize(more.rows(), channels.cols() + more.cols());
    channels.rightCols(more.cols()) = more;
  }
  const MatrixXd vectors = channels.topRows(kPoseRowCount);
  math::Pca pca = fit_components(vectors);
  SelfOrganizingMap som{options.som.rows, options.som.columns, {}};
  if (options.kind == MapKind::kSom) som = fit_som(vectors, options.som, progress);
  const Region pca_region = region_around(pca.transform(vectors));
  const Region plane{Vector2d::Zero(), Vector2d(som.columns - 1.0, som.rows - 1.0)};
  // The generator is fitted once the frames have their places, which only a manifold can tell.
  const Grbf none(options.grbf, plane,
                  MatrixXd::Zero(1, options.grbf.centers_a_side * options.grbf.centers_a_side + 3));
  LearnedManifold learned{PoseManifold{options.kind,
                                       clips.front().frame_rate_hz(),
                                       std::move(som),
                                       std::move(pca),
                                       pca_region,
                                       none,
                                       {},
                                       {},
                                       take_begins,
                                       std::move(rig),
                                       "{}"},
                          {}};
  PoseManifold& manifold = learned.manifold;
  fit_generator(manifold, channels, options.grbf);
  manifold.primitives =
      find_primitives(manifold.pca.transform(vectors), manifold, options, learned.report);
  if (options.kind == MapKind::kSom) learned.report.map = map_errors(manifold.som, vectors);
  learned.report.explained_share = manifold.plane_share();
  for (Index f = 0; f < vectors.cols(); ++f) {
    const MapPose pose = pose_at(manifold, manifold.points.col(f));
    learned.report.reconstruction_m += mean_joint_distance(
        Eigen::Map<const Eigen::VectorXd>(pose.positions.data(), kPoseRowCount), vectors.col(f));
  }
  learned.report.reconstruction_m /= static_cast<double>(vectors.cols());
  return learned;
}

double reconstruction_error_m(const PoseManifold& manifold, const motion::PoseMatrix& pose) {
  const MatrixXd vectors = pose_vectors(pose);
  const Matrix2Xd points = manifold.places(vectors);
  double sum = 0.0;
  for (Index f = 0; f < vectors.cols(); ++f) {
    const MapPose back = pose_at(manifold, points.col(f));
    sum += mean_joint_distance(
        Eigen::Map<const Eigen::VectorXd>(back.positions.data(), kPoseRowCount), vectors.col(f));
  }
  return sum / static_cast<double>(vectors.cols());
}

}  // namespace laban::manifold
