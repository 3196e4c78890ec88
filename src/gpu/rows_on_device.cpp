// SPDX-License-Identifier: Apache-2.0
#include "gpu/rows_on_device.h"

#include <algorithm>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "denoising/part_features.h"
#include "denoising/weighed_candidate.h"
#include "gpu/held_out.h"
#include "gpu/network_candidates.h"
#include "gpu/residual_correction.h"

namespace covary::gpu {

double bytes_of_mean(int groups) { return 12.0 * groups + 700; }
double largest_buffer_of_mean(int groups) { return 12.0 * std::max(groups, kMaxCandidates); }

RowsOnDevice::RowsOnDevice(Device& device, const MeanMixture& request, const Trial& trial)
    : device_(device),
      base_(CandidateBase::kMean),
      independent_(request.independent),
      auxiliary_(request.features),
      kinds_(request.kinds),
      weighting_(request.weighting),
      std_error_(request.std_error || request.history.is_used()),
      stages_(device, trial) {
  stages_.run("copy samples and auxiliary images", [&] {
    groups_ = upload(device_, independent_);
    upload_features();
  });
  stages_.run("means and errors", [&] { parts_ = parts_of_mean(device_, groups_); });
}

RowsOnDevice::RowsOnDevice(Device& device, const PairMixture& request, const Trial& trial)
    : device_(device),
      base_(CandidateBase::kPair),
      independent_(request.parts->groups),
      auxiliary_(request.parts->features),
      kinds_(FilterKinds::kNlMeans),
      weighting_(request.weighting),
      std_error_(request.std_error || request.history.is_used()),
      stages_(device, trial) {
  stages_.run("copy images", [&] {
    groups_ = upload(device_, independent_);
    device_.write(groups_.valid, request.parts->valid);
    upload_features();
    parts_[0] = upload(device_, request.parts->whole);
    for (const int half : {0, 1}) parts_[half + 1] = upload(device_, request.parts->halves[half]);
  });
}

void RowsOnDevice::upload_features() {
  features_[0].emplace(device_, auxiliary_, kinds_);
  for (const int part : {1, 2})
    if (auxiliary_.differences) features_[part].emplace(device_, PartFeatures(auxiliary_, part).view(), kinds_);
}

std::array<Image, 3> RowsOnDevice::noisy() {
  std::array<Image, 3> images;
  stages_.run("copy images for the network", [&] {
    for (size_t i = 0; i < images.size(); ++i) images[i] = downloaded(parts_[i].noisy(), 3);
  });
  return images;
}

void RowsOnDevice::make_candidates(const NetworkImages* network) {
  if (!makers_.empty()) return;
  stages_.run("candidates", [&] {
    makers_.emplace_back().names = filter_names(auxiliary_, base_, kinds_);
    if (network)  // of a mean, its candidates come first
      makers_.insert(is_mean() ? makers_.begin() : makers_.end(),
                     neural_candidates({}, {}, base_, std::make_shared<const NetworkImages>(*network)));
    const WeighingNetwork* const weighing = network || !is_mean() ? nullptr : WeighingNetwork::find(names_of(makers_));
    if (weighing) add_weighing_maker(auxiliary_, makers_);
    n_candidates_ = static_cast<int>(names_of(makers_).size());
    const size_t filtered = network && is_mean() ? 3 * pixels() * kNetworkCandidates : 0;
    if (weighing) weighing_network_ = std::make_unique<Weighing>(device_, *weighing);
    for (size_t i = 0; i < parts_.size(); ++i) {
      candidates_[i] = device_.make<float>(3 * pixels() * n_candidates_);
      filter(device_, groups_, features_of(i), base_, parts_[i], i > 0, {&candidates_[i], filtered});
      if (network && is_mean()) add_network(network->images[i], i);
      if (network && !is_mean())
        device_.write(candidates_[i], network->images[i].data, 3 * pixels() * (n_candidates_ - 1));
      if (!weighing) continue;
      WeighingCells shares = weighing_network_->add_weighed(weighing_input(i));
      if (i == 0) shares_ = std::move(shares);
    }
  });
}

WeighingBuffers RowsOnDevice::weighing_input(size_t part) const {
  const PartBuffers& p = parts_[part];
  return {groups_.width,      groups_.height,   &p.independent.mean,
          &candidates_[part], &p.noisy_error(), features_of(part).surfaces()};
}

void RowsOnDevice::add_network(const Image& clean, size_t part) {
  const GroupSet set = part == 0 ? GroupSet{} : GroupSet{static_cast<int>(part) - 1, 2};
  const PartBuffers& p = parts_[part];
  write_network_candidates(device_, groups_, p, relative_counts_of(device_, independent_, set), clean,
                           candidates_[part]);
  if (p.limited)
    limit_by_network(device_, groups_.width, groups_.height, n_made(), p.limited, p.limited_error, candidates_[part]);
}

/// Number of candidates without that which consists of others.
int RowsOnDevice::n_made() const { return n_candidates_ - (makers_.back().shares ? 1 : 0); }

MixtureBuffers RowsOnDevice::mixture_input() {
  MixtureBuffers in;
  in.width = groups_.width, in.height = groups_.height, in.candidates = n_candidates_;
  in.whole = {&parts_[0].image(), &candidates_[0]};
  for (const int half : {0, 1}) {
    const PartBuffers& part = parts_[half + 1];
    in.halves[half] = {&part.image(), &candidates_[half + 1]};
    in.independent[half] = &part.independent.mean;
    if (!counts_[half]) counts_[half] = counts_of(half);
    in.counts[half] = &counts_[half];
  }
  in.valid = &groups_.valid;
  in.bias_share = weighting_.bias_share, in.of_pair = !is_mean();
  in.prior = is_mean() ? kPriorOfMean : weighting_.prior;
  return in;
}

/// Of a pair, 1 / (F'_A^2 + 0.01).
Buffer<float> RowsOnDevice::counts_of(int half) {
  const PartBuffers& part = parts_[half + 1];
  if (is_mean()) return error_weights(device_, candidates_[half + 1], part.std_error);
  const Buffer<float> no_error = device_.upload(std::span<const float>(std::vector<float>(3 * pixels())));
  return error_weights(device_, part.image(), no_error);
}

std::vector<NormalRow> RowsOnDevice::normal_rows(int first, int end) {
  std::vector<NormalRow> rows;
  stages_.run("weights of the whole image", [&] { rows = gpu::normal_rows(device_, mixture_input(), first, end); });
  return rows;
}

MixedRows RowsOnDevice::mix(const std::vector<float>& everywhere) {
  stages_.run("mixture", [&] { mixed_ = gpu::mix(device_, mixture_input(), everywhere); });
  if (weighting_.residual_correction && !is_mean()) stages_.run("residual correction", [&] { correct_residual(); });
  MixedRows rows;
  stages_.run("copy picture", [&] { rows.result.estimate = downloaded(mixed_.image, 3); });
  const bool network = has_network(makers_);
  if (is_mean())
    rows.result.risk_kind = network ? ErrorKind::kNetwork : ErrorKind::kFilters;
  else
    rows.result.risk_kind = network ? ErrorKind::kPairNetwork : ErrorKind::kPairFilters;
  if (std_error_) stages_.run("errors, with their copies", [&] { find_errors(rows); });
  return rows;
}

void RowsOnDevice::correct_residual() {
  const std::array<const Buffer<float>*, 3> images = {&mixed_.image, &mixed_.halves[0], &mixed_.halves[1]};
  for (size_t i = 0; i < images.size(); ++i) {
    const PartBuffers& part = parts_[i];
    const ResidualInput input =
        residual_input(device_, part.independent.mean, part.independent.variance_of_mean, part.relative_count);
    gpu::correct_residual(device_, stages_,
                          {groups_.width, groups_.height, &input.guide, &input.other, &groups_.valid, &part.std_error},
                          {}, *images[i]);
  }
}

void RowsOnDevice::find_errors(MixedRows& rows) {
  HeldOutBuffers held_out{groups_.width,   groups_.height, {Place{&mixed_.halves[0]}, Place{&mixed_.halves[1]}}, {},
                          &candidates_[0], &groups_.valid};
  for (const int half : {0, 1}) held_out.independent[half] = &parts_[half + 1].independent;
  rows.error = held_out_parts(device_, held_out);
  MixtureBuffers made = mixture_input();
  made.candidates = n_made();
  rows.disagreement = downloaded(disagreement(device_, made, mixed_.image), 1);
  rows.result.bias = held_out_bias(device_, held_out, {&candidates_[1], &candidates_[2]});
  rows.result.risk_rows =
      image_risk(device_, held_out, mixed_.image, parts_[0].independent, groups_, features_of(0).surfaces());
  for (const auto& [error, n] : base_rows(device_, held_out, parts_[0].std_error)) rows.of_base.push_back({error, n});
  for (int p = 0; p < n_candidates_; ++p) {
    const size_t first = 3 * pixels() * p;
    held_out.halves = {Place{&candidates_[1], first}, Place{&candidates_[2], first}};
    rows.of_candidates.push_back(held_out_rows(device_, held_out));
  }
}

FrameHistory RowsOnDevice::history_of(const History& before, const Image& std_error) {
  FrameBuffers frame{groups_.width, groups_.height, {}, {}, &candidates_[0], &groups_.valid};
  for (const int half : {0, 1}) {
    frame.independent[half] = &parts_[half + 1].independent.mean;
    if (is_mean()) frame.counts[half] = &counts_[half];
  }
  return FrameHistory(device_, before, std_error, frame);
}

std::array<Image, 2> RowsOnDevice::halves_with_samples(const FrameHistory* history) {
  if (!history) return {downloaded(parts_[1].image(), 3), downloaded(parts_[2].image(), 3)};
  std::array<Image, 2> halves;
  stages_.run("samples of frames before", [&] {
    const std::array<Buffer<float>, 2> made =
        history->add_samples(parts_[0].image(), {&parts_[1].image(), &parts_[2].image()});
    halves = {downloaded(made[0], 3), downloaded(made[1], 3)};
  });
  return halves;
}

Image RowsOnDevice::add_history(const FrameHistory& history, const MixedBuffers* accumulated) {
  Image picture;
  stages_.run("history", [&] {
    history.add_history(accumulated, n_candidates_, mixed_);
    picture = downloaded(mixed_.image, 3);
  });
  return picture;
}

LayerBuffers RowsOnDevice::upload_layer(const Layer& layer) {
  const bool is_part = layer.sum != Layer::kNoSum;
  if (is_part && !limits_) limits_ = limits_of(device_, groups_, {});
  return gpu::upload_layer(device_, layer.image, groups_, is_part ? &*limits_ : nullptr);
}

Image RowsOnDevice::noisy_layer(const Layer& layer) {
  Image image;
  stages_.run("copy layers for the network", [&] { image = downloaded(upload_layer(layer).noisy, 3); });
  return image;
}

Image RowsOnDevice::denoised_layer(const Layer& layer, const Image* clean) {
  Image image;
  stages_.run("layers, with their copies", [&] {
    const LayerBuffers means = upload_layer(layer);
    auto made = device_.make<float>(3 * pixels() * n_made());
    const int of_network = clean ? kNetworkCandidates : 0;
    for (int p = 0; p < of_network; ++p) device_.write(made, clean->data, 3 * pixels() * p);
    filter(device_, groups_, features_of(0), base_, parts_[0], false, {&made, 3 * pixels() * of_network}, &means.noisy);
    const bool is_shared = n_made() < n_candidates_;
    const Buffer<float> shared =
        is_shared ? weighing_network_->share_weight(shares_, weighing_input(0), mixed_.weights) : Buffer<float>();
    MixtureBuffers in = mixture_input();
    in.candidates = n_made();
    image = downloaded(mixture_of(device_, in, {&means.mean, &made}, is_shared ? shared : mixed_.weights), 3);
  });
  return image;
}

long RowsOnDevice::unusable(int first, int n) {
  std::vector<unsigned char> valid(static_cast<size_t>(n) * groups_.width);
  device_.read(groups_.valid, valid, static_cast<size_t>(first) * groups_.width);
  return std::count(valid.begin(), valid.end(), 0);
}

Image RowsOnDevice::downloaded(const Buffer<float>& buffer, int channels, size_t first) {
  Image image(groups_.width, groups_.height, channels);
  device_.read(buffer, image.data, first);
  return image;
}

std::vector<Image> RowsOnDevice::downloaded_images(const Buffer<float>& buffer, int channels) {
  std::vector<Image> images;
  for (int p = 0; p < n_candidates_; ++p) images.push_back(downloaded(buffer, channels, pixels() * channels * p));
  return images;
}

}  // namespace covary::gpu
