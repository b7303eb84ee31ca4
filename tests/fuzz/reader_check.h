#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>

namespace laban::fuzz {

/// Calls a reader on a file of these bytes and aborts, so that libFuzzer keeps the file, if any
/// exception but base::Error leaves it, if that says nothing or blames laban (kInternal), or if the
/// reader at any time holds more memory than kBytesPerByte times the file plus kFreeBytes: that
/// stops it at the very allocation. Crashes, leaks and undefined behaviour are the sanitizers' to
/// find, hangs libFuzzer's (-timeout).
///
/// @return 0, as LLVMFuzzerTestOneInput has to.
int check_reader(const std::uint8_t* data, std::size_t size,
                 const std::function<void(std::string_view bytes)>& read);

/// The same of files in base/container.h's form, whose last bytes are their checksum. No mutation
/// keeps a checksum right, so it is put right before: a damaged file is refused by it, but one made
/// to harm has it.
int check_container_reader(const std::uint8_t* data, std::size_t size,
                           const std::function<void(std::string_view bytes)>& read);

inline constexpr std::size_t kBytesPerByte = 16;
inline constexpr std::size_t kFreeBytes = std::size_t{64} << 20U;

}  // namespace laban::fuzz
