#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace laban::io {

/// Throws Error{kFormat} "name: pointer: message"; an empty pointer is left out.
[[noreturn]] void fail_gltf(std::string_view name, const std::string& pointer,
                            const std::string& message);

/// A glTF file of either form as one JSON text and one buffer.
///
/// The JSON is the file's own but for this: there is one buffer without uri, whose bytes are
/// `binary`; buffer views point into it; images are buffer views too, where they could be read.
/// Indices of everything else are as in the file.
struct GltfDocument {
  nlohmann::json json;
  std::string binary;
  std::size_t file_bytes = 0;  ///< of the file and its companions, what bounds are measured by
};

/// Takes a .gltf or .glb apart: container, JSON (bounded in depth and in what it would take in
/// memory), buffers in data URIs, in the BIN chunk and in files of `folder`.
///
/// A companion file is found below `folder` only: an absolute path, a scheme, `..`, a symbolic link
/// that leads out, a directory are all refused. An image that cannot be read stays as it is named,
/// with a warning.
///
/// @throws Error{kFormat} "name: JSON pointer: what; mend"; Error{kIo} if a companion file cannot
/// be
///         read.
[[nodiscard]] GltfDocument read_gltf_document(std::string_view bytes, std::string_view name,
                                              const std::optional<std::filesystem::path>& folder,
                                              std::vector<std::string>& warnings);

/// The value of a whole number >= 0 at `key` of an object; `otherwise` if there is none.
/// @throws Error{kFormat} if it is anything else, or above 2^53.
[[nodiscard]] std::size_t whole_number(std::string_view name, const nlohmann::json& object,
                                       const char* key, const std::string& at,
                                       std::optional<std::size_t> otherwise = std::nullopt);

/// The array at `key` of an object, or an empty one. @throws Error{kFormat} if it is no array, or
/// an element is not an object where `of_objects` says so.
[[nodiscard]] const nlohmann::json& array_at(std::string_view name, const nlohmann::json& object,
                                             const char* key, const std::string& at,
                                             bool of_objects);

/// Text of a file as a message cites it: in quotes, cut, without control characters.
[[nodiscard]] std::string cited(std::string_view text);

/// `"there is 1 buffer"`, `"there are 5 buffers"`.
[[nodiscard]] std::string there_are(std::size_t count, const std::string& what);

/// Two chunks and their header, as a GLB file; chunks are padded to 4 bytes, JSON with spaces, BIN
/// with zeros. @throws Error{kData} above 4 GB.
[[nodiscard]] std::string pack_glb(const nlohmann::json& json, std::string_view binary);

}  // namespace laban::io
