// SPDX-License-Identifier: Apache-2.0
#include "live/live_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <sstream>
#include <thread>
#include <utility>

#include "core/error.h"
#include "estimators/estimator_result.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "live/coarse.h"
#include "plans/made_of.h"
#include "risk/predicted_error.h"

namespace covary {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kBytes = 12 * sizeof(float);  // per pixel, without groups
constexpr auto kPause = std::chrono::milliseconds(500);
constexpr const char *kAttribute = "covary:", *kFilm = "covary:film";  // of files
constexpr double kQuiet = 15;  // seconds without a change after which the page says how to go on

std::vector<fs::path> images_in(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().extension() == ".exr" && entry.is_regular_file(ignored)) paths.push_back(entry.path());
  return paths;
}

fs::file_time_type time_of(const fs::path& path) {
  std::error_code failed;
  const fs::file_time_type time = fs::last_write_time(path, failed);
  return failed ? fs::file_time_type::min() : time;
}

std::string value_of(const std::map<std::string, std::string>& attributes, const std::string& name) {
  const auto found = attributes.find(kAttribute + name);
  return found == attributes.end() ? "" : found->second;
}

/// What a film shows: the scene, and in a sequence the camera's place and the time.
std::string view_of(const std::map<std::string, std::string>& attributes) {
  std::string view = value_of(attributes, film_key::kSceneHash);
  std::istringstream lines(value_of(attributes, film_key::kMadeOf));
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(std::string(kMadeAtPlace) + "=") || line.starts_with(std::string(kMadeAtTime) + "="))
      view += "\n" + line;
  return view;
}

std::string waiting_for(const std::string& path) {
  const bool is_file = fs::path(path).extension() == ".exr";
  return fmt::format("waiting for '{}'{}", path,
                     is_file || fs::exists(path) ? "" : ", a folder that does not exist yet");
}

}  // namespace

LiveFiles::LiveFiles(int port, std::string path)
    : path_(std::move(path)), page_(port, path_, [](const Json&) { throw Error(ErrorCode::kUsage, "no buttons"); }) {
  page_.say({{"kind", "files"}, {"pictures", Json::array()}, {"phase", waiting_for(path_)}});
}

std::string LiveFiles::waiting() const { return fs::exists(path_) ? "" : waiting_for(path_); }

/// The newest ones, by name.
std::vector<fs::path> LiveFiles::files() const {
  std::vector<fs::path> paths;
  std::error_code ignored;
  if (fs::is_directory(path_, ignored)) {
    paths = images_in(path_);
  } else {
    paths = images_in(fs::path(path_).replace_extension(".passes"));
    if (fs::exists(path_, ignored)) paths.emplace_back(path_);
  }
  std::sort(paths.begin(), paths.end(),
            [](const fs::path& a, const fs::path& b) { return std::pair(time_of(a), b) > std::pair(time_of(b), a); });
  paths.resize(std::min(paths.size(), kMax));
  std::sort(paths.begin(), paths.end());
  return paths;
}

void LiveFiles::read(const fs::path& path, Followed& followed) const {
  const ImageInfo info = inspect_image(path);
  followed.attributes = info.attributes;
  require_image_memory(path, info.place.window.width, info.place.window.height, kBytes);
  followed.film.reset();
  followed.std_error = {};
  if (info.attributes.contains(kFilm)) {
    followed.film = read_film(path);
    MeanAndError mean = mean_of_films({&*followed.film}, nullptr);
    followed.image = std::move(mean.mean), followed.std_error = std::move(mean.std_error);
    return;
  }
  followed.image = read_image(path).image;
  const std::vector<std::string> layers = image_layers(info.channels);
  if (std::find(layers.begin(), layers.end(), "StdError") != layers.end())
    followed.std_error = read_image(path, "StdError").image;
}

void LiveFiles::look() {
  const std::vector<fs::path> paths = files();
  bool changed = std::erase_if(followed_, [&](const auto& followed) {
                   return std::find(paths.begin(), paths.end(), followed.first) == paths.end();
                 }) > 0;
  for (const fs::path& path : paths) {
    std::error_code ignored;
    Followed& followed = followed_[path];
    const fs::file_time_type time = time_of(path);
    const uintmax_t size = fs::file_size(path, ignored);
    if (time == followed.changed && size == followed.size) continue;
    followed.changed = time, followed.size = size;
    changed = true;
    followed.problem.clear();
    try {
      read(path, followed);
    } catch (const Error& error) {  // such as a file that was replaced meanwhile
      followed.problem = error.what();
    }
  }
  if (changed) show();
  say_state();
}

Json LiveFiles::picture(const std::string& id, const std::string& name, const Image& image, const Image& std_error) {
  page_.show(id, live_image(image));
  std::string label;
  if (std_error.data.empty()) {
    page_.remove(id + ":error");
  } else {
    page_.show(id + ":error", live_image(std_error));
    EstimatorResult result;
    result.estimate = image, result.std_error = std_error;
    label = fmt::format("predicted relMSE {:.2g}", predicted_relmse(result));
  }
  return {{"id", id}, {"name", name}, {"label", label}};
}

/// The mean of all films, if they show the same pixels of the same view with different seeds.
Json LiveFiles::show_sum() {
  std::vector<const Film*> films;
  std::vector<std::string> seeds;
  std::set<std::string> views;
  for (const auto& [path, followed] : followed_)
    if (followed.film) {
      films.push_back(&*followed.film);
      views.insert(view_of(followed.attributes));
      seeds.push_back(value_of(followed.attributes, film_key::kSeed));
    }
  std::sort(seeds.begin(), seeds.end());
  const auto differs = [&](const Film* film) {
    return film->width() != films[0]->width() || film->height() != films[0]->height();
  };
  if (films.size() < 2 || views.size() > 1 || std::adjacent_find(seeds.begin(), seeds.end()) != seeds.end() ||
      std::any_of(films.begin(), films.end(), differs))
    return nullptr;
  const MeanAndError all = mean_of_films(films, nullptr);
  return picture("all", "All films", all.mean, all.std_error);
}

void LiveFiles::show() {
  const auto newest = std::max_element(followed_.begin(), followed_.end(), [](const auto& a, const auto& b) {
    return a.second.changed < b.second.changed;
  });
  Json pictures = Json::array();
  problems_.clear();
  for (size_t i = 0; i < kMax; ++i)
    page_.remove(fmt::format("file{}", i)), page_.remove(fmt::format("file{}:error", i));
  page_.remove("all"), page_.remove("all:error");
  if (newest == followed_.end()) return page_.say({{"pictures", pictures}});
  const int width = newest->second.image.width, height = newest->second.image.height;
  page_.say({{"size", Json::array({width, height})}});
  size_t number = 0, place = 0;  // of the newest
  for (const auto& [path, followed] : followed_) {
    const size_t i = number++;
    if (!followed.problem.empty()) problems_.push_back(followed.problem);
    const Image& image = followed.image;
    if (image.data.empty()) continue;
    if (image.width != width || image.height != height)
      problems_.push_back(fmt::format("'{}' has other pixels than '{}' and is not shown", path.filename().string(),
                                      newest->first.filename().string()));
    else
      pictures.push_back(picture(fmt::format("file{}", i), path.stem().string(), image, followed.std_error));
    if (path == newest->first && !pictures.empty()) place = pictures.size() - 1;
  }
  if (Json sum = show_sum(); !sum.is_null())
    pictures.insert(pictures.begin(), std::move(sum));
  else if (!pictures.empty())  // the newest first
    std::rotate(pictures.begin(), pictures.begin() + static_cast<ptrdiff_t>(place),
                pictures.begin() + static_cast<ptrdiff_t>(place) + 1);
  page_.say({{"pictures", pictures}});
}

void LiveFiles::say_state() {
  if (followed_.empty()) return;
  const auto newest = std::max_element(followed_.begin(), followed_.end(), [](const auto& a, const auto& b) {
    return a.second.changed < b.second.changed;
  });
  const Followed& last = newest->second;
  const double age = std::chrono::duration<double>(fs::file_time_type::clock::now() - last.changed).count();
  const bool complete = value_of(last.attributes, film_key::kComplete) != "false";
  std::string resume = value_of(last.attributes, film_key::kCommand);
  if (resume.find("--resume") == std::string::npos) resume += " --resume";
  std::string phase = complete ? "complete" : "being rendered";
  if (!complete && age > kQuiet)
    phase = fmt::format("no change for {:.0f} s; if the render has ended, this continues it: {}", age, resume);
  page_.say({{"phase", phase},
             {"message", fmt::format("{}", fmt::join(problems_, "; "))},
             {"resume", complete ? "" : resume},
             {"facts", Json::array({Json::array({"files", followed_.size()}),
                                    Json::array({"newest", newest->first.filename().string()})})}});
}

void LiveFiles::run(const std::atomic<bool>& stop) {
  while (!stop) {
    look();
    std::this_thread::sleep_for(kPause);
  }
}

}  // namespace covary
