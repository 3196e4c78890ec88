// SPDX-License-Identifier: Apache-2.0
#include "live/coarse.h"

#include <gtest/gtest.h>

#include <cmath>

namespace covary {
namespace {

Film film_of(int width, int height, int groups, int samples, float first) {
  Film film(width, height, {0, 0, width, height}, groups);
  for (int s = 0; s < samples; ++s)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const float value = first + static_cast<float>(s);
        film.add(x, y, Spectrum(value));
      }
  return film;
}

TEST(Coarse, ImageIsTheMeanOfSquares) {
  Image image(3, 2, 1);
  image.data = {1, 2, 3, 5, 6, 9};
  const Image coarse = coarse_image(image, 2);
  EXPECT_EQ(coarse.width, 2);
  EXPECT_EQ(coarse.height, 1);
  EXPECT_EQ(coarse.data, (std::vector<float>{3.5f, 6}));  // (1+2+5+6)/4, (3+9)/2
}

TEST(Coarse, GroupsAreTheFirstOnes) {
  const Film film = film_of(4, 4, 3, 3, 10);  // groups 10, 11, 12
  const CoarseGroups coarse = coarse_groups(film, 4, 2);
  EXPECT_EQ(coarse.image.groups, 2);
  EXPECT_EQ(coarse.data, (std::vector<float>{10, 10, 10, 11, 11, 11}));
}

TEST(Coarse, MeanOfFilmsWeightsThemBySamples) {
  const Film a = film_of(2, 1, 2, 2, 1), b = film_of(2, 1, 2, 6, 4);  // 1, 2 and 4 … 9: mean 42 / 8
  const auto [mean, std_error] = mean_of_films({&a, &b}, nullptr);
  EXPECT_FLOAT_EQ(mean.data[0], 42.0f / 8);
  // Groups of a: 1, 2, its standard error 1/2; of b: 6, 7, also 1/2; weights 1/4 and 3/4.
  EXPECT_FLOAT_EQ(std_error.data[0], 0.5f * std::sqrt(1.0f / 16 + 9.0f / 16));
}

TEST(Coarse, ErrorNeedsTwoSamples) {
  const Film film = film_of(2, 1, 2, 1, 1);
  EXPECT_TRUE(mean_of_films({&film}, nullptr).std_error.data.empty());
}

}  // namespace
}  // namespace covary
