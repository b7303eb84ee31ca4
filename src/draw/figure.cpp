#include "draw/figure.h"

#include <cmath>
#include <numbers>

#include "laban/math/constants.h"
#include "laban/motion/forward_kinematics.h"

namespace laban::draw {
namespace {

constexpr double kElevationRad = 8.0 * math::kDegree;
constexpr double kThreeQuarterRad = 40.0 * math::kDegree;
constexpr double kRim = 1.3;  // units of white around a limb

constexpr Color kLeftColor = rgb(0x0072b2);
constexpr Color kRightColor = rgb(0xd55e00);
constexpr Color kTrunkColor = rgb(0x454c54);
constexpr Color kGhostColor = rgb(0xd3d8de);
constexpr Color kShadowColor = rgb(0xeaedf0);

struct FlatFigure {
  const Body& body;
  const Eigen::Matrix3Xd& flat;  // projected nodes
  const Placing& placing;
};

Point node_point(const FlatFigure& figure, int node) {
  return figure.placing(figure.flat(0, node), figure.flat(1, node));
}

// Bones thinner than this could not be seen in a small picture.
double visible(double radius) {
  return std::max(radius, 0.55);
}

void draw_bones(Canvas& canvas, const FlatFigure& figure, const Limb& limb, const Color& color,
                double rim) {
  const double scale = figure.placing.scale;
  for (const Bone& bone : limb.bones) {
    canvas.capsule(node_point(figure, bone.from), visible(scale * bone.radius_from) + rim,
                   node_point(figure, bone.to), visible(scale * bone.radius_to) + rim, color);
  }
}

double mean_depth(const FlatFigure& figure, const Limb& limb) {
  double sum = 0.0;
  for (const Bone& bone : limb.bones) sum += figure.flat(2, bone.from) + figure.flat(2, bone.to);
  return limb.bones.empty() ? 0.0 : sum / (2.0 * static_cast<double>(limb.bones.size()));
}

std::vector<std::size_t> limbs_back_to_front(const FlatFigure& figure) {
  std::vector<double> depths;
  std::vector<std::size_t> order;
  for (const Limb& limb : figure.body.limbs) {
    order.push_back(order.size());
    depths.push_back(mean_depth(figure, limb));
  }
  std::stable_sort(order.begin(), order.end(),
                   [&depths](std::size_t a, std::size_t b) { return depths[a] < depths[b]; });
  return order;
}

void draw_shadow(Canvas& canvas, const Body& body, const Eigen::Matrix3Xd& nodes, double floor,
                 const Camera& camera, const Eigen::Vector3d& origin, const Placing& placing) {
  Eigen::Matrix3Xd fallen = nodes.colwise() - origin;
  fallen.row(1).setConstant(floor - origin.y());
  const Eigen::Matrix3Xd flat = camera.project(fallen);
  const FlatFigure figure{body, flat, placing};
  for (const Limb& limb : body.limbs) draw_bones(canvas, figure, limb, kShadowColor, 0.0);
}

// The head's circle is drawn with the trunk, so that an arm before the face stays before it.
void draw_head(Canvas& canvas, const Body& body, const Point& center, double scale,
               const Color& color, double rim) {
  canvas.circle(center, scale * body.head_radius() + rim, color);
}

// Facing at one frame, zero if the hips give none.
Eigen::Vector3d facing_at(const motion::Clip& clip, int frame, int left_hip, int right_hip) {
  const auto pose = motion::forward_kinematics(clip, frame);
  const Eigen::Vector3d to_left = pose.positions.col(left_hip) - pose.positions.col(right_hip);
  Eigen::Vector3d facing = to_left.cross(Eigen::Vector3d::UnitY());
  facing.y() = 0.0;
  return facing.norm() > 1e-6 ? facing.normalized() : Eigen::Vector3d::Zero();
}

}  // namespace

Eigen::Matrix3Xd Camera::project(const Eigen::Ref<const Eigen::Matrix3Xd>& points) const {
  Eigen::Matrix3d axes;
  axes << right.transpose(), up.transpose(), toward.transpose();
  return axes * points;
}

Camera camera_from(const Eigen::Vector3d& from) {
  Camera camera;
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  camera.right = y.cross(from).normalized();
  camera.toward = std::cos(kElevationRad) * from + std::sin(kElevationRad) * y;
  camera.up = camera.toward.cross(camera.right);
  return camera;
}

Eigen::Vector3d mean_facing(const motion::Clip& clip, const Body& body) {
  const Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
  if (!body.left_hip || !body.right_hip) return ahead;
  constexpr int kMaxSamples = 200;
  const int stride = std::max(1, clip.frame_count() / kMaxSamples);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  int count = 0;
  for (int f = 0; f < clip.frame_count(); f += stride) {
    const Eigen::Vector3d facing = facing_at(clip, f, *body.left_hip, *body.right_hip);
    if (first.isZero()) first = facing;
    sum += facing;
    ++count;
  }
  // Below a third the directions spread over most of the circle: their mean says little.
  if (sum.norm() > count / 3.0) return sum.normalized();
  return first.isZero() ? ahead : first;
}

Camera camera_for(View view, const Eigen::Vector3d& facing) {
  const Eigen::Vector3d to_right = facing.cross(Eigen::Vector3d::UnitY());
  double angle = kThreeQuarterRad;
  if (view == View::kFront) angle = 0.0;
  if (view == View::kSide) angle = std::numbers::pi / 2.0;
  return camera_from(std::cos(angle) * facing + std::sin(angle) * to_right);
}

Color side_color(Side side) {
  if (side == Side::kLeft) return kLeftColor;
  return side == Side::kRight ? kRightColor : kTrunkColor;
}

void draw_figure(Canvas& canvas, const Body& body, const Eigen::Matrix3Xd& nodes,
                 const Eigen::Vector3d& origin, const Camera& camera, const Placing& placing,
                 Ink ink) {
  canvas.begin_group(ink == Ink::kColored ? "figure" : "ghost");
  if (ink == Ink::kColored) {
    draw_shadow(canvas, body, nodes, origin.y(), camera, origin, placing);
  }
  const Eigen::Matrix3Xd flat = camera.project(nodes.colwise() - origin);
  const FlatFigure figure{body, flat, placing};
  if (body.limbs.size() == 1 && body.limbs[0].bones.empty()) {
    canvas.circle(node_point(figure, 0), 2.5, ink == Ink::kColored ? kTrunkColor : kGhostColor);
  }
  for (const std::size_t l : limbs_back_to_front(figure)) {
    const Limb& limb = body.limbs[l];
    const Color color = ink == Ink::kColored ? side_color(limb.side) : kGhostColor;
    draw_bones(canvas, figure, limb, kWhite, kRim);
    const bool with_head = l == 0 && body.head.has_value();
    Point head = Point::Zero();
    if (with_head) {
      const Eigen::Vector3d center = head_center(body, nodes) - origin;
      head = placing(camera.right.dot(center), camera.up.dot(center));
      draw_head(canvas, body, head, placing.scale, kWhite, kRim);
    }
    draw_bones(canvas, figure, limb, color, 0.0);
    if (with_head) draw_head(canvas, body, head, placing.scale, color, 0.0);
  }
  canvas.end_group();
}

Eigen::Vector3d head_center(const Body& body, const Eigen::Matrix3Xd& nodes) {
  const Eigen::Vector3d at = nodes.col(*body.head);
  const Eigen::Vector3d along = nodes.col(body.head_tip) - nodes.col(body.head_base);
  const double length = along.norm();
  if (length < 1e-9) return at;
  return at + along * (0.9 * body.head_radius() / length);
}

}  // namespace laban::draw
