#pragma once

#include <optional>
#include <vector>

#include "laban/align/time_warp.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/pose_matrix.h"
#include "laban/transfer/style_model.h"
#include "laban/transfer/style_search.h"

namespace laban::transfer {

/// In a blend no fragment plays faster than so many times its own speed, unless it is that much
/// longer. Limits the slope of time warps, the more the farther alpha lies outside [0, 1]: there a
/// steep warp jerks. 4 leaves the warps of [0, 1] as they were learnt from.
inline constexpr double kFastestPlay = 4.0;

/// A fragment as it goes by in a blend.
struct PlayedPart {
  int fragment = 0;
  std::vector<double> frames;  ///< of the fragment, (fractional), one a frame of the blend
};

/// A chosen blend as it is played.
struct PlayedChoice {
  motion::PoseMatrix pose;
  motion::FootContacts contacts;  ///< of the fragments, carried through the blend
  std::vector<PlayedPart> parts;  ///< in the order of BlendChoice::shares
};

/// How a motion jerks, m/s^3 (motion/calm.h).
struct Jerk {
  double usual_m_s3 = 0.0;    ///< root mean square
  double largest_m_s3 = 0.0;  ///< at its worst moment
};

/// What playing choices finds out about a model's fragments, for the calls to come: found once,
/// when a choice first needs it. For one thread at a time.
class PlayMemory {
 public:
  /// @param model  must outlive this.
  explicit PlayMemory(const StyleModel& model);

  struct Known {
    motion::FootContacts contacts;
    Jerk jerk;
  };
  /// Valid while this lives.
  const Known& of(int fragment);
  [[nodiscard]] const StyleModel& model() const noexcept { return *model_; }

 private:
  const StyleModel* model_;
  std::vector<std::optional<Known>> known_;  // one a fragment
};

/// The one way in which a choice becomes motion, for whoever plays or judges it: its fragments
/// blended by calm warps, and low-passed where the blend has more jerk than they.
/// @param fastest_play  in (1, kMaxWarpSlope].
[[nodiscard]] PlayedChoice play_choice(const StyleModel& model, const BlendChoice& choice,
                                       double fastest_play = kFastestPlay);
/// The same, with what earlier calls found out about the fragments.
[[nodiscard]] PlayedChoice play_choice(PlayMemory& memory, const BlendChoice& choice,
                                       double fastest_play = kFastestPlay);

}  // namespace laban::transfer
