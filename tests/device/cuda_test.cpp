// SPDX-License-Identifier: Apache-2.0
// Devices by CUDA, whose driver and compiler are those of cuda_stand_in.cpp.
#include <gtest/gtest.h>

#include <cstdlib>
#include <numeric>
#include <string>
#include <vector>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "device/device.h"
#include "device/kernel_source.h"
#include "estimators/test_images.h"
#include "gpu/comparison.h"
#include "gpu/mixed_denoising.h"
#include "gpu/target.h"
#include "support/files.h"

namespace covary::device {
namespace {

constexpr int kWidth = 40, kHeight = 29;

/// Programs are told of the stand-in by these; kernels are not kept.
class Cuda : public testing::Test {
 protected:
  Cuda() {
    setenv("COVARY_NVRTC", COVARY_CUDA_STAND_IN, 1);
    setenv("COVARY_KERNEL_CACHE", cache_.path().c_str(), 1);
  }
  ~Cuda() override { unsetenv("COVARY_KERNEL_CACHE"); }

 private:
  test_support::TemporaryFolder cache_;
};

TEST_F(Cuda, IsListed) {
  const std::vector<DeviceInfo> all = devices();
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all[0].text(), "cuda:0 (a stand-in for tests)");
  EXPECT_EQ(all[0].driver, "CUDA 12.4, NVRTC 12.4, sm_90");
  EXPECT_EQ(all[0].memory, size_t{1} << 30);
  EXPECT_EQ(all[0].local_memory, 96u << 10);
  EXPECT_TRUE(all[0].stops_long_work);
  EXPECT_EQ(Device::open("auto").info().id(), "cuda:0");
}

TEST_F(Cuda, GivesKernelsTheirArguments) {
  std::vector<float> values(1000);
  std::iota(values.begin(), values.end(), 1.0f);
  for (int run = 0; run < 2; ++run) {  // compiled, and from the cache
    Device device = Device::open("cuda");
    const Buffer<float> from = device.upload(std::span<const float>(values)), to = device.make<float>(2);
    device.launch(device.kernel("sum.cl", "sum", {"GROUP=64"}), {64}, {64}, from, 1000, to);
    EXPECT_EQ(device.download(to)[0], 500500.0f);
    device.launch(device.kernel("sum.cl", "sum_in_given_memory", {"GROUP=64"}), {64}, {64}, from, 999, to,
                  LocalMemory{64 << 10});
    EXPECT_EQ(device.download(to)[0], 499500.0f);
  }
}

/// What cuda_backend.cpp writes to a variable of the kernels.
TEST_F(Cuda, BeginsALaunchAtItsFirstGroup) {
  const std::unique_ptr<Backend> backend = open_cuda(0);
  const std::string source = kernel_source("portable.h") + R"(
KERNEL places(GLOBAL int* result) {
  const int i = get_global_id(0) + 10 * get_global_id(1);
  result[i] = 1 + get_group_id(0) * 100 + get_group_id(1) * 1000;
})";
  const uint64_t program = backend->load(backend->compile(source, {})), kernel = backend->kernel(program, "places");
  const uint64_t buffer = backend->allocate(100 * sizeof(int));
  std::vector<int> found(100);
  backend->write(buffer, 0, found.data(), 100 * sizeof(int));
  const Argument argument{Argument::Kind::kBuffer, buffer};
  backend->launch(kernel, {{1, 3, 0}, {2, 4, 1}, {2, 1, 1}}, {&argument, 1});
  backend->launch(kernel, {{0, 0, 0}, {1, 1, 1}, {2, 1, 1}}, {&argument, 1});
  backend->read(buffer, 0, found.data(), 100 * sizeof(int));
  std::vector<int> expected(100);
  for (int y = 3; y < 7; ++y)
    for (int x = 2; x < 6; ++x) expected[static_cast<size_t>(x + 10 * y)] = 1 + x / 2 * 100 + y * 1000;
  expected[0] = expected[1] = 1;
  EXPECT_EQ(found, expected);
  backend->release(buffer);
  backend->unload(program);
}

template <typename Action>
Failure failure_of(const Action& action) {
  try {
    action();
  } catch (const Failure& failure) {
    return failure;
  }
  ADD_FAILURE() << "nothing was thrown";
  return {FailureKind::kLost, ""};
}

TEST_F(Cuda, TellsItsFaults) {
  Device device = Device::open("cuda:0");
  const Failure words = failure_of([&] { device.kernel_of("KERNEL f() { no such words }", "f", {}); });
  EXPECT_EQ(words.kind(), FailureKind::kCompile);
  EXPECT_EQ(std::string(words.what()).find("NVRTC cannot compile a kernel: "), 0u) << words.what();
  const Failure memory = failure_of([&] { device.make<char>(size_t{1} << 40); });
  EXPECT_EQ(memory.kind(), FailureKind::kMemory);
  EXPECT_EQ(std::string(memory.what()),
            "cuda:0 (a stand-in for tests) failed: a buffer of 1048576 MB: CUDA_ERROR_OUT_OF_MEMORY");
  EXPECT_EQ(failure_of([] { Device::open("cuda:1"); }).kind(), FailureKind::kUnavailable);
  EXPECT_EQ(failure_of([] { read_from_cuda(1, 0, nullptr, 0); }).kind(), FailureKind::kLost);
}

/// The default's image, which launches most kinds of kernels.
Image image_on(const std::string& device) {
  MethodSettings settings;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 21, 1);
  return make_default_estimator(false, {}, {"auto", "off", {}}, gpu::Target::open(device))
      .image({{}, image.view()}, settings)
      .estimate;
}

TEST_F(Cuda, MakesTheImageOfTheProcessor) {
  EXPECT_TRUE(test_support::agree(image_on("cpu").data, image_on("cuda").data));
}

/// Memory that another program has there.
TEST_F(Cuda, ReadsMemoryOfOthers) {
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 30, 1);
  Device other = Device::open("cuda"), device = Device::open("cuda");
  const Buffer<float> owned = other.upload(std::span(image.data));
  std::vector<float> copy(image.data.size());
  read_from_cuda(0, owned.handle(), copy.data(), copy.size() * sizeof(float));
  EXPECT_EQ(copy, image.data);
  MeanMixture request{image.view(), {}, FilterKinds::kAll, {1, 1, false}, {}, true, false};
  const MixedDenoising expected = gpu::mix_mean(device, request);
  const ValuesOnDevice there{nullptr, owned.handle(), "cuda:0"};
  request.independent.data = nullptr, request.independent.on_device = &there;
  EXPECT_EQ(gpu::mix_mean(device, request).result.estimate.data, expected.result.estimate.data);
}

}  // namespace
}  // namespace covary::device
