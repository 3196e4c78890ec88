// SPDX-License-Identifier: Apache-2.0
// Devices of OpenCL 1.2 and later.
#include <fmt/format.h>

#include "device/backend.h"
#include "device/opencl_api.h"

namespace covary::device {
namespace {

using namespace opencl;

/// A device as the list names it.
struct Listed {
  DeviceInfo info;
  DeviceId id;
  bool rounds_divisions;  ///< can round divisions and roots correctly
};

std::string text_info(const Functions& cl, DeviceId id, uint32_t what) {
  size_t size = 0;
  if (cl.get_device_info(id, what, 0, nullptr, &size) != kSuccess || size == 0) return {};
  std::string text(size, '\0');
  cl.get_device_info(id, what, size, text.data(), nullptr);
  text.resize(text.find('\0') == std::string::npos ? size : text.find('\0'));
  return text;
}

/// A number of the type that the specification gives for it; zero if the driver does not know it.
template <typename T>
T number_info(const Functions& cl, DeviceId id, uint32_t what) {
  T value = 0;
  cl.get_device_info(id, what, sizeof value, &value, nullptr);
  return value;
}

std::vector<Listed> list(std::string* why) {
  const Functions* cl = functions(why);
  if (!cl) return {};
  uint32_t n_platforms = 0;
  cl->get_platforms(0, nullptr, &n_platforms);
  std::vector<Platform> platforms(n_platforms);
  if (n_platforms) cl->get_platforms(n_platforms, platforms.data(), nullptr);
  std::vector<Listed> found;
  for (Platform platform : platforms) {
    uint32_t n = 0;
    if (cl->get_devices(platform, kAllDevices, 0, nullptr, &n) != kSuccess || n == 0) continue;
    std::vector<DeviceId> ids(n);
    cl->get_devices(platform, kAllDevices, n, ids.data(), nullptr);
    for (DeviceId id : ids) {
      if (!number_info<uint32_t>(*cl, id, kAvailable) || !number_info<uint32_t>(*cl, id, kCompiler)) continue;
      DeviceInfo info;
      info.api = Api::kOpenCl;
      info.number = static_cast<int>(found.size());
      info.name = text_info(*cl, id, kName);
      info.driver = text_info(*cl, id, kDeviceVersion) + ", driver " + text_info(*cl, id, kDriverVersion);
      info.is_processor = (number_info<uint64_t>(*cl, id, kType) & kProcessor) != 0;
      info.memory = number_info<uint64_t>(*cl, id, kMemorySize);
      info.largest_buffer = number_info<uint64_t>(*cl, id, kLargestBuffer);
      info.local_memory = number_info<uint64_t>(*cl, id, kLocalMemorySize);
      info.largest_group = static_cast<uint32_t>(number_info<size_t>(*cl, id, kLargestGroup));
      info.units = number_info<uint32_t>(*cl, id, kUnits);
      const bool rounds = (number_info<uint64_t>(*cl, id, kSingleConfig) & kRoundedDivision) != 0;
      found.push_back({info, id, rounds});
    }
  }
  if (found.empty() && why) *why = "no device; drivers register themselves in /etc/OpenCL/vendors";
  return found;
}

FailureKind kind_of(int code) {
  return code == kNoAllocation || code == kOutOfHostMemory || code == kInvalidBufferSize ? FailureKind::kMemory
                                                                                         : FailureKind::kLost;
}

template <typename Handle>
uint64_t number_of(Handle handle) {
  return reinterpret_cast<uintptr_t>(handle);
}
template <typename Handle>
Handle handle_of(uint64_t number) {
  return reinterpret_cast<Handle>(static_cast<uintptr_t>(number));
}

class OpenClBackend final : public Backend {
 public:
  explicit OpenClBackend(const Listed& device)
      : cl_(*functions(nullptr)), info_(device.info), id_(device.id), rounds_divisions_(device.rounds_divisions) {
    int code = kSuccess;
    context_ = cl_.create_context(nullptr, 1, &id_, nullptr, nullptr, &code);
    check(code, "clCreateContext");
    queue_ = cl_.create_queue(context_, id_, 0, &code);
    if (code != kSuccess) cl_.release_context(context_);
    check(code, "clCreateCommandQueue");
  }
  ~OpenClBackend() override {
    cl_.finish(queue_);
    for (KernelObject kernel : kernels_) cl_.release_kernel(kernel);
    cl_.release_queue(queue_);
    cl_.release_context(context_);
  }

  const DeviceInfo& info() const override { return info_; }

  uint64_t allocate(size_t bytes) override {
    int code = kSuccess;
    const Memory memory = cl_.create_buffer(context_, kReadWrite, bytes, nullptr, &code);
    check(code, fmt::format("a buffer of {} MB", bytes >> 20));
    return number_of(memory);
  }
  void release(uint64_t buffer) noexcept override { cl_.release_memory(handle_of<Memory>(buffer)); }

  void write(uint64_t buffer, size_t offset, const void* from, size_t bytes) override {
    check(cl_.write(queue_, handle_of<Memory>(buffer), 1, offset, bytes, from, 0, nullptr, nullptr),
          "clEnqueueWriteBuffer");
  }
  void read(uint64_t buffer, size_t offset, void* to, size_t bytes) override {
    check(cl_.read(queue_, handle_of<Memory>(buffer), 1, offset, bytes, to, 0, nullptr, nullptr),
          "clEnqueueReadBuffer");
  }
  void finish() override { check(cl_.finish(queue_), "clFinish"); }

  std::string compile(const std::string& source, const std::vector<std::string>& definitions) override {
    const char* text = source.c_str();
    const size_t length = source.size();
    int code = kSuccess;
    const Program program = cl_.create_from_source(context_, 1, &text, &length, &code);
    check(code, "clCreateProgramWithSource");
    const Owned owned{cl_, program};
    build(program, options(definitions));
    size_t size = 0;
    check(cl_.get_program_info(program, kBinarySizes, sizeof size, &size, nullptr), "clGetProgramInfo");
    std::string binary(size, '\0');
    char* const to = binary.data();
    check(cl_.get_program_info(program, kBinaries, sizeof to, const_cast<char**>(&to), nullptr), "clGetProgramInfo");
    return binary;
  }

  uint64_t load(const std::string& binary) override {
    const auto* bytes = reinterpret_cast<const unsigned char*>(binary.data());
    const size_t size = binary.size();
    int code = kSuccess, status = kSuccess;
    const Program program = cl_.create_from_binary(context_, 1, &id_, &size, &bytes, &status, &code);
    check(code, "clCreateProgramWithBinary");
    try {
      build(program, "");
    } catch (...) {
      cl_.release_program(program);
      throw;
    }
    return number_of(program);
  }
  void unload(uint64_t program) noexcept override { cl_.release_program(handle_of<Program>(program)); }

  uint64_t kernel(uint64_t program, const std::string& name) override {
    int code = kSuccess;
    const KernelObject kernel = cl_.create_kernel(handle_of<Program>(program), name.c_str(), &code);
    check(code, "kernel " + name);
    kernels_.push_back(kernel);
    return number_of(kernel);
  }

  void launch(uint64_t kernel, const Grid& grid, std::span<const Argument> arguments) override {
    const KernelObject object = handle_of<KernelObject>(kernel);
    for (uint32_t i = 0; i < arguments.size(); ++i) {
      const Argument& a = arguments[i];
      const Memory memory = handle_of<Memory>(a.buffer);
      const bool is_buffer = a.kind == Argument::Kind::kBuffer;
      check(cl_.set_argument(object, i, is_buffer ? sizeof memory : a.bytes, is_buffer ? &memory : a.value),
            fmt::format("argument {} of a kernel", i));
    }
    std::array<size_t, 3> offset, global, local;
    for (size_t d = 0; d < 3; ++d) {
      local[d] = grid.items[d];
      global[d] = size_t{grid.groups[d]} * grid.items[d];
      offset[d] = size_t{grid.first[d]} * grid.items[d];
    }
    check(cl_.launch(queue_, object, 3, offset.data(), global.data(), local.data(), 0, nullptr, nullptr),
          "clEnqueueNDRangeKernel");
  }

 private:
  struct Owned {
    const Functions& cl;
    Program program;
    ~Owned() { cl.release_program(program); }
  };

  std::string options(const std::vector<std::string>& definitions) const {
    std::string text = "-cl-std=CL1.2";
    if (rounds_divisions_) text += " -cl-fp32-correctly-rounded-divide-sqrt";
    for (const std::string& definition : definitions) text += " -D" + definition;
    return text;
  }

  void build(Program program, const std::string& options) {
    const int code = cl_.build(program, 1, &id_, options.c_str(), nullptr, nullptr);
    if (code == kSuccess) return;
    size_t size = 0;
    std::string log;
    if (cl_.get_build_info(program, id_, kBuildLog, 0, nullptr, &size) == kSuccess && size > 1) {
      log.resize(size);
      cl_.get_build_info(program, id_, kBuildLog, size, log.data(), nullptr);
      log.resize(size - 1);
    }
    throw cannot_compile(info_.text(), log.empty() ? error_name(code) : log);
  }

  void check(int code, const std::string& what) const {
    if (code == kSuccess) return;
    throw Failure(kind_of(code), fmt::format("{} failed: {}: {}", info_.text(), what, error_name(code)));
  }

  const Functions& cl_;
  const DeviceInfo info_;
  DeviceId id_;
  const bool rounds_divisions_;
  Context context_ = nullptr;
  Queue queue_ = nullptr;
  std::vector<KernelObject> kernels_;
};

}  // namespace

std::vector<DeviceInfo> opencl_devices(std::string* why) {
  std::vector<DeviceInfo> infos;
  for (const Listed& device : list(why)) infos.push_back(device.info);
  return infos;
}

std::unique_ptr<Backend> open_opencl(int number) {
  return std::make_unique<OpenClBackend>(list(nullptr).at(static_cast<size_t>(number)));
}

}  // namespace covary::device
