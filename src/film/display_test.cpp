// SPDX-License-Identifier: Apache-2.0
// Bytes of packets; missing and slow viewers. tests/display decodes what a render sends.
#include "film/display.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <utility>
#include <vector>

#include "support/files.h"

namespace covary {
namespace {

using Clock = std::chrono::steady_clock;

/// A listening socket on a free local port that accepts connections and reads nothing.
class SilentServer {
 public:
  SilentServer() : descriptor_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    EXPECT_EQ(bind(descriptor_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(descriptor_, 4), 0);
    EXPECT_EQ(getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
  }
  ~SilentServer() { stop(); }
  SilentServer(const SilentServer&) = delete;
  SilentServer& operator=(const SilentServer&) = delete;
  void stop() {
    if (descriptor_ >= 0) close(descriptor_);
    descriptor_ = -1;
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  int descriptor_;
  uint16_t port_ = 0;
};

TEST(TevPackets, CreateImage) {
  const std::vector<uint8_t> expected{27, 0, 0, 0, 4, 1, 'a', 'b', 0, 3,   0, 0,   0, 2,
                                      0,  0, 0, 3, 0, 0, 0,   'R', 0, 'G', 0, 'B', 0};
  EXPECT_EQ(tev::create_image("ab", 3, 2), expected);
}

TEST(TevPackets, UpdateImageHoldsTheRowsAskedFor) {
  Image image(1, 3, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i);
  const std::vector<uint8_t> packet = tev::update_image("a", image, 1, 5);
  // Length, type, focus, name, channels, names, window, 3 + 3 int64, two rows of three floats.
  EXPECT_EQ(packet.size(), 4 + 1 + 1 + 2 + 4 + 6 + 16 + 48 + 24u);
  EXPECT_EQ(packet[4], 6);
  float first = 0;
  std::memcpy(&first, packet.data() + packet.size() - 24, sizeof(first));
  EXPECT_EQ(first, 3) << "row 1 begins with value 3";
}

TEST(Display, RefusesWhatIsNoAddress) {
  for (const char* address :
       {"", "localhost", ":14158", "localhost:", "localhost:0", "localhost:70000", "localhost:x1"})
    EXPECT_TRUE(test_support::contains(
        test_support::message_of([&] { Display display(address, "a", [](const std::string&) {}); }),
        "expected HOST:PORT, e.g. localhost:14158"))
        << address;
}

TEST(Display, AMissingViewerIsOneWarningAndNoWait) {
  std::string address;
  {
    const SilentServer server;
    address = server.address();
  }
  std::atomic<int> warnings{0};
  std::string text;
  const auto start = Clock::now();
  {
    Display display(address, "a", [&](const std::string& warning) {
      text = warning;
      ++warnings;
    });
    for (int i = 0; i < 100; ++i) display.update(Image(4, 4, 3));
  }
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(3));
  EXPECT_EQ(warnings, 1);
  EXPECT_TRUE(test_support::contains(text, "display server " + address + ": cannot connect: Connection refused"));
}

TEST(Display, AViewerThatReadsNothingHoldsUpNobody) {
  const SilentServer server;
  std::atomic<int> warnings{0};
  std::vector<Image> images(10, Image(1024, 1024, 3));  // 12 MB each, more than socket buffers hold
  auto start = Clock::now();
  Clock::duration updates{};
  {
    Display display(server.address(), "a", [&](const std::string&) { ++warnings; });
    for (Image& image : images) display.update(std::move(image));
    updates = Clock::now() - start;
    start = Clock::now();
  }
  EXPECT_LT(updates, std::chrono::seconds(1));
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(4)) << "the last image gets two seconds";
  EXPECT_EQ(warnings, 1);
}

}  // namespace
}  // namespace covary
