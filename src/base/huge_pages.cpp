#include "laban/base/huge_pages.h"

#include <cstdint>

#include <sys/mman.h>
#include <unistd.h>

namespace laban::base {
namespace {

// Below this there is too little to gain, and malloc may use the pages for something else later.
constexpr std::size_t kWorthwhile = std::size_t{8} << 20U;

}  // namespace

void prefer_huge_pages([[maybe_unused]] const void* memory, std::size_t size) noexcept {
  if (size < kWorthwhile) return;
#ifdef MADV_HUGEPAGE
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const std::uintptr_t begin = reinterpret_cast<std::uintptr_t>(memory);
  const std::uintptr_t first = (begin + page - 1) / page * page;
  const std::uintptr_t last = (begin + size) / page * page;
  static_cast<void>(::madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE));
#endif
}

}  // namespace laban::base
