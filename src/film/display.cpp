// SPDX-License-Identifier: Apache-2.0
#include "film/display.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <optional>
#include <thread>

#include "core/error.h"
#include "core/number_text.h"

namespace covary {

static_assert(std::endian::native == std::endian::little, "packets are written as the machine holds numbers");

namespace tev {
namespace {

constexpr uint8_t kCreateImage = 4, kUpdateImageV3 = 6;
constexpr std::array<const char*, 3> kChannels{"R", "G", "B"};

class Packet {
 public:
  explicit Packet(uint8_t type) {
    add(uint32_t{0});  // placeholder for the length
    add(type);
  }
  template <typename T>
  void add(T value) {
    add_bytes(&value, sizeof(value));
  }
  void add_text(const std::string& text) { add_bytes(text.c_str(), text.size() + 1); }
  void add_bytes(const void* data, size_t size) {
    const auto* begin = static_cast<const uint8_t*>(data);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }
  std::vector<uint8_t> finish() {
    const auto length = static_cast<uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &length, sizeof(length));
    return std::move(bytes_);
  }

 private:
  std::vector<uint8_t> bytes_;
};

}  // namespace

std::vector<uint8_t> create_image(const std::string& name, int width, int height) {
  Packet packet(kCreateImage);
  packet.add(uint8_t{1});  // grab focus
  packet.add_text(name);
  for (const int32_t number : {width, height, static_cast<int>(kChannels.size())}) packet.add(number);
  for (const char* channel : kChannels) packet.add_text(channel);
  return packet.finish();
}

std::vector<uint8_t> update_image(const std::string& name, const Image& image, int first_row, int n_rows) {
  const int rows = std::min(n_rows, image.height - first_row);
  Packet packet(kUpdateImageV3);
  packet.add(uint8_t{0});
  packet.add_text(name);
  packet.add(static_cast<int32_t>(kChannels.size()));
  for (const char* channel : kChannels) packet.add_text(channel);
  for (const int32_t number : {0, first_row, image.width, rows}) packet.add(number);
  for (size_t c = 0; c < kChannels.size(); ++c) packet.add(static_cast<int64_t>(c));                 // offsets
  for (size_t c = 0; c < kChannels.size(); ++c) packet.add(static_cast<int64_t>(kChannels.size()));  // strides
  packet.add_bytes(image.pixel(0, first_row), static_cast<size_t>(image.width) * rows * 3 * sizeof(float));
  return packet.finish();
}

}  // namespace tev

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kConnectTime = std::chrono::seconds(3);
constexpr auto kStallTime = std::chrono::seconds(10);  // the viewer counts as lost if it accepts no byte for this long
constexpr auto kLastTime = std::chrono::seconds(2);
constexpr size_t kPacketBytes = 1 << 20;

struct Address {
  std::string host, port;
};

Address parse_address(const std::string& text) {
  const size_t colon = text.rfind(':');
  const std::string port = colon == std::string::npos ? "" : text.substr(colon + 1);
  std::string host = text.substr(0, std::min(colon, text.size()));
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const int number = parse_number<int>(port).value_or(0);
  if (host.empty() || number < 1 || number > 65535)
    throw Error(ErrorCode::kUsage, "display server '" + text + "': expected HOST:PORT, e.g. localhost:14158");
  return {host, port};
}

}  // namespace

/// The sending thread, and the state it shares with the render.
struct Display::Connection {
  std::string address_text, name;
  Address address;
  std::function<void(const std::string&)> warn;

  mutable std::mutex mutex;
  std::condition_variable changed;
  std::optional<Image> next;
  bool lost = false, closing = false;
  Clock::time_point deadline = Clock::time_point::max();  // for the last image, set when closing

  int descriptor = -1;
  std::thread thread;

  void run() {
    try {
      connect_to_viewer();
      bool created = false;
      while (std::optional<Image> image = wait_for_image()) {
        if (!created) send(tev::create_image(name, image->width, image->height));
        created = true;
        const int rows =
            std::max<int>(1, static_cast<int>(kPacketBytes / (static_cast<size_t>(image->width) * 3 * sizeof(float))));
        for (int y = 0; y < image->height; y += rows) send(tev::update_image(name, *image, y, rows));
      }
    } catch (const Error& error) {
      {
        const std::lock_guard lock(mutex);
        lost = true;
        next.reset();
      }
      warn(fmt::format("display server {}: {}; rendering continues without it", address_text, error.what()));
    }
    if (descriptor >= 0) close(descriptor);
  }

  /// The newest image, or nothing when the render has ended.
  std::optional<Image> wait_for_image() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return next || closing; });
    std::optional<Image> image = std::move(next);
    next.reset();
    return image;
  }

  [[noreturn]] static void fail(const std::string& what) { throw Error(ErrorCode::kIo, what); }

  void connect_to_viewer() {
    addrinfo hints{}, *found = nullptr;
    hints.ai_socktype = SOCK_STREAM;
    const int status = getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found);
    if (status != 0) fail(gai_strerror(status));
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> list(found, freeaddrinfo);
    int reason = 0;
    for (const addrinfo* a = found; a && descriptor < 0; a = a->ai_next) reason = try_connect(*a);
    if (descriptor < 0) fail(fmt::format("cannot connect: {}", std::strerror(reason)));
  }

  /// Sets the descriptor, or returns errno.
  int try_connect(const addrinfo& a) {
    const int candidate = socket(a.ai_family, a.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a.ai_protocol);
    if (candidate < 0) return errno;
    descriptor = candidate;
    int reason = connect(candidate, a.ai_addr, a.ai_addrlen) == 0 ? 0 : errno;
    if (reason == EINPROGRESS) {
      reason = ETIMEDOUT;
      socklen_t size = sizeof(reason);
      if (wait_writable(kConnectTime)) getsockopt(candidate, SOL_SOCKET, SO_ERROR, &reason, &size);
    }
    if (reason == 0) return 0;
    close(candidate);
    descriptor = -1;
    return reason;
  }

  Clock::time_point last_moment() const {
    const std::lock_guard lock(mutex);
    return deadline;
  }

  /// Polls in short steps, because closing may shorten the wait.
  bool wait_writable(Clock::duration longest) const {
    const auto end = Clock::now() + longest;
    while (Clock::now() < std::min(end, last_moment())) {
      pollfd poll_for{descriptor, POLLOUT, 0};
      if (poll(&poll_for, 1, 50) > 0) return true;
    }
    return false;
  }

  void send(const std::vector<uint8_t>& bytes) {
    size_t sent = 0;
    while (sent < bytes.size()) {
      const ssize_t n = ::send(descriptor, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (n > 0)
        sent += static_cast<size_t>(n);
      else if (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)
        fail(fmt::format("connection lost: {}", std::strerror(errno)));
      else if (!wait_writable(kStallTime))
        fail("it takes no more data");
    }
  }
};

Display::Display(const std::string& address, std::string name, std::function<void(const std::string&)> warn)
    : connection_(std::make_unique<Connection>()) {
  connection_->address = parse_address(address);
  connection_->address_text = address;
  connection_->name = std::move(name);
  connection_->warn = std::move(warn);
  connection_->thread = std::thread([this] { connection_->run(); });
}

Display::~Display() {
  {
    const std::lock_guard lock(connection_->mutex);
    connection_->closing = true;
    connection_->deadline = Clock::now() + kLastTime;
  }
  connection_->changed.notify_one();
  connection_->thread.join();
}

bool Display::ready() const {
  const std::lock_guard lock(connection_->mutex);
  return !connection_->lost && !connection_->next;
}

void Display::update(Image image) {
  COVARY_CHECK(image.channels == 3, "the display server takes images of 3 channels");
  {
    const std::lock_guard lock(connection_->mutex);
    if (connection_->lost) return;
    connection_->next = std::move(image);
  }
  connection_->changed.notify_one();
}

}  // namespace covary
