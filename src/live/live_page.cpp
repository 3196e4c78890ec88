// SPDX-License-Identifier: Apache-2.0
#include "live/live_page.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "live/embedded.h"
#include "report/image_block.h"
#include "report/report.h"

namespace covary {
namespace {

constexpr double kPresent = 3;  // seconds for which a reader counts as watching
constexpr size_t kMaxReaders = 100;

using Json = nlohmann::json;

std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

LiveImage live_image(const Image& image, int stride) {
  const size_t row = image.width, plane = row * image.height;
  auto bytes = std::make_shared<std::vector<char>>(2 * plane * image.channels);
  for (int c = 0; c < image.channels; ++c)
    for (size_t i = 0; i < plane; ++i) {
      const uint16_t bits = half_bits(image.data[i * image.channels + c]);
      char* to = bytes->data() + 2 * (c * plane + i);
      to[0] = static_cast<char>(bits & 0xff), to[1] = static_cast<char>(bits >> 8);
    }
  return {image.width, image.height, image.channels, stride, std::move(bytes)};
}

LivePage::LivePage(int port, const std::string& title, Act act) : act_(std::move(act)) {
  const std::string html = script_page(title, live_files::live_css, live_files::live_js);
  html_ = std::make_shared<const std::vector<char>>(html.begin(), html.end());
  members_["title"] = title;
  server_ = std::make_unique<LiveServer>(port, [this](const LiveRequest& request) { return answer(request); });
}

void LivePage::show(const std::string& name, LiveImage image) {
  const std::lock_guard lock(mutex_);
  image_version_ = ++version_;
  images_[name] = {version_, std::move(image)};
}

void LivePage::remove(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (images_.erase(name)) image_version_ = ++version_;
}

void LivePage::say(const Json& members) {
  const std::lock_guard lock(mutex_);
  ++version_;
  members_.update(members);
}

bool LivePage::is_watched() const {
  const std::lock_guard lock(mutex_);
  return std::any_of(readers_.begin(), readers_.end(),
                     [&](const auto& reader) { return watch_.seconds() - reader.second.looked < kPresent; });
}

bool LivePage::everybody_has(int64_t version) const {
  bool watched = false;
  for (const auto& [id, reader] : readers_) {
    if (watch_.seconds() - reader.looked >= kPresent) continue;
    watched = true;
    if (reader.has < version) return false;
  }
  return watched;
}

bool LivePage::is_seen() const {
  const std::lock_guard lock(mutex_);
  return everybody_has(image_version_);
}

void LivePage::wait_until_seen(double seconds) const {
  const Stopwatch watch;
  const auto has_all = [&] {
    const std::lock_guard lock(mutex_);
    return everybody_has(version_);
  };
  while (is_watched() && !has_all() && watch.seconds() < seconds)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

/// Reader `reader` has everything up to version `has`, and gets what is newer.
LiveAnswer LivePage::state(const std::string& body) {
  const Json asked = Json::parse(body);
  const std::lock_guard lock(mutex_);
  if (readers_.size() > kMaxReaders) readers_.clear();
  Reader& reader = readers_[asked.at("reader").get<std::string>()];
  reader = {watch_.seconds(), asked.at("has").get<int64_t>()};
  Json state = members_;
  state["version"] = version_;
  state["images"] = Json::object();
  for (const auto& [name, of] : images_) {
    const auto& [version, image] = of;
    state["images"][name] = {{"version", version},
                             {"width", image.width},
                             {"height", image.height},
                             {"channels", image.channels},
                             {"stride", image.stride}};
  }
  return LiveAnswer::text(200, "application/json", dumped(state));
}

LiveAnswer LivePage::answer(const LiveRequest& request) {
  constexpr const char* kImage = "image/";
  if (request.method == "GET" && request.path.empty()) return {200, "text/html; charset=utf-8", html_};
  if (request.method == "GET" && request.path.starts_with(kImage)) {
    const std::lock_guard lock(mutex_);
    const auto found = images_.find(request.path.substr(std::strlen(kImage)));
    if (found != images_.end()) return {200, "application/octet-stream", found->second.second.halves};
  }
  if (request.method == "POST" && request.path == "state") return state(request.body);
  if (request.method == "POST" && request.path == "act") {
    act_(Json::parse(request.body));
    return LiveAnswer::text(200, "application/json", "{}");
  }
  return LiveAnswer::text(404, "text/plain", "not found\n");
}

}  // namespace covary
