// SPDX-License-Identifier: Apache-2.0
// Python arrays (NumPy, PyTorch, anything with DLPack or the buffer protocol) as images, and images as NumPy arrays.
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

#include "estimators/estimator_result.h"
#include "film/film.h"
#include "film/grouped_image.h"
#include "risk/predicted_error.h"

namespace covary::python {

namespace nb = nanobind;

/// "numpy.ndarray of float64": describes an object that is not accepted.
std::string describe(nb::handle object);

/// The float32 values of a Python array in place, with any strides; of one on a device of CUDA, a copy.
struct Floats {
  nb::ndarray<nb::ro> owner;
  const float* data = nullptr;
  std::vector<int64_t> shape, strides;  ///< strides in floats
  std::vector<float> copy;              ///< what `data` points to if the values are on a device
  ValuesOnDevice there = {};            ///< of those
};

/// The array's values. `name` stands for the argument in messages; `shape` is the expected shape, such as "H, W, 3",
/// whose numbers are sizes that the array must have. Raises TypeError for another type of object or values, or a device
/// that is neither the processor nor one of CUDA, and ValueError for another shape; throws device::Failure.
Floats floats_of(nb::handle array, const std::string& name, const std::string& shape);

/// An array [T, H, W, 3] as a grouped image. Memory in the order [H, W, T, 3] is used in place. view() copies other
/// orders into this one when it is first called, which needs no GIL. Values on a device of CUDA stay there, too.
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

/// A copy of an array [H, W, 3] as an image. Raises like floats_of(); `shape` may name the size that it must have.
Image image_of(nb::handle array, const std::string& name, const std::string& shape = "H, W, 3");

/// A copy of an array [H, W, 3], or [H, W] with one channel. Raises likewise.
Image layer_of(nb::handle array, const std::string& name);
/// Copies of one image [H, W, 3] or of several, [T, H, W, 3] with T = `n`. `shape`: "H, W, 3", with the size that they
/// must have. Raises likewise.
std::vector<Image> images_of(nb::handle array, const std::string& name, int n, const std::string& shape);

/// The image's memory as an array [H, W, channels], or [H, W] with one channel; None if the image is empty.
nb::object array_of(Image&& image);
/// Adds "predicted_relmse" and "predicted_bounds" (low, high), both None if not known, and "prediction_doubt".
/// `note`: of the image, which says why there is no prediction.
void add_prediction(const std::optional<PredictedError>& predicted, const std::string& note, nb::dict& to);
/// Adds "bias_share" and "risks" of a denoised image, None and an empty dict if it is none.
void add_risks(const EstimatorResult& image, nb::dict& to);
/// [T, H, W, 3] of values in the order [H, W, T, 3].
nb::object groups_array(std::vector<float>&& values, int width, int height, int groups);

}  // namespace covary::python
