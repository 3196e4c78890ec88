// SPDX-License-Identifier: Apache-2.0
#include "stages.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "commands.h"
#include "core/error.h"
#include "declared_options.h"
#include "film/image_writer.h"
#include "metrics/error_map.h"
#include "value_names.h"

namespace covary {
namespace {

/// Linear RGB of an image of one channel.
Image coloured(Image map) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (float& value : map.data) {
    if (!std::isfinite(value)) value = std::numeric_limits<float>::quiet_NaN();
    if (value > 0) least = std::min<double>(least, value);
    if (value > 0) most = std::max<double>(most, value);
  }
  const bool is_wide = most > 100 * least;
  return colour_errors(map, is_wide ? decade_scale({&map, 1}) : ErrorScale{0, most > 0 ? most : 1, false});
}

}  // namespace

void add_stages_option(CLI::App& command, std::string& folder) {
  add_value(command, "--save-stages", folder, kFolderValue,
            "Folder for images of each step (EXR and PNG), if the estimator has steps");
}

void check_stages(const std::string& folder, const Method& estimator) {
  if (!folder.empty() && !estimator.stages)
    throw Error(ErrorCode::kUsage, "--save-stages: " + estimator.name + " has no single steps to show");
}

void save_stages(const std::string& folder, const Method& method, const Samples& samples,
                 const MethodSettings& settings, const ImagePlace& place) {
  if (folder.empty()) return;
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) throw Error(ErrorCode::kIo, "--save-stages '" + folder + "': " + failed.message());
  for (auto& [name, image] : method.stages(samples, settings)) {
    const std::string path = (std::filesystem::path(folder) / name).string();
    std::vector<ExrPlane> planes;
    if (image.channels == 3)
      add_image_planes("", image, planes);
    else
      planes.push_back({"Y", ExrPlane::Type::kFloat, image.data.data(), sizeof(float)});
    write_exr(path + ".exr", place, {{"covary:version", COVARY_VERSION}, {"covary:command", command_line()}}, planes);
    write_png(path + ".png", image.channels == 3 ? image : coloured(image));
  }
}

}  // namespace covary
