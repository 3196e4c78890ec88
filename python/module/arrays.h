// SPDX-License-Identifier: Apache-2.0
// Arrays of Python (NumPy, PyTorch, anything with DLPack or the buffer protocol) as images, and images as NumPy arrays.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "film/film.h"
#include "film/grouped_image.h"
#include "risk/predicted_error.h"

namespace covary::python {

namespace nb = nanobind;

/// "numpy.ndarray of float64"; what is known of an object that is not taken.
std::string describe(nb::handle object);

/// float32 values of a Python array where they lie, with any strides.
struct Floats {
  nb::ndarray<nb::ro> owner;
  const float* data = nullptr;
  std::vector<int64_t> shape, strides;  ///< strides in floats
};

/// The array's values. `name` stands for the argument in messages, `shape` is that wanted, "H, W, 3"; a number in it is
/// a size that the array must have. Raises TypeError for another type of object, values or device, and ValueError for
/// another shape.
Floats floats_of(nb::handle array, const std::string& name, const std::string& shape);

/// An array [T, H, W, 3] as a grouped image. Memory that is [H, W, T, 3] is used as it lies; other orders are brought
/// into this one when view() is first called, which needs no GIL.
class Groups {
 public:
  /// Raises like floats_of().
  Groups(nb::handle array, const std::string& name);
  GroupedImage view();
  int width() const { return static_cast<int>(source_.shape[2]); }
  int height() const { return static_cast<int>(source_.shape[1]); }
  int groups() const { return static_cast<int>(source_.shape[0]); }

 private:
  Floats source_;
  std::unique_ptr<float[], decltype(&std::free)> ordered_{nullptr, std::free};
};

/// An array [H, W, 3] as an image of its own. Raises like floats_of(); `shape` may name the size that it must have.
Image image_of(nb::handle array, const std::string& name, const std::string& shape = "H, W, 3");

/// [H, W, channels], or [H, W] with one channel, of the image's memory; None where it is empty.
nb::object array_of(Image&& image);
/// "predicted_relmse", "predicted_bounds" (low, high), both None where not known, and "prediction_doubt".
void add_prediction(const std::optional<PredictedError>& predicted, nb::dict& to);
/// [T, H, W, 3] of values in the order [H, W, T, 3].
nb::object groups_array(std::vector<float>&& values, int width, int height, int groups);

}  // namespace covary::python
