#include "reader_check.h"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include <sanitizer/allocator_interface.h>
#include <sanitizer/common_interface_defs.h>

#include "laban/base/error.h"
#include "laban/base/sha256.h"

namespace laban::fuzz {
namespace {

// Bytes the reader holds and may hold. Of this thread only: libFuzzer has others.
struct Ledger {
  bool open = false;
  std::int64_t held = 0;
  std::int64_t limit = 0;
};
thread_local Ledger ledger;

[[noreturn]] void report(const char* what, const char* detail) {
  ledger.open = false;
  std::fprintf(stderr, "reader check: %s: %s\n", what, detail);
  __sanitizer_print_stack_trace();
  std::abort();
}

void note_allocation(const volatile void*, std::size_t size) {
  if (!ledger.open) return;
  ledger.held += static_cast<std::int64_t>(size);
  if (ledger.held <= ledger.limit) return;
  const std::int64_t held = ledger.held;
  const std::int64_t limit = ledger.limit;
  ledger.open = false;
  char detail[100];
  std::snprintf(detail, sizeof detail, "%lld bytes held, at most %lld are allowed",
                static_cast<long long>(held), static_cast<long long>(limit));
  report("too much memory", detail);
}

void note_release(const volatile void* memory) {
  if (!ledger.open || memory == nullptr) return;
  ledger.held -=
      static_cast<std::int64_t>(__sanitizer_get_allocated_size(const_cast<const void*>(memory)));
}

// Hooks rather than operator new: Eigen calls malloc.
const bool hooked = __sanitizer_install_malloc_and_free_hooks(&note_allocation, &note_release) != 0;

}  // namespace

int check_reader(const std::uint8_t* data, std::size_t size,
                 const std::function<void(std::string_view bytes)>& read) {
  if (!hooked) report("memory", "the allocator takes no hooks");
  ledger = {true, 0, static_cast<std::int64_t>(kBytesPerByte * size + kFreeBytes)};
  try {
    read({reinterpret_cast<const char*>(data), size});
  } catch (const base::Error& error) {
    ledger.open = false;
    if (*error.what() == '\0') report("an error", "without a message");
    if (error.kind() == base::ErrorKind::kInternal) report("internal error", error.what());
  } catch (const std::exception& error) {
    report("an exception other than base::Error", error.what());
  } catch (...) {
    report("an exception other than base::Error", "of unknown type");
  }
  ledger.open = false;
  return 0;
}

int check_container_reader(const std::uint8_t* data, std::size_t size,
                           const std::function<void(std::string_view bytes)>& read) {
  constexpr std::size_t kDigestSize = 64;  // hexadecimal SHA-256 at the end of a container
  if (size < kDigestSize) return 0;
  std::string bytes(reinterpret_cast<const char*>(data), size - kDigestSize);
  bytes += base::sha256_hex(bytes);
  return check_reader(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), read);
}

}  // namespace laban::fuzz
