#pragma once

#include <list>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "laban/align/time_warp.h"
#include "laban/blend/space_time_interpolation.h"
#include "laban/motion/calm.h"
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
  motion::FootContacts contacts;    ///< of the fragments, carried through the blend
  std::vector<PlayedPart> parts;    ///< in the order of BlendChoice::shares
  Eigen::MatrixXd joint_positions;  ///< motion::standard_joint_positions of `pose`
};

/// What choosing and playing blends finds out about a model's fragments, for the calls to come:
/// found once, when it is first needed. For one thread at a time.
class PlayMemory {
 public:
  /// @param model  must outlive this.
  explicit PlayMemory(const StyleModel& model);

  struct Known {
    motion::FootContacts contacts;
    motion::Jerk jerk;
  };
  /// Valid while this lives.
  const Known& of(int fragment);
  /// path_between two fragments.
  const std::vector<align::FramePair>& path(int fragment_i, int fragment_j);
  /// Two fragments side by side for blends at `alpha` in which none plays faster than
  /// `fastest_play` allows. Valid until kKeptPairs others were asked for.
  const blend::BlendPair& pair(int fragment_i, int fragment_j, double alpha, double fastest_play);
  /// The search around a fragment. Valid until one is asked for with other options.
  const BlendSearch& search(int fragment, const SearchOptions& options);
  [[nodiscard]] const StyleModel& model() const noexcept { return *model_; }

 private:
  /// Of 160 kB each: those that the tries for a target and its neighbours come back to.
  static constexpr std::size_t kKeptPairs = 32;
  struct KeptPair {
    int i = 0;
    int j = 0;
    double max_slope = 0.0;
    blend::BlendPair pair;
  };

  const StyleModel* model_;
  std::vector<std::optional<Known>> known_;  // one a fragment
  std::map<std::pair<int, int>, std::vector<align::FramePair>> paths_;
  std::list<KeptPair> pairs_;            // the one asked for last first
  std::map<int, BlendSearch> searches_;  // by fragment, all with the same options
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
