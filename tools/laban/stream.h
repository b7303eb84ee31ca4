#pragma once

#include <functional>
#include <optional>
#include <string>

#include "laban/io/bvh.h"
#include "laban/motion/clip.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {

/// Frames that are made at once at most; what is longer is streamed.
inline constexpr int kMostFrames = 10'000'000;

/// How long a motion without end is asked to be: at most one of the two.
struct AskedLength {
  std::optional<int> frames;
  std::optional<double> seconds;

  [[nodiscard]] explicit operator bool() const noexcept { return frames || seconds; }
  /// nullopt if neither is given. @throws Error{kUsage} unless 1 .. kMostFrames frames.
  [[nodiscard]] std::optional<int> resolved(double frame_rate_hz) const;
};

/// Adds --frames and --seconds.
void add_length_options(CLI::App* verb, AskedLength& length);

/// @throws Error{kUsage} if --stream does not go with where and what is to be written.
void check_stream(const std::string& output, const WriteClipOptions& writing, bool reported,
                  const Common& common);

/// Writes BVH to stdout row by row, as it is made: memory does not grow.
/// @param frames  nullopt: for ever.
/// @param next    makes so many frames more.
void stream_bvh(std::optional<int> frames, const io::BvhWriteOptions& writing, const Common& common,
                const std::function<motion::Clip(int)>& next);

}  // namespace laban::cli
