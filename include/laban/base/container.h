#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace laban::base {

/// A matrix of doubles in a model file, column-major, rows * cols values.
struct Array {
  int rows = 0;
  int cols = 0;
  std::vector<double> values;
};

/// What every laban model file holds (DESIGN 3): a kind, a format version, a JSON header and named
/// arrays.
struct Container {
  std::string kind;         ///< "laban.style", "laban.texture", ..: at most 31 bytes
  int version = 1;          ///< of the format of that kind, >= 1
  std::string header_json;  ///< UTF-8 JSON object: schema, training record, names
  std::map<std::string, Array> arrays;

  /// The array of that name. @throws Error{kFormat} naming it if absent.
  [[nodiscard]] const Array& array(const std::string& name) const;
};

/// The bytes of a container: magic, version, sizes, header, arrays (little-endian), SHA-256 of all
/// before it. The same container gives the same bytes.
[[nodiscard]] std::string write_container(const Container& container);

/// Reads a container back, checking sizes, checksum and that every value is finite.
///
/// @param name          of the file, for messages.
/// @param kind          expected kind.
/// @param max_version   newest version the caller reads; older ones are the caller's to upgrade.
/// @throws Error{kFormat} "name: ..." saying what is wrong and the mend.
[[nodiscard]] Container read_container(std::string_view bytes, std::string_view name,
                                       std::string_view kind, int max_version);

}  // namespace laban::base
