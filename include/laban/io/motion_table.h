#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/motion/clip.h"
#include "laban/motion/pose_matrix.h"

namespace laban::io {

/// Numbers over time for R, numpy and spreadsheets: a row a frame, a named column a quantity.
struct MotionTable {
  /// What the numbers are, e.g. "joint positions".
  std::string title;
  double frame_rate_hz = 0.0;
  /// C names, each ending in its unit: "LeftHand_x_m", "hips_tilt_x_rad".
  std::vector<std::string> columns;
  Eigen::MatrixXd values;  ///< C x F, a column of the matrix is a frame
};

/// Model-space joint positions: three columns a joint, metres, +Y up. A joint whose name was seen
/// before has its number behind it ("Hand_12").
[[nodiscard]] MotionTable joint_position_table(const motion::Clip& clip);

/// A pose matrix as it is (METHODS 0): 63 exponential maps, height, and the heading-frame steps.
[[nodiscard]] MotionTable pose_table(const motion::PoseMatrix& pose);

/// As CSV: a comment line "# laban: TITLE, frame_rate_hz=RATE", a line of names that begins with
/// time_s, a line a frame; numbers read back as exactly those they were.
[[nodiscard]] std::string format_csv(const MotionTable& table);

/// As NPY 2.0: an array of F records, float64, little-endian, with the columns as named fields
/// after time_s; the title of the field time_s is "frame_rate_hz=RATE":
///
///     data = numpy.load("clip.npy"); data["LeftHand_x_m"]
///     numpy.lib.recfunctions.structured_to_unstructured(data)  # F x (1 + C)
[[nodiscard]] std::string format_npy(const MotionTable& table);

}  // namespace laban::io
