// SPDX-License-Identifier: Apache-2.0
// Devices by OpenCL on the processor (Debian: pocl-opencl-icd), which behave as any other.
#include "device/device.h"

#include <gtest/gtest.h>

#include <chrono>
#include <numeric>
#include <thread>

#include "device/kernel_source.h"
#include "device/opencl_api.h"
#include "device/wrapped_backend.h"
#include "support/files.h"

namespace covary::device {
namespace {

using test_support::TemporaryFolder;

/// The cache of kernels in a folder of its own, while it exists.
class OwnCache {
 public:
  OwnCache() { setenv("COVARY_KERNEL_CACHE", folder_.path().c_str(), 1); }
  ~OwnCache() { unsetenv("COVARY_KERNEL_CACHE"); }
  int files() const { return static_cast<int>(std::distance(std::filesystem::directory_iterator(folder_.path()), {})); }

 private:
  TemporaryFolder folder_;
};

std::vector<float> ones_to(int n) {
  std::vector<float> values(static_cast<size_t>(n));
  std::iota(values.begin(), values.end(), 1.0f);
  return values;
}

float sum_on(Device& device, const std::string& kernel_name, const std::vector<float>& values) {
  const Buffer<float> from = device.upload(std::span(values)), to = device.make<float>(1);
  const Kernel kernel = device.kernel("sum.cl", kernel_name, {"GROUP=64"});
  const int n = static_cast<int>(values.size());
  if (kernel_name == "sum")
    device.launch(kernel, {64}, {64}, from, n, to);
  else
    device.launch(kernel, {64}, {64}, from, n, to, LocalMemory{64 * sizeof(float)});
  return device.download(to).at(0);
}

TEST(Device, IsFound) {
  std::vector<std::string> notes;
  const std::vector<DeviceInfo> all = devices(&notes);
  ASSERT_FALSE(all.empty()) << "no device for these tests: scripts/setup installs pocl-opencl-icd; " << notes.at(0);
  for (const DeviceInfo& device : all) {
    EXPECT_FALSE(device.name.empty());
    EXPECT_GT(device.memory, 0u);
    EXPECT_GT(device.largest_buffer, 0u);
    EXPECT_GT(device.local_memory, 0u);
    EXPECT_GT(device.largest_group, 0u);
    EXPECT_GT(device.units, 0u);
  }
}

TEST(Device, Sums) {
  const OwnCache cache;
  Device device = Device::open("opencl");
  EXPECT_EQ(sum_on(device, "sum", ones_to(1000)), 500500.0f);
  EXPECT_EQ(sum_on(device, "sum_in_given_memory", ones_to(1001)), 501501.0f);
  EXPECT_EQ(cache.files(), 1);
}

TEST(Device, TakesCompiledKernelsFromTheCache) {
  const OwnCache cache;
  for (int run = 0; run < 2; ++run) {
    Device device = Device::open("opencl:0");
    EXPECT_EQ(sum_on(device, "sum", ones_to(10)), 55.0f);
    EXPECT_EQ(cache.files(), 1);
  }
  Device device = Device::open("opencl:0");
  device.kernel("sum.cl", "sum", {"GROUP=32"});
  EXPECT_EQ(cache.files(), 2);
}

TEST(Device, WritesAndReadsParts) {
  Device device = Device::open("opencl");
  Buffer<int> buffer = device.make<int>(5);
  device.write(buffer, std::vector<int>{1, 2, 3, 4, 5});
  device.write(buffer, std::vector<int>{30, 40}, 2);
  std::vector<int> part(3);
  device.read(buffer, part, 1);
  EXPECT_EQ(part, (std::vector<int>{2, 30, 40}));
  EXPECT_THROW(device.write(buffer, std::vector<int>(2), 4), Error);
  EXPECT_TRUE(device.make<float>(0));
}

/// A device that is slow, for each work group.
class SlowBackend final : public test_support::WrappedBackend {
 public:
  explicit SlowBackend(double seconds_per_group, std::vector<Grid>& launches)
      : seconds_per_group_(seconds_per_group), launches_(launches) {}
  void launch(uint64_t kernel, const Grid& grid, std::span<const Argument> arguments) override {
    WrappedBackend::launch(kernel, grid, arguments);
    const uint32_t n = grid.groups[0] * grid.groups[1] * grid.groups[2];
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds_per_group_ * n));
    launches_.push_back(grid);
  }

 private:
  const double seconds_per_group_;
  std::vector<Grid>& launches_;
};

/// Each item writes its place, one more than what was there.
constexpr const char* kPlaces = R"(
KERNEL places(int width, int height, GLOBAL int* result) {
  const int x = get_group_id(0) * get_local_size(0) + get_local_id(0), y = get_global_id(1), z = get_global_id(2);
  if (x >= width || y >= height) return;
  const int i = (z * height + y) * width + x;
  result[i] += 1 + i + 1000 * (x - get_global_id(0));
})";

/// The same result in parts, none of which takes long.
TEST(Device, LaunchesLongWorkInParts) {
  struct Size {
    int x, y, z;
    size_t axis;
  };
  for (const auto& [x, y, z, axis] : {Size{4000, 1, 1, 0}, {40, 50, 1, 1}, {10, 5, 20, 2}}) {
    std::vector<Grid> launches;
    Device device(std::make_shared<SlowBackend>(1e-3, launches));
    const auto n = static_cast<size_t>(x) * y * z;
    const auto result = device.upload(std::span<const int>(std::vector<int>(n)));
    const Kernel kernel = device.kernel_of(kernel_source("portable.h") + kPlaces, "places", {});
    const auto size = [](int items) { return static_cast<uint32_t>(items); };
    device.launch(kernel, {size(x), size(y), size(z)}, {8, 1, 1}, x, y, result);
    EXPECT_EQ(device.download(result), [&] {
      std::vector<int> expected(n);
      std::iota(expected.begin(), expected.end(), 1);
      return expected;
    }());
    ASSERT_GT(launches.size(), 2u);
    uint32_t next = 0;
    for (const Grid& part : launches) {
      EXPECT_EQ(part.first[axis], next);
      EXPECT_LE(part.groups[0] * part.groups[1] * part.groups[2], 110u);  // 0.11 s
      next += part.groups[axis];
    }
  }
}

TEST(Device, LaunchesShortWorkAtOnce) {
  std::vector<Grid> launches;
  Device device(std::make_shared<SlowBackend>(0, launches));
  const auto result = device.make<int>(4000);
  const Kernel kernel = device.kernel_of(kernel_source("portable.h") + kPlaces, "places", {});
  for (int run = 0; run < 8; ++run) {
    launches.clear();
    device.launch(kernel, {4000}, {8}, 4000, 1, result);
  }
  EXPECT_EQ(launches.size(), 1u);
}

TEST(Device, UsesMemoryAgain) {
  Device device = Device::open("opencl");
  uint64_t handle;
  {
    const Buffer<float> first = device.make<float>(1000), other = device.make<float>(1000);
    EXPECT_NE(first.handle(), other.handle());
    handle = other.handle();
  }
  const Buffer<float> larger = device.make<float>(1001);
  EXPECT_NE(larger.handle(), handle);
  const Buffer<float> again = device.make<float>(1000), once_more = device.make<float>(1000);
  EXPECT_TRUE(again.handle() == handle || once_more.handle() == handle);
}

TEST(Device, BuffersOutliveTheDevice) {
  Buffer<float> buffer;
  {
    Device device = Device::open("opencl");
    buffer = device.make<float>(100);
  }
  EXPECT_EQ(buffer.size(), 100u);
  buffer.reset();
  EXPECT_FALSE(buffer);
}

/// What `action` throws.
template <typename Action>
Failure failure_of(const Action& action) {
  try {
    action();
  } catch (const Failure& failure) {
    return failure;
  }
  ADD_FAILURE() << "nothing was thrown";
  return Failure(FailureKind::kLost, "");
}

TEST(Device, TellsWhatTheCompilerSays) {
  Device device = Device::open("opencl");
  const Failure failure = failure_of([&] { device.kernel_of("__kernel void f() { no such words }", "f", {}); });
  EXPECT_EQ(failure.kind(), FailureKind::kCompile);
  EXPECT_NE(failure.log().find("error"), std::string::npos) << failure.log();
  const std::string message = failure.what();
  EXPECT_EQ(message.find(device.info().text() + " cannot compile a kernel: "), 0u) << message;
  EXPECT_NE(message.find("error"), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST(Device, FindsTheFirstErrorInALog) {
  const auto text = [](const std::string& log) { return std::string(cannot_compile("NVRTC", log).what()); };
  EXPECT_EQ(text("a warning\nkernels.cu(3): error: no\nmore errors\n"),
            "NVRTC cannot compile a kernel: kernels.cu(3): error: no");
  EXPECT_EQ(text("only this"), "NVRTC cannot compile a kernel: only this");
}

TEST(Device, TellsThatMemoryIsTooSmall) {
  Device device = Device::open("opencl");
  const Failure failure = failure_of([&] { device.make<char>(size_t{1} << 50); });
  EXPECT_EQ(failure.kind(), FailureKind::kMemory);
}

TEST(Device, NamesWhatThereIs) {
  const Failure failure = failure_of([] { Device::open("opencl:77"); });
  EXPECT_EQ(failure.kind(), FailureKind::kUnavailable);
  EXPECT_EQ(failure.code(), ErrorCode::kUsage);
  const std::string message = failure.what();
  EXPECT_EQ(message.find("there is no device 'opencl:77'; found: "), 0u) << message;
  for (const DeviceInfo& device : devices()) EXPECT_NE(message.find(device.text()), std::string::npos) << message;
}

TEST(Device, AutoTakesNoProcessor) {
  try {
    EXPECT_FALSE(Device::open("auto").info().is_processor);
  } catch (const Failure& failure) {
    EXPECT_EQ(std::string(failure.what()).find("there is no GPU; found: "), 0u) << failure.what();
  }
}

TEST(Device, NamesErrorsLikeTheSpecification) {
  EXPECT_EQ(opencl::error_name(-5), "CL_OUT_OF_RESOURCES");
  EXPECT_EQ(opencl::error_name(-12345), "error -12345");
}

}  // namespace
}  // namespace covary::device
