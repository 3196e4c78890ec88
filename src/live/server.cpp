// SPDX-License-Identifier: Apache-2.0
#include "live/server.h"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <optional>
#include <random>
#include <thread>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

constexpr auto kPatience = std::chrono::seconds(30);  // with a reader who neither asks nor takes
constexpr size_t kMaxBody = 64 << 10, kMaxHeader = 16 << 10, kMaxConnections = 64;

using Request = http::request<http::string_body>;
using Response = http::response<http::span_body<const char>>;

/// 128 bits of the system's generator, as 32 hexadecimal digits.
std::string random_token() {
  std::random_device device;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", static_cast<uint32_t>(device()));
  return token;
}

/// In a time that does not tell how much of the texts is equal.
bool is_same(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned different = 0;
  for (size_t i = 0; i < a.size(); ++i)
    different |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return different == 0;
}

std::string_view view_of(beast::string_view text) { return {text.data(), text.size()}; }

/// The rules of LiveServer's constructor. Another port of this machine is that of a tunnel.
bool is_own(const Request& request) {
  const std::string_view host = view_of(request[http::field::host]), origin = view_of(request[http::field::origin]);
  const std::string_view name = host.substr(0, host.rfind(':'));
  if (name != "127.0.0.1" && name != "localhost") return false;
  return origin.empty() || origin == "http://" + std::string(host);
}

/// One connection, which serves one request after the other.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(tcp::socket socket, const std::string& token, const LiveServer::Handler& answer, size_t& connections)
      : stream_(std::move(socket)), token_(token), answer_(answer), connections_(connections) {
    ++connections_;
  }
  ~Session() { --connections_; }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void read() {
    parser_.emplace();
    parser_->body_limit(kMaxBody);
    parser_->header_limit(kMaxHeader);
    stream_.expires_after(kPatience);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](beast::error_code failed, size_t) {
      if (!failed) self->write(self->parser_->release());
    });
  }

 private:
  LiveAnswer answer(const Request& request) const {
    const std::string_view target = view_of(request.target());
    const size_t end = target.find('/', 1);
    const bool knows = end != std::string_view::npos && target[0] == '/' && is_same(target.substr(1, end - 1), token_);
    if (!knows || !is_own(request)) return LiveAnswer::text(403, "text/plain", "forbidden\n");
    if (request.method() != http::verb::get && request.method() != http::verb::post)
      return LiveAnswer::text(405, "text/plain", "expected GET or POST\n");
    const std::string_view path = target.substr(end + 1);
    return answer_(
        {std::string(view_of(request.method_string())), std::string(path.substr(0, path.find('?'))), request.body()});
  }

  void write(const Request& request) {
    LiveAnswer given;
    try {
      given = answer(request);
    } catch (const std::exception& error) {
      given = LiveAnswer::text(400, "text/plain", std::string(error.what()) + "\n");
    }
    body_ = given.body ? given.body : std::make_shared<const std::vector<char>>();
    response_ = Response(http::int_to_status(static_cast<unsigned>(given.status)), request.version());
    response_.set(http::field::content_type, given.type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("Referrer-Policy", "same-origin");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("Content-Security-Policy",
                  "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
                  "img-src data: blob:; base-uri 'none'; form-action 'none'; "
                  "frame-ancestors 'self' http://127.0.0.1:* http://localhost:*");
    response_.body() = beast::span<const char>(body_->data(), body_->size());
    response_.keep_alive(request.keep_alive());
    response_.prepare_payload();
    stream_.expires_after(kPatience);
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code failed, size_t) {
      if (!failed && self->response_.keep_alive()) self->read();
    });
  }

  beast::tcp_stream stream_;
  const std::string& token_;
  const LiveServer::Handler& answer_;
  size_t& connections_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  std::shared_ptr<const std::vector<char>> body_;  // what response_ refers to
  Response response_;
};

}  // namespace

LiveAnswer LiveAnswer::text(int status, const std::string& type, const std::string& body) {
  return {status, type, std::make_shared<const std::vector<char>>(body.begin(), body.end())};
}

struct LiveServer::Implementation {
  explicit Implementation(Handler handler) : answer(std::move(handler)), acceptor(context), token(random_token()) {}

  void accept() {
    acceptor.async_accept([this](beast::error_code failed, tcp::socket socket) {
      if (!acceptor.is_open()) return;
      if (!failed && connections < kMaxConnections)
        std::make_shared<Session>(std::move(socket), token, answer, connections)->read();
      accept();
    });
  }

  Handler answer;
  size_t connections = 0;  // outlives the sessions, which the context holds
  asio::io_context context{1};
  tcp::acceptor acceptor;
  std::string token, address;
  int port = 0;
  std::thread thread;
};

LiveServer::LiveServer(int port, Handler answer) : implementation_(new Implementation(std::move(answer))) {
  Implementation& i = *implementation_;
  try {
    const tcp::endpoint here(asio::ip::address_v4::loopback(), static_cast<unsigned short>(port));
    i.acceptor.open(here.protocol());
    i.acceptor.set_option(tcp::acceptor::reuse_address(true));
    i.acceptor.bind(here);
    i.acceptor.listen();
    i.port = i.acceptor.local_endpoint().port();
  } catch (const boost::system::system_error& error) {
    throw Error(ErrorCode::kIo, fmt::format("no page can be served at 127.0.0.1:{}: {}; without a port, any free one "
                                            "is taken",
                                            port, error.code().message()));
  }
  i.address = fmt::format("http://127.0.0.1:{}/{}/", i.port, i.token);
  i.accept();
  i.thread = std::thread([&i] { i.context.run(); });
}

LiveServer::~LiveServer() {
  implementation_->context.stop();
  implementation_->thread.join();
}

const std::string& LiveServer::address() const { return implementation_->address; }
int LiveServer::port() const { return implementation_->port; }

}  // namespace covary
