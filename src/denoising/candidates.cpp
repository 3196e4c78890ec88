// SPDX-License-Identifier: Apache-2.0
#include "denoising/candidates.h"

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>

#include "denoising/mirrored_halves.h"
#include "filters/nl_means.h"
#include "filters/regression.h"
#include "filters/residual_correction.h"

namespace covary {
namespace {

/// Scales of guide differences, and the smallest albedo to divide by.
constexpr float kAlbedoUnit = 0.07f, kNormalUnit = 0.2f, kLeastAlbedo = 0.02f;
/// Bandwidths of the sharp and the smooth filter.
constexpr float kSharp = 0.5f, kSmooth = 1;
/// Residual correction in two widths (residual_correction.h).
constexpr ResidualOptions kWideResidual = {0.5f, 61, 4}, kNarrowResidual = {0.3f, 41, 2};

/// Copies an image's channels, divided by `unit`, to the planes from index `first` on.
void copy_guide(const Image& image, float unit, int first, Planes& planes) {
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

struct FilterGuides {
  Planes all, normal;
  Image albedo;                 // at least kLeastAlbedo; empty where there is none
  std::vector<Image> features;  // of the regression; none: without it
  Image position;               // likewise; empty where there is none
  bool nl_means = true;         // of the image itself, too
};

FilterGuides filter_guides(const Guides& guides, FilterKinds kinds) {
  FilterGuides result;
  const auto planes = [&](const Image& like, int count) {
    return Planes(like.width, like.height, count, kNlMeansRadius, 0.0f);
  };
  if (!guides.albedo) return result;
  if (kinds != FilterKinds::kNlMeans) {
    result.nl_means = kinds == FilterKinds::kAll;
    const Guides behind_glass = network_guides(guides);
    result.features.push_back(*behind_glass.albedo);
    if (behind_glass.normal) result.features.push_back(*behind_glass.normal);
    if (behind_glass.normal && behind_glass.normal->data != guides.normal->data)
      result.features.push_back(*guides.normal);
    if (guides.position) result.position = *guides.position;
  }
  result.all = planes(*guides.albedo, guides.normal ? 6 : 3);
  copy_guide(*guides.albedo, kAlbedoUnit, 0, result.all);
  result.albedo = *guides.albedo;
  for (float& value : result.albedo.data) value = std::max(value, kLeastAlbedo);
  if (!guides.normal) return result;
  result.normal = planes(*guides.normal, 3);
  copy_guide(*guides.normal, kNormalUnit, 3, result.all);
  copy_guide(*guides.normal, kNormalUnit, 0, result.normal);
  return result;
}

const Planes* or_null(const Planes& planes) { return planes.count() > 0 ? &planes : nullptr; }
const Image* or_null(const Image& image) { return image.data.empty() ? nullptr : &image; }

/// The sources filtered by regression; `others`: their images by another filter. Coarse for halves, which serve only to
/// find weights.
std::vector<Image> regressed(const FilterGuides& guides, const CandidateInput& in, std::vector<const Image*> sources,
                             std::span<const Image> others, bool is_half) {
  RegressionInput input{in.estimate, in.std_error, std::move(sources), {}, or_null(guides.position), is_half};
  for (const Image& other : others) input.others.push_back(&other);
  std::vector<const Image*> features;
  for (const Image& feature : guides.features) features.push_back(&feature);
  return regressed(input, features, *in.valid);
}

/// The candidates of each input.
std::vector<std::vector<Image>> filtered(const FilterGuides& guides, CandidateBase base,
                                         std::span<const CandidateInput> inputs) {
  std::vector<std::vector<Image>> all(inputs.size());
  std::vector<NlMeansSteering> steerings;
  std::vector<Image> images;
  if (guides.nl_means) {
    for (const CandidateInput& in : inputs) {
      std::vector<const Image*> sharp = {in.estimate};
      if (base == CandidateBase::kPair) sharp.push_back(in.independent);
      steerings.push_back({in.estimate, in.std_error, {{kSharp, sharp}, {kSmooth, {in.estimate}}}});
    }
    images = nl_means(steerings, or_null(guides.all), *inputs[0].valid);
    const size_t n = images.size() / inputs.size();
    for (size_t i = 0; i < images.size(); ++i) all[i / n].push_back(std::move(images[i]));
    if (guides.albedo.data.empty()) return all;
    steerings.clear();
  }
  std::deque<Image> demodulated;
  for (const CandidateInput& in : inputs) {
    const Image& image = demodulated.emplace_back(combined(*in.estimate, guides.albedo, std::divides<>()));
    const Image& error = demodulated.emplace_back(combined(*in.std_error, guides.albedo, std::divides<>()));
    steerings.push_back({&image, &error, {{kSharp, {&image}}}});
  }
  images = nl_means(steerings, or_null(guides.normal), *inputs[0].valid);
  for (size_t i = 0; i < all.size(); ++i) {
    all[i].push_back(combined(images[i], guides.albedo, std::multiplies<>()));
    if (!guides.features.empty())
      all[i].insert(all[i].begin(), regressed(guides, inputs[i], {inputs[i].estimate}, {&all[i].back(), 1}, i > 0)[0]);
  }
  return all;
}

/// Filters layers with the weights of each candidate.
std::vector<std::vector<Image>> filtered_layers(const FilterGuides& guides, const CandidateInput& in,
                                                std::span<const Image> layers) {
  const auto n = static_cast<ptrdiff_t>(layers.size());
  std::vector<const Image*> sources;
  for (const Image& layer : layers) sources.push_back(&layer);
  std::vector<NlMeansSteering> steerings;
  std::vector<Image> images;
  std::vector<std::vector<Image>> all;
  if (guides.nl_means) {
    steerings = {{in.estimate, in.std_error, {{kSharp, sources}, {kSmooth, sources}}}};
    images = nl_means(steerings, or_null(guides.all), *in.valid);
    all.emplace_back(images.begin(), images.begin() + n);
    all.emplace_back(images.begin() + n, images.end());
    if (guides.albedo.data.empty()) return all;
  }
  std::deque<Image> demodulated;
  for (const Image* source : {in.estimate, in.std_error})
    demodulated.push_back(combined(*source, guides.albedo, std::divides<>()));
  std::vector<const Image*> without_albedo;
  for (const Image& layer : layers)
    without_albedo.push_back(&demodulated.emplace_back(combined(layer, guides.albedo, std::divides<>())));
  steerings = {{&demodulated[0], &demodulated[1], {{kSharp, without_albedo}}}};
  images = nl_means(steerings, or_null(guides.normal), *in.valid);
  for (Image& image : images) image = combined(image, guides.albedo, std::multiplies<>());
  all.push_back(std::move(images));
  if (!guides.features.empty()) all.insert(all.begin(), regressed(guides, in, sources, all.back(), false));
  return all;
}

/// Open Image Denoise with guides that it prefilters unless they are clean.
class GuidedNetwork {
 public:
  GuidedNetwork(const Guides& guides, const DenoiseOptions& options) : denoiser_(options) {
    if (!guides.albedo) return;
    if (guides.clean) {
      albedo_ = *guides.albedo;
      if (guides.normal) normal_ = *guides.normal;
      return;
    }
    albedo_ = denoiser_.denoise_guide("albedo", *guides.albedo);
    if (guides.normal) normal_ = denoiser_.denoise_guide("normal", *guides.normal);
  }

  int runs() const { return denoiser_.runs(); }
  /// `image` is already mirrored.
  Image denoise(const Image& image, Mirror mirror = Mirror::kNone) {
    if (mirror == Mirror::kNone) return denoiser_.denoise(image, or_null(albedo_), or_null(normal_), true);
    const Image albedo = mirrored(albedo_, mirror), normal = mirrored(normal_, mirror);
    return denoiser_.denoise(image, or_null(albedo), or_null(normal), true);
  }

 private:
  static const Image* or_null(const Image& image) { return image.data.empty() ? nullptr : &image; }

  Denoiser denoiser_;
  Image albedo_, normal_;
};

/// The independent images denoised: the network was trained on noise that is independent between pixels.
/// `with_residual`: the estimates instead, also with residual correction in two widths.
std::vector<std::vector<Image>> denoised(GuidedNetwork& network, std::span<const CandidateInput> inputs,
                                         bool with_residual) {
  std::vector<const Image*> noisy;
  for (const CandidateInput& in : inputs) noisy.push_back(with_residual ? in.estimate : in.independent);
  const std::vector<Image> clean =
      denoise_with_halves(noisy, [&](const Image& image, Mirror mirror) { return network.denoise(image, mirror); });
  std::vector<std::vector<Image>> all;
  for (size_t i = 0; i < inputs.size(); ++i) {
    std::vector<Image>& images = all.emplace_back(with_residual ? 3 : 1, clean[i]);
    if (!with_residual) continue;
    add_residual(*inputs[i].moments, kWideResidual, *inputs[i].valid, images[1]);
    add_residual(*inputs[i].moments, kNarrowResidual, *inputs[i].valid, images[2]);
  }
  return all;
}

}  // namespace

CandidateMaker::Make one_by_one(std::function<std::vector<Image>(const CandidateInput&)> make) {
  return [make = std::move(make)](std::span<const CandidateInput> inputs) {
    std::vector<std::vector<Image>> all;
    for (const CandidateInput& in : inputs) all.push_back(make(in));
    return all;
  };
}

CandidateMaker filtered_candidates(const Guides& guides, CandidateBase base, FilterKinds kinds) {
  const auto kept = std::make_shared<FilterGuides>(filter_guides(guides, kinds));
  CandidateMaker maker;
  if (!kept->features.empty()) maker.names = {"regression"};
  if (kept->nl_means) {
    maker.names.emplace_back("sharp");
    if (base == CandidateBase::kPair) maker.names.emplace_back("sharp-independent");
    maker.names.emplace_back("smooth");
  }
  if (!kept->albedo.data.empty()) maker.names.emplace_back("demodulated");
  maker.make = [kept, base](std::span<const CandidateInput> inputs) { return filtered(*kept, base, inputs); };
  maker.make_layers = [kept](const CandidateInput& input, std::span<const Image> layers) {
    return filtered_layers(*kept, input, layers);
  };
  return maker;
}

Guides network_guides(const Guides& guides) {
  const bool has_both = guides.denoising_albedo && (guides.denoising_normal || !guides.normal);
  if (!has_both) return {guides.albedo, guides.normal, nullptr, nullptr, nullptr, guides.clean};
  return {guides.denoising_albedo, guides.denoising_normal, nullptr, nullptr, nullptr, guides.clean};
}

CandidateMaker neural_candidates(const Guides& guides, const DenoiseOptions& options, CandidateBase base) {
  const auto network = std::make_shared<GuidedNetwork>(network_guides(guides), options);
  CandidateMaker maker;
  maker.error_over_variance = 1.1;
  maker.network = true;
  maker.runs = [network] { return network->runs(); };
  if (base == CandidateBase::kPair) {
    maker.names = {"oidn-independent"};
    maker.make = [network](std::span<const CandidateInput> in) { return denoised(*network, in, false); };
    return maker;
  }
  maker.names = {"oidn", "oidn-wide", "oidn-narrow"};
  maker.make = [network](std::span<const CandidateInput> in) { return denoised(*network, in, true); };
  maker.make_layers = [network, n = maker.names.size()](const CandidateInput&, std::span<const Image> layers) {
    std::vector<Image> images;
    for (const Image& layer : layers) images.push_back(network->denoise(layer));
    return std::vector(n, images);
  };
  return maker;
}

}  // namespace covary
