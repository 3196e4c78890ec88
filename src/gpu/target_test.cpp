// SPDX-License-Identifier: Apache-2.0
// Devices that fail: the processor takes over, or it is an error if the device was named.
#include "gpu/target.h"

#include <gtest/gtest.h>

#include <limits>

#include "estimators/iicv.h"
#include "estimators/test_images.h"
#include "gpu/agreement.h"
#include "gpu/pair_methods.h"
#include "support/files.h"

namespace covary::gpu {
namespace {

using device::Argument, device::Backend, device::Device, device::Failure, device::FailureKind;
using test_support::contains, test_support::message_of;

enum class Fault { kNone, kCompile, kMemory, kLost, kNoNumbers };

/// The device of the tests with a fault.
class FaultyBackend final : public Backend {
 public:
  explicit FaultyBackend(Fault fault) : fault_(fault), real_(device::open_opencl(0)) {}
  const device::DeviceInfo& info() const override { return real_->info(); }
  uint64_t allocate(size_t bytes) override {
    if (fault_ == Fault::kMemory) throw Failure(FailureKind::kMemory, "the device is full");
    return real_->allocate(bytes);
  }
  void release(uint64_t buffer) noexcept override { real_->release(buffer); }
  void write(uint64_t buffer, size_t offset, const void* from, size_t bytes) override {
    real_->write(buffer, offset, from, bytes);
  }
  void read(uint64_t buffer, size_t offset, void* to, size_t bytes) override {
    real_->read(buffer, offset, to, bytes);
    if (fault_ == Fault::kNoNumbers && bytes >= sizeof(float))
      *static_cast<float*>(to) = std::numeric_limits<float>::quiet_NaN();
  }
  void finish() override { real_->finish(); }
  std::string compile(const std::string& source, const std::vector<std::string>& definitions) override {
    if (fault_ == Fault::kCompile) return real_->compile("no kernel", definitions);
    return real_->compile(source, definitions);
  }
  uint64_t load(const std::string& binary) override {
    if (fault_ == Fault::kCompile) throw Failure(FailureKind::kCompile, "a binary of another driver");
    return real_->load(binary);
  }
  void unload(uint64_t program) noexcept override { real_->unload(program); }
  uint64_t kernel(uint64_t program, const std::string& name) override { return real_->kernel(program, name); }
  void launch(uint64_t kernel, const uint32_t (&groups)[3], const uint32_t (&items)[3],
              std::span<const Argument> arguments) override {
    if (fault_ == Fault::kLost) throw Failure(FailureKind::kLost, "the device has fallen off the bus");
    real_->launch(kernel, groups, items, arguments);
  }

 private:
  const Fault fault_;
  const std::unique_ptr<Backend> real_;
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

std::shared_ptr<Target> faulty(Fault fault, bool is_automatic) {
  return std::make_shared<Target>(Device(std::make_shared<FaultyBackend>(fault)), is_automatic);
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
