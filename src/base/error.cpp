#include "laban/base/error.h"

namespace laban::base {

void require_none(const std::vector<std::string>& problems) {
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
}

void check_failed(const char* condition, const char* file, int line) {
  throw Error(ErrorKind::kInternal, std::string("bug in laban: ") + file + ":" +
                                        std::to_string(line) + ": " + condition + " does not hold");
}

}  // namespace laban::base
