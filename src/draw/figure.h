#pragma once

#include "laban/draw/contact_sheet.h"

#include "draw/body.h"
#include "draw/canvas.h"

namespace laban::draw {

/// Orthographic camera: how model space shows on the picture plane.
struct Camera {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();   ///< of the picture, model space, unit
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();      ///< of the picture
  Eigen::Vector3d toward = Eigen::Vector3d::UnitZ();  ///< from the subject to the camera

  /// x to the right, y up, metres on the picture plane; z toward the camera.
  [[nodiscard]] Eigen::Matrix3Xd project(const Eigen::Ref<const Eigen::Matrix3Xd>& points) const;
};

/// A camera slightly above the subject that looks at it from `from`, a direction in the floor
/// plane (unit, model space).
[[nodiscard]] Camera camera_from(const Eigen::Vector3d& from);

/// Where the character faces on average: unit, in the floor plane; across the hip joints. +Z where
/// the body has none. A clip in which it turns all the way around: where it faces at first.
[[nodiscard]] Eigen::Vector3d mean_facing(const motion::Clip& clip, const Body& body);

/// The camera for `view` of a character that faces `facing`.
[[nodiscard]] Camera camera_for(View view, const Eigen::Vector3d& facing);

/// From metres on the picture plane to the canvas: x = origin.x + scale x, y = origin.y - scale y.
struct Placing {
  Point origin = Point::Zero();
  double scale = 1.0;  ///< units a metre

  [[nodiscard]] Point operator()(double x, double y) const {
    return {origin.x() + scale * x, origin.y() - scale * y};
  }
};

enum class Ink { kColored, kGhost };

[[nodiscard]] Color side_color(Side side);

/// One figure: its shadow on the floor, then limbs from the furthest to the nearest, each with a
/// white rim that tells it from what is behind.
///
/// @param nodes   3 x N model-space nodes of `body`.
/// @param origin  model-space point that comes to `placing.origin`; its y is the floor.
void draw_figure(Canvas& canvas, const Body& body, const Eigen::Matrix3Xd& nodes,
                 const Eigen::Vector3d& origin, const Camera& camera, const Placing& placing,
                 Ink ink);

/// Center of the head's circle, model space. Precondition: body.head.
[[nodiscard]] Eigen::Vector3d head_center(const Body& body, const Eigen::Matrix3Xd& nodes);

}  // namespace laban::draw
