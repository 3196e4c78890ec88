// SPDX-License-Identifier: Apache-2.0
#include "gpu/mixed_denoising.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "denoising/denoising_parts.h"
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
      append_layers(rows, band, whole.result.layers);
      if (request_.stages) append_stages(rows, band, out);
    }
    out.names = names_of(makers);
    std::vector<Image> layers = std::move(whole.result.layers);
    out.result = finish(std::move(whole), makers, "mean");
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
  needs.largest_buffer_per_pixel = largest_buffer_of_mean(image.groups);
  const int halo = mixed_halo(CandidateBase::kMean, static_cast<bool>(request.network), kMeanHalo, request.weighting);
  int rows =
      trial.rows_at_once > 0 ? trial.rows_at_once : rows_that_fit(device.info(), image.width, image.height, needs);
  MeanDenoising denoising(device, request, trial);
  while (true) {
    try {
      return denoising.run(rows);
    } catch (const device::Failure& failure) {
      if (failure.kind() != device::FailureKind::kMemory || rows < 2 * halo) throw;
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
  std::vector<NormalRow> all;
  for (const auto& [first, end] : sampled_rows(parts.groups.width, parts.groups.height)) {
    const std::vector<NormalRow> some = rows.normal_rows(first, end);
    all.insert(all.end(), some.begin(), some.end());
  }
  MixedRows mixed =
      rows.mix(weights_of_whole(false, rows.makers(), request.weighting, mean_samples(parts.groups), all));
  mixed.result.nonfinite_pixels = parts.whole.image.nonfinite_pixels;
  MixedDenoising out;
  out.names = names_of(rows.makers());
  out.result = finish(std::move(mixed), rows.makers(), parts.name);
  out.result.network_runs = network.runs;
  if (request.stages) out.candidates = rows.candidates(), out.weights = rows.weights();
  return out;
}

}  // namespace covary::gpu
