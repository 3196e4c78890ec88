// SPDX-License-Identifier: Apache-2.0
// Devices that fail: the processor takes over, or it is an error if the device was named.
#include "gpu/target.h"

#include <gtest/gtest.h>

#include <limits>

#include "device/wrapped_backend.h"
#include "estimators/iicv.h"
#include "estimators/test_images.h"
#include "gpu/agreement.h"
#include "gpu/pair_methods.h"
#include "support/files.h"

namespace covary::gpu {
namespace {

using device::Argument, device::Device, device::Failure, device::FailureKind;
using test_support::contains, test_support::message_of;

enum class Fault { kNone, kCompile, kMemory, kLost, kNoNumbers };

/// The device of the tests with a fault, after so many launches.
class FaultyBackend final : public test_support::WrappedBackend {
 public:
  explicit FaultyBackend(Fault fault, int launches_before = 0) : fault_(fault), launches_left_(launches_before) {}
  uint64_t allocate(size_t bytes) override {
    if (has(Fault::kMemory)) throw Failure(FailureKind::kMemory, "the device is full");
    return WrappedBackend::allocate(bytes);
  }
  void read(uint64_t buffer, size_t offset, void* to, size_t bytes) override {
    WrappedBackend::read(buffer, offset, to, bytes);
    if (has(Fault::kNoNumbers) && bytes >= sizeof(float))
      *static_cast<float*>(to) = std::numeric_limits<float>::quiet_NaN();
  }
  void finish() override {
    check_lost();
    WrappedBackend::finish();
  }
  std::string compile(const std::string& source, const std::vector<std::string>& definitions) override {
    return WrappedBackend::compile(has(Fault::kCompile) ? "no kernel" : source, definitions);
  }
  uint64_t load(const std::string& binary) override {
    if (has(Fault::kCompile)) throw Failure(FailureKind::kCompile, "a binary of another driver");
    return WrappedBackend::load(binary);
  }
  void launch(uint64_t kernel, const device::Grid& grid, std::span<const Argument> arguments) override {
    check_lost();
    WrappedBackend::launch(kernel, grid, arguments);
    --launches_left_;
  }

 private:
  bool has(Fault fault) const { return fault_ == fault && launches_left_ <= 0; }
  void check_lost() const {
    if (has(Fault::kLost)) throw Failure(FailureKind::kLost, "the device has fallen off the bus");
  }
  const Fault fault_;
  int launches_left_;
};

struct Pair {
  test::Grouped crn = test::crn_image(21, 17, 4, 1), independent = test::independent_image(21, 17, 4, 2);
};

Method iicv_on(const std::shared_ptr<Target>& target) {
  Settings none;
  Method method = make_iicv(none);
  method.name = kIicv;
  if (target) put_on(target, {}, method);
  return method;
}

MethodImage image_of(const Method& method, const Pair& in) {
  MethodSettings settings;
  settings.std_error = true;
  return method.image({in.crn.view(), in.independent.view()}, settings);
}

std::shared_ptr<Target> faulty(Fault fault, bool is_automatic, int launches_before = 0) {
  return std::make_shared<Target>(Device(std::make_shared<FaultyBackend>(fault, launches_before)), is_automatic);
}

TEST(Target, RunsAMethodOnADevice) {
  const Pair in;
  const auto target = faulty(Fault::kNone, false);
  EXPECT_EQ(target->made_by(), "");
  const MethodImage found = image_of(iicv_on(target), in), expected = image_of(iicv_on(nullptr), in);
  EXPECT_GE(test_support::agreeing(found.estimate, expected.estimate), 0.999);
  EXPECT_NE(found.estimate.data, expected.estimate.data);
  EXPECT_EQ(target->made_by(), target->info().text());
  EXPECT_EQ(found.note, "");
}

/// The same bits as without a device, and one line.
TEST(Target, ProcessorTakesOver) {
  const Pair in;
  const MethodImage expected = image_of(iicv_on(nullptr), in);
  for (const auto& [fault, text] : {std::pair{Fault::kCompile, "cannot compile a kernel"},
                                    {Fault::kMemory, "memory is too small even for parts of the image"},
                                    {Fault::kLost, "the device has fallen off the bus"},
                                    {Fault::kNoNumbers, "made values that are not finite numbers"}}) {
    const auto target = faulty(fault, true);
    const Method method = iicv_on(target);
    for (int run = 0; run < 2; ++run) {
      const MethodImage found = image_of(method, in);
      EXPECT_EQ(found.estimate.data, expected.estimate.data) << text;
      EXPECT_EQ(found.std_error.data, expected.std_error.data) << text;
      EXPECT_TRUE(contains(found.note, text)) << found.note;
      EXPECT_TRUE(contains(found.note, "; the processor takes over")) << found.note;
      EXPECT_FALSE(contains(found.note, "\n"));
    }
    EXPECT_EQ(target->made_by(), "");
  }
}

/// A device that vanishes while it works, with what it has made so far.
TEST(Target, ProcessorTakesOverInTheMiddle) {
  const Pair in;
  const MethodImage expected = image_of(iicv_on(nullptr), in);
  for (const int launches : {1, 3, 5}) {
    const MethodImage found = image_of(iicv_on(faulty(Fault::kLost, true, launches)), in);
    EXPECT_EQ(found.estimate.data, expected.estimate.data) << launches;
    EXPECT_TRUE(contains(found.note, "fallen off the bus; the processor takes over")) << found.note;
    EXPECT_THROW(image_of(iicv_on(faulty(Fault::kLost, false, launches)), in), Error) << launches;
  }
}

TEST(Target, NamedDeviceThatFailsIsAnError) {
  const Pair in;
  for (const Fault fault : {Fault::kCompile, Fault::kMemory, Fault::kLost, Fault::kNoNumbers}) {
    const Method method = iicv_on(faulty(fault, false));
    const std::string message = message_of([&] { image_of(method, in); });
    EXPECT_TRUE(contains(message, "; `device` cpu does without it")) << message;
  }
}

/// Errors of the input are the user's, and no reason to try elsewhere.
TEST(Target, WrongInputIsNoFailureOfTheDevice) {
  const Pair in;
  const test::Grouped other = test::crn_image(20, 17, 4, 1);
  const Method method = iicv_on(faulty(Fault::kNone, true));
  EXPECT_THROW(method.image({other.view(), in.independent.view()}, {}), Error);
}

TEST(Target, IsOpenedByName) {
  EXPECT_EQ(Target::open("cpu"), nullptr);
  ASSERT_NE(Target::open("opencl"), nullptr);
  EXPECT_TRUE(contains(message_of([] { Target::open("opencl:99"); }), "`device` opencl:99: there is no device"));
  for (const char* good : {"cpu", "auto", "cuda", "opencl", "cuda:0", "opencl:12"})
    EXPECT_EQ(wrong_device_name(good), "") << good;
  for (const char* wrong : {"", "gpu", "cpu:0", "auto:1", "opencl:", "opencl:x", "cuda:-1", "cuda:0:1"})
    EXPECT_NE(wrong_device_name(wrong), "") << wrong;
}

}  // namespace
}  // namespace covary::gpu
