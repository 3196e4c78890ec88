// SPDX-License-Identifier: Apache-2.0
#include "python/module/arrays.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <new>
#include <sstream>

#include "core/error.h"
#include "core/large_vector.h"
#include "core/parallel.h"
#include "device/device.h"

namespace covary::python {
namespace {

constexpr const char* kArrays = "an array of NumPy or PyTorch, or one with DLPack or the buffer protocol";

[[noreturn]] void raise_type(nb::handle object, const std::string& name, const std::string& shape,
                             const std::string& found) {
  std::string message = fmt::format("{}: found {}; expected {}, of float32 [{}]", name,
                                    found.empty() ? describe(object) : found, kArrays, shape);
  if (nb::isinstance<nb::list>(object) || nb::isinstance<nb::tuple>(object))
    message += "; numpy.stack(images) makes one of several";
  if (nb::hasattr(object, "dtype")) message += "; convert with array.astype(numpy.float32), or tensor.float()";
  throw nb::type_error(message.c_str());
}

std::string text_of(const std::vector<int64_t>& shape) { return fmt::format("[{}]", fmt::join(shape, ", ")); }

/// The required sizes, and -1 for those that are free.
std::vector<int64_t> parse_shape(const std::string& shape) {
  std::vector<int64_t> sizes;
  std::stringstream words(shape);
  for (std::string word; std::getline(words, word, ',');) {
    word.erase(0, word.find_first_not_of(' '));
    sizes.push_back(std::isdigit(static_cast<unsigned char>(word[0])) ? std::stoll(word) : -1);
  }
  return sizes;
}

void check_shape(const Floats& floats, const std::string& name, const std::string& shape) {
  const std::vector<int64_t> wanted = parse_shape(shape);
  bool fits = wanted.size() == floats.shape.size();
  for (size_t i = 0; fits && i < wanted.size(); ++i)
    fits = wanted[i] < 0 ? floats.shape[i] > 0 && floats.shape[i] <= std::numeric_limits<int>::max()
                         : floats.shape[i] == wanted[i];
  if (fits) return;
  const bool has_none = std::ranges::find(floats.shape, 0) != floats.shape.end();
  throw nb::value_error(fmt::format("{}: found the shape {}{}; expected [{}]", name, text_of(floats.shape),
                                    has_none ? ", without values" : "", shape)
                            .c_str());
}

/// The values from the first to the last in memory, of an array on a device.
void copy_from_device(Floats& floats) {
  int64_t first = 0, last = 0;  // places relative to `data`
  for (size_t i = 0; i < floats.shape.size(); ++i)
    (floats.strides[i] < 0 ? first : last) += (floats.shape[i] - 1) * floats.strides[i];
  const int number = floats.owner.device_id();
  const auto address = reinterpret_cast<uintptr_t>(floats.data);
  floats.copy.resize(static_cast<size_t>(last - first + 1));
  device::read_from_cuda(number, address + static_cast<uintptr_t>(first) * sizeof(float), floats.copy.data(),
                         floats.copy.size() * sizeof(float));
  floats.data = floats.copy.data() - first;
  floats.there = {floats.data, address, fmt::format("cuda:{}", number)};
}

/// A NumPy array of the vector's memory, which is freed with the array.
nb::object array_of(std::vector<float>&& values, const std::vector<size_t>& shape,
                    const std::vector<int64_t>& strides) {
  auto* kept = new std::vector<float>(std::move(values));
  const nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<float>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, float>(kept->data(), shape.size(), shape.data(), owner,
                                                strides.empty() ? nullptr : strides.data()));
}

/// Memory for n floats, to be freed with std::free. Large arrays are on huge pages if the system has them: the first
/// touch of 65,000 small pages would take longer than filling them.
float* large_pages(size_t n) {
  constexpr size_t kPage = size_t{2} << 20;
  const size_t bytes = (n * sizeof(float) + kPage - 1) / kPage * kPage;
  void* memory = bytes > kPage ? std::aligned_alloc(kPage, bytes) : std::malloc(n * sizeof(float));
  if (!memory) throw std::bad_alloc();
  if (bytes > kPage) ask_for_huge_pages(memory, bytes);
  return static_cast<float*>(memory);
}

/// 0 if unknown.
int dimensions_of(nb::handle array) { return nb::hasattr(array, "ndim") ? nb::cast<int>(array.attr("ndim")) : 0; }

/// An image whose rows, pixels and channels are so many floats apart.
Image copied(const float* data, int width, int height, const int64_t* strides) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = data[y * strides[0] + x * strides[1] + c * strides[2]];
  return image;
}

}  // namespace

std::string describe(nb::handle object) {
  std::string text = nb::cast<std::string>(nb::str(object.type().attr("__module__"))) + "." +
                     nb::cast<std::string>(nb::str(object.type().attr("__name__")));
  if (text.starts_with("builtins.")) text.erase(0, 9);
  if (nb::hasattr(object, "dtype")) text += " of " + nb::cast<std::string>(nb::str(nb::object(object.attr("dtype"))));
  return text;
}

Floats floats_of(nb::handle array, const std::string& name, const std::string& shape) {
  Floats floats;
  if (!nb::try_cast(array, floats.owner)) raise_type(array, name, shape, "");
  const int device = floats.owner.device_type();
  const bool is_here = device == nb::device::cpu::value || device == nb::device::cuda_host::value;
  if (!is_here && device != nb::device::cuda::value && device != nb::device::cuda_managed::value)
    raise_type(array, name, shape,
               describe(array) + " on a device that is neither the processor nor CUDA's (tensor.cpu() copies it)");
  if (floats.owner.dtype() != nb::dtype<float>()) raise_type(array, name, shape, "");
  floats.data = static_cast<const float*>(floats.owner.data());
  for (size_t i = 0; i < floats.owner.ndim(); ++i) {
    floats.shape.push_back(static_cast<int64_t>(floats.owner.shape(i)));
    floats.strides.push_back(floats.owner.stride(i));
  }
  check_shape(floats, name, shape);
  if (is_here) return floats;
  try {
    copy_from_device(floats);
  } catch (const device::Failure& failure) {
    throw Error(failure.code(), fmt::format("{}: {}; tensor.cpu() copies it", name, failure.what()));
  }
  return floats;
}

Groups::Groups(nb::handle array, const std::string& name) : source_(floats_of(array, name, "T, H, W, 3")) {
  if (source_.shape[0] > Film::kMaxGroups)
    throw nb::value_error(
        fmt::format("{}: found {} groups; at most {} are accepted", name, source_.shape[0], Film::kMaxGroups).c_str());
}

GroupedImage Groups::view() {
  const int64_t T = source_.shape[0], H = source_.shape[1], W = source_.shape[2];
  GroupedImage image{static_cast<int>(W), static_cast<int>(H), static_cast<int>(T), source_.data};
  const std::vector<int64_t>& s = source_.strides;
  // With a size of 1, any stride will do.
  const auto lies = [&](int axis, int64_t stride) { return source_.shape[axis] == 1 || s[axis] == stride; };
  if (lies(0, 3) && lies(1, W * T * 3) && lies(2, T * 3) && lies(3, 1)) {
    if (source_.there.handle) image.on_device = &source_.there;
    return image;
  }
  constexpr int64_t kBlock = 128;  // pixels whose groups stay in the fastest memory while they are brought together
  if (!ordered_) {
    ordered_.reset(large_pages(static_cast<size_t>(T * H * W * 3)));
    parallel_for(H, [&](int64_t y) {
      for (int64_t first = 0; first < W; first += kBlock)
        for (int64_t t = 0; t < T; ++t) {
          const float* from = source_.data + t * s[0] + y * s[1] + first * s[2];
          float* to = ordered_.get() + ((y * W + first) * T + t) * 3;
          for (int64_t x = first; x < std::min(W, first + kBlock); ++x, from += s[2], to += T * 3)
            to[0] = from[0], to[1] = from[s[3]], to[2] = from[2 * s[3]];
        }
    });
  }
  image.data = ordered_.get();
  if (source_.there.handle) {
    source_.there.of = image.data, source_.there.strides = s;
    image.on_device = &source_.there;
  }
  return image;
}

Image image_of(nb::handle array, const std::string& name, const std::string& shape) {
  const Floats floats = floats_of(array, name, shape);
  return copied(floats.data, static_cast<int>(floats.shape[1]), static_cast<int>(floats.shape[0]),
                floats.strides.data());
}

Image layer_of(nb::handle array, const std::string& name) {
  if (dimensions_of(array) != 2) return image_of(array, name);
  const Floats floats = floats_of(array, name, "H, W");
  Image image(static_cast<int>(floats.shape[1]), static_cast<int>(floats.shape[0]), 1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      *image.pixel(x, y) = floats.data[y * floats.strides[0] + x * floats.strides[1]];
  return image;
}

std::vector<Image> images_of(nb::handle array, const std::string& name, int n, const std::string& shape) {
  std::vector<Image> images;
  if (dimensions_of(array) != 4) {
    images.push_back(image_of(array, name, shape));
    return images;
  }
  const Floats floats = floats_of(array, name, fmt::format("{}, {}", n, shape));
  for (int i = 0; i < n; ++i)
    images.push_back(copied(floats.data + i * floats.strides[0], static_cast<int>(floats.shape[2]),
                            static_cast<int>(floats.shape[1]), &floats.strides[1]));
  return images;
}

nb::object array_of(Image&& image) {
  if (image.data.empty()) return nb::none();
  std::vector<size_t> shape{static_cast<size_t>(image.height), static_cast<size_t>(image.width)};
  if (image.channels > 1) shape.push_back(static_cast<size_t>(image.channels));
  return array_of(std::move(image.data), shape, {});
}

void add_prediction(const std::optional<PredictedError>& predicted, const std::string& note, nb::dict& to) {
  nb::object relmse = nb::none(), bounds = nb::none();
  if (predicted) relmse = nb::float_(predicted->relmse);
  if (predicted && predicted->bounds) bounds = nb::make_tuple(predicted->bounds->low, predicted->bounds->high);
  const std::string doubt = predicted ? predicted->doubt : note;
  to["predicted_relmse"] = relmse;
  to["predicted_bounds"] = bounds;
  to["prediction_doubt"] = nb::str(doubt.c_str());
}

void add_risks(const EstimatorResult& image, nb::dict& to) {
  nb::dict risks;
  nb::object bias_share = nb::none();
  if (image.risks) {
    bias_share = nb::float_(image.risks->bias_share);
    for (const auto& [name, relmse] : image.risks->images) risks[name.c_str()] = nb::float_(relmse);
  }
  to["bias_share"] = bias_share;
  to["risks"] = risks;
}

nb::object groups_array(std::vector<float>&& values, int width, int height, int groups) {
  const int64_t W = width, T = groups;
  return array_of(std::move(values),
                  {static_cast<size_t>(groups), static_cast<size_t>(height), static_cast<size_t>(width), 3},
                  {3, W * T * 3, T * 3, 1});
}

}  // namespace covary::python
