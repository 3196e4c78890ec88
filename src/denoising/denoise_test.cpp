// SPDX-License-Identifier: Apache-2.0
// The denoiser if its library is installed, otherwise the message that says how to get it. The checks of arguments need
// no library.
#include "denoising/denoise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "core/error.h"
#include "estimators/test_images.h"
#include "support/files.h"

namespace covary {
namespace {

namespace fs = std::filesystem;
using test_support::message_of;
using test_support::test_folder;

/// The test picture with independent noise.
Image noisy(int width, int height) {
  const test::Grouped grouped = test::noisy_image(width, height, 1, 5, 1.0f, 0.0f);
  Image image(width, height, 3);
  image.data = grouped.data;
  return image;
}

double mean_square_error(const Image& image) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) sum += std::pow(image.pixel(x, y)[c] - test::expected(x, y, c), 2);
  return sum / static_cast<double>(image.data.size());
}

TEST(Denoise, LowersNoiseOrSaysHowToGetTheLibrary) {
  Image image = noisy(64, 48);
  if (find_denoiser().empty()) {
    const std::string message = message_of([&] { denoise(image, nullptr, nullptr); });
    EXPECT_NE(message.find("pip install pyoidn"), std::string::npos) << message;
    return;
  }
  const Image result = denoise(image, nullptr, nullptr);
  EXPECT_LT(mean_square_error(result), 0.2 * mean_square_error(image));
  EXPECT_EQ(result.data, denoise(image, nullptr, nullptr).data);

  Image albedo(64, 48, 3), normal(64, 48, 3);
  std::fill(albedo.data.begin(), albedo.data.end(), 0.5f);
  std::fill(normal.data.begin(), normal.data.end(), 0.0f);
  EXPECT_LT(mean_square_error(denoise(image, &albedo, &normal)), 0.2 * mean_square_error(image));

  image.pixel(10, 10)[1] = std::numeric_limits<float>::quiet_NaN();
  for (float value : denoise(image, nullptr, nullptr).data) ASSERT_TRUE(std::isfinite(value));
}

/// Every folder of the wheel leads to the library, here an empty file, which the loader rejects with its name.
TEST(Denoise, FindsTheWheelFromEveryFolderOfIt) {
  fs::path folder = test_folder() / "venv";
  std::vector<std::string> above = {folder.string()};
  for (const char* next : {"lib", "python3.11", "site-packages", "pyoidn", "oidn", "lib"}) {
    folder /= next;
    above.push_back(folder.string());
  }
  fs::create_directories(folder);
  const std::string library = (folder / "libOpenImageDenoise.so.2").string();
  std::ofstream(library).close();
  above.push_back(library);
  for (const std::string& path : above) {
    const std::string message = message_of([&] { denoise(Image(4, 3, 3), nullptr, nullptr, {path}); });
    EXPECT_NE(message.find("Open Image Denoise was not found (" + library), std::string::npos) << path << "\n"
                                                                                               << message;
  }
  // The message names a folder that leads nowhere.
  const std::string elsewhere = (test_folder() / "venv" / "lib" / "python3.11" / "site-packages" / "other").string();
  fs::create_directories(elsewhere);
  const std::string message = message_of([&] { denoise(Image(4, 3, 3), nullptr, nullptr, {elsewhere}); });
  EXPECT_NE(message.find("(" + elsewhere + "/libOpenImageDenoise.so.2: "), std::string::npos) << message;
}

TEST(Denoise, SaysWhatIsMissing) {
  const Image image(4, 3, 3), other(4, 2, 3), grey(4, 3, 1);
  const std::string message =
      message_of([&] { denoise(image, nullptr, nullptr, {"/nowhere/libOpenImageDenoise.so.2"}); });
  EXPECT_NE(message.find("Open Image Denoise was not found (/nowhere/libOpenImageDenoise.so.2: "), std::string::npos)
      << message;
  EXPECT_NE(message.find("; install it with `pip install pyoidn`, or name libOpenImageDenoise.so.2, its folder or "
                         "the Python environment that holds it with `oidn` or the environment variable COVARY_OIDN"),
            std::string::npos)
      << message;
  EXPECT_EQ(message_of([&] { denoise(image, &other, nullptr); }),
            "denoise: the albedo is 4 x 2 with 3 channels, the image 4 x 3; expected 3 channels and the same size");
  EXPECT_EQ(message_of([&] { denoise(image, nullptr, &image); }),
            "denoise: a normal without an albedo; the denoiser needs both");
  EXPECT_EQ(message_of([&] { denoise(grey, nullptr, nullptr); }),
            "denoise: the image is 4 x 3 with 1 channels; expected 3 channels");
}

}  // namespace
}  // namespace covary
