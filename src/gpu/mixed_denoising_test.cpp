// SPDX-License-Identifier: Apache-2.0
// The default's denoising on a device, as a whole, against the processor's.
#include "gpu/mixed_denoising.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "combine/registry.h"
#include "device/wrapped_backend.h"
#include "estimators/test_images.h"
#include "gpu/comparison.h"
#include "gpu/rows_on_device.h"
#include "gpu/target.h"
#include "risk/error_interval.h"
#include "risk/plain_mean.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;

constexpr int kWidth = 72, kHeight = 53;

struct Pictures {
  Image albedo = Image(kWidth, kHeight, 3), normal = albedo, position = albedo;

  Pictures() {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          albedo.pixel(x, y)[c] = 0.4f + 0.3f * test::noise(4, static_cast<uint64_t>(x / 8 + y / 8 * 100), c);
          normal.pixel(x, y)[c] = x + y > 45 ? 0.3f : -0.6f;
          position.pixel(x, y)[c] = static_cast<float>(c == 0 ? x : c == 1 ? y : x + y) * 0.05f;
        }
  }
};

Method denoised_mean(DenoiseMode mode, bool on_device) {
  MixedDenoisingOptions options;
  options.mode = mode;
  options.use_oidn = false;
  if (on_device)
    options.mix_mean = [](const MeanMixture& request, const auto&) { return mix_mean(test_device(), request); };
  return with_denoising(make_estimator(kMixture), options);
}

EstimatorResult picture_of(const test::Grouped& image, const Features& features, DenoiseMode mode, bool on_device,
                           bool std_error = true) {
  MethodSettings settings;
  settings.std_error = std_error;
  settings.features = features;
  return with_error(denoised_mean(mode, on_device).image({{}, image.view()}, settings));
}

void expect_same(const test::Grouped& image, const Features& features, DenoiseMode mode) {
  const EstimatorResult expected = picture_of(image, features, mode, false),
                        found = picture_of(image, features, mode, true);
  EXPECT_TRUE(agree(expected.estimate.data, found.estimate.data));
  EXPECT_TRUE(agree(expected.std_error.data, found.std_error.data));
  EXPECT_TRUE(agree(expected.bias.data, found.bias.data));
  EXPECT_EQ(expected.nonfinite_pixels, found.nonfinite_pixels);
  ASSERT_TRUE(found.interval && found.risks);
  EXPECT_NEAR(found.interval->below, expected.interval->below, 1e-3);
  EXPECT_NEAR(found.interval->above, expected.interval->above, 1e-3 * expected.interval->above);
  ASSERT_EQ(found.risks->images.size(), expected.risks->images.size());
  for (size_t i = 0; i < found.risks->images.size(); ++i) {
    EXPECT_EQ(found.risks->images[i].name, expected.risks->images[i].name);
    EXPECT_NEAR(found.risks->images[i].relmse, expected.risks->images[i].relmse,
                1e-3 * expected.risks->images[i].relmse);
  }
}

TEST(GpuMixedDenoising, IsThatOfTheProcessor) {
  const Pictures p;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 12, 21, 1);
  expect_same(image, {&p.albedo, &p.normal, nullptr, nullptr, &p.position}, DenoiseMode::kAuto);
  expect_same(image, {}, DenoiseMode::kAuto);
}

TEST(GpuMixedDenoising, TakesFeaturesOfEachHalf) {
  const Pictures p;
  Image other = p.albedo;
  for (size_t i = 0; i < other.data.size(); ++i) other.data[i] += 0.1f * test::noise(5, i, 0);
  std::fill_n(other.pixel(0, 20), 60, 0.0f);  // black pixels
  FeatureDifferences differences;
  for (size_t i = 0; i < other.data.size(); ++i)
    differences.values[feature::kAlbedo].push_back(upper_half(other.data[i] - p.albedo.data[i]));
  Features features{&p.albedo, &p.normal};
  features.differences = &differences;
  expect_same(test::noisy_image(kWidth, kHeight, 12, 24, 1), features, DenoiseMode::kAuto);
}

TEST(GpuMixedDenoising, TakesManySamplesAndPixelsThatAreLeftOut) {
  const Pictures p;
  test::Grouped image = test::noisy_image(kWidth, kHeight, 8, 22, 1);
  image.counts.assign(size_t{kWidth} * kHeight, 96);  // NL-means beside the regression
  image.pixel(10, 11)[2] = std::numeric_limits<float>::infinity();
  expect_same(image, {&p.albedo, &p.normal}, DenoiseMode::kBalanced);
}

TEST(GpuMixedDenoising, TakesTwoGroups) {
  const Pictures p;
  test::Grouped image = test::noisy_image(kWidth, kHeight, 2, 23, 1);
  image.counts.assign(size_t{kWidth} * kHeight, 8);
  expect_same(image, {&p.albedo}, DenoiseMode::kAuto);
}

/// Stands for a network: the mean of 3 x 3 pixels.
Image blurred(const Image& image) {
  Image result = image;
  for (int y = 1; y + 1 < image.height; ++y)
    for (int x = 1; x + 1 < image.width; ++x)
      for (int c = 0; c < 3; ++c) {
        float sum = 0;
        for (int i = 0; i < 9; ++i) sum += image.pixel(x + i % 3 - 1, y + i / 3 - 1)[c];
        result.pixel(x, y)[c] = sum / 9;
      }
  return result;
}

TEST(GpuMixedDenoising, TakesTheImagesOfANetwork) {
  const Pictures p;
  test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 27, 1);
  for (int i = 0; i < kWidth * kHeight; ++i) image.counts.push_back(12 + static_cast<uint32_t>(i % 5));
  image.pixel(30, 30)[0] = 2000;  // a firefly
  const Features features{&p.albedo, &p.normal};
  DenoisingParts parts = covary::parts_of_mean(image.view());
  const auto network = [](const std::array<Image, 3>& noisy) {
    return NetworkImages{{blurred(noisy[0]), blurred(noisy[1]), blurred(noisy[2])}, 3};
  };
  const auto made = std::make_shared<const NetworkImages>(
      network({parts.whole.limited->estimate, parts.halves[0].limited->estimate, parts.halves[1].limited->estimate}));
  const std::vector<CandidateMaker> makers = {
      neural_candidates({}, {}, CandidateBase::kMean, made),
      filtered_candidates(features, CandidateBase::kMean, FilterKinds::kNlMeans)};
  parts.features = features;
  const MixedDenoising expected = denoise_by_mixture(std::move(parts), makers, DenoiseMode::kAuto, true);
  const MixedDenoising found =
      mix_mean(test_device(), {image.view(), features, FilterKinds::kNlMeans, {1, 1, false}, network, true, true});
  EXPECT_EQ(found.names, expected.names);
  EXPECT_EQ(found.result.network_runs, 3);
  for (size_t i = 0; i < expected.candidates.size(); ++i)
    EXPECT_TRUE(agree(expected.candidates[i].data, found.candidates[i].data)) << expected.names[i];
  EXPECT_TRUE(agree(expected.result.estimate.data, found.result.estimate.data));
  EXPECT_TRUE(agree(expected.result.std_error.data, found.result.std_error.data));
}

/// The command line's method uses the device, and says so; what devices cannot do is told.
TEST(GpuMixedDenoising, IsPartOfTheDefault) {
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 28, 1);
  const auto target = std::make_shared<Target>(device::Device::open("opencl"), false);
  const Method method = make_default_estimator(false, {}, {DenoisingChoice::kAuto, "off", {}}, target);
  const MethodImage found = method.image({{}, image.view()}, {});
  EXPECT_EQ(target->made_by(), target->info().text());
  EXPECT_EQ(found.note, "");
  test::Grouped of_few = image;
  of_few.counts.assign(size_t{kWidth} * kHeight, 3);
  EXPECT_NE(method.image({{}, of_few.view()}, {}).note.find("on the processor"), std::string::npos);
}

TEST(GpuMixedDenoising, TimesItsStages) {
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 29, 1);
  std::vector<std::string> stages;
  const Trial trial{"", 0, [&](const std::string& stage, double seconds) {
                      stages.push_back(stage);
                      EXPECT_GE(seconds, 0);
                    }};
  mix_mean(test_device(), {image.view(), {}, FilterKinds::kNlMeans, {1, 0, false}, {}, true, false}, trial);
  EXPECT_EQ(stages, (std::vector<std::string>{"copy samples and auxiliary images", "means and errors", "candidates",
                                              "weights of the whole image", "mixture", "copy picture",
                                              "errors, with their copies"}));
}

/// A device of so many bytes, whose allocation number `first_failing` fails, when it is tried again, too.
class SmallBackend final : public test_support::WrappedBackend {
 public:
  SmallBackend(uint64_t memory, int first_failing)
      : info_(WrappedBackend::info()), left_(memory), first_failing_(first_failing) {
    info_.memory = memory;
  }
  const device::DeviceInfo& info() const override { return info_; }
  uint64_t allocate(size_t bytes) override {
    const int number = n_++;
    if (bytes > left_ || number == first_failing_ || number == first_failing_ + 1)
      throw device::Failure(device::FailureKind::kMemory, "the device is full");
    const uint64_t buffer = WrappedBackend::allocate(bytes);
    left_ -= sizes_[buffer] = bytes;
    return buffer;
  }
  void release(uint64_t buffer) noexcept override {
    left_ += sizes_[buffer];
    WrappedBackend::release(buffer);
  }

 private:
  device::DeviceInfo info_;
  uint64_t left_;
  const int first_failing_;
  int n_ = 0;
  std::map<uint64_t, uint64_t> sizes_;
};

/// A picture that is higher than bands and what they overlap by.
struct HighPicture {
  static constexpr int kHigh = 470, kNarrow = 12;
  Image albedo = Image(kNarrow, kHigh, 3), normal = albedo;
  test::Grouped image = test::noisy_image(kNarrow, kHigh, 6, 31, 1);
  Features features{&albedo, &normal};

  HighPicture() {
    for (int y = 0; y < kHigh; ++y)
      for (int x = 0; x < kNarrow; ++x)
        for (int c = 0; c < 3; ++c) {
          albedo.pixel(x, y)[c] = 0.4f + 0.3f * test::noise(4, static_cast<uint64_t>(x / 8 + y / 8 * 100), c);
          normal.pixel(x, y)[c] = x + y % 50 > 30 ? 0.3f : -0.6f;
        }
    image.pixel(5, 200)[0] = std::numeric_limits<float>::infinity();
  }
  MeanMixture request(bool with_network = false) const {
    MeanMixture mixture{image.view(), features, kinds_of_mean(with_network), {1, 1, false}, {}, true, true};
    if (with_network)
      mixture.network = [](const std::array<Image, 3>& noisy) {
        return NetworkImages{{blurred(noisy[0]), blurred(noisy[1]), blurred(noisy[2])}, 3};
      };
    return mixture;
  }
};

void expect_like_whole(const MixedDenoising& whole, const MixedDenoising& bands) {
  EXPECT_TRUE(agree(whole.result.estimate.data, bands.result.estimate.data));
  EXPECT_TRUE(agree(whole.result.std_error.data, bands.result.std_error.data));
  EXPECT_TRUE(agree(whole.result.bias.data, bands.result.bias.data));
  EXPECT_EQ(bands.result.nonfinite_pixels, 1);
  EXPECT_EQ(whole.result.network_runs, bands.result.network_runs);
  ASSERT_EQ(whole.names, bands.names);
  for (size_t i = 0; i < whole.names.size(); ++i) {
    EXPECT_TRUE(agree(whole.candidates[i].data, bands.candidates[i].data)) << whole.names[i];
    EXPECT_TRUE(agree(whole.weights[i].data, bands.weights[i].data)) << whole.names[i];
  }
}

TEST(GpuMixedDenoising, WorksInBands) {
  const HighPicture p;
  for (const bool with_network : {false, true}) {
    SCOPED_TRACE(with_network);
    std::vector<std::string> stages;
    const Trial bands{"", with_network ? 340 : 440, [&](const std::string& stage, double) { stages.push_back(stage); }};
    const MeanMixture request = p.request(with_network);
    expect_like_whole(mix_mean(test_device(), request), mix_mean(test_device(), request, bands));
    EXPECT_GE(std::ranges::count(stages, "mixture"), 2);
    EXPECT_EQ(std::ranges::count(stages, "network"), with_network ? 1 : 0);
  }
}

/// The mixture by a device of so many bytes, and the number of bands.
std::pair<MixedDenoising, int> mixed_by(const MeanMixture& request, uint64_t memory, int first_failing = -2) {
  device::Device device(std::make_shared<SmallBackend>(memory, first_failing));
  int bands = 0;
  const Trial trial{"", 0, [&](const std::string& stage, double) { bands += stage == "mixture"; }};
  MixedDenoising mixed = mix_mean(device, request, trial);
  return {std::move(mixed), bands};
}

TEST(GpuMixedDenoising, PlansTheMemoryThatThereIs) {
  const HighPicture p;
  const auto pixels = static_cast<uint64_t>(HighPicture::kHigh) * HighPicture::kNarrow;
  const uint64_t plan = static_cast<uint64_t>(bytes_of_mean(6)) * pixels * 5 / 4;
  const auto [whole, one] = mixed_by(p.request(), plan + 10000);
  EXPECT_EQ(one, 1);
  const auto [in_bands, bands] = mixed_by(p.request(), plan - plan / 50);
  EXPECT_GT(bands, 1);
  expect_like_whole(whole, in_bands);
  EXPECT_THROW(mixed_by(p.request(), plan / 4), device::Failure);
}

/// With the network's images of the first try.
TEST(GpuMixedDenoising, FallsBackToBandsWithoutMemory) {
  const HighPicture p;
  const auto [whole, one] = mixed_by(p.request(true), uint64_t{1} << 30);
  const auto [in_bands, bands] = mixed_by(p.request(true), uint64_t{1} << 30, 36);
  EXPECT_EQ(one, 1);
  EXPECT_GT(bands, 1);
  expect_like_whole(whole, in_bands);
}

TEST(GpuMixedDenoising, IsTheSameEveryTime) {
  const Pictures p;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 12, 24, 1);
  const Features features{&p.albedo, &p.normal};
  const EstimatorResult first = picture_of(image, features, DenoiseMode::kAuto, true),
                        second = picture_of(image, features, DenoiseMode::kAuto, true);
  EXPECT_EQ(first.estimate.data, second.estimate.data);
  EXPECT_EQ(first.std_error.data, second.std_error.data);
}

/// Counts what is copied to it.
class CountingBackend final : public test_support::WrappedBackend {
 public:
  explicit CountingBackend(size_t& written) : written_(written) {}
  void write(uint64_t buffer, size_t offset, const void* from, size_t bytes) override {
    written_ += bytes;
    WrappedBackend::write(buffer, offset, from, bytes);
  }

 private:
  size_t& written_;
};

/// Those that another program made there: the same bits, without a copy, and they are left as they are.
TEST(GpuMixedDenoising, ReadsSamplesOnTheDeviceInPlace) {
  const Pictures p;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 30, 1);
  size_t written = 0;
  device::Device device(std::make_shared<CountingBackend>(written));
  MeanMixture request{image.view(), {&p.albedo, &p.normal}, FilterKinds::kAll, {1, 1, false}, {}, true, false};
  const MixedDenoising expected = mix_mean(device, request);
  const size_t with_copy = std::exchange(written, 0);
  const Buffer<float> owned = device.upload(std::span(image.data));
  {
    const ValuesOnDevice samples{nullptr, owned.handle(), device.info().id()};
    request.independent.data = nullptr;
    request.independent.on_device = &samples;
    written = 0;
    const MixedDenoising found = mix_mean(device, request);
    EXPECT_EQ(found.result.estimate.data, expected.result.estimate.data);
    EXPECT_EQ(found.result.std_error.data, expected.result.std_error.data);
    EXPECT_EQ(with_copy - written, image.data.size() * sizeof(float));
    EXPECT_EQ(device.download(owned), image.data);
    EXPECT_THROW(mix_mean(device, request, {"", 20, {}}), device::Failure) << "not in bands";
  }
}

TEST(GpuMixedDenoising, TellsItsStages) {
  const Pictures p;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 26, 1);
  MethodSettings settings;
  settings.features = {&p.albedo, &p.normal};
  const auto expected = denoised_mean(DenoiseMode::kAuto, false).stages({{}, image.view()}, settings),
             found = denoised_mean(DenoiseMode::kAuto, true).stages({{}, image.view()}, settings);
  ASSERT_EQ(found.size(), 10u);
  for (const auto& [name, stage] : expected) EXPECT_TRUE(agree(stage.data, found.at(name).data)) << name;
}

TEST(GpuMixedDenoising, MakesThePictureAlone) {
  const Pictures p;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 25, 1);
  const EstimatorResult expected = picture_of(image, {&p.albedo}, DenoiseMode::kAuto, false, false),
                        found = picture_of(image, {&p.albedo}, DenoiseMode::kAuto, true, false);
  EXPECT_TRUE(agree(expected.estimate.data, found.estimate.data));
  EXPECT_TRUE(found.std_error.data.empty());
}

}  // namespace
}  // namespace covary::gpu
