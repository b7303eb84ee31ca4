#pragma once

#include <functional>
#include <map>
#include <stdexcept>
#include <string>

namespace laban::studio {

/// A request that passed every check of who may ask.
struct Request {
  std::string method;                        ///< "GET", "POST", ..
  std::string path;                          ///< without the query, decoded: "/api/clips/c0/motion"
  std::map<std::string, std::string> query;  ///< decoded
  std::string body;
};

struct Response {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body;
  std::string file_name = {};  ///< to be saved as, if not empty
  /// Of a page: what its scripts and styles carry to be let run; empty for what runs nothing.
  std::string nonce = {};
};

/// What the client did wrong, as the answer that it gets.
class HttpError : public std::runtime_error {
 public:
  HttpError(unsigned status, const std::string& what) : std::runtime_error(what), status_(status) {}
  [[nodiscard]] unsigned status() const noexcept { return status_; }

 private:
  unsigned status_;
};

/// Answers a request; called by one thread at a time.
using Handler = std::function<Response(const Request&)>;
/// What answers which request, by "METHOD /path".
using Routes = std::map<std::string, Handler>;

/// {"error": "one line"}.
[[nodiscard]] Response error_response(unsigned status, const std::string& what);

/// "%20" and "+" as what they stand for. @throws HttpError{400} for a broken escape or a zero byte.
[[nodiscard]] std::string percent_decoded(const std::string& text);

/// Path and query of a request's target. @throws HttpError{400} unless it begins with '/'.
void parse_target(const std::string& target, Request& request);

}  // namespace laban::studio
