#pragma once

#include <atomic>
#include <chrono>

#include "laban/base/progress.h"

#include "json_requests.h"

namespace laban::studio {

/// How far the request that is worked on has come. One thread works; any thread may ask, and stop
/// the work where the library lets it be stopped.
class Work final : public base::Progress {
 public:
  [[nodiscard]] bool update(double fraction) override;

  /// One request, from here to the end of the scope.
  class Turn {
   public:
    explicit Turn(Work& work);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Work& work_;
  };

  /// {"busy", "seconds", "fraction"}: fraction null where the work does not tell it.
  [[nodiscard]] Json told() const;
  /// Asks the present work to stop; it then fails with "interrupted".
  void stop();

 private:
  using Clock = std::chrono::steady_clock;

  std::atomic<bool> busy_ = false;
  std::atomic<bool> stopped_ = false;
  std::atomic<double> fraction_ = -1.0;
  std::atomic<Clock::rep> begun_ = 0;
};

}  // namespace laban::studio
