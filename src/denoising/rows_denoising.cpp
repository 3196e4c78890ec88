// SPDX-License-Identifier: Apache-2.0
#include "denoising/rows_denoising.h"

#include <algorithm>
#include <array>
#include <utility>

#include "denoising/mixed_rows.h"
#include "denoising/row_bands.h"
#include "denoising/rows_of_parts.h"
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

/// Rows first … of the image, as the whole has them: the samples' images, and their candidates of rows before `made`.
struct MadeRows {
  int first = 0, made = 0;
  DenoisingParts parts;
  std::vector<CandidateSet> sets;  ///< of all samples and of both halves, or of the halves alone
  std::vector<CandidateMaker> makers;
  std::shared_ptr<FeatureRows> features;

  int end() const { return first + parts.whole.image.estimate.height; }
  std::vector<const DenoisingPart*> parts_of_sets() const {
    std::vector<const DenoisingPart*> all = {&parts.whole, &parts.halves[0], &parts.halves[1]};
    return {all.end() - static_cast<ptrdiff_t>(sets.size()), all.end()};
  }
  /// Adds the candidates that consist of others.
  void weigh() {
    add_weighed(parts_of_sets(), parts.valid, makers, sets.size() == 2 ? 1 : 0, sets);
    features.reset();
  }
};

/// Rows that the next band has, too.
struct KeptRows {
  int made = 0;
  DenoisingParts parts;
  std::vector<std::vector<Image>> candidates;

  KeptRows() = default;
  KeptRows(int first, const MadeRows& rows)
      : made(rows.made),
        parts(rows_of(rows.parts, first - rows.first, rows.end() - first)),
        candidates(rows_of(rows.sets, first - rows.first, rows.made - first)) {}
};

/// What is left of rows `first` to `end` - 1 of an image if they begin with cells.
struct Rows {
  int first, n;
  Rows(int wanted, int end, int height)
      : first(std::max(0, wanted) / kBandCell * kBandCell), n(std::min(height, end) - first) {}
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
    const int of_mixture = kErrorHalo + mixture_halo(is_mean, method_.weighting);
    for_each_made(of_mixture + of_weighing(), 0, image_.height, true, [&](const RowBand& band, MadeRows& rows) {
      rows.weigh();
      append_mixed({band.y - of_mixture, band.y + band.n + of_mixture, image_.height}, band, rows, whole);
      makers = std::move(rows.makers), base = rows.parts.name;
    });
    MethodImage result = finish(std::move(whole), makers, base);
    result.network_runs = network_ ? network_->runs : 0;
    return result;
  }

 private:
  /// Calls f(band, y, n) for bands that hold rows y … y + n - 1 and `halo` more on both sides.
  template <typename Function>
  void for_each_band(int halo, int first, int end, const Function& f) const {
    for (const RowBand& b : bands_of(image_.height, image_.rows_at_once, halo, first, end)) {
      Band band{b.first, b.skipped, image_.rows(b.first, b.rows), FeatureRows(settings_.features, b.first, b.rows),
                settings_};
      band.settings.features = band.features.features;
      f(band, b.y, b.n);
    }
  }

  int of_candidates() const { return method_.network ? kCandidateHalo : kFiltersHalo; }
  int of_weighing() const { return weighing_halo(method_.base, method_.network.has_value()); }

  /// Calls f(band, rows) for bands that hold rows first … end - 1 and `halo` more on both sides, with the candidates
  /// of all of these, which f may use up. `with_whole`: of all samples, too.
  template <typename Function>
  void for_each_made(int halo, int first, int end, bool with_whole, const Function& f) const {
    const int around = method_.halo_of_parts, below = std::max(halo + of_candidates(), around);
    const int above = first > 0 ? below : std::max({halo, of_candidates(), around});  // there, candidates are kept
    const int of_first = first > 0 ? 2 * around + kBandCell : 0;
    const std::vector<RowBand> bands =
        bands_of(image_.height, image_.rows_at_once - of_first, {above, below}, first, end);
    KeptRows kept;
    for (size_t i = 0; i < bands.size(); ++i) {
      MadeRows rows = made_rows(bands[i], std::min(image_.height, bands[i].y + bands[i].n + halo), with_whole,
                                std::exchange(kept, {}));
      if (i + 1 < bands.size()) kept = KeptRows(bands[i + 1].first, rows);
      f(bands[i], rows);
    }
  }

  /// The rows of a band, with candidates up to row `made`.
  MadeRows made_rows(const RowBand& band, int made, bool with_whole, KeptRows kept) const {
    MadeRows rows{
        .first = band.first, .made = made, .parts = std::move(kept.parts), .sets = {}, .makers = {}, .features = {}};
    const bool has_kept = !kept.candidates.empty();
    const int from = has_kept ? rows.end() : band.first, end = band.first + band.rows;
    if (from < end) append_rows(parts_of_rows(from, end), rows.parts);
    rows.features = std::make_shared<FeatureRows>(settings_.features, band.first, band.rows);
    const int first = has_kept ? kept.made - band.first : band.first > 0 ? of_candidates() : 0;
    rows.makers = makers_of(rows.features->features, {band.first, first, made - band.first}, band.rows);
    rows.sets.resize(with_whole ? 3 : 2);
    rows.sets = made_candidates(rows.parts_of_sets(), rows.parts.valid, rows.makers, with_whole ? 0 : 1);
    for (CandidateMaker& maker : rows.makers) maker.make = {}, maker.make_layers = {};  // and what they hold
    set_rows(kept.candidates, rows.sets);
    return rows;
  }

  DenoisingParts parts_of_rows(int from, int end) const {
    const Rows around(from - method_.halo_of_parts, end + method_.halo_of_parts, image_.height);
    const Samples samples = image_.rows(around.first, around.n);
    const FeatureRows features(settings_.features, around.first, around.n);
    MethodSettings settings = settings_;
    settings.features = features.features;
    DenoisingParts parts = method_.parts(samples, settings);
    leave_rows(from - around.first, end - from, parts);
    return parts;
  }

  /// Mixes rows `mixed` …, which the band's error needs.
  void append_mixed(const Rows& mixed, const RowBand& band, MadeRows& rows, MixedRows& whole) const {
    DenoisingParts& parts = rows.parts;
    leave_rows(mixed.first - rows.first, mixed.n, parts), leave_rows(mixed.first - rows.first, mixed.n, rows.sets);
    MixedParts mixture = mix_sets(parts, std::move(rows.sets), rows.makers, method_.weighting, &whole_);
    const Rows left(band.y - kErrorHalo, band.y + band.n + kErrorHalo, image_.height);
    leave_rows(left.first - mixed.first, left.n, parts), leave_rows(left.first - mixed.first, left.n, mixture);
    const Samples samples = image_.rows(left.first, left.n);
    const FeatureRows features(settings_.features, left.first, left.n);
    parts.groups = samples.independent, parts.features = features.features;
    const int skipped = band.y - left.first;
    append(mixed_rows(parts, mixture, rows.makers, settings_.std_error), skipped, band.y, band.n, image_.height, whole);
    whole.result.nonfinite_pixels += unusable(samples, skipped, band.n);
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
    for_each_band(method_.halo_of_parts, 0, image_.height, [&](const Band& band, int y, int n) {
      const std::array<Image, 3> rows = noisy_rows(band);
      for (size_t i = 0; i < rows.size(); ++i) copy_rows(rows[i], band.skipped, y, n, image_.height, noisy[i]);
    });
    network_ = std::make_shared<NetworkImages>(network_images(settings_.features, *method_.network, std::move(noisy)));
  }

  std::vector<CandidateMaker> makers_of(const Features& features, const WantedRows& wanted, int n) const {
    std::vector<CandidateMaker> makers = {method_.filters(features, wanted)};
    const bool is_mean = method_.base == CandidateBase::kMean;
    if (!network_) {
      if (is_mean && enough_) add_weighing_maker(features, makers);
      return makers;
    }
    const auto rows = std::make_shared<NetworkImages>();
    rows->runs = network_->runs;
    for (size_t i = 0; i < rows->images.size(); ++i)
      if (!network_->images[i].data.empty()) rows->images[i] = rows_of(network_->images[i], wanted.first_row, n);
    CandidateMaker network = neural_candidates({}, {}, method_.base, rows);
    makers.insert(is_mean ? makers.begin() : makers.end(), std::move(network));
    return makers;
  }

  void find_weights() {
    std::vector<NormalRow> all;
    std::vector<CandidateMaker> makers;
    for (const auto& [first, end] : sampled_rows(image_.width, image_.height))
      for_each_made(of_weighing(), first, end, false, [&](const RowBand& band, MadeRows& rows) {
        rows.weigh();
        const int begin = band.y - rows.first;
        const std::vector<NormalRow> sums =
            normal_rows_of(rows.parts, std::move(rows.sets), method_.weighting, begin, begin + band.n);
        all.insert(all.end(), sums.begin(), sums.end());
        makers = std::move(rows.makers);
      });
    const bool is_mean = method_.base == CandidateBase::kMean;
    whole_.everywhere = weights_of_whole(is_mean, makers, method_.weighting, whole_.samples, all);
  }

  MethodImage by_bands_of_few() const {
    MethodImage whole;
    for_each_band(method_.halo_of_parts + kCandidateHalo, 0, image_.height, [&](const Band& band, int y, int n) {
      const MethodImage part =
          method_.of_few(band.rows, band.settings,
                         makers_of(band.features.features, {.first_row = band.first}, band.rows.independent.height));
      append_rows(part, band.skipped, y, n, image_.height, whole);
      whole.note = part.note;
      whole.nonfinite_pixels += unusable(band.rows, band.skipped, n);
    });
    whole.network_runs = network_ ? network_->runs : 0;
    return whole;
  }

  /// Pixels that are left out, without the surrounding rows, which belong to other bands.
  static long unusable(const Samples& rows, int skipped, int n) {
    const GroupedImage& crn = rows.crn.data ? rows.crn : rows.independent;
    long n_unusable = 0;
    finite_pixels(rows_of(crn, skipped, n), rows_of(rows.independent, skipped, n), n_unusable);
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

int rows_halo(const RowsMethod& method) {
  return mixed_halo(method.base, method.network.has_value(), method.halo_of_parts, method.weighting);
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
