#pragma once

#include <array>
#include <initializer_list>

#include "control.h"
#include "timing.h"

namespace laban::phrase {

/// A control and where it should be.
struct ControlValue {
  Control control = Control::kCount;
  double value = 0.0;
};

/// What an action asks of the body: a track of keys for each control that takes part. Values are
/// departures from the performer's own posture, so 0 everywhere is that posture at rest.
class Score {
 public:
  /// Asks for these values at `time_s`; other controls are not concerned.
  void at(double time_s, std::initializer_list<ControlValue> values) {
    for (const ControlValue& v : values) tracks_[index_of(v.control)].add({time_s, v.value});
  }
  /// Asks for these controls to be, or to stay, in the performer's own posture at `time_s`.
  void home(double time_s, std::initializer_list<Control> controls) {
    for (const Control c : controls) tracks_[index_of(c)].add({time_s, 0.0});
  }
  /// Asks all controls used so far to be home at `time_s`.
  void all_home(double time_s) {
    for (Track& track : tracks_) {
      if (!track.empty()) track.add({time_s, 0.0});
    }
  }
  [[nodiscard]] const Track& track(Control control) const { return tracks_[index_of(control)]; }

  double duration_s = 0.0;     ///< on the score's clock, which starts at 0
  double least_fluency = 0.0;  ///< whatever the manner

 private:
  std::array<Track, kControlCount> tracks_;
};

}  // namespace laban::phrase
