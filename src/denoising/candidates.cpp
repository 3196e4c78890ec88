// SPDX-License-Identifier: Apache-2.0
#include "denoising/candidates.h"

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <utility>

#include "denoising/mirrored_halves.h"
#include "filters/nl_means.h"
#include "filters/regression.h"
#include "filters/residual_correction.h"

namespace covary {
namespace {

/// The smallest albedo to divide by.
constexpr float kLeastAlbedo = 0.02f;

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

struct FilterGuides : RegressionGuides {
  Planes all, normal;
  Image albedo;       // at least kLeastAlbedo; empty where there is none
  int first_row = 0;  // of a larger image
};

FilterGuides filter_guides(const Guides& guides, FilterKinds kinds) {
  FilterGuides result{regression_guides(guides, kinds)};
  const auto planes = [&](const Image& like, int count) {
    return Planes(like.width, like.height, count, kNlMeansRadius, 0.0f);
  };
  if (!guides.albedo) return result;
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

/// The sources filtered by regression; `others`: their images by another filter. Coarse for halves, which serve only to
/// find weights.
std::vector<Image> regressed(const FilterGuides& guides, const CandidateInput& in, std::vector<const Image*> sources,
                             std::span<const Image> others) {
  RegressionInput input{in.estimate,     in.std_error, std::move(sources), {},
                        guides.position, in.part > 0,  guides.first_row};
  for (const Image& other : others) input.others.push_back(&other);
  return regressed(input, guides.features, *in.valid);
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
      steerings.push_back({in.estimate, in.std_error, {{kSharpBandwidth, sharp}, {kSmoothBandwidth, {in.estimate}}}});
    }
    images = nl_means(steerings, or_null(guides.all), *inputs[0].valid, guides.first_row);
    const size_t n = images.size() / inputs.size();
    for (size_t i = 0; i < images.size(); ++i) all[i / n].push_back(std::move(images[i]));
    if (guides.albedo.data.empty()) return all;
    steerings.clear();
  }
  std::deque<Image> demodulated;
  for (const CandidateInput& in : inputs) {
    const Image& image = demodulated.emplace_back(combined(*in.estimate, guides.albedo, std::divides<>()));
    const Image& error = demodulated.emplace_back(combined(*in.std_error, guides.albedo, std::divides<>()));
    steerings.push_back({&image, &error, {{kSharpBandwidth, {&image}}}});
  }
  images = nl_means(steerings, or_null(guides.normal), *inputs[0].valid, guides.first_row);
  demodulated.clear(), steerings.clear();
  for (size_t i = 0; i < all.size(); ++i) {
    all[i].push_back(combined(images[i], guides.albedo, std::multiplies<>()));
    if (!guides.features.empty())
      all[i].insert(all[i].begin(), regressed(guides, inputs[i], {inputs[i].estimate}, {&all[i].back(), 1})[0]);
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
    steerings = {{in.estimate, in.std_error, {{kSharpBandwidth, sources}, {kSmoothBandwidth, sources}}}};
    images = nl_means(steerings, or_null(guides.all), *in.valid, guides.first_row);
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
  steerings = {{&demodulated[0], &demodulated[1], {{kSharpBandwidth, without_albedo}}}};
  images = nl_means(steerings, or_null(guides.normal), *in.valid, guides.first_row);
  for (Image& image : images) image = combined(image, guides.albedo, std::multiplies<>());
  all.push_back(std::move(images));
  if (!guides.features.empty()) all.insert(all.begin(), regressed(guides, in, sources, all.back()));
  return all;
}

/// Open Image Denoise with guides that it prefilters unless they are clean.
class GuidedNetwork {
 public:
  GuidedNetwork(const Guides& guides, const DenoiseOptions& options) : denoiser_(options) {
    if (!guides.albedo) return;
    const auto clean = [&](const char* name, const Image& guide) {
      return std::make_shared<const Image>(guides.clean ? guide : denoiser_.denoise_guide(name, guide));
    };
    albedo_ = clean("albedo", *guides.albedo);
    if (guides.normal) normal_ = clean("normal", *guides.normal);
  }

  int runs() const { return denoiser_.runs(); }
  /// `image` is already mirrored.
  Image denoise(Image image, Mirror mirror = Mirror::kNone) {
    const auto turned = [&](const std::shared_ptr<const Image>& guide) {
      return guide && mirror != Mirror::kNone ? std::make_shared<const Image>(mirrored(*guide, mirror)) : guide;
    };
    return denoiser_.denoise(std::move(image), turned(albedo_), turned(normal_), true);
  }

 private:
  Denoiser denoiser_;
  std::shared_ptr<const Image> albedo_, normal_;
};

void denoise_all(GuidedNetwork& network, std::span<Image> images) {
  denoise_with_halves(images, [&](Image image, Mirror mirror) { return network.denoise(std::move(image), mirror); });
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

RegressionGuides regression_guides(const Guides& guides, FilterKinds kinds) {
  RegressionGuides result;
  if (!guides.albedo || kinds == FilterKinds::kNlMeans) return result;
  result.nl_means = kinds == FilterKinds::kAll;
  const Guides behind_glass = network_guides(guides);
  result.features.push_back(behind_glass.albedo);
  if (behind_glass.normal) result.features.push_back(behind_glass.normal);
  if (behind_glass.normal && behind_glass.normal->data != guides.normal->data) result.features.push_back(guides.normal);
  result.position = guides.position;
  return result;
}

std::vector<std::string> filter_names(const Guides& guides, CandidateBase base, FilterKinds kinds) {
  const RegressionGuides regression = regression_guides(guides, kinds);
  std::vector<std::string> names;
  if (!regression.features.empty()) names.emplace_back("regression");
  if (regression.nl_means) {
    names.emplace_back("sharp");
    if (base == CandidateBase::kPair) names.emplace_back("sharp-independent");
    names.emplace_back("smooth");
  }
  if (guides.albedo) names.emplace_back("demodulated");
  return names;
}

CandidateMaker filtered_candidates(const Guides& guides, CandidateBase base, FilterKinds kinds, int first_row) {
  const auto kept = std::make_shared<FilterGuides>(filter_guides(guides, kinds));
  kept->first_row = first_row;
  CandidateMaker maker;
  maker.names = filter_names(guides, base, kinds);
  maker.make = [kept, base](std::span<const CandidateInput> inputs) { return filtered(*kept, base, inputs); };
  maker.make_layers = [kept](const CandidateInput& input, std::span<const Image> layers) {
    return filtered_layers(*kept, input, layers);
  };
  return maker;
}

void check_guides(const Guides& guides) {
  if (guides.albedo) check_guide("the albedo", *guides.albedo);
  if (guides.normal) check_guide("the normal", *guides.normal);
  if (guides.denoising_albedo) check_guide("the albedo behind glass", *guides.denoising_albedo);
  if (guides.denoising_normal) check_guide("the normal behind glass", *guides.denoising_normal);
  if (guides.position) check_guide("the position", *guides.position);
}

Guides network_guides(const Guides& guides) {
  const bool has_both = guides.denoising_albedo && (guides.denoising_normal || !guides.normal);
  if (!has_both) return {guides.albedo, guides.normal, nullptr, nullptr, nullptr, guides.clean};
  return {guides.denoising_albedo, guides.denoising_normal, nullptr, nullptr, nullptr, guides.clean};
}

NetworkImages network_images(const Guides& guides, const DenoiseOptions& options, std::array<Image, 3> images) {
  GuidedNetwork network(network_guides(guides), options);
  const bool has_halves = !images[1].data.empty();
  denoise_all(network, std::span(images).first(has_halves ? 3 : 1));
  return {std::move(images), network.runs()};
}

CandidateMaker neural_candidates(const Guides& guides, const DenoiseOptions& options, CandidateBase base,
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
  const auto network = std::make_shared<GuidedNetwork>(network_guides(guides), options);
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
