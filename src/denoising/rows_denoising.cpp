// SPDX-License-Identifier: Apache-2.0
#include "denoising/rows_denoising.h"

#include <algorithm>
#include <array>
#include <utility>

#include "denoising/mixed_rows.h"
#include "denoising/row_bands.h"
#include "denoising/weighed_candidate.h"
#include "estimators/result_rows.h"
#include "risk/halves.h"

namespace covary {
namespace {

/// Rows first … of the image, which hold the rows that are wanted from row `skipped` on.
struct Band {
  int first = 0, skipped = 0;
  Samples rows;
  FeatureRows features;
  MethodSettings settings;
};

class RowsDenoising {
 public:
  RowsDenoising(const SamplesInRows& image, const MethodSettings& settings, const RowsMethod& method)
      : image_(image), settings_(settings), method_(method) {}

  MethodImage run() {
    survey();
    const bool is_mean = method_.base == CandidateBase::kMean;
    if (method_.network && (enough_ || is_mean)) denoise_by_network();
    if (!enough_) return by_bands_of_few();
    find_weights();
    MixedRows whole;
    std::vector<CandidateMaker> makers;
    std::string base;
    for_each_band(rows_reach(method_), 0, image_.height, [&](const Band& band, int y, int n) {
      makers = makers_of(band);
      const DenoisingParts parts = method_.parts(band.rows, band.settings);
      base = parts.name;
      const MixedParts mixed = mix_parts(parts, makers, method_.weighting, &whole_);
      append(mixed_rows(parts, mixed, makers, settings_.std_error), band.skipped, y, n, image_.height, whole);
      whole.result.nonfinite_pixels += unusable(band, n);
    });
    MethodImage result = finish(std::move(whole), makers, base);
    result.network_runs = network_ ? network_->runs : 0;
    return result;
  }

 private:
  /// Calls f(band, y, n) for bands that hold rows y … y + n - 1 and `reach` more on both sides.
  template <typename Function>
  void for_each_band(int reach, int first, int end, const Function& f) const {
    for (const RowBand& b : bands_of(image_.height, image_.rows_at_once, reach, first, end)) {
      Band band{b.first, b.skipped, image_.rows(b.first, b.rows), FeatureRows(settings_.features, b.first, b.rows),
                settings_};
      band.settings.features = band.features.features;
      f(band, b.y, b.n);
    }
  }

  /// The number of samples, and whether there are enough.
  void survey() {
    const Samples first = image_.rows(0, 1);
    enough_ = method_.are_enough(first), whole_.samples = mean_samples(first.independent);
    if (!first.independent.counts) return;  // all pixels are alike
    double samples = 0;
    for_each_band(0, 0, image_.height, [&](const Band& band, int, int n) {
      samples += all_samples(rows_of(band.rows.independent, band.skipped, n));
      enough_ = enough_ && method_.are_enough(band.rows);
    });
    whole_.samples = samples / (static_cast<double>(image_.width) * image_.height);
  }

  /// What the network denoises: of all samples and of both halves.
  std::array<Image, 3> noisy_rows(const Band& band) const {
    if (method_.base == CandidateBase::kMean) {
      const DenoisingParts parts =
          enough_ ? parts_of_mean(band.rows.independent) : whole_of_mean(band.rows.independent);
      const auto noisy = [](const DenoisingPart& part) {
        return part.limited ? part.limited->estimate : part.image.estimate;
      };
      if (!enough_) return {noisy(parts.whole), Image(), Image()};
      return {noisy(parts.whole), noisy(parts.halves[0]), noisy(parts.halves[1])};
    }
    const GroupedImage& independent = band.rows.independent;
    long ignored = 0;
    const std::vector<unsigned char> valid = finite_pixels(band.rows.crn, independent, ignored);
    const auto mean = [&](const GroupedImage& groups) { return mean_image(moments(groups, valid, 0, 0.0f)); };
    return {mean(independent), mean(HalfImage(independent, 0).view()), mean(HalfImage(independent, 1).view())};
  }

  void denoise_by_network() {
    std::array<Image, 3> noisy;
    for_each_band(method_.reach_of_parts, 0, image_.height, [&](const Band& band, int y, int n) {
      const std::array<Image, 3> rows = noisy_rows(band);
      for (size_t i = 0; i < rows.size(); ++i) copy_rows(rows[i], band.skipped, y, n, image_.height, noisy[i]);
    });
    network_ = std::make_shared<NetworkImages>(network_images(settings_.features, *method_.network, std::move(noisy)));
  }

  std::vector<CandidateMaker> makers_of(const Band& band) const {
    std::vector<CandidateMaker> makers = {method_.filters(band.features.features, band.first)};
    const bool is_mean = method_.base == CandidateBase::kMean;
    if (!network_) {
      if (is_mean && enough_) add_weighing_maker(band.features.features, makers);
      return makers;
    }
    const auto rows = std::make_shared<NetworkImages>();
    rows->runs = network_->runs;
    for (size_t i = 0; i < rows->images.size(); ++i)
      if (!network_->images[i].data.empty())
        rows->images[i] = rows_of(network_->images[i], band.first, band.rows.independent.height);
    CandidateMaker network = neural_candidates({}, {}, method_.base, rows);
    makers.insert(is_mean ? makers.begin() : makers.end(), std::move(network));
    return makers;
  }

  void find_weights() {
    std::vector<NormalRow> all;
    std::vector<CandidateMaker> makers;
    const int reach = candidates_reach(method_.base, method_.network.has_value(), method_.reach_of_parts);
    for (const auto& [first, end] : sampled_rows(image_.width, image_.height))
      for_each_band(reach, first, end, [&](const Band& band, int, int n) {
        makers = makers_of(band);
        const std::vector<NormalRow> rows = normal_rows_of(method_.parts(band.rows, band.settings), makers,
                                                           method_.weighting, band.skipped, band.skipped + n);
        all.insert(all.end(), rows.begin(), rows.end());
      });
    const bool is_mean = method_.base == CandidateBase::kMean;
    whole_.everywhere = weights_of_whole(is_mean, makers, method_.weighting, whole_.samples, all);
  }

  MethodImage by_bands_of_few() const {
    MethodImage whole;
    for_each_band(method_.reach_of_parts + kCandidateReach, 0, image_.height, [&](const Band& band, int y, int n) {
      const MethodImage part = method_.of_few(band.rows, band.settings, makers_of(band));
      append_rows(part, band.skipped, y, n, image_.height, whole);
      whole.note = part.note;
      whole.nonfinite_pixels += unusable(band, n);
    });
    whole.network_runs = network_ ? network_->runs : 0;
    return whole;
  }

  /// Pixels that are left out, without the surrounding rows, which belong to other bands.
  static long unusable(const Band& band, int n) {
    const GroupedImage& crn = band.rows.crn.data ? band.rows.crn : band.rows.independent;
    long n_unusable = 0;
    finite_pixels(rows_of(crn, band.skipped, n), rows_of(band.rows.independent, band.skipped, n), n_unusable);
    return n_unusable;
  }

  const SamplesInRows& image_;
  const MethodSettings& settings_;
  const RowsMethod& method_;
  WholeImage whole_;
  bool enough_ = true;
  std::shared_ptr<const NetworkImages> network_;
};

}  // namespace

int rows_reach(const RowsMethod& method) {
  return mixed_reach(method.base, method.network.has_value(), method.reach_of_parts, method.weighting);
}

double bytes_of_whole(bool with_network) {
  constexpr double kImage = 3 * sizeof(float), kPlane = sizeof(float);
  // Weights and disagreement. With a network its three images, and while it runs, before there is a result of three
  // images, its features, mirrored ones and an image.
  return with_network ? (3 + 5 - 3) * kImage : 2 * kPlane;
}

MethodImage denoise_in_rows(const SamplesInRows& image, const MethodSettings& settings, const RowsMethod& method) {
  return RowsDenoising(image, settings, method).run();
}

}  // namespace covary
