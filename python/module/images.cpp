// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>

#include "combine/grouped_file.h"
#include "combine/result_file.h"
#include "core/error.h"
#include "denoising/denoise.h"
#include "denoising/denoised_references.h"
#include "film/image_file.h"
#include "film/image_writer.h"
#include "film/outputs.h"
#include "metrics/metrics.h"
#include "python/module/arrays.h"
#include "python/module/bindings.h"
#include "python/module/work.h"

namespace covary::python {
namespace {

nb::object read(const std::string& path, const std::string& layer, bool accept_changed) {
  PlacedImage image;
  const ChecksumPolicy checksums = accept_changed ? ChecksumPolicy::kIgnore : ChecksumPolicy::kCheck;
  run_work([&](WorkState&) { image = read_image(path, layer, checksums); }, nb::none());
  return array_of(std::move(image.image));
}

void check_extension_of_image(const std::string& path) {
  const std::vector<std::string>& known = image_extensions();
  if (const std::string extension = lower_extension(path);
      std::find(known.begin(), known.end(), extension) == known.end())
    throw Error(ErrorCode::kUsage,
                fmt::format("path: found '{}'; the name must end in {}", path, fmt::join(known, ", ")));
}

void write(const std::string& path, nb::object array, const std::map<std::string, std::string>& attributes) {
  check_extension_of_image(path);
  const Image image = image_of(array, "image");
  run_work([&](WorkState&) { write_image(path, image, {}, attributes); }, nb::none());
}

/// An EXR file of an image with its error and layers, as renders write it.
void write_with_error(const std::string& path, nb::object array, nb::object std_error, nb::object bias, nb::dict aovs,
                      const std::map<std::string, std::string>& attributes) {
  EstimatorResult result;
  result.estimate = image_of(array, "image");
  if (!std_error.is_none()) result.std_error = image_of(std_error, "std_error");
  if (!bias.is_none()) result.bias = image_of(bias, "bias");
  std::map<std::string, Image> layers;
  for (const auto& [key, layer] : aovs) {
    const auto name = nb::cast<std::string>(key);
    layers[name] = layer_of(layer, "aovs: " + name);
  }
  const int width = result.estimate.width, height = result.estimate.height;
  run_work(
      [&](WorkState&) {
        write_result(path, {width, height, {0, 0, width, height}}, attributes, result, layers);
      },
      nb::none());
}

nb::object read_groups(const std::vector<std::string>& paths, const std::string& layer) {
  GroupedFile::Rows rows;
  int width = 0, height = 0, groups = 0;
  run_work(
      [&](WorkState&) {
        const GroupedFile file(paths, layer);
        width = file.width(), height = file.height(), groups = file.groups();
        file.read_rows(0, height, rows);
      },
      nb::none());
  return groups_array(std::move(rows.data), width, height, groups);
}

nb::tuple metric(const std::string& name, nb::object image, nb::object reference, nb::object reference2,
                 nb::object denominator, bool low_dynamic_range) {
  const Metric metric = find_metric(name).metric;
  const Image pixels = image_of(image, "image");
  std::vector<Image> references{image_of(reference, "reference")};
  if (!reference2.is_none()) references.push_back(image_of(reference2, "reference2"));
  const bool is_relative = metric == Metric::kRelMse || metric == Metric::kRelMseTrimmed;
  std::vector<Image> denominators;
  if (!denominator.is_none()) {
    if (references.size() < 2 || !is_relative)
      throw Error(ErrorCode::kUsage, "denominator: it takes effect only in relmse and relmse-trimmed with reference2");
    denominators.push_back(image_of(denominator, "denominator"));
  }
  MetricResult result;
  const auto compute = [&] {
    if (denominators.empty() && is_relative) denominators = denoised_references(references);
    result = compute_metric(metric, pixels, references, low_dynamic_range, denominators);
  };
  run_work([&](WorkState& state) { run_stoppable(state, compute); }, nb::none());
  return nb::make_tuple(result.value, result.n_pixels, result.n_non_finite, array_of(std::move(result.map)),
                        result.reference_error);
}

nb::object denoised(nb::object image, nb::object albedo, nb::object normal, const std::string& library) {
  const Image rgb = image_of(image, "image");
  Image a, n;
  if (!albedo.is_none()) a = image_of(albedo, "albedo");
  if (!normal.is_none()) n = image_of(normal, "normal");
  if (a.data.empty() && !n.data.empty())
    throw Error(ErrorCode::kUsage, "normal: it has an effect only together with the albedo");
  check_feature("albedo", a);
  check_feature("normal", n);
  Image result;
  const auto compute = [&] {
    result = denoise(rgb, a.data.empty() ? nullptr : &a, n.data.empty() ? nullptr : &n, {library});
  };
  run_work([&](WorkState& state) { run_stoppable(state, compute); }, nb::none());
  return array_of(std::move(result));
}

}  // namespace

void bind_images(nb::module_& module) {
  using namespace nb::literals;
  module.def("is_made_by", &is_made_by, "path"_a, "command"_a,
             nb::sig("def is_made_by(path: str, command: str) -> bool"));
  module.def(
      "copied", [](nb::object image) { return array_of(image_of(image, "image")); }, "image"_a.none(),
      nb::sig("def copied(image: object) -> typing.Any"));
  module.def("read_image", &read, "path"_a, "layer"_a, "accept_changed"_a = false,
             nb::sig("def read_image(path: str, layer: str, accept_changed: bool = False) -> typing.Any"));
  module.def("write_image", &write, "path"_a, "image"_a.none(), "attributes"_a,
             nb::sig("def write_image(path: str, image: object, attributes: dict[str, str]) -> None"));
  module.def("write_result", &write_with_error, "path"_a, "image"_a.none(), "std_error"_a.none(), "bias"_a.none(),
             "aovs"_a, "attributes"_a,
             nb::sig("def write_result(path: str, image: object, std_error: object | None, bias: object | None, aovs: "
                     "dict[str, typing.Any], attributes: dict[str, str]) -> None"));
  module.def("read_groups", &read_groups, "paths"_a, "layer"_a,
             nb::sig("def read_groups(paths: list[str], layer: str) -> typing.Any"));
  module.def("metric", &metric, "name"_a, "image"_a.none(), "reference"_a.none(), "reference2"_a.none(),
             "denominator"_a.none(), "low_dynamic_range"_a,
             nb::sig("def metric(name: str, image: object, reference: object, reference2: object | None, "
                     "denominator: object | None, low_dynamic_range: bool) -> tuple[float, int, int, typing.Any, "
                     "float]"));
  module.def("denoise", &denoised, "image"_a.none(), "albedo"_a.none(), "normal"_a.none(), "library"_a,
             nb::sig("def denoise(image: object, albedo: object | None, normal: object | None, library: str) -> "
                     "typing.Any"));
}

}  // namespace covary::python
