#include "laban/base/error.h"

namespace laban::base {

void check_failed(const char* condition, const char* file, int line) {
  throw Error(ErrorKind::kInternal, std::string("bug in laban: ") + file + ":" +
                                        std::to_string(line) + ": " + condition + " does not hold");
}

}  // namespace laban::base
