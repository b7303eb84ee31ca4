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
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const std::size_t before = (page - reinterpret_cast<std::uintptr_t>(memory) % page) % page;
  const std::size_t whole = (size - before) / page * page;
  static_cast<void>(
      ::madvise(static_cast<char*>(const_cast<void*>(memory)) + before, whole, MADV_HUGEPAGE));
#endif
}

}  // namespace laban::base
