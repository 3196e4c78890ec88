// SPDX-License-Identifier: Apache-2.0
#include "false_colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/srgb.h"

namespace covary {
namespace {

constexpr double kDecades = 3;
/// Rows of the scale: the strip, and the numbers below it. Letters have 3 x 5 pixels and one column between them.
constexpr int kStrip = 8, kText = 9, kLetter = 4, kLetterRows = 5;

/// Colours in sRGB, from the least to the largest value.
constexpr std::array<std::array<double, 3>, 6> kColours = {{{0.03, 0.03, 0.12},
                                                            {0.23, 0.07, 0.43},
                                                            {0.55, 0.15, 0.50},
                                                            {0.87, 0.29, 0.35},
                                                            {0.99, 0.60, 0.32},
                                                            {0.99, 0.97, 0.75}}};

/// `t`: 0 to 1.
void set_colour(double t, float* rgb) {
  const double at = std::clamp(t, 0.0, 1.0) * (kColours.size() - 1);
  const auto i = std::min(static_cast<size_t>(at), kColours.size() - 2);
  for (size_t c = 0; c < 3; ++c)
    rgb[c] = srgb_to_linear(static_cast<float>(kColours[i][c] + (at - i) * (kColours[i + 1][c] - kColours[i][c])));
}

float mean_at(const Image& image, size_t pixel) {
  float sum = 0;
  for (int c = 0; c < image.channels; ++c) sum += image.data[pixel * image.channels + c];
  return sum / static_cast<float>(image.channels);
}

/// What one pixel in a thousand exceeds.
double largest_of(const Image& image) {
  std::vector<float> values;
  for (size_t i = 0; i < image.data.size() / image.channels; ++i)
    if (const float value = mean_at(image, i); std::isfinite(value) && value > 0) values.push_back(value);
  if (values.empty()) return 1;
  const auto rank = values.begin() + static_cast<ptrdiff_t>(0.999 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), rank, values.end());
  return *rank;
}

/// Rows from the top, three bits each, of the letters of "1e-N".
std::array<uint8_t, kLetterRows> letter(char c) {
  constexpr std::array<std::array<uint8_t, kLetterRows>, 10> kDigits = {{{7, 5, 5, 5, 7},
                                                                         {2, 6, 2, 2, 7},
                                                                         {7, 1, 7, 4, 7},
                                                                         {7, 1, 7, 1, 7},
                                                                         {5, 5, 7, 1, 1},
                                                                         {7, 4, 7, 1, 7},
                                                                         {7, 4, 7, 5, 7},
                                                                         {7, 1, 1, 1, 1},
                                                                         {7, 5, 7, 5, 7},
                                                                         {7, 5, 7, 1, 7}}};
  if (c >= '0' && c <= '9') return kDigits[static_cast<size_t>(c - '0')];
  return c == 'e' ? std::array<uint8_t, kLetterRows>{0, 7, 7, 4, 7} : std::array<uint8_t, kLetterRows>{0, 0, 7, 0, 0};
}

void write(const std::string& text, int x, int y, Image& image) {
  for (const char c : text) {
    const std::array<uint8_t, kLetterRows> rows = letter(c);
    for (int j = 0; j < kLetterRows; ++j)
      for (int i = 0; i < 3; ++i)
        if ((rows[static_cast<size_t>(j)] >> (2 - i)) & 1 && x + i >= 0 && x + i < image.width)
          std::fill_n(image.pixel(x + i, y + j), 3, 1.0f);
    x += kLetter;
  }
}

}  // namespace

Image in_false_colours(const Image& image) {
  Image result(image.width, image.height + kStrip + kText, 3);
  const double high = std::log10(largest_of(image)), low = high - kDecades;
  for (size_t i = 0; i < image.data.size() / image.channels; ++i)
    if (const float value = mean_at(image, i); value > 0)
      set_colour((std::log10(value) - low) / kDecades, &result.data[3 * i]);
  for (int x = 0; x < image.width; ++x)
    for (int y = image.height + 2; y < image.height + kStrip; ++y)
      set_colour((x + 0.5) / image.width, result.pixel(x, y));
  for (int power = static_cast<int>(std::ceil(low)); power <= high; ++power) {
    const int x = static_cast<int>((power - low) / kDecades * image.width);
    if (x < image.width)
      for (int y = image.height + 2; y < image.height + kStrip; ++y) std::fill_n(result.pixel(x, y), 3, 1.0f);
    const std::string text = "1e" + std::to_string(power);
    const int length = kLetter * static_cast<int>(text.size());
    write(text, std::clamp(x - length / 2, 0, std::max(0, image.width - length)), image.height + kStrip + 2, result);
  }
  return result;
}

}  // namespace covary
