// SPDX-License-Identifier: Apache-2.0
// Errors of sequences: known values on images around 1 with noise of fixed seeds, and planted ghosting.
#include "metrics/sequence_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/error.h"
#include "core/random.h"

namespace covary {
namespace {

constexpr int kWidth = 96, kHeight = 64, kFrames = 4;

/// 1 + `offset` + uniform noise of standard deviation `sigma`.
Image noisy(double offset, double sigma, uint64_t seed, int frame) {
  Image image(kWidth, kHeight, 3);
  for (size_t i = 0; i < image.data.size(); ++i) {
    const float u = PathRandom(Sampling::kIndependent, seed, frame, i, 0).get_1d(0, Event::kPixel);
    image.data[i] = static_cast<float>(1 + offset + sigma * std::sqrt(12.0) * (u - 0.5));
  }
  return image;
}

using Change = std::function<void(int frame, Image&)>;

std::vector<FrameErrors> errors_of(double offset, double sigma, double reference_sigma, const Change& change = {},
                                   uint64_t seed = 3, const Change& change_references = {}) {
  SequenceErrors errors;
  for (int f = 0; f < kFrames; ++f) {
    Image frame = noisy(offset, sigma, seed, f);
    if (change) change(f, frame);
    std::vector<Image> references{noisy(0, reference_sigma, 1, f), noisy(0, reference_sigma, 2, f)};
    if (change_references)
      for (Image& reference : references) change_references(f, reference);
    errors.add(std::move(frame), std::move(references));
  }
  return errors.frames();
}

void add_to(Image& image, int x0, int y0, int x1, int y1, float value) {
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x)
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] += value;
}

TEST(SequenceErrors, LeaveOutTheReferencesNoise) {
  // 73,728 products of standard deviation below 0.1 each; that of their mean is 4e-4. Weights are 1 / 1.01 up to 1 %
  // from noise in the references.
  const SequenceSummary s = summary_of(errors_of(0.2, 0.1, 0.1));
  EXPECT_NEAR(s.relmse, (0.04 + 0.01) / 1.01, 0.002);
  EXPECT_NEAR(s.temporal, 2 * 0.01 / 1.01, 0.002) << "what stays is no change";
  EXPECT_NEAR(summary_of(errors_of(0, 0, 0.1)).temporal, 0, 0.001);
}

TEST(SequenceErrors, OfTheFirstFrameHaveNoChange) {
  const std::vector<FrameErrors> frames = errors_of(0.2, 0.1, 0.1);
  ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
  EXPECT_TRUE(std::isnan(frames[0].temporal) && std::isnan(frames[0].temporal_flip) &&
              frames[0].temporal_regions.empty());
  EXPECT_GT(frames[1].temporal, 0);
}

TEST(SequenceErrors, TemporalFlipSeesFlickerAndNoBiasThatStays) {
  const double flicker = summary_of(errors_of(0, 0.1, 0.001)).temporal_flip;
  EXPECT_GT(flicker, 0.02);
  EXPECT_LT(summary_of(errors_of(0.2, 0.001, 0.001)).temporal_flip, 0.1 * flicker);
  // A change that the references share is no error.
  const Change flash = [](int f, Image& image) { add_to(image, 0, 0, kWidth, kHeight, f == 2 ? 1.0f : 0.0f); };
  EXPECT_LT(summary_of(errors_of(0, 0.001, 0.001, flash, 3, flash)).temporal_flip, 0.1 * flicker);
  EXPECT_GT(summary_of(errors_of(0, 0.001, 0.001, flash)).temporal_flip, flicker) << "only the frames have it";
  EXPECT_GT(summary_of(errors_of(0, 0.001, 0.001, {}, 3, flash)).temporal_flip, flicker) << "only the references";
}

TEST(SequenceErrors, WorstRegionIsThatOfAPlantedTrail) {
  const auto alone = errors_of(0, 0.3, 0.1);
  const Change trail = [](int f, Image& image) {
    if (f == 2) add_to(image, 64, 32, 96, 64, 0.6f);
  };
  const WorstRegions worst = worst_regions(errors_of(0, 0.2, 0.1, trail, 4), alone);
  EXPECT_EQ(worst.relmse_of_frame.frame, 2);
  EXPECT_EQ(worst.relmse_of_frame.column, 2);
  EXPECT_EQ(worst.relmse_of_frame.row, 1);
  EXPECT_NEAR(worst.relmse_of_frame.ratio, (0.04 + 0.36) / 0.09, 0.6);
  EXPECT_EQ(worst.relmse.frame, -1);
  EXPECT_EQ(worst.relmse.column, 2);
  EXPECT_NEAR(worst.relmse.ratio, (4 * 0.04 + 0.36) / 4 / 0.09, 0.25);
  EXPECT_GT(worst.temporal_of_frame.ratio, 2);
  EXPECT_LT(worst_regions(errors_of(0, 0.2, 0.1, {}, 4), alone).relmse_of_frame.ratio, 0.7) << "nothing planted";
}

TEST(SequenceErrors, RegionsThatTheReferencesDoNotTellAreLeftOut) {
  const auto exact = errors_of(0, 0, 0.1);
  EXPECT_TRUE(std::isnan(worst_regions(exact, exact).relmse_of_frame.ratio));
  const auto alone = errors_of(0, 0.3, 0.1, [](int f, Image& image) {
    const Image clean = noisy(0, 0, 1, f);
    for (int y = 0; y < 32; ++y) std::copy_n(clean.pixel(0, y), 32 * 3, image.pixel(0, y));
  });
  const WorstRegion worst = worst_regions(alone, alone).relmse_of_frame;
  EXPECT_EQ(worst.left_out, static_cast<uint64_t>(kFrames));
  EXPECT_EQ(worst.ratio, 1);
}

TEST(SequenceErrors, RegionsCoverTheImage) {
  SequenceErrors errors;
  Image frame(90, 20, 3);
  add_to(frame, 89, 0, 90, 1, 3);
  errors.add(frame, {Image(90, 20, 3)});
  const RegionErrors& regions = errors.frames()[0].regions;
  EXPECT_EQ(regions.columns, 3);
  EXPECT_EQ(regions.rows, 1) << "a smaller side is one region";
  EXPECT_EQ(regions.error[0], 0);
  EXPECT_NEAR(regions.error[2], 9 / 0.01 / (32 * 20), 1e-6);
}

TEST(SequenceErrors, OfWhatIsUnchanged) {
  // One block of 96 changes in the references, and the frames are wrong there.
  const Change change = [](int f, Image& image) { add_to(image, 8, 0, 16, 8, f == 2 ? 0.3f : 0.0f); };
  const Change wrong = [](int, Image& image) { add_to(image, 8, 0, 16, 8, 5); };
  const auto frames = errors_of(0.1, 0, 0.01, wrong, 3, change);
  EXPECT_EQ(frames[1].still_part, 1);
  EXPECT_NEAR(frames[2].still_part, 95.0 / 96, 1e-12);
  EXPECT_NEAR(frames[2].still_relmse, 0.01 / 1.01, 0.001);
  EXPECT_GT(frames[1].still_relmse, 0.1);
}

TEST(SequenceErrors, PixelsThatAreNotFiniteAreLeftOut) {
  const auto frames = errors_of(0.2, 0, 0, [](int f, Image& image) {
    if (f == 1) image.pixel(5, 7)[1] = std::numeric_limits<float>::quiet_NaN();
  });
  EXPECT_EQ(frames[1].n_non_finite, 1u);
  for (const FrameErrors& frame : frames) EXPECT_NEAR(frame.relmse, 0.04 / 1.01, 1e-4);
  for (int f = 1; f < kFrames; ++f) EXPECT_NEAR(frames[f].temporal, 0, 1e-9);
}

TEST(SequenceErrors, NeedFramesOfOneSize) {
  SequenceErrors errors;
  errors.add(Image(4, 4, 3), {Image(4, 4, 3)});
  EXPECT_THROW(errors.add(Image(4, 4, 3), {Image(4, 5, 3)}), Error);
  EXPECT_THROW(errors.add(Image(5, 4, 3), {Image(5, 4, 3)}), Error);
}

}  // namespace
}  // namespace covary
