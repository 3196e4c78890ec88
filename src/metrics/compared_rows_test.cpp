// SPDX-License-Identifier: Apache-2.0
// Reading in bands gives the same bits as whole images.
#include "metrics/compared_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "core/random.h"
#include "film/image_writer.h"
#include "metrics/metrics.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::test_file;

/// Images in memory, in bands of a given height.
class Bands final : public ComparedRows {
 public:
  Bands(const Image& image, const std::vector<Image>& references, int band_rows) : sources_{&image} {
    for (const Image& r : references) sources_.push_back(&r);
    width_ = image.width, height_ = image.height, band_rows_ = band_rows;
  }

 private:
  Band read(int first_row, int n_rows) override {
    kept_.clear();
    for (const Image* source : sources_) {
      Image& rows = kept_.emplace_back(width_, n_rows, 3);
      std::copy_n(source->pixel(0, first_row), rows.data.size(), rows.data.begin());
    }
    Band band{&kept_[0], {}, {}};
    for (size_t i = 1; i < kept_.size(); ++i) band.references.push_back(&kept_[i]);
    return band;
  }

  std::vector<const Image*> sources_;
  std::vector<Image> kept_;
};

/// Values over several decades, some equal, some not finite.
Image picture(int width, int height, uint64_t seed) {
  Image image(width, height, 3);
  for (size_t i = 0; i < image.data.size(); ++i) {
    const uint64_t bits = combine64(seed, i);
    image.data[i] = std::exp2(static_cast<float>(bits % 1024) / 128 - 4);
    if (bits % 997 == 0) image.data[i] = std::numeric_limits<float>::quiet_NaN();
  }
  return image;
}

void expect_equal(const MetricResult& a, const MetricResult& b, const std::string& what) {
  EXPECT_EQ(a.value, b.value) << what;
  EXPECT_EQ(a.mean, b.mean) << what;
  EXPECT_EQ(a.reference_mean, b.reference_mean) << what;
  EXPECT_EQ(a.n_pixels, b.n_pixels) << what;
  EXPECT_EQ(a.n_non_finite, b.n_non_finite) << what;
  ASSERT_EQ(a.map.data.size(), b.map.data.size()) << what;
  for (size_t p = 0; p < a.map.data.size(); ++p)
    ASSERT_TRUE(a.map.data[p] == b.map.data[p] || (std::isnan(a.map.data[p]) && std::isnan(b.map.data[p])))
        << what << ", pixel " << p;
}

TEST(ComparedRows, BandsOfAnyHeightGiveTheSameBits) {
  const Image image = picture(61, 67, 1);
  const std::vector<Image> references = {picture(61, 67, 2), picture(61, 67, 3)};
  for (const MetricInfo& info : metrics())
    for (const size_t n_references : {1, 2})
      for (const bool low_dynamic_range : {false, true}) {
        const std::vector<Image> given(references.begin(), references.begin() + static_cast<ptrdiff_t>(n_references));
        const std::vector<Image> denominators(n_references == 2 ? 2 : 0, picture(61, 67, 4));
        const MetricResult whole = compute_metric(info.metric, image, given, low_dynamic_range, denominators);
        EXPECT_GT(whole.n_non_finite, 0u);
        for (const int band_rows : {1, 9, 23, 66}) {
          Bands bands(image, given, band_rows);
          bands.set_denominators(denominators);
          expect_equal(compute_metric(info.metric, bands, low_dynamic_range, true), whole,
                       info.name + " in bands of " + std::to_string(band_rows));
        }
      }
}

/// The file is wider than the window and tall enough for three bands.
TEST(ComparedRows, FilesGiveTheSameBits) {
  const int width = 2048, height = 1100;
  const CropWindow window{3, 5, 2040, 1090};
  const Image images[] = {picture(width, height, 1), picture(width, height, 2)};
  std::vector<ImageRows> files;
  std::vector<Image> cuts;
  for (const Image& image : images) {
    const std::string path = test_file("rows" + std::to_string(files.size()) + ".pfm");
    write_image(path, image, {width, height, {0, 0, width, height}}, {});
    files.emplace_back(path);
    Image& cut = cuts.emplace_back(window.width, window.height, 3);
    for (int y = 0; y < cut.height; ++y)
      std::copy_n(image.pixel(window.x, window.y + y), 3 * cut.width, cut.pixel(0, y));
  }
  ImageRows* const compared[] = {&files[0], &files[1]};
  ComparedFiles rows(compared, window);
  EXPECT_LT(rows.band_rows() * 2, window.height);
  for (const Metric metric : {Metric::kRelMse, Metric::kRelMseTrimmed})
    expect_equal(compute_metric(metric, rows, true, true), compute_metric(metric, cuts[0], {&cuts[1], 1}, true), "");
  EXPECT_TRUE(compute_metric(Metric::kMse, rows, false, false).map.data.empty());
}

}  // namespace
}  // namespace covary
