#pragma once

/// @file
/// Conventions that hold everywhere after a reader has done its work.
///
/// - Metres, seconds, hertz, radians. Degrees exist only in io's text formats and at the command
/// line.
/// - Right-handed, +Y up, the character faces +Z at heading 0.
/// - Rotations are unit Eigen::Quaterniond, Hamilton, active; along time neighbours are in one
///   hemisphere.
/// - Names of transforms: model_from_child = model_from_parent * parent_from_child.
/// - A matrix of samples is D x N: a column is a frame. Ranges are half-open.
/// - Effort factors lie in [-3, 3]: -3 indulging (free, light, sustained), +3 condensing (bound,
///   strong, sudden).
