#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace laban::base {

/// What an error is about; the command line turns it into its exit code.
enum class ErrorKind {
  kUsage,     ///< a wrong option or argument
  kIo,        ///< a file that could not be read or written
  kFormat,    ///< a malformed file
  kData,      ///< data that the method cannot work on
  kNumeric,   ///< a numerical failure
  kInternal,  ///< a bug in laban
};

/// The only exception type that leaves laban. `what()` names the place, the value and the rule,
/// e.g. "walk.bvh:214:7: expected 69 channel values, found 68".
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& what) : std::runtime_error(what), kind_(kind) {}
  [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }

 private:
  ErrorKind kind_;
};

/// Throws Error{kUsage} with the first of the rules that options break, if they break any.
void require_none(const std::vector<std::string>& problems);

/// Throws Error{kInternal}: a broken promise of our own, reported as a bug.
[[noreturn]] void check_failed(const char* condition, const char* file, int line);

}  // namespace laban::base

/// Always on: what cannot be false unless laban has a bug.
#define LABAN_CHECK(condition) \
  ((condition) ? void(0) : ::laban::base::check_failed(#condition, __FILE__, __LINE__))
