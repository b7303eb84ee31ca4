#pragma once

#include <span>
#include <string>
#include <vector>

#include "laban/draw/format.h"
#include "laban/motion/clip.h"

namespace laban::draw {

/// One clip of a contact sheet.
struct Strip {
  motion::Clip clip;
  std::string title;            ///< above the strip, at the left; may be empty
  std::vector<double> marks_s;  ///< times to mark by a dashed line, e.g. the joins of an output
  std::string note;             ///< above the strip, at the right, grey; may be empty
};

/// Where the camera stands, relative to the way the character faces on average.
enum class View {
  kThreeQuarter,  ///< before the character, 40 degrees to its right
  kFront,         ///< before the character
  kSide,          ///< at the character's right: it faces the right edge of the page
};

/// Where the poses of a strip stand.
enum class Placement {
  kSpread,    ///< each in its own cell, the floor moving with it; true travel in the trail panel
  kPanorama,  ///< all at their true place on one floor, as in a multiple exposure
};

struct ContactSheetOptions {
  Format format = Format::kPng;
  std::string title;    ///< of the sheet; may be empty
  int pose_count = 12;  ///< poses over the longest clip, first and last frame included; 1 .. 200
  View view = View::kThreeQuarter;
  Placement placement = Placement::kSpread;
  /// Draw the trails of hands, feet and head: of the last step of time in each cell, and of the
  /// whole clip in its true space in a panel of its own.
  bool trajectories = true;
  double width = 1000.0;     ///< units (CSS pixels), 200 .. 10000; the height follows
  double pixel_ratio = 2.0;  ///< PNG pixels a unit, 0.25 .. 8

  /// Broken rules, each like "ContactSheetOptions::pose_count = 0 (must be 1 .. 200)".
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Times of the poses, seconds: pose_count equal steps over the longest clip, the same for every
/// strip. Fewer when that clip has fewer frames (one a frame at most). A clip that ends before a
/// time leaves the cell empty.
/// @throws Error{kUsage} if there is no strip or pose_count < 1.
[[nodiscard]] std::vector<double> contact_sheet_times(std::span<const Strip> strips,
                                                      int pose_count);

/// A contact sheet: a row of figures at equal times for each strip, input above output.
///
/// Any skeleton is drawn: a tapered bone from every joint to its parent and to its end site. Sides
/// are told by joint names ("Left..", "l_..", "..L", "lfemur" beside "rfemur"), else by x at rest;
/// left is blue, right is orange, the rest grey. The joint named head gets a circle. The camera
/// follows from the mean direction across the hip joints, never from the rest pose; without named
/// hips the character is taken to face +Z. All strips have one scale.
///
/// @returns bytes of a PNG or SVG file. In SVG, each figure is a group of class "figure".
/// @throws Error{kUsage} if there is no strip or `options` has problems; Error{kData} if a joint
///         lies further than 1e6 m from the origin, naming strip and frame.
/// Time O(frames * joints).
[[nodiscard]] std::string contact_sheet(std::span<const Strip> strips,
                                        const ContactSheetOptions& options = {});

}  // namespace laban::draw
