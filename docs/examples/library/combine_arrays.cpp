// SPDX-License-Identifier: Apache-2.0
// Combines images from any renderer, given as plain arrays, into one with less noise.
//
//     combine_arrays WIDTH HEIGHT GROUPS CRN INDEPENDENT OUT
//
// CRN and INDEPENDENT are files of floats [y][x][group][rgb]: per pixel, the means of GROUPS groups of samples, with
// the same random numbers in every pixel and with independent ones, respectively. OUT is [y][x][rgb].
#include <covary/core/error.h>
#include <covary/estimators/iicv.h>
#include <covary/risk/predicted_error.h>

#include <charconv>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

/// The number in a word of the command line, from 1 on.
int number_of(const char* name, const std::string& word) {
  int number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc() || end != word.data() + word.size() || number < 1)
    throw covary::Error(covary::ErrorCode::kUsage,
                        std::string(name) + " '" + word + "': expected a whole number from 1 on");
  return number;
}

std::vector<float> read_floats(const char* path, size_t count) {
  std::vector<float> values(count);
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(float))) ||
      file.peek() != std::ifstream::traits_type::eof())
    throw covary::Error(covary::ErrorCode::kIo, std::string(path) + ": not " + std::to_string(count) + " floats");
  return values;
}

int main(int argc, char** argv) try {
  if (argc != 7) return std::fprintf(stderr, "combine_arrays WIDTH HEIGHT GROUPS CRN INDEPENDENT OUT\n"), 2;
  const int width = number_of("WIDTH", argv[1]), height = number_of("HEIGHT", argv[2]);
  const int groups = number_of("GROUPS", argv[3]);
  const size_t count = static_cast<size_t>(width) * height * groups * 3;
  const std::vector<float> crn_means = read_floats(argv[4], count), independent_means = read_floats(argv[5], count);

  const covary::GroupedImage crn{width, height, groups, crn_means.data()};
  const covary::GroupedImage independent{width, height, groups, independent_means.data()};
  covary::IicvOptions options;
  options.std_error = true;
  const covary::EstimatorResult result = covary::iicv(crn, independent, options);

  std::printf("relMSE by the standard errors %.3g\n", covary::predicted_relmse(result));
  const std::vector<float>& image = result.estimate.data;
  std::ofstream out(argv[6], std::ios::binary);
  out.write(reinterpret_cast<const char*>(image.data()), static_cast<std::streamsize>(image.size() * sizeof(float)));
  return out.flush() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "combine_arrays: %s\n", error.what());
  return 1;
}
