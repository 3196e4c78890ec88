// SPDX-License-Identifier: Apache-2.0
#include "gpu/held_out.h"

#include "estimators/estimator_result.h"
#include "gpu/launch.h"

namespace covary::gpu {
namespace {

constexpr int kPart = 16;  // as in the kernels
constexpr int kErrorPlanes = 7, kBiasPlanes = 19;

/// The sums of the parts of a row, in the order of the kernel image_risk.cl; those of `error` are squared, too.
constexpr double RiskRow::*kRiskSumsOfParts[] = {
    &RiskRow::error,         &RiskRow::covariance,       &RiskRow::variance,
    &RiskRow::noise,         &RiskRow::noise_squares,    &RiskRow::specular_noise,
    &RiskRow::light,         &RiskRow::light_of_largest, &RiskRow::squared_deviations,
    &RiskRow::fourth_powers, &RiskRow::spread,           &RiskRow::values};

int parts_in(const HeldOutBuffers& in) { return (in.width + kPart - 1) / kPart; }

device::Kernel kernel(Device& device, const char* file, const char* name, const HeldOutBuffers& in) {
  return device.kernel(file, name, with_bug({}, in.planted_bug));
}

/// Calls add(row, values of a part) for all parts of all rows, n values each.
template <typename Row, typename Add>
std::vector<Row> rows_of_parts(Device& device, const HeldOutBuffers& in, const Buffer<float>& parts, int n,
                               const Add& add) {
  const std::vector<float> values = device.download(parts);
  std::vector<Row> rows(static_cast<size_t>(in.height));
  const float* p = values.data();
  for (Row& row : rows)
    for (int part = 0; part < parts_in(in); ++part, p += n) add(row, p);
  return rows;
}

Buffer<float> make_parts(Device& device, const HeldOutBuffers& in, int n) {
  return device.make<float>(static_cast<size_t>(in.height) * parts_in(in) * n);
}

Image downloaded(Device& device, const HeldOutBuffers& in, const Buffer<float>& buffer, int channels) {
  Image image(in.width, in.height, channels);
  device.read(buffer, image.data);
  return image;
}

}  // namespace

std::vector<HeldOutRow> held_out_rows(Device& device, const HeldOutBuffers& in) {
  const auto parts = make_parts(device, in, 2);
  device.launch(kernel(device, "held_out_error.cl", "held_out_parts", in), image_of(parts_in(in), in.height), kOfImage,
                *in.halves[0].buffer, *in.halves[1].buffer, static_cast<int>(in.halves[0].first),
                in.independent[0]->mean, in.independent[1]->mean, in.independent[0]->variance_of_mean,
                in.independent[1]->variance_of_mean, *in.guide, *in.valid, in.width, in.height, parts);
  return rows_of_parts<HeldOutRow>(device, in, parts, 2, [](HeldOutRow& row, const float* part) {
    row.error += part[0], row.variance += part[1];
    row.squares += double{part[0]} * part[0], row.parts += 1;
  });
}

HeldOutParts held_out_parts(Device& device, const HeldOutBuffers& in) {
  constexpr const char* kFile = "held_out_error.cl";
  const int columns = cells_in(in.width), rows = cells_in(in.height);
  const auto pixels = static_cast<size_t>(in.width) * in.height;
  const auto cells = device.make<float>(static_cast<size_t>(columns) * rows * kErrorPlanes);
  const auto relative = device.make<float>(3 * pixels), weight = device.make<float>(pixels);
  device.launch(kernel(device, kFile, "error_cells", in), image_of(columns, rows), kOfImage, *in.guide,
                *in.halves[0].buffer, *in.halves[1].buffer, *in.valid, in.width, in.height, cells);
  device.launch(kernel(device, kFile, "relative_error", in), image_of(in.width, in.height), kOfImage, cells, *in.guide,
                *in.valid, in.width, in.height, relative, weight);
  return {downloaded(device, in, relative, 3), downloaded(device, in, weight, 1), held_out_rows(device, in)};
}

Image held_out_bias(Device& device, const HeldOutBuffers& in, const std::array<const Buffer<float>*, 2>& guides) {
  constexpr const char* kFile = "held_out_bias.cl";
  const int columns = cells_in(in.width), rows = cells_in(in.height);
  const size_t n_cells = static_cast<size_t>(columns) * rows;
  const auto cells = device.make<float>(n_cells * kBiasPlanes), biases = device.make<float>(3 * n_cells);
  const auto result = device.make<float>(static_cast<size_t>(in.width) * in.height * 3);
  device.launch(kernel(device, kFile, "bias_cells", in), image_of(columns, rows), kOfImage, *in.halves[0].buffer,
                *in.halves[1].buffer, *guides[0], *guides[1], in.independent[0]->mean, in.independent[1]->mean,
                *in.valid, in.width, in.height, cells);
  device.launch(kernel(device, kFile, "bias_of_cells", in), image_of(columns, rows), kOfImage, cells, columns, rows,
                biases);
  device.launch(kernel(device, kFile, "bias_of_pixels", in), image_of(in.width, in.height), kOfImage, biases, *in.valid,
                in.width, in.height, result);
  return downloaded(device, in, result, 3);
}

std::vector<RiskRow> image_risk(Device& device, const HeldOutBuffers& in, const Buffer<float>& image,
                                const MeanBuffers& all, const Groups& groups, const SurfaceBuffers& surfaces) {
  constexpr int kSums = std::size(kRiskSumsOfParts);
  const bool normals = surfaces.normal && surfaces.normal_behind, albedos = surfaces.albedo && surfaces.albedo_behind;
  const auto parts = make_parts(device, in, kSums);
  device.launch(kernel(device, "image_risk.cl", "risk_parts", in), image_of(parts_in(in), in.height), kOfImage, image,
                *in.halves[0].buffer, *in.halves[1].buffer, all.mean, all.variance_of_mean, in.independent[0]->mean,
                in.independent[1]->mean, groups.data, groups.groups, *in.guide, *in.valid,
                (normals ? 1 : 0) + (albedos ? 2 : 0), normals ? *surfaces.normal : image,
                normals ? *surfaces.normal_behind : image, albedos ? *surfaces.albedo : image,
                albedos ? *surfaces.albedo_behind : image, in.width, in.height, parts);
  std::vector<RiskRow> rows = rows_of_parts<RiskRow>(device, in, parts, kSums, [](RiskRow& row, const float* part) {
    for (int k = 0; k < kSums; ++k) row.*kRiskSumsOfParts[k] += part[k];
    row.squares += double{part[0]} * part[0], row.parts += 1;
  });
  for (RiskRow& row : rows) row.groups = groups.groups;
  return rows;
}

std::vector<std::array<double, 2>> base_rows(Device& device, const HeldOutBuffers& in, const Buffer<float>& std_error) {
  const auto parts = make_parts(device, in, 2);
  device.launch(kernel(device, "held_out_error.cl", "base_parts", in), image_of(parts_in(in), in.height), kOfImage,
                std_error, *in.guide, *in.valid, in.width, in.height, parts);
  return rows_of_parts<std::array<double, 2>>(device, in, parts, 2, [](std::array<double, 2>& row, const float* part) {
    row[0] += part[0], row[1] += part[1];
  });
}

}  // namespace covary::gpu
