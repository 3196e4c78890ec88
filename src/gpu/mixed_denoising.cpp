// SPDX-License-Identifier: Apache-2.0
#include "gpu/mixed_denoising.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "denoising/denoising_parts.h"
#include "denoising/history.h"
#include "denoising/layers.h"
#include "denoising/mixed_rows.h"
#include "denoising/row_bands.h"
#include "estimators/result_rows.h"
#include "gpu/bands.h"
#include "gpu/rows_on_device.h"

namespace covary::gpu {
namespace {

/// A band of the image on the device, or the whole. Copies of features are made for bands alone.
struct BandOnDevice {
  RowBand band;
  std::optional<FeatureRows> features;
  MeanMixture request;
  std::optional<RowsOnDevice> rows;

  BandOnDevice(Device& device, const MeanMixture& whole, const RowBand& wanted, const Trial& trial)
      : band(wanted), request(whole) {
    if (band.rows < whole.independent.height) {
      request.independent = rows_of(whole.independent, band.first, band.rows);
      request.features = features.emplace(whole.features, band.first, band.rows).features;
    }
    rows.emplace(device, request, trial);
  }
};

/// Weights of the whole image, whose rows these are.
std::vector<float> weights_of_all(RowsOnDevice& rows, bool is_mean, const PartsWeighting& weighting,
                                  const GroupedImage& image) {
  std::vector<NormalRow> all;
  for (const auto& [first, end] : sampled_rows(image.width, image.height)) {
    const std::vector<NormalRow> some = rows.normal_rows(first, end);
    all.insert(all.end(), some.begin(), some.end());
  }
  return weights_of_whole(is_mean, rows.makers(), weighting, mean_samples(image), all);
}

/// Errors that only the history needed.
void forget_unwanted_errors(bool std_error, MethodImage& result) {
  if (std_error) return;
  result.std_error = {}, result.bias = {}, result.risk_rows.clear(), result.risks.reset();
}

/// The mixture of independent samples whose halves have these means.
class SamplesMixture {
 public:
  /// `runs`: becomes the number of the network's runs so far.
  SamplesMixture(Device& device, const MeanMixture& frame, const std::array<Image, 2>& halves, const Trial& trial,
                 int& runs)
      : groups_(groups_of(halves)), request_(frame) {
    request_.independent = {halves[0].width, halves[0].height, 2, groups_.data()};
    request_.std_error = false, request_.layers = {}, request_.history = {};
    rows_.emplace(device, request_, trial);
    NetworkImages network;
    Stages(device, trial).run("network", [&] { network = request_.network(rows_->noisy()); });
    runs = network.runs;
    rows_->make_candidates(&network);
    rows_->mix(weights_of_all(*rows_, true, request_.weighting, request_.independent));
  }
  const MixedBuffers& mixed() const { return rows_->mixed(); }

 private:
  static std::vector<float> groups_of(const std::array<Image, 2>& halves) {
    std::vector<float> data;
    data.reserve(2 * halves[0].data.size());
    for (size_t i = 0; i < halves[0].data.size(); i += 3)
      for (const Image& half : halves) data.insert(data.end(), &half.data[i], &half.data[i] + 3);
    return data;
  }

  const std::vector<float> groups_;
  MeanMixture request_;
  std::optional<RowsOnDevice> rows_;
};

class MeanDenoising {
 public:
  MeanDenoising(Device& device, const MeanMixture& request, const Trial& trial)
      : device_(device), request_(request), trial_(trial), height_(request.independent.height) {}

  /// In bands of so many rows. After a failure, a network's images are kept.
  MixedDenoising run(int rows_at_once) {
    rows_at_once_ = rows_at_once;
    last_.reset();
    if (has_network() && network_.images[0].data.empty()) run_network();
    const std::vector<float> everywhere = find_weights();
    MixedDenoising out;
    MixedRows whole;
    std::vector<CandidateMaker> makers;
    const int halo = mixed_halo(CandidateBase::kMean, has_network(), kMeanHalo, request_.weighting);
    for (const RowBand& band : bands(halo, 0, height_)) {
      RowsOnDevice& rows = with_candidates(band);
      makers = rows.makers();
      append(rows.mix(everywhere), band.skipped, band.y, band.n, height_, whole);
      whole.result.nonfinite_pixels += rows.unusable(band.skipped, band.n);
      if (!request_.history.is_used()) append_layers(rows, band, whole.result.layers);
      if (request_.stages) append_stages(rows, band, out);
    }
    out.names = names_of(makers);
    std::vector<Image> layers = std::move(whole.result.layers);
    out.result = finish(std::move(whole), makers, "mean");
    if (request_.history.is_used()) {
      use_history(out.result);
      append_layers(*last_->rows, last_->band, layers);
      if (request_.stages) out.weights = last_->rows->weights();
    }
    add_up(out.result.estimate, request_.layers, layers);
    out.result.layers = std::move(layers);
    out.result.network_runs = std::max(network_.runs, network_layers_.runs);
    return out;
  }

 private:
  bool has_network() const { return static_cast<bool>(request_.network); }

  std::vector<RowBand> bands(int halo, int first, int end) const {
    if (rows_at_once_ >= height_) return {{0, height_, first, first, end - first}};
    return bands_of(height_, rows_at_once_, halo, first, end);
  }

  /// The rows of a band on the device, where those of the last one stay until others are asked for.
  RowsOnDevice& on_device(const RowBand& band) {
    if (!last_ || last_->band.first != band.first || last_->band.rows != band.rows) {
      last_.reset();  // gives back its memory
      last_.emplace(device_, request_, band, trial_);
    }
    return *last_->rows;
  }

  RowsOnDevice& with_candidates(const RowBand& band) {
    RowsOnDevice& rows = on_device(band);
    if (!has_network()) {
      rows.make_candidates(nullptr);
    } else if (band.rows == height_) {
      rows.make_candidates(&network_);
    } else {
      NetworkImages part{{}, network_.runs};
      for (size_t i = 0; i < part.images.size(); ++i)
        part.images[i] = rows_of(network_.images[i], band.first, band.rows);
      rows.make_candidates(&part);
    }
    return rows;
  }

  /// denoising/frame_history.h; the image is in one band.
  void use_history(MethodImage& result) {
    const MixingHistory& use = request_.history;
    RowsOnDevice& rows = *last_->rows;
    std::optional<FrameHistory> history;
    if (use.before) history.emplace(rows.history_of(*use.before, result.std_error));
    if (use.keep_samples) result.kept_samples.resize(kKeptSamples.size());
    const bool has_samples = has_network() && use.before && !use.before->samples[0].data.empty();
    std::optional<SamplesMixture> accumulated;
    if (has_network() && (has_samples || use.keep_samples)) {
      std::array<Image, 2> halves = rows.halves_with_samples(has_samples ? &*history : nullptr);
      if (has_samples) accumulated.emplace(device_, request_, halves, trial_, network_.runs);
      if (use.keep_samples) std::ranges::move(halves, result.kept_samples.begin());
    }
    if (history) result.estimate = rows.add_history(*history, accumulated ? &accumulated->mixed() : nullptr);
    forget_unwanted_errors(request_.std_error, result);
  }

  void run_network() {
    std::array<Image, 3> noisy;
    std::vector<Image> layers(request_.layers.size());
    for (const RowBand& band : bands(kMeanHalo, 0, height_)) {
      const std::array<Image, 3> part = on_device(band).noisy();
      for (size_t i = 0; i < part.size(); ++i) copy_rows(part[i], band.skipped, band.y, band.n, height_, noisy[i]);
      for (size_t k = 0; k < layers.size(); ++k)
        copy_rows(on_device(band).noisy_layer(layer_of(band, k)), band.skipped, band.y, band.n, height_, layers[k]);
    }
    Stages(device_, trial_).run("network", [&] {
      network_ = request_.network(std::move(noisy));
      if (!layers.empty()) network_layers_ = request_.network_of_layers(std::move(layers));
    });
  }

  /// The rows of layer k in a band.
  Layer layer_of(const RowBand& band, size_t k) const {
    const Layer& whole = request_.layers[k];
    return {whole.name, band.rows < height_ ? rows_of(whole.image, band.first, band.rows) : whole.image, whole.sum};
  }

  void append_layers(RowsOnDevice& rows, const RowBand& band, std::vector<Image>& layers) const {
    layers.resize(request_.layers.size());
    for (size_t k = 0; k < layers.size(); ++k) {
      Image clean;
      if (has_network()) clean = rows_of(network_layers_.images[k], band.first, band.rows);
      const Image part = rows.denoised_layer(layer_of(band, k), has_network() ? &clean : nullptr);
      copy_rows(part, band.skipped, band.y, band.n, height_, layers[k]);
    }
  }

  std::vector<float> find_weights() {
    std::vector<NormalRow> all;
    std::vector<CandidateMaker> makers;
    const int halo = candidates_halo(CandidateBase::kMean, has_network(), kMeanHalo);
    for (const auto& [first, end] : sampled_rows(request_.independent.width, height_))
      for (const RowBand& band : bands(halo, first, end)) {
        RowsOnDevice& rows = with_candidates(band);
        makers = rows.makers();
        const std::vector<NormalRow> part = rows.normal_rows(band.skipped, band.skipped + band.n);
        all.insert(all.end(), part.begin(), part.end());
      }
    return weights_of_whole(true, makers, request_.weighting, mean_samples(request_.independent), all);
  }

  void append_stages(RowsOnDevice& rows, const RowBand& band, MixedDenoising& out) const {
    const auto append_all = [&](const std::vector<Image>& part, std::vector<Image>& whole) {
      whole.resize(part.size());
      for (size_t i = 0; i < part.size(); ++i) copy_rows(part[i], band.skipped, band.y, band.n, height_, whole[i]);
    };
    append_all(rows.candidates(), out.candidates);
    append_all(rows.weights(), out.weights);
  }

  Device& device_;
  const MeanMixture& request_;
  const Trial& trial_;
  const int height_;
  int rows_at_once_ = 0;
  std::optional<BandOnDevice> last_;
  NetworkImages network_;
  NetworkLayers network_layers_;
};

}  // namespace

MixedDenoising mix_mean(Device& device, const MeanMixture& request, const Trial& trial) {
  const GroupedImage& image = request.independent;
  BandNeeds needs;
  needs.bytes_per_pixel = bytes_of_mean(image.groups) + (request.layers.empty() ? 0 : bytes_of_layer(image.groups));
  if (request.features.differences) needs.bytes_per_pixel += kBytesOfHalfFeatures;
  needs.largest_buffer_per_pixel = largest_buffer_of_mean(image.groups);
  const int halo = mixed_halo(CandidateBase::kMean, static_cast<bool>(request.network), kMeanHalo, request.weighting);
  const bool has_history = request.history.is_used(), is_whole = has_history || !image.data;
  if (has_history) needs.bytes_per_pixel += kBytesOfHistory + (request.network ? bytes_of_mean(2) : 0);
  int rows =
      trial.rows_at_once > 0 ? trial.rows_at_once : rows_that_fit(device.info(), image.width, image.height, needs);
  if (is_whole && rows < image.height)
    throw device::Failure(
        device::FailureKind::kMemory,
        fmt::format("{} are denoised as a whole, and the device's memory holds {} of {} rows",
                    has_history ? "frames with a history" : "samples on a device", rows, image.height));
  MeanDenoising denoising(device, request, trial);
  while (true) {
    try {
      return denoising.run(rows);
    } catch (const device::Failure& failure) {
      if (failure.kind() != device::FailureKind::kMemory || rows < 2 * halo || is_whole) throw;
      rows = std::min(rows, image.height) / 2;
    }
  }
}

MixedDenoising mix_pair(Device& device, const PairMixture& request, const Trial& trial) {
  RowsOnDevice rows(device, request, trial);
  NetworkImages network;
  if (request.network) Stages(device, trial).run("network", [&] { network = request.network(); });
  rows.make_candidates(request.network ? &network : nullptr);
  const DenoisingParts& parts = *request.parts;
  MixedRows mixed = rows.mix(weights_of_all(rows, false, request.weighting, parts.groups));
  mixed.result.nonfinite_pixels = parts.whole.image.nonfinite_pixels;
  MixedDenoising out;
  out.names = names_of(rows.makers());
  out.result = finish(std::move(mixed), rows.makers(), parts.name);
  out.result.network_runs = network.runs;
  if (request.history.keep_samples) out.result.kept_samples.resize(kKeptSamples.size());
  if (request.history.before)
    out.result.estimate = rows.add_history(rows.history_of(*request.history.before, out.result.std_error), nullptr);
  forget_unwanted_errors(request.std_error, out.result);
  if (request.stages) out.candidates = rows.candidates(), out.weights = rows.weights();
  return out;
}

}  // namespace covary::gpu
