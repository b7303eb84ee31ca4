#include "stream.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include <fmt/core.h>

#include "laban/base/error.h"

#include "number_checks.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

// Frames of an endless BVH: its header must give a number, and readers take more than this for an
// error.
constexpr std::int64_t kEndlessFrames = 2147483647;
constexpr int kPieceFrames = 256;

void put(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw Error(ErrorKind::kIo, "stdout: cannot be written any more");
  }
}

}  // namespace

std::optional<int> AskedLength::resolved(double frame_rate_hz) const {
  if (frames || !seconds) return frames;
  const double count = std::round(*seconds * frame_rate_hz);
  if (!(count >= 1.0 && count <= kMostFrames)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("--seconds {:g} at {:g} Hz is {:g} frames; 1 to {} are made at once: "
                            "--stream without either runs on",
                            *seconds, frame_rate_hz, count, kMostFrames));
  }
  return static_cast<int>(count);
}

void add_length_options(CLI::App* verb, AskedLength& length) {
  CLI::Option* frames = verb->add_option("--frames", length.frames, "frames to make")
                            ->check(CLI::Range(1, kMostFrames));
  verb->add_option("--seconds", length.seconds, "seconds to make")
      ->check(positive_number())
      ->excludes(frames);
}

void check_stream(const std::string& output, const WriteClipOptions& writing, bool reported,
                  const Common& common) {
  const auto usage = [](const char* what) { throw Error(ErrorKind::kUsage, what); };
  if (output != "-") {
    usage("--stream writes to stdout, -o -; a file appears whole, without --stream");
  }
  if (!writing.format.empty() && writing.format != "bvh") {
    usage("--stream writes BVH, the one format whose rows may come one by one");
  }
  if (writing.up_axis != "y") usage("--stream writes +Y up");
  if (reported || common.json) {
    usage("--stream has no end to report: --report, --picture and --json are for files");
  }
}

void stream_bvh(std::optional<int> frames, const io::BvhWriteOptions& writing, const Common& common,
                const std::function<motion::Clip(int)>& next) {
  std::int64_t left = frames ? *frames : kEndlessFrames;
  std::optional<io::BvhStream> rows;
  while (left > 0) {
    const int count = static_cast<int>(std::min<std::int64_t>(left, kPieceFrames));
    const motion::Clip piece = next(count);
    if (!rows) {
      rows.emplace(piece, writing);
      for (const std::string& rename : rows->renames()) warn(common, "stdout: " + rename);
      put(rows->head(left));
    }
    put(rows->rows(piece));
    left -= count;
  }
}

}  // namespace laban::cli
