#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"

namespace laban::draw {

/// One clip of a preview.
struct AnimatedClip {
  motion::Clip clip;
  std::string title;  ///< UTF-8; what is not, is shown as "?"
  std::string note;   ///< below the title, grey; may be empty
  /// Of the clip's skeleton; with it, feet are marked where they touch the ground.
  std::optional<motion::Humanoid> humanoid;
  std::vector<double> marks_s;  ///< times to mark below the views, e.g. the joins of an output
};

struct AnimationOptions {
  std::string title;  ///< of the page; empty: the clips' titles
  /// For each frame of the last clip the (fractional) frame of the first that shows the same
  /// moment; empty: the clips are shown at the same seconds, each at its own rate.
  std::vector<double> source_frames;
  /// Clips of higher rates are resampled to this one: no screen shows more, and the page stays
  /// small.
  double max_frame_rate_hz = 60.0;

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Most clips side by side in one preview.
inline constexpr int kMaxAnimatedClips = 4;

/// A page that plays clips side by side in any browser, by itself: no network, no other file. It
/// can be turned, zoomed, scrubbed and stepped through by mouse, touch and keyboard, and follows
/// the reader's light or dark scheme.
///
/// Bodies are those of contact_sheet, with volume. Positions are kept to 16 bits a coordinate (of
/// the clip's extent: 0.1 mm on a stage of 6 m): about 4.8 kB a second for ten nodes at 60 Hz.
/// @return HTML, UTF-8; the same bytes for the same input.
/// @throws Error{kUsage} if options have problems, there is no clip, or more than
///         kMaxAnimatedClips; Error{kData} if source_frames are not one a frame of the last clip
///         and finite, or a joint lies further than 1e6 m from the origin.
[[nodiscard]] std::string animation(std::span<const AnimatedClip> clips,
                                    const AnimationOptions& options = {});

}  // namespace laban::draw
