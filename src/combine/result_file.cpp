// SPDX-License-Identifier: Apache-2.0
#include "combine/result_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <optional>
#include <set>
#include <sstream>

#include "core/error.h"
#include "film/exr_copy.h"
#include "film/film_file.h"
#include "film/image_writer.h"

namespace covary {
namespace {

/// Layers of covary's files that describe the samples of their picture, beside the groups.
constexpr const char* kStatistics[] = {"StdError", "Bias",     "variance_in_groups", "samples",
                                       "HistoryA", "HistoryB", "HistoryAlbedo",      "HistoryNormal"};

bool is_statistics(const std::string& channel) {
  std::stringstream parts(channel);  // of which the first may be the name of a part
  for (std::string layer; std::getline(parts, layer, '.');) {
    const bool is_group =
        layer.starts_with("group") && layer.size() > 5 && layer.find_first_not_of("0123456789", 5) == std::string::npos;
    if (is_group || std::find(std::begin(kStatistics), std::end(kStatistics), layer) != std::end(kStatistics))
      return true;
  }
  return false;
}

/// The mean alpha of the renders; empty if the first has none, or all have the same.
std::vector<float> mean_alpha(const ResultSource& source, const std::string& channel) {
  std::vector<float> first;
  std::vector<double> sum;
  bool differs = false;
  for (const std::string& path : source.files) {
    const ExrFile file(path);
    if (!file.find(channel)) return {};
    const CropWindow& window = file.place().window;
    std::vector<float> alpha(static_cast<size_t>(window.width) * static_cast<size_t>(window.height));
    const ExrPlane plane{channel, ExrPlane::Type::kFloat, alpha.data(), sizeof(float)};
    file.read({&plane, 1});
    if (first.empty()) first = alpha, sum.resize(alpha.size());
    if (sum.size() != alpha.size()) return {};
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += alpha[i], differs |= alpha[i] != first[i];
  }
  if (!differs) return {};
  const auto n = static_cast<double>(source.files.size());
  for (size_t i = 0; i < sum.size(); ++i) first[i] = static_cast<float>(sum[i] / n);
  return first;
}

/// Changes of a file, and what their planes point to.
class NewVersion {
 public:
  NewVersion(const std::map<std::string, std::string>& attributes, const ResultSource& source)
      : file_(source.files[0]) {
    changes_.attributes = attributes;
    changes_.picture = file_.find(source.picture[0]) ? source.picture[0] : "";
    changes_.left_out = statistics_channels(file_);
  }

  void add(EstimatorResult& result, std::map<std::string, Image>& aovs, const ResultSource& source) {
    changes_.left_out.insert(source.used.begin(), source.used.end());
    add_planes(source.picture, result.estimate);
    if (!result.std_error.data.empty()) add_image_planes(source.prefix + "StdError", result.std_error, changes_.planes);
    if (!result.bias.data.empty()) add_image_planes(source.prefix + "Bias", result.bias, changes_.planes);
    const std::vector<ColourLayer> layers = colour_layers(file_.channels());
    for (auto& [name, image] : aovs) {
      const auto old =
          std::find_if(layers.begin(), layers.end(), [&, &name = name](const auto& l) { return l.name == name; });
      if (old != layers.end() && image.channels == 3)
        add_planes(old->channels, image);
      else
        add_image_planes((file_.find(name) ? "" : source.prefix) + name, image, changes_.planes);
    }
    const std::string alpha = alpha_channel(file_.channels(), source.picture[0]);
    if (source.files.size() < 2 || alpha.empty() || aovs.contains(alpha)) return;
    std::vector<float>& mean = alphas_.emplace_back(mean_alpha(source, alpha));
    if (!mean.empty()) changes_.planes.push_back({alpha, ExrPlane::Type::kFloat, mean.data(), sizeof(float)});
  }

  std::vector<std::string> write(const std::string& path, const std::string& source) const {
    return write_changed_exr(path, source, changes_);
  }

 private:
  /// The planes of an image whose channels have these names; of grey, one channel with the mean.
  void add_planes(const std::array<std::string, 3>& names, Image& image) {
    if (names[0] != names[2]) {
      for (size_t c = 0; c < 3; ++c)
        changes_.planes.push_back({names[c], ExrPlane::Type::kFloat, image.data.data() + c, 3 * sizeof(float)});
      return;
    }
    Image& grey = greys_.emplace_back(image.width, image.height, 1);
    for (size_t i = 0; i < grey.data.size(); ++i)
      grey.data[i] = (image.data[3 * i] + image.data[3 * i + 1] + image.data[3 * i + 2]) / 3;
    add_image_planes(names[0], grey, changes_.planes);
  }

  const ExrFile file_;
  ExrChanges changes_;
  std::deque<Image> greys_;
  std::deque<std::vector<float>> alphas_;
};

}  // namespace

std::set<std::string> statistics_channels(const ExrFile& file) {
  std::set<std::string> names;
  if (!file.attributes().contains(std::string("covary:") + film_key::kVersion)) return names;
  for (const ExrFile::Channel& channel : file.channels())
    if (is_statistics(channel.name)) names.insert(channel.name);
  return names;
}

std::map<std::string, std::string> prediction_attributes(const std::optional<PredictedError>& predicted) {
  std::map<std::string, std::string> attributes;
  if (!predicted) return attributes;
  attributes[film_key::kPredicted] = fmt::format("{:.4g}", predicted->relmse);
  if (const std::optional<PredictedBounds>& bounds = predicted->bounds)
    attributes[film_key::kPredictedBounds] = fmt::format("{:.4g} {:.4g}", bounds->low, bounds->high);
  if (!predicted->doubt.empty()) attributes[film_key::kPredictionDoubt] = predicted->doubt;
  return attributes;
}

std::vector<std::string> write_result(const std::string& path, const ImagePlace& place,
                                      const std::map<std::string, std::string>& attributes, EstimatorResult& result,
                                      std::map<std::string, Image>& aovs, const ResultSource& source) {
  const CropWindow& window = place.window;
  if (window.width != result.estimate.width || window.height != result.estimate.height)
    throw Error(ErrorCode::kUsage,
                fmt::format("'{}': the place has {} x {} pixels, the image {} x {}", path, window.width, window.height,
                            result.estimate.width, result.estimate.height));
  if (const std::string ending = lower_extension(path); !ending.empty() && ending != ".exr")
    throw Error(ErrorCode::kUsage, fmt::format("'{}': results are EXR files (.exr); write_image() writes pictures of "
                                               "other formats",
                                               path));
  std::map<std::string, std::string> all = attributes;
  const auto predicted = predicted_error(result, std::numeric_limits<double>::infinity(), 0);
  for (const auto& [key, value] : prediction_attributes(predicted)) all["covary:" + key] = value;
  if (!source.files.empty() && is_exr_image(source.files[0])) {
    NewVersion version(all, source);
    version.add(result, aovs, source);
    return version.write(path, source.files[0]);
  }
  std::vector<ExrPlane> planes;
  add_image_planes("", result.estimate, planes);
  if (!result.std_error.data.empty()) add_image_planes("StdError", result.std_error, planes);
  if (!result.bias.data.empty()) add_image_planes("Bias", result.bias, planes);
  for (auto& [name, image] : aovs) add_image_planes(name, image, planes);
  write_exr(path, place, all, planes);
  return {};
}

std::vector<std::string> write_results(const std::string& path, const std::map<std::string, std::string>& attributes,
                                       std::vector<ResultPicture>& pictures) {
  NewVersion version(attributes, pictures[0].source);
  for (ResultPicture& picture : pictures) version.add(picture.image, picture.aovs, picture.source);
  return version.write(path, pictures[0].source.files[0]);
}

}  // namespace covary
