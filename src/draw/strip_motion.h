#pragma once

#include <vector>

#include "laban/draw/contact_sheet.h"

#include "draw/body.h"
#include "draw/figure.h"

namespace laban::draw {

/// What a contact sheet needs to know of one clip, in model space, metres.
struct StripMotion {
  const Strip* strip = nullptr;  ///< not owned
  Body body;
  double floor = 0.0;                    ///< height of the floor
  Eigen::Matrix3Xd anchors;              ///< 3 x F: below the pelvis, on the floor
  std::vector<Eigen::Matrix3Xd> tracks;  ///< 3 x F for each tracer of the body
  std::vector<int> frames;               ///< of the poses, one a time the clip reaches
  std::vector<Eigen::Matrix3Xd> poses;   ///< nodes of the body at `frames`
  Camera camera;                         ///< of the poses
  Camera travel_camera;                  ///< of the true space: from the side of its travel

  [[nodiscard]] Eigen::Vector3d anchor(int frame) const { return anchors.col(frame); }
  [[nodiscard]] int frame_at(double time_s) const;
};

/// @param index  of the strip, for messages.
/// @throws Error{kData} if a joint lies further than 1e6 m from the origin.
[[nodiscard]] StripMotion describe_strip(const Strip& strip, std::size_t index,
                                         const std::vector<double>& times, View view);

/// A box on the picture plane, metres; y up.
struct Extent {
  double left = 0.0;
  double right = 0.0;
  double bottom = 0.0;
  double top = 0.0;

  [[nodiscard]] double width() const { return right - left; }
  [[nodiscard]] double height() const { return top - bottom; }
  /// Widens the box to hold `other`.
  void include(const Extent& other);
};

/// Extent of pose `index` around its anchor, with the thickness of its limbs.
[[nodiscard]] Extent pose_extent(const StripMotion& motion, std::size_t index,
                                 const Camera& camera);

/// Extent of poses and, if asked, tracks in true space, around the anchor of frame 0.
[[nodiscard]] Extent travel_extent(const StripMotion& motion, bool with_tracks);

}  // namespace laban::draw
