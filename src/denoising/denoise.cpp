// SPDX-License-Identifier: Apache-2.0
#include "denoising/denoise.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "core/detached_work.h"
#include "core/error.h"
#include "filters/stray_values.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLibrary = "libOpenImageDenoise.so.2";

/// The part of the library's C interface (version 2) that is used here; handles are opaque.
struct Api {
  static constexpr int kDeviceCpu = 1, kFormatFloat3 = 3, kBalancedQuality = 5;
  void* (*new_device)(int type) = nullptr;
  void (*commit_device)(void* device) = nullptr;
  void (*release_device)(void* device) = nullptr;
  void (*set_device_int)(void* device, const char* name, int value) = nullptr;
  int (*get_device_int)(void* device, const char* name) = nullptr;
  int (*device_error)(void* device, const char** message) = nullptr;
  void* (*new_filter)(void* device, const char* type) = nullptr;
  void (*set_image)(void* filter, const char* name, void* data, int format, size_t width, size_t height,
                    size_t byte_offset, size_t pixel_stride, size_t row_stride) = nullptr;
  void (*set_bool)(void* filter, const char* name, bool value) = nullptr;
  void (*set_int)(void* filter, const char* name, int value) = nullptr;
  /// Calls `question` while the filter runs; the filter stops once it returns false.
  void (*set_progress)(void* filter, bool (*question)(void* data, double done), void* data) = nullptr;
  void (*commit_filter)(void* filter) = nullptr;
  void (*execute_filter)(void* filter) = nullptr;
  void (*release_filter)(void* filter) = nullptr;
  // Only of a library with devices of CUDA, whose images are in buffers:
  bool (*is_cuda_supported)(int number) = nullptr;
  void* (*new_cuda_device)(const int* numbers, void* const* streams, int count) = nullptr;
  void* (*new_buffer)(void* device, size_t bytes) = nullptr;
  void (*write_buffer)(void* buffer, size_t offset, size_t bytes, const void* from) = nullptr;
  void (*read_buffer)(void* buffer, size_t offset, size_t bytes, void* to) = nullptr;
  void (*release_buffer)(void* buffer) = nullptr;
  void (*set_image_in_buffer)(void* filter, const char* name, void* buffer, int format, size_t width, size_t height,
                              size_t byte_offset, size_t pixel_stride, size_t row_stride) = nullptr;

  bool has_cuda(int number) const {
    return number >= 0 && is_cuda_supported && new_cuda_device && new_buffer && write_buffer && read_buffer &&
           release_buffer && set_image_in_buffer && is_cuda_supported(number);
  }
};

/// Where the Python wheel `pyoidn` puts the library, from the root of an environment downwards; a star matches any
/// suffix.
constexpr std::array<const char*, 6> kWheelFolders = {"lib", "python3*", "*-packages", "pyoidn", "oidn", "lib"};

bool matches(const std::string& name, std::string_view pattern) {
  const size_t star = pattern.find('*');
  if (star == std::string_view::npos) return name == pattern;
  const std::string_view before = pattern.substr(0, star), after = pattern.substr(star + 1);
  return name.size() >= before.size() + after.size() && name.starts_with(before) && name.ends_with(after);
}

/// Finds the library in `folder` or, below it, along the wheel's folders from number `first` on.
void find_along_wheel(const fs::path& folder, size_t first, std::vector<std::string>& found) {
  std::error_code ignored;
  if (first == kWheelFolders.size()) {
    if (fs::exists(folder / kLibrary, ignored)) found.push_back((folder / kLibrary).string());
    return;
  }
  std::vector<fs::path> below;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
    if (matches(entry.path().filename().string(), kWheelFolders[first])) below.push_back(entry.path());
  std::sort(below.begin(), below.end());
  for (const fs::path& next : below) find_along_wheel(next, first + 1, found);
}

/// The libraries that a user's path may mean: the path may be a library, its folder, or any folder of the wheel above
/// it, up to the environment's root.
std::vector<std::string> libraries_at(const std::string& path) {
  std::vector<std::string> found;
  if (!fs::is_directory(path)) return {path};
  for (size_t first = kWheelFolders.size() + 1; first-- > 0;) find_along_wheel(path, first, found);
  if (found.empty()) found.push_back((fs::path(path) / kLibrary).string());  // for the message
  return found;
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

/// The site-packages folder that contains this code if pip installed it, otherwise "".
fs::path own_packages() {
  Dl_info info{};
  if (!dladdr(reinterpret_cast<const void*>(&own_packages), &info) || !info.dli_fname) return {};
  fs::path folder = fs::path(info.dli_fname).parent_path();
  while (folder.has_relative_path() && !matches(folder.filename().string(), kWheelFolders[2]))
    folder = folder.parent_path();
  return folder.has_relative_path() ? folder : fs::path();
}

/// Possible locations of the library, in order. The loader searches for a name without a folder.
std::vector<std::string> candidates(const DenoiseOptions& options) {
  if (!options.library.empty()) return libraries_at(options.library);
  if (const std::string path = environment("COVARY_OIDN"); !path.empty()) return libraries_at(path);
  std::vector<std::string> all;
  if (const fs::path packages = own_packages(); !packages.empty()) find_along_wheel(packages, 3, all);
  all.push_back(kLibrary);
  for (const char* name : {"VIRTUAL_ENV", "CONDA_PREFIX"})
    if (const std::string path = environment(name); !path.empty()) find_along_wheel(path, 0, all);
  if (const std::string home = environment("HOME"); !home.empty()) find_along_wheel(fs::path(home) / ".local", 0, all);
  find_along_wheel("/usr/local", 0, all);
  find_along_wheel("/usr", 0, all);
  return all;
}

struct LibraryFile {
  std::string path;
  void* handle = nullptr;
};

/// The library stays loaded until the program ends, because its threads and ours may share a scheduler.
LibraryFile open_library(const DenoiseOptions& options, std::string& why) {
  for (const std::string& path : candidates(options)) {
    if (void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) return {path, handle};
    why = dlerror();
  }
  return {};
}

template <typename Function>
void bind_if_any(const LibraryFile& library, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(library.handle, name));
}

template <typename Function>
void bind(const LibraryFile& library, const char* name, Function& function) {
  bind_if_any(library, name, function);
  if (!function)
    throw Error(ErrorCode::kIo,
                fmt::format("{} has no function {}; version 2 of Open Image Denoise is needed", library.path, name));
}

Api load(const DenoiseOptions& options, std::string* path = nullptr) {
  std::string why;
  const LibraryFile library = open_library(options, why);
  if (!library.handle)
    throw Error(
        ErrorCode::kUsage,
        fmt::format(
            "Open Image Denoise was not found ({}); install it with `pip install pyoidn`, or name {}, its "
            "folder or the Python environment that holds it with `oidn` or the environment variable COVARY_OIDN",
            why, kLibrary));
  if (path) *path = library.path;
  Api api;
  bind(library, "oidnNewDevice", api.new_device);
  bind(library, "oidnSetDeviceInt", api.set_device_int);
  bind(library, "oidnGetDeviceInt", api.get_device_int);
  bind(library, "oidnCommitDevice", api.commit_device);
  bind(library, "oidnReleaseDevice", api.release_device);
  bind(library, "oidnGetDeviceError", api.device_error);
  bind(library, "oidnNewFilter", api.new_filter);
  bind(library, "oidnSetSharedFilterImage", api.set_image);
  bind(library, "oidnSetFilterBool", api.set_bool);
  bind(library, "oidnSetFilterInt", api.set_int);
  bind(library, "oidnSetFilterProgressMonitorFunction", api.set_progress);
  bind(library, "oidnCommitFilter", api.commit_filter);
  bind(library, "oidnExecuteFilter", api.execute_filter);
  bind(library, "oidnReleaseFilter", api.release_filter);
  bind_if_any(library, "oidnIsCUDADeviceSupported", api.is_cuda_supported);
  bind_if_any(library, "oidnNewCUDADevice", api.new_cuda_device);
  bind_if_any(library, "oidnNewBuffer", api.new_buffer);
  bind_if_any(library, "oidnWriteBuffer", api.write_buffer);
  bind_if_any(library, "oidnReadBuffer", api.read_buffer);
  bind_if_any(library, "oidnReleaseBuffer", api.release_buffer);
  bind_if_any(library, "oidnSetFilterImage", api.set_image_in_buffer);
  return api;
}

void check_size(const char* name, const Image& rgb, const Image* feature) {
  if (feature && (feature->width != rgb.width || feature->height != rgb.height || feature->channels != 3))
    throw Error(
        ErrorCode::kInput,
        fmt::format(
            "denoise: the {} is {} x {} with {} channels, the image {} x {}; expected 3 channels and the same size",
            name, feature->width, feature->height, feature->channels, rgb.width, rgb.height));
}

/// The image with 0 in place of values that are not finite.
std::shared_ptr<const Image> finite(const std::shared_ptr<const Image>& image) {
  const auto is_bad = [](float v) { return !std::isfinite(v); };
  if (!image || std::none_of(image->data.begin(), image->data.end(), is_bad)) return image;
  const auto copy = std::make_shared<Image>(*image);
  std::replace_if(copy->data.begin(), copy->data.end(), is_bad, 0.0f);
  return copy;
}

std::shared_ptr<const Image> copy_of(const Image* image) {
  return image ? std::make_shared<const Image>(*image) : nullptr;
}

void check_images(const Image& rgb, const Image* albedo, const Image* normal) {
  if (rgb.width < 1 || rgb.height < 1 || rgb.channels != 3)
    throw Error(ErrorCode::kInput, fmt::format("denoise: the image is {} x {} with {} channels; expected 3 channels",
                                               rgb.width, rgb.height, rgb.channels));
  check_size("albedo", rgb, albedo);
  check_size("normal", rgb, normal);
  if (normal && !albedo) throw Error(ErrorCode::kInput, "denoise: a normal without an albedo; the denoiser needs both");
}

}  // namespace

std::string find_denoiser(const DenoiseOptions& options) {
  std::string why;
  return open_library(options, why).path;
}

void check_named_denoiser(const DenoiseOptions& options) {
  const std::string named = environment("COVARY_OIDN");
  if (named.empty() || !options.library.empty() || !find_denoiser(options).empty()) return;
  throw Error(ErrorCode::kUsage,
              fmt::format("the environment variable COVARY_OIDN is '{}', where Open Image Denoise is "
                          "not found; unset it, or `oidn` off does without",
                          named));
}

bool runs_on_cuda(const DenoiseOptions& options) { return load(options).has_cuda(options.cuda_device); }

struct Denoiser::Library {
  std::string path;
  Api api;
  bool is_on_cuda;
  std::unique_ptr<void, void (*)(void*)> device;

  explicit Library(const DenoiseOptions& options)
      : api(load(options, &path)),
        is_on_cuda(api.has_cuda(options.cuda_device)),
        device(is_on_cuda ? cuda_device(options.cuda_device) : api.new_device(Api::kDeviceCpu), api.release_device) {
    check();
    if (!is_on_cuda) use_processor();
    api.commit_device(device.get());
    check();
  }

  void* cuda_device(int number) const {
    void* const usual_stream = nullptr;
    return api.new_cuda_device(&number, &usual_stream, 1);
  }
  void use_processor() const {
    const auto threads = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    api.set_device_int(device.get(), "numThreads", static_cast<int>(threads));
    // Pinned threads of two processes on one machine would compete for the same cores.
    api.set_device_int(device.get(), "setAffinity", 0);
  }

  void check() const {
    const char* message = nullptr;
    if (api.device_error(device.get(), &message) != 0 || !device)
      throw Error(ErrorCode::kIo, fmt::format("Open Image Denoise: {}", message ? message : "no device"));
  }
};

namespace {

/// One run of the filter "RT". It owns everything that the library accesses, because its thread may outlive the caller:
/// the library cannot be stopped within a layer of the network (half a second or more on large images).
struct Run {
  std::shared_ptr<const Denoiser::Library> library;
  std::vector<std::pair<const char*, std::shared_ptr<const Image>>> inputs;  ///< by the filter's names; at least one
  bool hdr = false, clean_features = false, small_network = false;
  Image result;
  std::atomic<bool> cancelled{false};

  /// Throws Error(kIo) if the library fails or was cancelled.
  void execute() {
    const Api& api = library->api;
    // The library stores errors per thread.
    void* const device = library->device.get();
    const std::unique_ptr<void, void (*)(void*)> filter(api.new_filter(device, "RT"), api.release_filter);
    library->check();
    std::vector<std::unique_ptr<void, void (*)(void*)>> buffers;
    const auto bytes = [](const Image& image) { return image.data.size() * sizeof(float); };
    const auto set = [&](const char* name, const Image& image) {
      if (library->is_on_cuda) {
        void* const buffer = buffers.emplace_back(api.new_buffer(device, bytes(image)), api.release_buffer).get();
        library->check();
        api.set_image_in_buffer(filter.get(), name, buffer, Api::kFormatFloat3, image.width, image.height, 0, 0, 0);
      } else {
        void* const pixels = const_cast<float*>(image.data.data());  // the library does not write to its inputs
        api.set_image(filter.get(), name, pixels, Api::kFormatFloat3, image.width, image.height, 0, 0, 0);
      }
    };
    for (const auto& [name, image] : inputs) {
      set(name, *image);
      if (library->is_on_cuda) api.write_buffer(buffers.back().get(), 0, bytes(*image), image->data.data());
    }
    result = Image(inputs.front().second->width, inputs.front().second->height, 3);
    set("output", result);
    if (hdr) api.set_bool(filter.get(), "hdr", true);
    if (clean_features) api.set_bool(filter.get(), "cleanAux", true);
    if (small_network) api.set_int(filter.get(), "quality", Api::kBalancedQuality);
    api.set_progress(
        filter.get(), [](void* data, double) { return !static_cast<std::atomic<bool>*>(data)->load(); }, &cancelled);
    api.commit_filter(filter.get());
    library->check();
    api.execute_filter(filter.get());
    library->check();
    if (!library->is_on_cuda) return;
    api.read_buffer(buffers.back().get(), 0, bytes(result), result.data.data());
    library->check();
  }
};

/// The result; throws Stopped as soon as the enclosing work is stopped.
Image image_of(const std::shared_ptr<Run>& run) {
  run_detached([run] { run->execute(); }, [run] { run->cancelled = true; });
  return std::move(run->result);
}

}  // namespace

void check_feature(const std::string& name, const Image& feature) {
  const auto it = std::find_if(feature.data.begin(), feature.data.end(), [](float v) { return !std::isfinite(v); });
  if (it == feature.data.end()) return;
  const auto pixel = static_cast<int>((it - feature.data.begin()) / feature.channels);
  throw Error(ErrorCode::kInput, fmt::format("{} holds the value {} at pixel ({}, {}); all values of auxiliary "
                                             "features must be finite",
                                             name, *it, pixel % feature.width, pixel / feature.width));
}

Denoiser::Denoiser(const DenoiseOptions& options) : library_(std::make_shared<Library>(options)) {}
Denoiser::~Denoiser() = default;

Image Denoiser::denoise(Image rgb, const Image* albedo, const Image* normal, bool clean_features) {
  return denoise(std::move(rgb), copy_of(albedo), copy_of(normal), clean_features);
}

Image Denoiser::denoise(Image rgb, std::shared_ptr<const Image> albedo, std::shared_ptr<const Image> normal,
                        bool clean_features) {
  check_images(rgb, albedo.get(), normal.get());
  const auto run = std::make_shared<Run>();
  run->library = library_, run->hdr = true, run->clean_features = clean_features && albedo;
  run->inputs.emplace_back("color", std::make_shared<const Image>(with_usable_values(std::move(rgb))));
  if (albedo) run->inputs.emplace_back("albedo", finite(albedo));
  if (normal) run->inputs.emplace_back("normal", finite(normal));
  ++runs_;
  return image_of(run);
}

Image Denoiser::denoise_feature(const std::string& name, Image feature) {
  COVARY_CHECK(name == "albedo" || name == "normal", "a feature is an albedo or a normal");
  check_images(feature, nullptr, nullptr);
  const auto run = std::make_shared<Run>();
  run->library = library_;
  run->inputs.emplace_back(name == "albedo" ? "albedo" : "normal",
                           finite(std::make_shared<const Image>(std::move(feature))));
  run->small_network = true;
  ++runs_;
  return image_of(run);
}

Image denoise(const Image& rgb, const Image* albedo, const Image* normal, const DenoiseOptions& options) {
  check_images(rgb, albedo, normal);
  return Denoiser(options).denoise(rgb, albedo, normal);
}

DenoiserInfo denoiser_info(const DenoiseOptions& options) {
  DenoiserInfo info;
  const Api api = load(options, &info.path);
  const std::unique_ptr<void, void (*)(void*)> device(api.new_device(Api::kDeviceCpu), api.release_device);
  const int version = device ? api.get_device_int(device.get(), "version") : 0;
  if (version == 0) throw Error(ErrorCode::kIo, "Open Image Denoise: no processor device");
  info.version = fmt::format("{}.{}.{}", version / 10000, version / 100 % 100, version % 100);
  return info;
}

}  // namespace covary
