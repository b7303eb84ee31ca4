#include "server.h"

#include <atomic>
#include <cstdint>
#include <limits>
#include <optional>
#include <thread>

#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

#include "laban/base/error.h"

namespace laban::studio {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = asio::ip::tcp;

/// Sessions live in what the network and the work have under way, and use all above these: they are
/// destroyed first.
struct Server::State {
  ServerOptions options;
  Access access;
  Handler handler;
  HandlerAtOnce at_once;
  std::atomic<int> connections = 0;
  asio::io_context network{1};
  asio::thread_pool work{1};
  tcp::acceptor acceptor{network};
};

namespace {

using Answer = http::response<http::string_body>;

Answer answer_of(Response response) {
  Answer answer{static_cast<http::status>(response.status), 11};
  answer.set(http::field::content_type, response.type);
  answer.set(http::field::cache_control, "no-store");
  answer.set("X-Content-Type-Options", "nosniff");
  answer.set("Referrer-Policy", "no-referrer");
  answer.set("Cross-Origin-Resource-Policy", "same-origin");
  answer.set("Cross-Origin-Opener-Policy", "same-origin");
  answer.set("X-Frame-Options", "DENY");
  std::string policy =
      "default-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";
  if (!response.nonce.empty()) {
    policy += "; script-src 'nonce-" + response.nonce + "'; style-src 'nonce-" + response.nonce +
              "'; img-src 'self' data: blob:; connect-src 'self' blob:";
  }
  answer.set("Content-Security-Policy", policy);
  if (!response.file_name.empty()) {
    answer.set(http::field::content_disposition,
               "attachment; filename=\"" + response.file_name + "\"");
  }
  answer.body() = std::move(response.body);
  answer.prepare_payload();
  return answer;
}

Response handled(const Handler& handler, const Request& request) {
  try {
    return handler(request);
  } catch (const HttpError& error) {
    return error_response(error.status(), error.what());
  } catch (const base::Error& error) {
    const bool ours = error.kind() == base::ErrorKind::kInternal;
    return error_response(ours ? 500 : 422, error.what());
  } catch (const std::bad_alloc&) {
    return error_response(507, "out of memory; try a shorter clip");
  } catch (const std::exception& error) {
    return error_response(500, std::string("bug in laban: ") + error.what());
  }
}

/// One connection: its requests, one after the other. Lives as long as something is under way.
class Session : public std::enable_shared_from_this<Session> {
 public:
  template <typename State>
  Session(tcp::socket socket, State& state)
      : stream_(std::move(socket)),
        options_(state.options),
        access_(state.access),
        handler_(state.handler),
        at_once_(state.at_once),
        network_(state.network),
        work_(state.work),
        connections_(state.connections) {
    ++connections_;
  }
  ~Session() { --connections_; }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void read_header(std::chrono::seconds time) {
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(options_.longest_header));
    // None yet: a stranger is to be refused as one, whatever he sends.
    parser_->body_limit(std::numeric_limits<std::uint64_t>::max());
    stream_.expires_after(time);
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = shared_from_this()](beast::error_code failed, std::size_t) {
                              if (!failed) return self->check_header();
                              if (failed == http::error::header_limit)
                                self->refuse(431, "the request's header is too long");
                              else if (failed == http::error::body_limit)
                                self->refuse_body();
                            });
  }

 private:
  void check_header() {
    const auto& header = parser_->get();
    try {
      request_ = {};
      request_.method = std::string(header.method_string());
      parse_target(std::string(header.target()), request_);
    } catch (const HttpError& error) {
      return refuse(error.status(), error.what());
    }
    Credentials credentials;
    const auto text = [](beast::string_view view) {
      return std::string_view(view.data(), view.size());
    };
    credentials.host = text(header[http::field::host]);
    if (header.count(http::field::origin) > 0)
      credentials.origin = text(header[http::field::origin]);
    const bool page = request_.method == "GET" && request_.path == "/";
    const std::string query_token = page ? request_.query["token"] : std::string();
    credentials.token = page ? std::string_view(query_token) : text(header["X-Laban-Token"]);
    const bool doubled =
        header.count(http::field::host) > 1 || header.count(http::field::origin) > 1;
    const std::string why = doubled ? "a header is there twice" : access_.refusal(credentials);
    if (!why.empty()) return refuse(403, why);
    read_body();
  }

  void read_body() {
    if (parser_->content_length().value_or(0) > options_.longest_body) return refuse_body();
    parser_->body_limit(options_.longest_body);
    stream_.expires_after(options_.body_time);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code failed, std::size_t) {
                       if (failed == http::error::body_limit) return self->refuse_body();
                       if (!failed) self->work_on();
                     });
  }

  void work_on() {
    keep_alive_ = parser_->get().keep_alive();
    request_.body = std::move(parser_->get().body());
    parser_.reset();
    if (at_once_) {
      if (auto told = at_once_(request_))
        return write(std::make_shared<Answer>(answer_of(std::move(*told))));
    }
    asio::post(work_, [self = shared_from_this()] {
      auto answer = std::make_shared<Answer>(answer_of(handled(self->handler_, self->request_)));
      self->request_ = {};
      asio::post(self->network_, [self, answer] { self->write(answer); });
    });
  }

  /// Answers, and reads no more from whoever it was.
  void refuse(unsigned status, const std::string& what) {
    keep_alive_ = false;
    write(std::make_shared<Answer>(answer_of(error_response(status, what))));
  }
  void refuse_body() {
    refuse(413, "more than " + std::to_string(options_.longest_body >> 20) +
                    " MB cannot be sent; name the file on the command line: laban studio FILE");
  }

  void write(const std::shared_ptr<Answer>& answer) {
    answer->keep_alive(keep_alive_);
    stream_.expires_after(options_.body_time);
    http::async_write(stream_, *answer,
                      [self = shared_from_this(), answer](beast::error_code failed, std::size_t) {
                        if (failed) return;
                        if (self->keep_alive_) return self->read_header(self->options_.idle_time);
                        beast::error_code ignored;
                        self->stream_.socket().shutdown(tcp::socket::shutdown_both, ignored);
                      });
  }

  beast::tcp_stream stream_;
  const ServerOptions& options_;
  const Access& access_;
  const Handler& handler_;
  const HandlerAtOnce& at_once_;
  asio::io_context& network_;
  asio::thread_pool& work_;
  std::atomic<int>& connections_;
  beast::flat_buffer buffer_{1 << 16};
  std::optional<http::request_parser<http::string_body>> parser_;
  Request request_;
  bool keep_alive_ = false;
};

template <typename State>
void accept_next(State& state) {
  state.acceptor.async_accept([&state](beast::error_code failed, tcp::socket socket) {
    if (failed == asio::error::operation_aborted) return;
    if (!failed && state.connections < state.options.most_connections) {
      std::make_shared<Session>(std::move(socket), state)->read_header(state.options.header_time);
    }
    accept_next(state);
  });
}

}  // namespace

Server::Server(const ServerOptions& options, Access access, Handler handler, HandlerAtOnce at_once)
    : state_(new State{options, std::move(access), std::move(handler), std::move(at_once)}) {
  try {
    const tcp::endpoint here(asio::ip::address_v4::loopback(), options.port);
    state_->acceptor.open(here.protocol());
    state_->acceptor.set_option(tcp::acceptor::reuse_address(true));
    state_->acceptor.bind(here);
    state_->acceptor.listen();
    state_->access.listen_on(state_->acceptor.local_endpoint().port());
  } catch (const boost::system::system_error& error) {
    throw base::Error(base::ErrorKind::kIo,
                      "127.0.0.1:" + std::to_string(options.port) +
                          " cannot be listened on: " + error.code().message() + "; try --port 0");
  }
}

Server::~Server() {
  stop();
  state_->work.join();
}

std::string Server::url() const {
  return "http://" + state_->access.host() + "/?token=" + state_->access.token();
}

void Server::run() {
  accept_next(*state_);
  state_->network.run();
}

void Server::stop() {
  state_->network.stop();
}

}  // namespace laban::studio
