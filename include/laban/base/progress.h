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

}  // namespace laban::base
