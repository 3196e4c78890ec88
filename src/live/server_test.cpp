// SPDX-License-Identifier: Apache-2.0
// Requests written byte by byte, so that browsers' good manners do not hide what the server would answer.
#include "live/server.h"

#include <gtest/gtest.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <string>

#include "core/error.h"

namespace covary {
namespace {

using boost::asio::ip::tcp;

class Served : public testing::Test {
 protected:
  LiveServer server{0, [this](const LiveRequest& request) {
                      ++asked;
                      return LiveAnswer::text(200, "text/plain",
                                              request.method + " " + request.path + " " + request.body);
                    }};
  int asked = 0;

  std::string token() const {
    const std::string& address = server.address();
    return address.substr(address.rfind('/', address.size() - 2) + 1, 32);
  }
  std::string host() const { return "127.0.0.1:" + std::to_string(server.port()); }

  std::string send(const std::string& text) const {
    boost::asio::io_context context;
    tcp::socket socket(context);
    socket.connect({boost::asio::ip::address_v4::loopback(), static_cast<unsigned short>(server.port())});
    std::string answer;
    boost::system::error_code end;  // a refused request may end the connection before all of it is sent
    boost::asio::write(socket, boost::asio::buffer(text), end);
    boost::asio::read(socket, boost::asio::dynamic_buffer(answer), end);
    return answer;
  }
  /// The status of a request with these further lines of its header.
  std::string status(const std::string& target, const std::string& host, const std::string& lines = "",
                     const std::string& method = "GET") const {
    const std::string answer =
        send(method + " " + target + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n" + lines + "\r\n");
    return answer.substr(9, 3);
  }
};

TEST_F(Served, AnswersWhoKnowsTheToken) {
  const std::string answer = send("POST /" + token() + "/state?x=1 HTTP/1.1\r\nHost: " + host() +
                                  "\r\nConnection: close\r\nContent-Length: 2\r\n\r\n{}");
  EXPECT_EQ(answer.substr(0, 15), "HTTP/1.1 200 OK");
  EXPECT_TRUE(answer.ends_with("\r\n\r\nPOST state {}")) << answer;
  EXPECT_NE(answer.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(status("/" + token() + "/", "localhost:8000"), "200");  // through a tunnel
  EXPECT_EQ(status("/" + token() + "/", host(), "Origin: http://" + host() + "\r\n"), "200");
}

TEST_F(Served, RefusesOthers) {
  std::string wrong = token();
  wrong[31] = wrong[31] == '0' ? '1' : '0';
  EXPECT_EQ(token().size(), 32u);
  for (const std::string& target : {std::string("/"), "/" + wrong + "/", "/" + token(), token() + "/", "//" + token(),
                                    "/" + token().substr(1) + "/", std::string("/state"), "/../" + token() + "/"})
    EXPECT_EQ(status(target, host()), "403") << target;
  for (const char* name : {"evil.example", "evil.example:80", "127.0.0.1.evil.example:80", "", "[::1]:80"})
    EXPECT_EQ(status("/" + token() + "/", name), "403") << name;
  for (const std::string& origin : {std::string("http://evil.example"), std::string("null"), "https://" + host(),
                                    std::string("http://127.0.0.1:1"), "http://" + host() + ".evil.example"})
    EXPECT_EQ(status("/" + token() + "/", host(), "Origin: " + origin + "\r\n"), "403") << origin;
  EXPECT_EQ(asked, 0);
}

TEST_F(Served, RefusesOtherMethodsAndLargeBodies) {
  EXPECT_EQ(status("/" + token() + "/", host(), "", "DELETE"), "405");
  const std::string large(100000, 'x');
  const std::string answer =
      send("POST /" + token() + "/act HTTP/1.1\r\nHost: " + host() + "\r\nContent-Length: 100000\r\n\r\n" + large);
  EXPECT_EQ(answer.find("200 OK"), std::string::npos);
  EXPECT_EQ(asked, 0);
}

TEST_F(Served, TokensDiffer) {
  const LiveServer other(0, [](const LiveRequest&) { return LiveAnswer(); });
  EXPECT_NE(other.address().substr(other.address().size() - 33), server.address().substr(server.address().size() - 33));
}

TEST_F(Served, SaysThatAPortIsTaken) {
  try {
    LiveServer(server.port(), [](const LiveRequest&) { return LiveAnswer(); });
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(host() + ": Address already in use"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace covary
