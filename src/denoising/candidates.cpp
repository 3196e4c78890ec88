// SPDX-License-Identifier: Apache-2.0
#include "denoising/candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "core/error.h"
#include "denoising/mirrored_halves.h"
#include "denoising/part_features.h"
#include "filters/residual_correction.h"

namespace covary {
namespace {

/// The smallest albedo to divide by.
constexpr float kMinAlbedo = 0.02f;
/// In feature_of_light(): the albedo of a pixel that reflects nothing, and its feature.
constexpr float kBlackAlbedo = 0.004f, kFarFromNormals = 1000;

/// Copies an image's channels, divided by `unit`, to the planes from index `first` on.
void copy_feature(const Image& image, float unit, int first, Planes& planes) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) planes.row(first + c, y)[x] = image.pixel(x, y)[c] / unit;
}

/// operation(a, b) for each pair of values.
template <typename Operation>
Image combined(const Image& a, const Image& b, const Operation& operation) {
  Image result = a;
  std::transform(a.data.begin(), a.data.end(), b.data.begin(), result.data.begin(), operation);
  return result;
}

struct FilterFeatures : RegressionFeatures {
  Planes all, of_light;
  Image albedo;  // at least kMinAlbedo; empty where there is none
  WantedRows wanted;
};

FilterFeatures filter_features(const Features& features, FilterKinds kinds) {
  FilterFeatures result{regression_features(features, kinds)};
  const auto planes = [&](const Image& like, int count) {
    return Planes(like.width, like.height, count, kNlMeansRadius, 0.0f);
  };
  if (!features.albedo) return result;
  result.all = planes(*features.albedo, features.normal ? 6 : 3);
  copy_feature(*features.albedo, kAlbedoUnit, 0, result.all);
  result.albedo = *features.albedo;
  for (float& value : result.albedo.data) value = std::max(value, kMinAlbedo);
  result.of_light = planes(*features.albedo, 3);
  copy_feature(feature_of_light(features), kNormalUnit, 0, result.of_light);
  if (!features.normal) return result;
  copy_feature(*features.normal, kNormalUnit, 3, result.all);
  return result;
}

const Planes* or_null(const Planes& planes) { return planes.count() > 0 ? &planes : nullptr; }

/// The sources filtered by regression; `others`: their images by another filter. Coarse for halves, which serve only to
/// find weights.
std::vector<Image> regressed(const FilterFeatures& features, const CandidateInput& in,
                             std::vector<const Image*> sources, std::span<const Image> others) {
  RegressionInput input{in.estimate,       in.std_error, std::move(sources), {},
                        features.position, in.part > 0,  features.wanted};
  for (const Image& other : others) input.others.push_back(&other);
  return regressed(input, features.features, *in.valid);
}

/// The candidates of each input.
std::vector<std::vector<Image>> filtered(const FilterFeatures& features, CandidateBase base,
                                         std::span<const CandidateInput> inputs) {
  std::vector<std::vector<Image>> all(inputs.size());
  std::vector<NlMeansSteering> steerings;
  std::vector<Image> images;
  if (features.nl_means) {
    for (const CandidateInput& in : inputs) {
      std::vector<const Image*> sharp = {in.estimate};
      if (base == CandidateBase::kPair) sharp.push_back(in.independent);
      steerings.push_back({in.estimate, in.std_error, {{kSharpBandwidth, sharp}, {kSmoothBandwidth, {in.estimate}}}});
    }
    images = nl_means(steerings, or_null(features.all), *inputs[0].valid, features.wanted);
    const size_t n = images.size() / inputs.size();
    for (size_t i = 0; i < images.size(); ++i) all[i / n].push_back(std::move(images[i]));
    if (features.albedo.data.empty()) return all;
    steerings.clear();
  }
  std::deque<Image> demodulated;
  for (const CandidateInput& in : inputs) {
    const Image& image = demodulated.emplace_back(combined(*in.estimate, features.albedo, std::divides<>()));
    const Image& error = demodulated.emplace_back(combined(*in.std_error, features.albedo, std::divides<>()));
    steerings.push_back({&image, &error, {{kSharpBandwidth, {&image}}}});
  }
  images = nl_means(steerings, or_null(features.of_light), *inputs[0].valid, features.wanted);
  demodulated.clear(), steerings.clear();
  for (size_t i = 0; i < all.size(); ++i) {
    all[i].push_back(combined(images[i], features.albedo, std::multiplies<>()));
    if (!features.features.empty())
      all[i].insert(all[i].begin(), regressed(features, inputs[i], {inputs[i].estimate}, {&all[i].back(), 1})[0]);
  }
  return all;
}

/// Filters layers with the weights of each candidate.
std::vector<std::vector<Image>> filtered_layers(const FilterFeatures& features, const CandidateInput& in,
                                                std::span<const Image> layers) {
  const auto n = static_cast<ptrdiff_t>(layers.size());
  std::vector<const Image*> sources;
  for (const Image& layer : layers) sources.push_back(&layer);
  std::vector<NlMeansSteering> steerings;
  std::vector<Image> images;
  std::vector<std::vector<Image>> all;
  if (features.nl_means) {
    steerings = {{in.estimate, in.std_error, {{kSharpBandwidth, sources}, {kSmoothBandwidth, sources}}}};
    images = nl_means(steerings, or_null(features.all), *in.valid, features.wanted);
    all.emplace_back(images.begin(), images.begin() + n);
    all.emplace_back(images.begin() + n, images.end());
    if (features.albedo.data.empty()) return all;
  }
  std::deque<Image> demodulated;
  for (const Image* source : {in.estimate, in.std_error})
    demodulated.push_back(combined(*source, features.albedo, std::divides<>()));
  std::vector<const Image*> without_albedo;
  for (const Image& layer : layers)
    without_albedo.push_back(&demodulated.emplace_back(combined(layer, features.albedo, std::divides<>())));
  steerings = {{&demodulated[0], &demodulated[1], {{kSharpBandwidth, without_albedo}}}};
  images = nl_means(steerings, or_null(features.of_light), *in.valid, features.wanted);
  for (Image& image : images) image = combined(image, features.albedo, std::multiplies<>());
  all.push_back(std::move(images));
  if (!features.features.empty()) all.insert(all.begin(), regressed(features, in, sources, all.back()));
  return all;
}

/// Open Image Denoise with features that it prefilters unless they are clean.
class NetworkWithFeatures {
 public:
  NetworkWithFeatures(const Features& features, const DenoiseOptions& options)
      : denoiser_(options), features_(features) {}

  int runs() const { return denoiser_.runs(); }
  /// `image`: of all samples or a half (CandidateInput::part), already mirrored.
  Image denoise(Image image, Mirror mirror = Mirror::kNone, int part = 0) {
    prepare_features(part);
    const auto turned = [&](const std::shared_ptr<const Image>& feature) {
      return feature && mirror != Mirror::kNone ? std::make_shared<const Image>(mirrored(*feature, mirror)) : feature;
    };
    return denoiser_.denoise(std::move(image), turned(albedo_), turned(normal_), true);
  }

 private:
  void prepare_features(int part) {
    const int wanted = features_.differences ? part : 0;
    if (std::exchange(prepared_, wanted) == wanted) return;
    albedo_.reset(), normal_.reset();
    const bool is_behind = network_features(features_).albedo == features_.denoising_albedo;
    const auto clean = [&](const char* name, feature::Index kind) -> std::shared_ptr<const Image> {
      if (!(features_.*kImagesOfFeatures[kind])) return nullptr;
      Image feature = feature_of_part(features_, kind, wanted);
      return std::make_shared<const Image>(features_.clean ? std::move(feature)
                                                           : denoiser_.denoise_feature(name, std::move(feature)));
    };
    albedo_ = clean("albedo", is_behind ? feature::kDenoisingAlbedo : feature::kAlbedo);
    if (albedo_) normal_ = clean("normal", is_behind ? feature::kDenoisingNormal : feature::kNormal);
  }

  Denoiser denoiser_;
  const Features features_;
  int prepared_ = -1;  // the part that those below are of
  std::shared_ptr<const Image> albedo_, normal_;
};

void denoise_all(NetworkWithFeatures& network, std::span<Image> images) {
  denoise_with_halves(
      images, [&](Image image, Mirror mirror, int part) { return network.denoise(std::move(image), mirror, part); });
}

/// The network's images as candidates; `with_residual`: also with residual correction in two widths.
std::vector<Image> with_residuals(const CandidateInput& in, const Image& clean, bool with_residual) {
  std::vector<Image> images(with_residual ? 3 : 1, clean);
  if (!with_residual) return images;
  add_residual(*in.moments, kNetworkResiduals[0], *in.valid, images[1]);
  add_residual(*in.moments, kNetworkResiduals[1], *in.valid, images[2]);
  return images;
}

/// What the network denoises: it was trained on noise that is independent between pixels.
const Image& noisy_of(const CandidateInput& in, CandidateBase base) {
  return base == CandidateBase::kMean ? *in.estimate : *in.independent;
}

}  // namespace

CandidateMaker::Make one_by_one(std::function<std::vector<Image>(const CandidateInput&)> make) {
  return [make = std::move(make)](std::span<const CandidateInput> inputs) {
    std::vector<std::vector<Image>> all;
    for (const CandidateInput& in : inputs) all.push_back(make(in));
    return all;
  };
}

Image feature_of_light(const Features& features) {
  const Image& albedo = *features.albedo;
  Image marked = features.normal ? *features.normal : Image(albedo.width, albedo.height, 3);
  for (size_t i = 0; i < albedo.data.size(); i += 3)
    if (std::max({albedo.data[i], albedo.data[i + 1], albedo.data[i + 2]}) < kBlackAlbedo)
      std::fill_n(&marked.data[i], 3, kFarFromNormals);
  return marked;
}

RegressionFeatures regression_features(const Features& features, FilterKinds kinds) {
  RegressionFeatures result;
  if (!features.albedo || kinds == FilterKinds::kNlMeans) return result;
  result.nl_means = kinds == FilterKinds::kAll;
  const Features behind_glass = network_features(features);
  result.features.push_back(behind_glass.albedo);
  if (behind_glass.normal) result.features.push_back(behind_glass.normal);
  if (behind_glass.normal && behind_glass.normal->data != features.normal->data)
    result.features.push_back(features.normal);
  result.position = features.position;
  return result;
}

std::vector<std::string> filter_names(const Features& features, CandidateBase base, FilterKinds kinds) {
  const RegressionFeatures regression = regression_features(features, kinds);
  std::vector<std::string> names;
  if (!regression.features.empty()) names.emplace_back("regression");
  if (regression.nl_means) {
    names.emplace_back("sharp");
    if (base == CandidateBase::kPair) names.emplace_back("sharp-independent");
    names.emplace_back("smooth");
  }
  if (features.albedo) names.emplace_back("demodulated");
  return names;
}

CandidateMaker filtered_candidates(const Features& features, CandidateBase base, FilterKinds kinds,
                                   const WantedRows& wanted) {
  const auto kept = std::make_shared<FilterFeatures>(filter_features(features, kinds));
  kept->wanted = wanted;
  CandidateMaker maker;
  maker.names = filter_names(features, base, kinds);
  maker.make = [kept, features, base, kinds](std::span<const CandidateInput> inputs) {
    if (!features.differences) return filtered(*kept, base, inputs);
    std::vector<std::vector<Image>> all;
    for (const CandidateInput& in : inputs) {
      if (in.part == 0) {
        all.push_back(std::move(filtered(*kept, base, {&in, 1})[0]));
        continue;
      }
      const PartFeatures of_part(features, in.part);
      FilterFeatures own = filter_features(of_part.view(), kinds);
      own.wanted = kept->wanted;
      all.push_back(std::move(filtered(own, base, {&in, 1})[0]));
    }
    return all;
  };
  maker.make_layers = [kept](const CandidateInput& input, std::span<const Image> layers) {
    return filtered_layers(*kept, input, layers);
  };
  return maker;
}

void check_features(const Features& features, int width, int height) {
  for (size_t i = 0; i < feature::kCount; ++i) {
    const Image* image = features.*kImagesOfFeatures[i];
    if (!image) continue;
    const char* const name = kAuxiliaryFeatures[i].name;
    const size_t n_values = 3 * static_cast<size_t>(width) * static_cast<size_t>(height);
    if (image->width != width || image->height != height || image->channels != 3 || image->data.size() != n_values)
      throw Error(
          ErrorCode::kInput,
          fmt::format("{} has {} x {} pixels of {} channels and {} values, the image {} x {} pixels; expected "
                      "the same size, 3 channels and {} values",
                      name, image->width, image->height, image->channels, image->data.size(), width, height, n_values));
    check_feature(name, *image);
  }
  if (features.normal && !features.albedo)
    throw Error(ErrorCode::kInput, "a normal without an albedo is not used; give both");
  for (size_t i = 0; features.differences && i < feature::kCount; ++i) {
    const size_t n = features.differences->values[i].size();
    COVARY_CHECK(n == 0 || (features.*kImagesOfFeatures[i] && n == (features.*kImagesOfFeatures[i])->data.size()),
                 "differences of features have their size");
  }
}

Features network_features(const Features& features) {
  const bool has_both = features.denoising_albedo && (features.denoising_normal || !features.normal);
  if (!has_both) return {features.albedo, features.normal, nullptr, nullptr, nullptr, features.clean};
  return {features.denoising_albedo, features.denoising_normal, nullptr, nullptr, nullptr, features.clean};
}

NetworkCalls network_calls(const Features& features, const DenoiseOptions& options) {
  const auto kept = std::make_shared<std::optional<NetworkWithFeatures>>();
  const auto network = [kept, features, options]() -> NetworkWithFeatures& {
    return *kept ? **kept : kept->emplace(features, options);
  };
  return {.images =
              [network](std::array<Image, 3> images) {
                const bool has_halves = !images[1].data.empty();
                denoise_all(network(), std::span(images).first(has_halves ? 3 : 1));
                return NetworkImages{std::move(images), network().runs()};
              },
          .layers =
              [network](std::vector<Image> layers) {
                for (Image& layer : layers) layer = network().denoise(std::move(layer));
                return NetworkLayers{std::move(layers), network().runs()};
              }};
}

NetworkImages network_images(const Features& features, const DenoiseOptions& options, std::array<Image, 3> images) {
  return network_calls(features, options).images(std::move(images));
}

CandidateMaker neural_candidates(const Features& features, const DenoiseOptions& options, CandidateBase base,
                                 std::shared_ptr<const NetworkImages> made) {
  const bool is_mean = base == CandidateBase::kMean;
  CandidateMaker maker;
  maker.error_over_variance = 1.1;
  maker.network = true;
  maker.names = is_mean ? std::vector<std::string>{"oidn", "oidn-wide", "oidn-narrow"}
                        : std::vector<std::string>{"oidn-independent"};
  if (made) {
    maker.runs = [made] { return made->runs; };
    maker.make = one_by_one([made, is_mean](const CandidateInput& in) {
      return with_residuals(in, made->images[static_cast<size_t>(in.part)], is_mean);
    });
    return maker;
  }
  const auto network = std::make_shared<NetworkWithFeatures>(features, options);
  maker.runs = [network] { return network->runs(); };
  maker.make = [network, base](std::span<const CandidateInput> inputs) {
    std::vector<Image> clean;
    for (const CandidateInput& in : inputs) clean.push_back(noisy_of(in, base));
    denoise_all(*network, clean);
    std::vector<std::vector<Image>> all;
    for (size_t i = 0; i < inputs.size(); ++i)
      all.push_back(with_residuals(inputs[i], clean[i], base == CandidateBase::kMean));
    return all;
  };
  if (!is_mean) return maker;
  maker.make_layers = [network, n = maker.names.size()](const CandidateInput&, std::span<const Image> layers) {
    std::vector<Image> images;
    for (const Image& layer : layers) images.push_back(network->denoise(layer));
    return std::vector(n, images);
  };
  return maker;
}

}  // namespace covary
