// SPDX-License-Identifier: Apache-2.0
#include "gpu/mixed_denoising.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "denoising/mixed_rows.h"
#include "denoising/weighed_candidate.h"
#include "gpu/denoising_parts.h"
#include "gpu/filtered_candidates.h"
#include "gpu/held_out.h"
#include "gpu/mixture.h"
#include "gpu/network_candidates.h"

namespace covary::gpu {
namespace {

class MeanDenoising {
 public:
  MeanDenoising(Device& device, const MeanMixture& request, const Trial& trial)
      : device_(device), request_(request), stages_(device, trial) {}

  MixedDenoising run() {
    stages_.run("copy samples and auxiliary images", [&] {
      groups_ = upload(device_, request_.independent);
      features_.emplace(device_, request_.features, request_.kinds);
    });
    stages_.run("means and errors", [&] { parts_ = parts_of_mean(device_, groups_); });
    stages_.run(request_.network ? "candidates, with the network" : "candidates", [&] { make_candidates(); });
    MixtureBuffers input;
    MixedBuffers mixed;
    stages_.run("mixture", [&] {
      input = mixture_input();
      mixed = mix(device_, input, [&](const std::vector<NormalRow>& rows) {
        return weights_of_whole(true, makers_, request_.weighting, mean_samples(request_.independent), rows);
      });
    });
    MixedDenoising out;
    out.names = names_of(makers_);
    out.result = finish(rows_of(input, mixed), makers_, "mean");
    out.result.network_runs = network_runs_;
    if (!request_.stages) return out;
    out.weights = downloaded_images(mixed.weights, 1);
    out.candidates = downloaded_images(candidates_[0], 3);
    return out;
  }

 private:
  size_t pixels() const { return static_cast<size_t>(groups_.pixels()); }

  /// Tells the names: those of the network first.
  void make_candidates() {
    NetworkImages network;
    if (request_.network) {
      network = request_.network(
          {downloaded(parts_[0].noisy(), 3), downloaded(parts_[1].noisy(), 3), downloaded(parts_[2].noisy(), 3)});
      makers_.push_back(
          neural_candidates({}, {}, CandidateBase::kMean, std::make_shared<const NetworkImages>(network)));
    }
    makers_.emplace_back().names = filter_names(request_.features, CandidateBase::kMean, request_.kinds);
    add_weighing_maker(request_.features, makers_);
    n_candidates_ = static_cast<int>(names_of(makers_).size());
    for (size_t i = 0; i < parts_.size(); ++i) {
      candidates_[i] = device_.make<float>(3 * pixels() * n_candidates_);
      const size_t filtered = request_.network ? 3 * pixels() * kNetworkCandidates : 0;
      filter(device_, groups_, *features_, parts_[i], i > 0, {&candidates_[i], filtered});
      if (request_.network) add_network(network.images[i], i);
      if (makers_.back().shares) add_weighed_candidate(i);
    }
    network_runs_ = network.runs;
  }

  void add_network(const Image& clean, size_t i) {
    const GroupSet set = i == 0 ? GroupSet{} : GroupSet{static_cast<int>(i) - 1, 2};
    write_network_candidates(device_, groups_, parts_[i], relative_counts_of(device_, request_.independent, set), clean,
                             candidates_[i]);
    if (parts_[i].limited)
      limit_by_network(device_, groups_.width, groups_.height, n_made(), parts_[i].limited, parts_[i].limited_error,
                       candidates_[i]);
  }

  /// Number of candidates without that which consists of others.
  int n_made() const { return n_candidates_ - (makers_.back().shares ? 1 : 0); }

  /// The others come down, and that candidate goes up.
  void add_weighed_candidate(size_t i) {
    CandidateSet set{downloaded(parts_[i].independent.mean, 3), {}};
    for (int p = 0; p < n_made(); ++p) set.candidates.push_back(downloaded(candidates_[i], 3, 3 * pixels() * p));
    const Image std_error = downloaded(parts_[i].noisy_error(), 3);
    CandidateInput input;
    input.std_error = &std_error;
    add_weighed(makers_.back(), input, set);
    device_.write(candidates_[i], set.candidates.back().data, 3 * pixels() * n_made());
  }

  MixtureBuffers mixture_input() {
    MixtureBuffers in;
    in.width = groups_.width, in.height = groups_.height, in.candidates = n_candidates_;
    in.whole = {&parts_[0].independent.mean, &candidates_[0]};
    for (const int half : {0, 1}) {
      const PartBuffers& part = parts_[half + 1];
      in.halves[half] = {&part.independent.mean, &candidates_[half + 1]};
      in.independent[half] = &part.independent.mean;
      counts_[half] = error_weights(device_, candidates_[half + 1], part.std_error);
      in.counts[half] = &counts_[half];
    }
    in.valid = &groups_.valid;
    in.bias_share = request_.weighting.bias_share;
    in.prior = kPriorOfMean;
    return in;
  }

  /// What mixed_rows() of denoising/mixed_rows.h makes.
  MixedRows rows_of(const MixtureBuffers& input, const MixedBuffers& mixed) {
    MixedRows rows;
    stages_.run("copy picture", [&] {
      rows.result.estimate = downloaded(mixed.image, 3);
      const std::vector<unsigned char> valid = device_.download(groups_.valid);
      rows.result.nonfinite_pixels = std::count(valid.begin(), valid.end(), 0);
    });
    rows.result.risk_kind = has_network(makers_) ? ErrorKind::kNetwork : ErrorKind::kFilters;
    if (request_.std_error) stages_.run("errors, with their copies", [&] { find_errors(input, mixed, rows); });
    return rows;
  }

  void find_errors(const MixtureBuffers& input, const MixedBuffers& mixed, MixedRows& rows) {
    HeldOutBuffers held_out{groups_.width,   groups_.height, {Place{&mixed.halves[0]}, Place{&mixed.halves[1]}}, {},
                            &candidates_[0], &groups_.valid};
    for (const int half : {0, 1}) held_out.independent[half] = &parts_[half + 1].independent;
    rows.error = held_out_parts(device_, held_out);
    MixtureBuffers made = input;
    made.candidates = n_made();
    rows.disagreement = downloaded(disagreement(device_, made, mixed.image), 1);
    rows.result.bias = held_out_bias(device_, held_out, {&candidates_[1], &candidates_[2]});
    rows.result.risk_rows =
        image_risk(device_, held_out, mixed.image, parts_[0].independent, groups_, features_->surfaces());
    for (const auto& [error, n] : base_rows(device_, held_out, parts_[0].std_error)) rows.of_base.push_back({error, n});
    for (int p = 0; p < n_candidates_; ++p) {
      const size_t first = 3 * pixels() * p;
      held_out.halves = {Place{&candidates_[1], first}, Place{&candidates_[2], first}};
      rows.of_candidates.push_back(held_out_rows(device_, held_out));
    }
  }

  Image downloaded(const Buffer<float>& buffer, int channels, size_t first = 0) {
    Image image(groups_.width, groups_.height, channels);
    device_.read(buffer, image.data, first);
    return image;
  }
  std::vector<Image> downloaded_images(const Buffer<float>& buffer, int channels) {
    std::vector<Image> images;
    for (int p = 0; p < n_candidates_; ++p) images.push_back(downloaded(buffer, channels, pixels() * channels * p));
    return images;
  }

  Device& device_;
  const MeanMixture& request_;
  Stages stages_;
  Groups groups_;
  std::optional<FeatureBuffers> features_;
  std::array<PartBuffers, 3> parts_;
  std::vector<CandidateMaker> makers_;
  int n_candidates_ = 0, network_runs_ = 0;
  std::array<Buffer<float>, 3> candidates_;
  std::array<Buffer<float>, 2> counts_;
};

}  // namespace

MixedDenoising mix_mean(Device& device, const MeanMixture& request, const Trial& trial) {
  return MeanDenoising(device, request, trial).run();
}

}  // namespace covary::gpu
