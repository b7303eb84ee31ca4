#include "io/gltf_document.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;
using nlohmann::json;
namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "GLB buffers are little-endian");

// Numbers of the glTF 2.0 specification.
constexpr std::uint32_t kGlbMagic = 0x46546C67;   // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004E4942;   // "BIN\0"

// glTF's own objects nest 8 deep; what extensions and extras hold is seldom deeper than 20.
constexpr int kMaxDepth = 64;
// Companion files are read whole.
constexpr std::uintmax_t kMaxCompanionBytes = std::uintmax_t{1} << 31U;

// What JSON takes in memory, in units of about 24 bytes: a number in a list one, a member's name
// three, a list or an object four. An accessor as writers write it has 3 bytes of text a unit, a
// hostile file two thirds of one; the free units let small files be as dense as they like.
constexpr std::size_t kKeyUnits = 3;
constexpr std::size_t kContainerUnits = 4;
constexpr std::size_t kFreeUnits = std::size_t{1} << 18U;
constexpr std::size_t kBytesPerUnit = 3;

/// The beginning of a text, control characters as spaces.
std::string one_line(std::string_view text, std::size_t most) {
  std::string line(text.substr(0, most));
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  }
  return line;
}

/// "line:column" of a byte, both from 1.
std::string line_and_column(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(byte, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t line_begin = before.rfind('\n') + 1;  // npos + 1 is 0
  return std::to_string(line) + ":" + std::to_string(before.size() - line_begin + 1);
}

/// Walks through JSON without keeping it, and stops at what should not be kept.
class JsonBounds : public nlohmann::json_sax<json> {
 public:
  JsonBounds(std::string_view name, std::string_view text) : name_(name), text_(text) {}

  bool null() override { return count(1); }
  bool boolean(bool /*value*/) override { return count(1); }
  bool number_integer(json::number_integer_t /*value*/) override { return count(1); }
  bool number_unsigned(json::number_unsigned_t /*value*/) override { return count(1); }
  bool number_float(json::number_float_t /*value*/, const std::string& /*text*/) override {
    return count(1);
  }
  bool string(std::string& /*value*/) override { return count(kKeyUnits); }
  bool binary(json::binary_t& /*value*/) override { return count(1); }
  bool key(std::string& /*name*/) override { return count(kKeyUnits); }
  bool start_object(std::size_t /*size*/) override { return open(); }
  bool start_array(std::size_t /*size*/) override { return open(); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool parse_error(std::size_t byte, const std::string& /*token*/,
                   const nlohmann::detail::exception& error) override {
    // nlohmann's text is "[json.exception..] parse error at line 1, column 2: what it is".
    std::string_view what = error.what();
    const std::size_t colon = what.find(": ");
    if (colon != what.npos) what.remove_prefix(colon + 2);
    const std::size_t bracket = what.find("] ");
    if (what.starts_with('[') && bracket != what.npos) what.remove_prefix(bracket + 2);
    throw Error(ErrorKind::kFormat, std::string(name_) + ":" +
                                        line_and_column(text_, byte > 0 ? byte - 1 : 0) +
                                        ": the JSON is malformed: " + one_line(what, 120));
  }

 private:
  bool count(std::size_t units) {
    units_ += units;
    if (units_ > kFreeUnits + text_.size() / kBytesPerUnit) {
      fail_gltf(name_, "",
                "the JSON holds more values than is read from a file of this size; put "
                "what is not glTF's own into a file beside it");
    }
    return true;
  }
  bool open() {
    if (++depth_ > kMaxDepth) {
      fail_gltf(name_, "",
                "the JSON is nested more than " + std::to_string(kMaxDepth) +
                    " deep, the most that is read");
    }
    return count(kContainerUnits);
  }
  bool close() {
    --depth_;
    return true;
  }

  std::string_view name_;
  std::string_view text_;
  std::size_t units_ = 0;
  int depth_ = 0;
};

json parse_json(std::string_view text, std::string_view name) {
  JsonBounds bounds(name, text);
  json::sax_parse(text.begin(), text.end(), &bounds);
  return json::parse(text.begin(), text.end());
}

std::uint32_t word_at(std::string_view bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, sizeof word);
  return word;
}

/// The two parts of a file; `binary` is empty for a .gltf.
struct Container {
  std::string_view text;
  std::optional<std::string_view> binary;
};

Container open_glb(std::string_view bytes, std::string_view name) {
  if (bytes.size() < 20) fail_gltf(name, "", "the file ends within the header of a GLB");
  if (word_at(bytes, 4) != 2) {
    fail_gltf(name, "",
              "GLB version " + std::to_string(word_at(bytes, 4)) +
                  " is not read (2 is); save it as glTF 2.0");
  }
  const std::size_t size = word_at(bytes, 8);
  if (size > bytes.size()) {
    fail_gltf(name, "",
              "the header says " + std::to_string(size) + " bytes, the file has " +
                  std::to_string(bytes.size()) + "; it is cut short");
  }
  Container container;
  std::size_t at = 12;
  for (int chunk = 0; chunk < 2 && at + 8 <= size; ++chunk) {
    const std::size_t length = word_at(bytes, at);
    const std::uint32_t kind = word_at(bytes, at + 4);
    if (length > size - at - 8) {
      fail_gltf(name, "",
                "chunk " + std::to_string(chunk) + " says " + std::to_string(length) +
                    " bytes, there are " + std::to_string(size - at - 8));
    }
    const std::string_view content = bytes.substr(at + 8, length);
    if (chunk == 0 && kind != kJsonChunk) fail_gltf(name, "", "the first chunk is not JSON");
    if (chunk == 0) container.text = content;
    if (chunk == 1 && kind == kBinChunk) container.binary = content;
    at += 8 + length;
  }
  return container;
}

Container open_container(std::string_view bytes, std::string_view name) {
  if (bytes.starts_with("glTF")) return open_glb(bytes, name);
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  return {bytes, std::nullopt};
}

void require_version(const json& asset, std::string_view name) {
  const auto place = asset.find("asset");
  const bool told = place != asset.end() && place->is_object() && place->contains("version") &&
                    (*place)["version"].is_string();
  if (!told) {
    fail_gltf(name, "/asset/version", "there is none; a glTF file says \"2.0\" there");
  }
  const std::string& version = (*place)["version"].get_ref<const std::string&>();
  if (!version.starts_with("2.")) {
    fail_gltf(name, "/asset/version",
              cited(version) + " is not read (2.0 is); save it as glTF 2.0");
  }
}

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+' || c == '-') return 62;
  if (c == '/' || c == '_') return 63;
  return -1;
}

/// Bytes of base64 text, padded or not; nothing if it is none.
std::optional<std::string> decode_base64(std::string_view text) {
  while (text.ends_with('=')) text.remove_suffix(1);
  if (text.size() % 4 == 1) return std::nullopt;
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    const int digit = base64_digit(c);
    if (digit < 0) return std::nullopt;
    bits = bits << 6U | static_cast<std::uint32_t>(digit);
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes.push_back(static_cast<char>(bits >> static_cast<unsigned>(held) & 0xFFU));
  }
  return bytes;
}

/// What a data URI holds.
struct DataUri {
  std::string media_type;
  std::string bytes;
};

bool is_data_uri(std::string_view uri) {
  return uri.starts_with("data:");
}

std::optional<DataUri> decode_data_uri(std::string_view uri) {
  const std::size_t comma = uri.find(',');
  if (comma == uri.npos) return std::nullopt;
  const std::string_view head = uri.substr(5, comma - 5);
  if (!head.ends_with(";base64")) return std::nullopt;
  std::optional<std::string> bytes = decode_base64(uri.substr(comma + 1));
  if (!bytes) return std::nullopt;
  return DataUri{std::string(head.substr(0, head.find(';'))), std::move(*bytes)};
}

/// `%20` and the like as the bytes they stand for; nothing where the two digits are missing.
std::optional<std::string> decode_percent(std::string_view uri) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  };
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] != '%') {
      text.push_back(uri[i]);
      continue;
    }
    if (i + 2 >= uri.size() || digit(uri[i + 1]) < 0 || digit(uri[i + 2]) < 0) return std::nullopt;
    text.push_back(static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2])));
    i += 2;
  }
  return text;
}

/// Why a decoded uri is not a plain path below the folder; empty if it is one.
std::string path_problem(const std::string& path) {
  if (path.empty()) return "is empty";
  if (path.find('\0') != path.npos) return "holds a zero byte";
  if (path.find('\\') != path.npos) return "holds a backslash";
  if (path.front() == '/') return "is an absolute path";
  if (path.find(':') != path.npos) return "names a scheme or a drive";
  for (const fs::path& part : fs::path(path)) {
    if (part == "..") return "leads out of the file's folder";
  }
  return {};
}

/// Reads files below one folder, and nothing else.
class Companions {
 public:
  Companions(std::string_view name, const std::optional<fs::path>& folder)
      : name_(name), folder_(folder) {}

  /// @throws Error{kFormat} if the uri is not to be followed, Error{kIo} if it cannot be read.
  [[nodiscard]] std::string read(const std::string& uri, const std::string& pointer) {
    const std::optional<std::string> decoded = decode_percent(uri);
    if (!decoded)
      fail_gltf(name_, pointer, cited(uri) + " has a '%' without two hexadecimal digits");
    const std::string problem = path_problem(*decoded);
    if (!problem.empty()) {
      fail_gltf(name_, pointer,
                cited(uri) + " " + problem + "; only files beside this one are read");
    }
    if (!folder_) {
      fail_gltf(name_, pointer,
                cited(uri) +
                    " is a file of its own, and there is no folder to find it in; name "
                    "the glTF file itself, or embed its data (.glb)");
    }
    return read_below(*folder_ / *decoded, pointer, cited(uri) + " ");
  }

 private:
  std::string read_below(const fs::path& path, const std::string& pointer,
                         const std::string& quoted) {
    std::error_code failed;
    const fs::path root = fs::canonical(folder_->empty() ? fs::path(".") : *folder_, failed);
    const fs::path file = failed ? fs::path() : fs::canonical(path, failed);
    if (failed) {
      throw Error(ErrorKind::kIo, std::string(name_) + ": " + pointer + ": " + quoted +
                                      "cannot be read: " + failed.message());
    }
    const auto [end_of_root, _] = std::mismatch(root.begin(), root.end(), file.begin(), file.end());
    if (end_of_root != root.end()) {
      fail_gltf(name_, pointer, quoted + "is a link that leads out of the file's folder");
    }
    if (!fs::is_regular_file(file)) fail_gltf(name_, pointer, quoted + "is not a regular file");
    total_ += fs::file_size(file, failed);
    if (failed || total_ > kMaxCompanionBytes) {
      fail_gltf(name_, pointer, quoted + "makes the files beside this one more than 2 GB");
    }
    return base::read_file(file);
  }

  std::string_view name_;
  const std::optional<fs::path>& folder_;
  std::uintmax_t total_ = 0;
};

/// Where the bytes of a buffer of the file lie in the one buffer.
struct Span {
  std::size_t begin = 0;
  std::size_t size = 0;
};

/// Gathers all buffers, and images, into one.
class Gatherer {
 public:
  Gatherer(GltfDocument& document, std::string_view name, const std::optional<fs::path>& folder)
      : document_(document), name_(name), companions_(name, folder) {}

  void gather_buffers(const std::optional<std::string_view>& chunk) {
    const json& buffers = array_at(name_, document_.json, "buffers", "", true);
    for (std::size_t b = 0; b < buffers.size(); ++b) {
      const std::string at = "/buffers/" + std::to_string(b);
      const std::size_t length = whole_number(name_, buffers[b], "byteLength", at);
      Span found = locate(buffers[b], b, at, chunk);
      if (found.size < length) {
        fail_gltf(name_, at + "/byteLength",
                  std::to_string(length) + ", the buffer has " + std::to_string(found.size) +
                      " bytes; the file is cut short or damaged");
      }
      found.size = length;
      buffers_.push_back(found);
    }
    move_views();
    if (buffers.empty()) return;
    json only = buffers.size() == 1 ? buffers[0] : json::object();
    only.erase("uri");
    document_.json["buffers"] = json::array({std::move(only)});
  }

  /// Images that can be read become buffer views; of others, the ones that are missing are told.
  void gather_images(std::vector<std::string>& warnings) {
    if (array_at(name_, document_.json, "images", "", true).empty()) return;
    json& images = document_.json["images"];
    for (std::size_t i = 0; i < images.size(); ++i) {
      const auto uri = images[i].find("uri");
      if (uri == images[i].end() || !uri->is_string()) continue;
      const std::string at = "/images/" + std::to_string(i) + "/uri";
      try {
        embed_image(images[i], uri->get<std::string>(), at);
      } catch (const Error& error) {
        warnings.push_back(error.what() + std::string("; the picture stays as it is named"));
      }
    }
  }

  /// The buffer's own length, when all is in it.
  void finish() {
    if (document_.binary.empty() && !document_.json.contains("buffers")) return;
    if (!document_.json.contains("buffers")) {
      document_.json["buffers"] = json::array({json::object()});
    }
    document_.json["buffers"][0]["byteLength"] = document_.binary.size();
  }

 private:
  Span append(std::string_view bytes) {
    std::string& binary = document_.binary;
    binary.resize((binary.size() + 3) / 4 * 4, '\0');  // accessors keep their alignment
    const Span span{binary.size(), bytes.size()};
    binary += bytes;
    return span;
  }

  Span locate(const json& buffer, std::size_t index, const std::string& at,
              const std::optional<std::string_view>& chunk) {
    const auto uri = buffer.find("uri");
    if (uri == buffer.end()) {
      if (index == 0 && chunk) return append(*chunk);
      fail_gltf(name_, at, "it has no uri; only the first buffer of a .glb may have none");
    }
    if (!uri->is_string()) fail_gltf(name_, at + "/uri", "it is not text");
    const std::string& text = uri->get_ref<const std::string&>();
    if (is_data_uri(text)) {
      const std::optional<DataUri> data = decode_data_uri(text);
      if (!data) fail_gltf(name_, at + "/uri", "it is not a data URI in base64");
      return append(data->bytes);
    }
    // A file that many buffers name is there once.
    const auto known = files_.find(text);
    if (known != files_.end()) return known->second;
    const Span span = append(companions_.read(text, at + "/uri"));
    files_.emplace(text, span);
    return span;
  }

  void move_views() {
    if (array_at(name_, document_.json, "bufferViews", "", true).empty()) return;
    json& views = document_.json["bufferViews"];
    for (std::size_t v = 0; v < views.size(); ++v) {
      const std::string at = "/bufferViews/" + std::to_string(v);
      move_view(views[v], at);
      // The one extension that keeps a place in a buffer of its own.
      const auto extensions = views[v].find("extensions");
      if (extensions == views[v].end() || !extensions->is_object()) continue;
      const auto packed = extensions->find("EXT_meshopt_compression");
      if (packed == extensions->end()) continue;
      const std::string inner = at + "/extensions/EXT_meshopt_compression";
      if (!packed->is_object()) fail_gltf(name_, inner, "it is not an object");
      move_view(*packed, inner);
    }
  }

  void move_view(json& view, const std::string& at) {
    const std::size_t buffer = whole_number(name_, view, "buffer", at);
    if (buffer >= buffers_.size()) {
      fail_gltf(name_, at + "/buffer",
                std::to_string(buffer) + ", " + there_are(buffers_.size(), "buffer"));
    }
    const std::size_t begin = whole_number(name_, view, "byteOffset", at, 0);
    const std::size_t length = whole_number(name_, view, "byteLength", at);
    if (begin > buffers_[buffer].size || length > buffers_[buffer].size - begin) {
      fail_gltf(name_, at,
                "bytes " + std::to_string(begin) + " to " + std::to_string(begin + length) +
                    ", the buffer has " + std::to_string(buffers_[buffer].size));
    }
    const std::size_t moved = buffers_[buffer].begin + begin;
    view["buffer"] = 0;
    if (moved != 0 || view.contains("byteOffset")) view["byteOffset"] = moved;
  }

  void embed_image(json& image, const std::string& uri, const std::string& at) {
    std::string bytes;
    if (is_data_uri(uri)) {
      std::optional<DataUri> data = decode_data_uri(uri);
      if (!data) fail_gltf(name_, at, "it is not a data URI in base64");
      bytes = std::move(data->bytes);
    } else {
      bytes = companions_.read(uri, at);
    }
    std::string mime;
    if (bytes.starts_with("\xFF\xD8\xFF")) mime = "image/jpeg";
    if (bytes.starts_with("\x89PNG")) mime = "image/png";
    if (mime.empty() && image.contains("mimeType") && image["mimeType"].is_string()) {
      mime = image["mimeType"].get<std::string>();
    }
    if (mime.empty()) fail_gltf(name_, at, "it is neither PNG nor JPEG and has no mimeType");
    const Span span = append(bytes);
    json& views = document_.json["bufferViews"];
    image.erase("uri");
    image["mimeType"] = mime;
    image["bufferView"] = views.size();
    views.push_back({{"buffer", 0}, {"byteOffset", span.begin}, {"byteLength", span.size}});
  }

  GltfDocument& document_;
  std::string_view name_;
  Companions companions_;
  std::vector<Span> buffers_;
  std::map<std::string, Span> files_;
};

void append_u32(std::string& bytes, std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  std::array<char, sizeof word> raw{};
  std::memcpy(raw.data(), &word, sizeof word);
  bytes.append(raw.data(), raw.size());
}

}  // namespace

void fail_gltf(std::string_view name, const std::string& pointer, const std::string& message) {
  throw Error(ErrorKind::kFormat, std::string(name) + ": " +
                                      (pointer.empty() ? std::string() : pointer + ": ") + message);
}

std::size_t whole_number(std::string_view name, const json& object, const char* key,
                         const std::string& at, std::optional<std::size_t> otherwise) {
  const auto found = object.find(key);
  if (found == object.end()) {
    if (otherwise) return *otherwise;
    fail_gltf(name, at, std::string("it has no ") + key);
  }
  constexpr double kMost = 9007199254740992.0;  // 2^53: sums of two stay exact
  const bool is_whole = found->is_number() && found->get<double>() >= 0.0 &&
                        found->get<double>() <= kMost &&
                        found->get<double>() == std::floor(found->get<double>());
  if (!is_whole) fail_gltf(name, at + "/" + key, "it is not a whole number of 0 or more");
  return static_cast<std::size_t>(found->get<double>());
}

const json& array_at(std::string_view name, const json& object, const char* key,
                     const std::string& at, bool of_objects) {
  static const json empty = json::array();
  const auto found = object.find(key);
  if (found == object.end()) return empty;
  const std::string pointer = at + "/" + key;
  if (!found->is_array()) fail_gltf(name, pointer, "it is not a list");
  for (std::size_t i = 0; of_objects && i < found->size(); ++i) {
    if (!(*found)[i].is_object()) {
      fail_gltf(name, pointer + "/" + std::to_string(i), "it is not an object");
    }
  }
  return *found;
}

std::string cited(std::string_view text) {
  return "'" + one_line(text, 80) + "'";
}

std::string there_are(std::size_t count, const std::string& what) {
  return "there " + std::string(count == 1 ? "is " : "are ") + std::to_string(count) + " " + what +
         (count == 1 ? "" : "s");
}

GltfDocument read_gltf_document(std::string_view bytes, std::string_view name,
                                const std::optional<fs::path>& folder,
                                std::vector<std::string>& warnings) {
  const Container container = open_container(bytes, name);
  GltfDocument document{parse_json(container.text, name), {}, bytes.size()};
  if (!document.json.is_object()) fail_gltf(name, "", "a glTF file is one JSON object");
  require_version(document.json, name);
  Gatherer gatherer(document, name, folder);
  gatherer.gather_buffers(container.binary);
  gatherer.gather_images(warnings);
  gatherer.finish();
  document.file_bytes = std::max(bytes.size(), document.binary.size());
  return document;
}

std::string pack_glb(const json& content, std::string_view binary) {
  // glTF keeps text as UTF-8; a name in another encoding gets U+FFFD for what it cannot be.
  std::string text = content.dump(-1, ' ', false, json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t padding = (4 - binary.size() % 4) % 4;
  const std::size_t chunk = binary.empty() ? 0 : 8 + binary.size() + padding;
  const std::size_t size = 12 + 8 + text.size() + chunk;
  if (size > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorKind::kData,
                "GLB: " + std::to_string(size) +
                    " bytes, a file holds at most 4294967295; cut the clip into shorter ones");
  }
  std::string bytes;
  bytes.reserve(size);
  for (const std::size_t word : {std::size_t{kGlbMagic}, std::size_t{2}, size, text.size()}) {
    append_u32(bytes, word);
  }
  append_u32(bytes, kJsonChunk);
  bytes += text;
  if (binary.empty()) return bytes;
  append_u32(bytes, binary.size() + padding);
  append_u32(bytes, kBinChunk);
  bytes += binary;
  bytes.append(padding, '\0');
  return bytes;
}

}  // namespace laban::io
