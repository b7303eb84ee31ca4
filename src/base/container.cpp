#include "laban/base/container.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "laban/base/error.h"
#include "laban/base/sha256.h"

// Layout, all integers unsigned little-endian:
//   8 bytes   "laban\r\n\x1a"       a transfer that changes line ends breaks it at once
//   32 bytes  kind, zero-padded
//   u32       version
//   u32       array count
//   u64       header size, then the header
//   an array: u32 name size, name, u32 rows, u32 cols, rows * cols IEEE doubles
//   64 bytes  SHA-256 of everything before, hexadecimal

namespace laban::base {
namespace {

static_assert(std::endian::native == std::endian::little, "the container is written little-endian");

constexpr std::string_view kMagic("laban\r\n\x1a", 8);
constexpr std::size_t kKindSize = 32;
constexpr std::size_t kDigestSize = 64;

// A JSON value takes up to 20 times its text in memory. Models' headers are some kilobytes.
constexpr std::size_t kMaxHeaderSize = std::size_t{8} << 20U;

template <typename Integer>
void put(std::string& bytes, Integer value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

/// Takes fields off the front of the bytes; refuses to run past their end.
class Cursor {
 public:
  Cursor(std::string_view bytes, std::string_view name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorKind::kFormat, std::string(name_) + ": " + what);
  }
  std::string_view take(std::uint64_t size, const char* what) {
    if (size > bytes_.size())
      fail(std::string("it ends inside ") + what + "; copy or train it again");
    const std::string_view field = bytes_.substr(0, static_cast<std::size_t>(size));
    bytes_.remove_prefix(static_cast<std::size_t>(size));
    return field;
  }
  template <typename Integer>
  Integer integer(const char* what) {
    Integer value{};
    std::memcpy(&value, take(sizeof value, what).data(), sizeof value);
    return value;
  }
  [[nodiscard]] bool empty() const noexcept { return bytes_.empty(); }

 private:
  std::string_view bytes_;
  std::string_view name_;
};

Array read_array(Cursor& cursor, const std::string& array_name) {
  const auto rows = cursor.integer<std::uint32_t>("the size of an array");
  const auto cols = cursor.integer<std::uint32_t>("the size of an array");
  if (rows > INT32_MAX || cols > INT32_MAX)
    cursor.fail("array '" + array_name + "' has an impossible size");
  const std::uint64_t count = std::uint64_t{rows} * cols;
  if (count > UINT64_MAX / 16) cursor.fail("array '" + array_name + "' has an impossible size");
  const std::string_view raw = cursor.take(count * sizeof(double), "an array");
  Array array{static_cast<int>(rows), static_cast<int>(cols),
              std::vector<double>(static_cast<std::size_t>(count))};
  if (!raw.empty()) std::memcpy(array.values.data(), raw.data(), raw.size());
  for (const double value : array.values) {
    if (!std::isfinite(value))
      cursor.fail("array '" + array_name + "' holds a value that is not finite");
  }
  return array;
}

}  // namespace

const Array& Container::array(const std::string& name) const {
  const auto found = arrays.find(name);
  if (found == arrays.end())
    throw Error(ErrorKind::kFormat, kind + ": array '" + name + "' is missing");
  return found->second;
}

std::string write_container(const Container& container) {
  LABAN_CHECK(container.kind.size() < kKindSize && container.version >= 1);
  std::string bytes(kMagic);
  bytes += container.kind;
  bytes.append(kKindSize - container.kind.size(), '\0');
  put(bytes, static_cast<std::uint32_t>(container.version));
  put(bytes, static_cast<std::uint32_t>(container.arrays.size()));
  put(bytes, static_cast<std::uint64_t>(container.header_json.size()));
  bytes += container.header_json;
  for (const auto& [name, array] : container.arrays) {
    LABAN_CHECK(array.values.size() ==
                static_cast<std::size_t>(array.rows) * static_cast<std::size_t>(array.cols));
    put(bytes, static_cast<std::uint32_t>(name.size()));
    bytes += name;
    put(bytes, static_cast<std::uint32_t>(array.rows));
    put(bytes, static_cast<std::uint32_t>(array.cols));
    bytes.append(reinterpret_cast<const char*>(array.values.data()),
                 array.values.size() * sizeof(double));
  }
  return bytes + sha256_hex(bytes);
}

Container read_container(std::string_view bytes, std::string_view name, std::string_view kind,
                         int max_version) {
  Cursor cursor(bytes, name);
  if (bytes.substr(0, kMagic.size()) != kMagic)
    cursor.fail("it is not a laban model file; make one with 'laban train'");
  if (bytes.size() < kMagic.size() + kDigestSize)
    cursor.fail("it ends inside its head; copy or train it again");
  Cursor body(bytes.substr(0, bytes.size() - kDigestSize), name);
  (void)body.take(kMagic.size(), "its head");
  Container container;
  const std::string_view padded_kind = body.take(kKindSize, "its head");
  container.kind = std::string(padded_kind.substr(0, padded_kind.find('\0')));
  const auto version = body.integer<std::uint32_t>("its head");
  if (container.kind != kind)
    body.fail("it holds '" + container.kind + "', not '" + std::string(kind) + "'");
  // The version comes before the checksum: a newer file is told apart from a damaged one.
  if (version < 1 || version > static_cast<std::uint32_t>(max_version)) {
    body.fail("its format version is " + std::to_string(version) + ", this laban reads up to " +
              std::to_string(max_version) + "; update laban or train the model again");
  }
  container.version = static_cast<int>(version);
  if (sha256_hex(bytes.substr(0, bytes.size() - kDigestSize)) !=
      bytes.substr(bytes.size() - kDigestSize)) {
    body.fail("its checksum does not match: the file is damaged; copy or train it again");
  }
  const auto array_count = body.integer<std::uint32_t>("its head");
  const auto header_size = body.integer<std::uint64_t>("its head");
  const std::string_view header = body.take(header_size, "its header");
  if (header.size() > kMaxHeaderSize) body.fail("its header is larger than 8 MB");
  container.header_json = std::string(header);
  for (std::uint32_t i = 0; i < array_count; ++i) {
    const auto name_size = body.integer<std::uint32_t>("an array's name");
    const std::string array_name(body.take(name_size, "an array's name"));
    if (!container.arrays.emplace(array_name, read_array(body, array_name)).second) {
      body.fail("array '" + array_name + "' is there twice");
    }
  }
  if (!body.empty()) body.fail("it has bytes after its last array; copy or train it again");
  return container;
}

}  // namespace laban::base
