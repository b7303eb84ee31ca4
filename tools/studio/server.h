#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "access.h"
#include "http.h"

namespace laban::studio {

/// Limits on what a client may cost. A request beyond one of them is cut off.
struct ServerOptions {
  unsigned short port = 0;  ///< 0: one that is free
  std::size_t longest_header = 8192;
  std::size_t longest_body = std::size_t{32} << 20;
  std::chrono::seconds header_time{10};  ///< from the first byte, or since the last answer
  std::chrono::seconds idle_time{120};   ///< an open connection without a request
  std::chrono::seconds body_time{60};    ///< for all of a body, or of an answer
  int most_connections = 64;
};

using HandlerAtOnce = std::function<std::optional<Response>(const Request&)>;

/// An HTTP/1.1 server for one person on this machine: it listens on 127.0.0.1 alone, refuses
/// whoever Access refuses before it reads a body, and hands what is left to a handler, one request
/// at a time.
class Server {
 public:
  /// @param at_once  answers what need not wait for its turn, from the thread that runs; nullopt
  ///                 for what is the handler's. Both may be called at the same time.
  /// Listens from here on; requests wait until run().
  /// @throws Error{kIo} naming the port if it cannot be had.
  Server(const ServerOptions& options, Access access, Handler handler, HandlerAtOnce at_once = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// "http://127.0.0.1:PORT/?token=.."
  [[nodiscard]] std::string url() const;
  /// Serves until stop().
  void run();
  /// May be called from any thread, and from the handler.
  void stop();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace laban::studio
