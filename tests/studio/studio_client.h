#pragma once

#include <atomic>
#include <cstdint>
#include <cstring>
#include <functional>
#include <future>
#include <string>

#include "laban/base/error.h"

#include "studio.h"

namespace laban::studio {

inline const std::string kTake = LABAN_SOURCE_DIR "/data/take.bvh";

/// Asks a studio of the embedded model as its page does.
class StudioClient {
 public:
  explicit StudioClient(StudioOptions options)
      : studio_(with_model(std::move(options)), "<p id=\"{{nonce}}\">", {}) {}

  Response get(const std::string& target) { return asked("GET", target, {}); }
  Response post(const std::string& target, const std::string& body) {
    return asked("POST", target, body);
  }
  Json post_json(const std::string& target, const Json& body) {
    return Json::parse(post(target, body.dump()).body);
  }
  /// What comes of a request that is asked to stop for as long as it is worked on.
  std::string told_when_stopped(const std::string& target, const Json& body) {
    std::atomic<bool> done = false;
    auto told = std::async(std::launch::async, [&] {
      std::string trouble = "it was done";
      try {
        (void)post(target, body.dump());
      } catch (const base::Error& error) {
        trouble = error.what();
      }
      done = true;
      return trouble;
    });
    while (!done) (void)studio_.handle_at_once({"DELETE", "/api/work", {}, {}});
    return told.get();
  }

 private:
  static StudioOptions with_model(StudioOptions options) {
    options.model = LABAN_DEFAULT_MODEL;
    return options;
  }
  Response asked(const std::string& method, const std::string& target, const std::string& body) {
    Request request{method, {}, {}, body};
    parse_target(target, request);
    return studio_.handle(request);
  }

  Studio studio_;
};

/// The one that most tests share: one take is open.
inline StudioClient& client() {
  static StudioClient opened([] {
    StudioOptions options;
    options.clips = {kTake};
    return options;
  }());
  return opened;
}

inline Response get(const std::string& target) {
  return client().get(target);
}
inline Response post(const std::string& target, const std::string& body) {
  return client().post(target, body);
}
inline Json post_json(const std::string& target, const Json& body) {
  return client().post_json(target, body);
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
