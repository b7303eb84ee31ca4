#include "server.h"

#include <chrono>
#include <fstream>
#include <future>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/sanitizers.h"

namespace laban::studio {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A server that echoes bodies, on a thread of its own.
class EchoServer {
 public:
  explicit EchoServer(ServerOptions options = {}, HandlerAtOnce at_once = {})
      : server_(
            options, Access("secret"),
            [this](const Request& request) {
              ++handled;
              if (delay) delay();
              return Response{200, "text/plain", request.method + request.path + request.body};
            },
            std::move(at_once)),
        thread_([this] { server_.run(); }) {
    const std::string url = server_.url();
    host = url.substr(7, url.find('/', 7) - 7);
    port = static_cast<unsigned short>(std::stoi(host.substr(host.find(':') + 1)));
  }
  ~EchoServer() {
    server_.stop();
    thread_.join();
  }

  std::atomic<int> handled = 0;
  std::function<void()> delay;  ///< called for each request; set before the first
  std::string host;
  unsigned short port = 0;

 private:
  Server server_;
  std::thread thread_;
};

tcp::socket connected(asio::io_context& io, const EchoServer& server) {
  tcp::socket socket(io);
  socket.connect({asio::ip::address_v4::loopback(), server.port});
  return socket;
}

/// What comes back until the server closes.
std::string rest_of(tcp::socket& socket) {
  std::string answer;
  boost::system::error_code ended;
  asio::read(socket, asio::dynamic_buffer(answer), ended);
  return answer;
}

std::string answer_to(const EchoServer& server, const std::string& bytes) {
  asio::io_context io;
  tcp::socket socket = connected(io, server);
  boost::system::error_code cut_off;
  asio::write(socket, asio::buffer(bytes), cut_off);
  return rest_of(socket);
}

std::string head(const EchoServer& server, const std::string& first, const std::string& more = {}) {
  return first + " HTTP/1.1\r\nHost: " + server.host +
         "\r\nX-Laban-Token: secret\r\nConnection: close\r\n" + more + "\r\n";
}

/// Of this process, bytes.
[[maybe_unused]] long resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  long pages = 0;
  long resident = 0;
  statm >> pages >> resident;
  return resident * 4096;
}

TEST(Server, AnswersWhoMayAsk) {
  EchoServer server;
  EXPECT_THAT(answer_to(server, head(server, "POST /a", "Content-Length: 3\r\n") + "xyz"),
              ::testing::EndsWith("\r\n\r\nPOST/axyz"));
  EXPECT_THAT(answer_to(server, "GET /?token=secret HTTP/1.0\r\nHost: " + server.host + "\r\n\r\n"),
              ::testing::EndsWith("\r\n\r\nGET/"));
}

TEST(Server, TellsAtOnceWhatNeedNotWaitForItsTurn) {
  std::promise<void> asked;
  EchoServer server({}, [&](const Request& request) -> std::optional<Response> {
    if (request.path != "/now") return std::nullopt;
    asked.set_value();
    return Response{200, "text/plain", "at once"};
  });
  server.delay = [waited = asked.get_future().share()] { waited.wait(); };
  asio::io_context io;
  tcp::socket worked_on = connected(io, server);
  asio::write(worked_on, asio::buffer(head(server, "GET /work")));
  EXPECT_THAT(answer_to(server, head(server, "GET /now")), ::testing::EndsWith("at once"));
  EXPECT_THAT(rest_of(worked_on), ::testing::EndsWith("GET/work"));
  EXPECT_EQ(server.handled, 1);
}

TEST(Server, RefusesStrangersBeforeTheirBodyIsRead) {
  EchoServer server;
  const std::string big = "Content-Length: 1000000000\r\n\r\n";
  const std::string token = "X-Laban-Token: secret\r\n";
  const std::string host = "Host: " + server.host + "\r\n";
  for (const std::string& lines :
       {host, host + "X-Laban-Token: wrong\r\n", "Host: localhost\r\n" + token,
        "Host: evil.example\r\n" + token, token, host + token + "Origin: http://evil.example\r\n",
        host + token + "Origin: null\r\n", host + host + token,
        host + token + "Origin: http://" + server.host + "\r\nOrigin: http://evil.example\r\n"}) {
    EXPECT_THAT(answer_to(server, "POST /a HTTP/1.1\r\n" + lines + big), StartsWith("HTTP/1.1 403"))
        << lines;
  }
  // The token in an address is for the page alone.
  EXPECT_THAT(answer_to(server, "GET /api/studio?token=secret HTTP/1.1\r\n" + host + "\r\n"),
              StartsWith("HTTP/1.1 403"));
  EXPECT_EQ(server.handled, 0);
}

TEST(Server, AllowsNoOtherPageAnything) {
  EchoServer server;
  const std::string answer = answer_to(server, head(server, "OPTIONS /a",
                                                    "Origin: http://evil.example\r\n"
                                                    "Access-Control-Request-Method: POST\r\n"));
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(answer, ::testing::Not(HasSubstr("Access-Control")));
}

TEST(Server, CutsOffEndlessHeaders) {
  EchoServer server;
  const std::string endless = "GET /?" + std::string(100000, 'a');
  EXPECT_THAT(answer_to(server, endless), StartsWith("HTTP/1.1 431"));
  EXPECT_EQ(server.handled, 0);
}

TEST(Server, CutsOffGreatBodiesInLittleMemory) {
  EchoServer server;
  EXPECT_THAT(answer_to(server, head(server, "POST /a", "Content-Length: 1073741824\r\n")),
              StartsWith("HTTP/1.1 413"));

  // Without a length said before: as long as the server reads.
  asio::io_context io;
  tcp::socket socket = connected(io, server);
  asio::write(socket, asio::buffer(head(server, "POST /a", "Transfer-Encoding: chunked\r\n")));
  [[maybe_unused]] const long idle = resident_bytes();
  const std::string chunk = "100000\r\n" + std::string(0x100000, 'x') + "\r\n";
  boost::system::error_code cut_off;
  int sent = 0;
  while (!cut_off && sent < 1024) {
    asio::write(socket, asio::buffer(chunk), cut_off);
    ++sent;
  }
  EXPECT_TRUE(cut_off);
  EXPECT_LT(sent, 64);
#ifndef LABAN_KEEPS_FREED_MEMORY
  EXPECT_LT(resident_bytes() - idle, 64L << 20);
#endif
  EXPECT_EQ(server.handled, 0);
}

TEST(Server, CutsOffSlowSenders) {
  ServerOptions options;
  options.header_time = std::chrono::seconds(1);
  options.body_time = std::chrono::seconds(1);
  EchoServer server(options);
  for (const std::string& begun :
       {std::string("GET / HT"), head(server, "POST /a", "Content-Length: 10\r\n") + "x"}) {
    asio::io_context io;
    tcp::socket socket = connected(io, server);
    asio::write(socket, asio::buffer(begun));
    const auto begin = std::chrono::steady_clock::now();
    // A byte now and then does not win time.
    boost::system::error_code cut_off;
    while (!cut_off && std::chrono::steady_clock::now() - begin < std::chrono::seconds(20)) {
      asio::write(socket, asio::buffer("y", 1), cut_off);
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
    EXPECT_TRUE(cut_off);
  }
  EXPECT_EQ(server.handled, 0);
}

TEST(Server, KeepsToItsConnections) {
  ServerOptions options;
  options.most_connections = 2;
  EchoServer server(options);
  asio::io_context io;
  tcp::socket first = connected(io, server);
  tcp::socket second = connected(io, server);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(answer_to(server, head(server, "GET /a")), "");
  first.close();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_THAT(answer_to(server, head(server, "GET /a")), StartsWith("HTTP/1.1 200"));
}

TEST(Server, SaysWhichPortCannotBeHad) {
  EchoServer server;
  ServerOptions options;
  options.port = server.port;
  try {
    Server another(options, Access("secret"), {});
    // The system may let two listen where the option to reuse an address is set; it must not here.
    FAIL() << "two servers on one port";
  } catch (const std::exception& error) {
    EXPECT_THAT(error.what(), HasSubstr(std::to_string(server.port)));
  }
}

}  // namespace
}  // namespace laban::studio
