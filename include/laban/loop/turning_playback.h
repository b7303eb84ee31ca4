#pragma once

#include <optional>
#include <vector>

#include "laban/base/rng.h"
#include "laban/loop/turning_points.h"

namespace laban::loop {

/// Where playback may turn round.
struct PlaybackTurn {
  int frame = 0;
  double most_probability = 0.0;  ///< P_max of [Graphcut, eq. 5], at most 1/2
  /// Frames over which playback slows down before it, and picks up speed after it, >= 1.
  int ease = 1;
};

/// Where playback may leap: forwards playback plays up to out_begin, then a seam, then goes on at
/// in_end.
struct PlaybackLeap {
  int out_begin = 0;
  int in_end = 0;
};

struct PlaybackPlan {
  int frame_count = 0;
  std::vector<PlaybackTurn> turns;  ///< by frame, without the ends
  PlaybackTurn first;               ///< the turn that is forced there, at frame 0 or after it
  PlaybackTurn last;                ///< and at the last frame
  /// False: forwards playback leaps rather than turn at the last frame, if it still can; but once,
  /// if more than a tenth of the clip lies beyond the last leap.
  bool last_turns = true;
  /// False: not even for frames that would never be shown.
  bool turns_at_all = true;
  std::vector<PlaybackLeap> leaps;
  /// By how much a probability falls when it is taken and rises when it is not, >= 0.
  double probability_step = 0.25;
};

/// Frames from one decision to the next, played at the clip's own speed but for the easing.
struct PlaybackLeg {
  int from = 0;
  int to = 0;               ///< before `from` when played backwards
  int ease_from = 0;        ///< > 0: the leg comes out of a turn
  int ease_to = 0;          ///< > 0: it ends in a turn
  std::optional<int> leap;  ///< it ends before that leap
};

/// Decides where endless playback of one clip turns and leaps [Graphcut, section 3.5].
///
/// At a point playback reverses with probability P = k P_max, k held per point from 1: it falls by
/// a fixed step when the point turns and rises when it does not, within [0, 2]. A turn is forced at
/// the clip's ends. Leaps are taken in the same way, with P_max = 1/2. Ours: P is also multiplied
/// by
/// ((1 + shown) / (1 + shown'))^3, shown and shown' how often the frames that would come otherwise
/// and those that would follow have been shown, so that all of the clip is used; and a point is
/// passed by where easing does not fit, or where one of those frames has had 1.5 times its share.
class TurningPlayback {
 public:
  /// Begins at frame 0, forwards.
  TurningPlayback(PlaybackPlan plan, base::Rng rng);

  [[nodiscard]] PlaybackLeg next();

  /// How often each frame has been shown by the legs so far.
  [[nodiscard]] const std::vector<double>& shown() const noexcept { return shown_; }

 private:
  struct Chance {
    double most = 0.5;
    double k = 1.0;
  };

  /// Frames of playback: where it begins and which way it goes.
  struct Way {
    int frame = 0;
    int direction = 1;
  };

  bool takes(Chance& chance, const Way& taken, const Way& passed);
  [[nodiscard]] double shown_along(const Way& way) const;
  [[nodiscard]] double most_shown_along(const Way& way) const;
  [[nodiscard]] double mean_shown() const;
  [[nodiscard]] bool leaves_much_unshown(int frame) const;
  PlaybackLeg end_leg(const PlaybackTurn& turn);
  PlaybackLeg end_leg_by_leap(int leap);
  PlaybackLeg forwards();
  PlaybackLeg backwards();
  void show(const PlaybackLeg& leg);

  PlaybackPlan plan_;
  base::Rng rng_;
  std::vector<Chance> turn_chances_;
  std::vector<Chance> leap_chances_;
  std::vector<double> shown_;
  int at_ = 0;
  int direction_ = 1;
  int ease_ = 0;
};

}  // namespace laban::loop
