// SPDX-License-Identifier: Apache-2.0
#include "film/outputs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "film/image_file.h"
#include "film/image_writer.h"
#include "imageio/output_file.h"
#include "imageio/output_folder.h"

namespace covary {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void usage(const std::string& message) { throw Error(ErrorCode::kUsage, message); }

bool ends_in(const std::string& path, const std::vector<std::string>& extensions) {
  return std::find(extensions.begin(), extensions.end(), lower_extension(path)) != extensions.end();
}

void check_extension(const std::string& option, const std::string& path, OutputKind kind) {
  const auto require = [&](const std::vector<std::string>& extensions, const std::string& more) {
    if (!ends_in(path, extensions))
      usage(fmt::format("{} '{}': the name must end in {}{}", option, path, fmt::join(extensions, ", "), more));
  };
  switch (kind) {
    case OutputKind::kFilm:
      return require({".exr"}, "; 'covary convert' makes PNG, HDR, PFM, JPEG and TIFF of it");
    case OutputKind::kImage:
      return require(image_extensions(), "");
    case OutputKind::kPng:
      return require({".png"}, "");
    case OutputKind::kScene:
      return require({".xml"}, "");
    case OutputKind::kPage:
      return require({".html", ".htm"}, "");
    case OutputKind::kText:
      if (ends_in(path, image_extensions()) ||
          ends_in(path, {".xml", ".pbrt", ".gltf", ".glb", ".html", ".htm", ".ply", ".obj", ".serialized"}))
        usage(
            fmt::format("{0} '{1}' names an image, a page or part of a scene; give {0}=- for standard output, or the "
                        "name of a text file",
                        option, path));
  }
}

/// Whether the bytes of `text` are somewhere in the file.
bool holds(const std::string& path, std::string_view text) {
  std::ifstream file(path, std::ios::binary);
  std::string block;
  for (std::vector<char> next(size_t{1} << 20); file;) {
    file.read(next.data(), static_cast<std::streamsize>(next.size()));
    block.append(next.data(), static_cast<size_t>(file.gcount()));
    if (block.find(text) != std::string::npos) return true;
    block.erase(0, block.size() - std::min(block.size(), text.size()));
  }
  return false;
}

}  // namespace

bool is_made_by(const std::string& path, const std::string& command) {
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored) && fs::file_size(path, ignored) == 0) return true;
  if (ends_in(path, {".png"})) return is_own_png(path);
  if (ends_in(path, {".mp4", ".mkv", ".mov", ".webm"})) return holds(path, kMadeByCovary);
  try {
    const std::map<std::string, std::string> attributes = inspect_image(path, ChecksumPolicy::kIgnore).attributes;
    const auto text = [&](const char* key) {
      const auto found = attributes.find(key);
      return found == attributes.end() ? std::string() : found->second;
    };
    return is_exr_image(path) ? text("covary:command").starts_with("covary " + command + " ")
                              : text("Software") == "covary";
  } catch (const Error&) {
    return false;  // damaged, or something else under this name
  }
}

bool is_render(const std::string& path) {
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored) && fs::file_size(path, ignored) == 0) return true;
  try {
    return inspect_image(path, ChecksumPolicy::kIgnore).attributes.contains("covary:scene_hash");
  } catch (const Error&) {
    return false;  // damaged, or something else under this name
  }
}

bool Outputs::identify(const std::string& path, Identity& identity) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0) {
    identity = {status.st_dev, status.st_ino, ""};
    return !S_ISCHR(status.st_mode);  // /dev/null may be used twice
  }
  const fs::path target = output_target(path).path;
  if (stat(target.has_parent_path() ? target.parent_path().c_str() : ".", &status) != 0) return false;
  identity = {status.st_dev, status.st_ino, target.filename().string()};
  return true;
}

void Outputs::reads(const std::string& path) {
  std::error_code ignored;
  Entry entry{"", path, {}};
  if (!fs::exists(path, ignored) || !identify(path, entry.identity)) return;
  for (const Entry& output : outputs_)
    if (output.identity == entry.identity)
      usage(
          fmt::format("{} '{}' is a file that the same command reads; give another name", output.option, output.path));
  inputs_.push_back(entry);
}

void Outputs::reads(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) reads(path);
}

void Outputs::writes(const std::string& option, const std::string& path, OutputKind kind) {
  if (kind == OutputKind::kText && (path.empty() || path == "-")) return;
  if (const std::string folder = fs::path(path).parent_path().string(); is_missing_folder(folder)) {
    check_extension(option, path, kind);
    make_output_folder(folder);
  }
  const OutputTarget target = output_target(path);
  if (!target.is_special) check_extension(option, path, kind);
  try_output(target);
  Entry entry{option, path, {}};
  if (!identify(path, entry.identity)) return;
  for (const Entry& input : inputs_)
    if (input.identity == entry.identity)
      usage(fmt::format("{} '{}' is a file that the same command reads; give another name", option, path));
  for (const Entry& output : outputs_)
    if (output.identity == entry.identity)
      usage(fmt::format("{} '{}' and {} '{}' are the same file", output.option, output.path, option, path));
  outputs_.push_back(entry);
}

void Outputs::writes_result(const std::string& option, const std::string& path, OutputKind kind,
                            const std::string& command, bool overwrite) {
  writes(option, path, kind);
  std::error_code ignored;
  if (overwrite || !fs::is_regular_file(path, ignored) || output_target(path).is_special || is_made_by(path, command))
    return;
  usage(
      fmt::format("{} '{}' already exists, and 'covary {}' did not make it; give another name, or --overwrite to "
                  "replace it",
                  option, path, command));
}

void Outputs::writes_derived_png(const std::string& option, const std::string& path, const std::string& remedy) {
  writes(option, path, OutputKind::kPng);
  std::error_code ignored;
  // Only regular files are opened: a pipe would block waiting for a writer.
  if (fs::exists(path, ignored) && !(fs::is_regular_file(path, ignored) && is_own_png(path)))
    usage(fmt::format("{} would replace '{}', which covary did not make; {}", option, path, remedy));
}

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return fs::equivalent(a, b, ignored) && !ignored;
}

}  // namespace covary
