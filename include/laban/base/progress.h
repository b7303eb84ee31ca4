#pragma once

namespace laban::base {

/// Told how far long work has come; may ask it to stop. Work takes a `Progress*` that may be null.
class Progress {
 public:
  virtual ~Progress() = default;
  /// @param fraction  done so far, in [0, 1].
  /// @returns false to ask the work to stop; it then throws Error{kUsage} saying "interrupted".
  [[nodiscard]] virtual bool update(double fraction) = 0;
};

/// Tells a listener, if there is one.
/// @throws Error{kUsage} "interrupted" if it asks the work to stop.
void tell(Progress* progress, double fraction);

/// The stretch from `begin` to `end` of longer work, for what does that part of it.
class ProgressPart final : public Progress {
 public:
  /// @param whole  may be null.
  ProgressPart(Progress* whole, double begin, double end)
      : whole_(whole), begin_(begin), end_(end) {}

  [[nodiscard]] bool update(double fraction) override;

 private:
  Progress* whole_;
  double begin_;
  double end_;
};

}  // namespace laban::base
