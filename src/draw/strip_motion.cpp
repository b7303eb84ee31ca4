#include "draw/strip_motion.h"

#include <cmath>

#include "laban/base/error.h"

namespace laban::draw {
namespace {

constexpr double kFurthestM = 1e6;
constexpr double kFloorQuantile = 0.02;  // a foot that sinks for a few frames does not lower it

Eigen::Vector3d pelvis(const Body& body, const Eigen::Matrix3Xd& nodes) {
  if (!body.left_hip) return nodes.col(body.root);
  return 0.5 * (nodes.col(*body.left_hip) + nodes.col(*body.right_hip));
}

void check_reach(const Eigen::Matrix3Xd& nodes, std::size_t strip, int frame) {
  if (nodes.cwiseAbs().maxCoeff() <= kFurthestM) return;  // false for NaN
  throw base::Error(base::ErrorKind::kData,
                    "contact_sheet: strip " + std::to_string(strip) + ", frame " +
                        std::to_string(frame) +
                        ": a joint lies further than 1e6 m from the origin");
}

double quantile(std::vector<double> values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

void follow(const Strip& strip, std::size_t index, StripMotion& motion) {
  const Body& body = motion.body;
  const int frames = strip.clip.frame_count();
  motion.anchors.resize(3, frames);
  motion.tracks.assign(body.tracers.size(), Eigen::Matrix3Xd(3, frames));
  std::vector<double> lowest;
  for (int f = 0; f < frames; ++f) {
    const Eigen::Matrix3Xd nodes = node_positions(strip.clip, body, f);
    check_reach(nodes, index, f);
    motion.anchors.col(f) = pelvis(body, nodes);
    lowest.push_back(nodes.row(1).minCoeff());
    for (std::size_t t = 0; t < body.tracers.size(); ++t) {
      const int joint = body.tracers[t].joint;
      motion.tracks[t].col(f) =
          joint == body.head ? head_center(body, nodes) : Eigen::Vector3d(nodes.col(joint));
    }
  }
  motion.floor = quantile(std::move(lowest), kFloorQuantile);
  motion.anchors.row(1).setConstant(motion.floor);
}

// From the side of a travel, so that it goes to the right; a clip that stays where it is is seen
// as its poses are.
Camera camera_of_travel(const StripMotion& motion) {
  const Eigen::Matrix3Xd path = motion.anchors.colwise() - motion.anchors.rowwise().mean();
  const Eigen::Matrix3d scatter = path * path.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter);
  Eigen::Vector3d along = axes.eigenvectors().col(2);
  along.y() = 0.0;
  const Eigen::RowVectorXd places = along.transpose() * path;
  const double reach = places.maxCoeff() - places.minCoeff();
  if (reach < 0.6 * motion.body.size_m || along.norm() < 0.5) return motion.camera;
  along.normalize();
  const double net = places(places.size() - 1) - places(0);
  // A travel there and back is seen from the side that the poses are seen from.
  const bool turn = std::abs(net) > 0.2 * reach ? net < 0.0 : motion.camera.right.dot(along) < 0.0;
  if (turn) along = -along;
  // Camera::right = y cross from.
  return camera_from(along.cross(Eigen::Vector3d::UnitY()));
}

Extent extent_of(const Eigen::Matrix3Xd& flat) {
  return {flat.row(0).minCoeff(), flat.row(0).maxCoeff(), flat.row(1).minCoeff(),
          flat.row(1).maxCoeff()};
}

Extent figure_extent(const StripMotion& motion, std::size_t index, const Camera& camera,
                     const Eigen::Vector3d& origin) {
  const Body& body = motion.body;
  const Eigen::Matrix3Xd nodes = motion.poses[index].colwise() - origin;
  Extent extent = extent_of(camera.project(nodes));
  const double rim = 0.02 * body.size_m;
  extent.left -= rim;
  extent.right += rim;
  extent.bottom -= rim;
  extent.top += rim;
  if (body.head) {
    const Eigen::Vector3d head = head_center(body, motion.poses[index]) - origin;
    const double x = camera.right.dot(head);
    const double y = camera.up.dot(head);
    const double r = body.head_radius();
    extent.include({x - r, x + r, y - r, y + r});
  }
  Eigen::Matrix3Xd shadow = nodes;
  shadow.row(1).setConstant(motion.floor - origin.y());
  extent.include(extent_of(camera.project(shadow)));
  return extent;
}

}  // namespace

int StripMotion::frame_at(double time_s) const {
  const double frame = std::round(time_s * strip->clip.frame_rate_hz());
  return static_cast<int>(std::clamp(frame, 0.0, strip->clip.frame_count() - 1.0));
}

void Extent::include(const Extent& other) {
  left = std::min(left, other.left);
  right = std::max(right, other.right);
  bottom = std::min(bottom, other.bottom);
  top = std::max(top, other.top);
}

StripMotion describe_strip(const Strip& strip, std::size_t index, const std::vector<double>& times,
                           View view) {
  StripMotion motion;
  motion.strip = &strip;
  motion.body = describe_body(strip.clip);
  follow(strip, index, motion);
  const double last_s = strip.clip.duration_s() + 0.5 / strip.clip.frame_rate_hz();
  for (const double time : times) {
    if (time >= last_s) break;
    motion.frames.push_back(motion.frame_at(time));
    motion.poses.push_back(node_positions(strip.clip, motion.body, motion.frames.back()));
  }
  motion.camera = camera_for(view, mean_facing(strip.clip, motion.body));
  motion.travel_camera = camera_of_travel(motion);
  return motion;
}

Extent pose_extent(const StripMotion& motion, std::size_t index, const Camera& camera) {
  return figure_extent(motion, index, camera, motion.anchor(motion.frames[index]));
}

Extent travel_extent(const StripMotion& motion, bool with_tracks) {
  const Eigen::Vector3d origin = motion.anchor(0);
  Extent extent = figure_extent(motion, 0, motion.travel_camera, origin);
  for (std::size_t i = 1; i < motion.poses.size(); ++i) {
    extent.include(figure_extent(motion, i, motion.travel_camera, origin));
  }
  if (!with_tracks) return extent;
  for (const Eigen::Matrix3Xd& track : motion.tracks) {
    extent.include(extent_of(motion.travel_camera.project(track.colwise() - origin)));
  }
  return extent;
}

}  // namespace laban::draw
