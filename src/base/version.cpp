#include "laban/base/version.h"

namespace laban::base {

std::string_view version() noexcept {
  return LABAN_VERSION;
}

}  // namespace laban::base
