#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <string>

#include "studio.h"

namespace laban::studio {

inline const std::string kTake = LABAN_SOURCE_DIR "/data/take.bvh";

/// The embedded model and one take, opened once.
inline Studio& studio() {
  static Studio opened({{kTake}, LABAN_DEFAULT_MODEL, {}, {}, {}, {}}, "<p id=\"{{nonce}}\">", {});
  return opened;
}

inline Response asked(const std::string& method, const std::string& target,
                      const std::string& body = {}) {
  Request request{method, {}, {}, body};
  parse_target(target, request);
  return studio().handle(request);
}

inline Response get(const std::string& target) {
  return asked("GET", target);
}

inline Response post(const std::string& target, const std::string& body) {
  return asked("POST", target, body);
}

inline Json post_json(const std::string& target, const Json& body) {
  return Json::parse(post(target, body.dump()).body);
}

/// The status that the work ends with.
inline unsigned status_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const HttpError& error) {
    return error.status();
  }
  return 200;
}

/// A motion message, taken apart as a page does.
struct Motion {
  Json header;
  std::string arrays;

  explicit Motion(const std::string& bytes) {
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data(), sizeof size);
    header = Json::parse(bytes.substr(4, size));
    arrays = bytes.substr(4 + size);
  }
  [[nodiscard]] float number(const std::string& array, std::size_t index) const {
    float value = 0.0F;
    const auto offset = header["arrays"][array]["offset"].get<std::size_t>();
    std::memcpy(&value, arrays.data() + offset + sizeof value * index, sizeof value);
    return value;
  }
};

}  // namespace laban::studio
