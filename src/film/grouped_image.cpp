// SPDX-License-Identifier: Apache-2.0
#include "film/grouped_image.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/number_text.h"
#include "film/groups.h"

namespace covary {
namespace {

/// Every group needs samples to have a mean.
void check_counts(const std::string& name, const GroupedImage& image, std::vector<std::string>& problems) {
  if (!image.counts) return;
  const size_t n_pixels = static_cast<size_t>(image.width) * image.height;
  const auto groups = static_cast<uint32_t>(image.groups);
  const uint32_t* few = std::find_if(image.counts, image.counts + n_pixels, [&](uint32_t n) { return n < groups; });
  if (few == image.counts + n_pixels) return;
  const auto pixel = static_cast<int>(few - image.counts);
  problems.push_back(
      fmt::format("pixel ({}, {}) of the {} has {}, fewer than the {} groups; render it with fewer "
                  "groups (`groups`), or more samples",
                  pixel % image.width, pixel / image.width, name, counted(*few, "sample"), groups));
}

}  // namespace

Spectrum GroupedImage::sample_variance(int x, int y) const {
  const size_t index = static_cast<size_t>(y) * width + x;
  return covary::sample_variance(pixel(x, y), variance_in_groups ? variance_in_groups + index * 3 : nullptr, groups,
                                 count(x, y));
}

GroupedImage rows_of(const GroupedImage& image, int first_row, int n_rows) {
  GroupedImage rows = image;
  const size_t skipped = static_cast<size_t>(first_row) * image.width;
  rows.height = n_rows;
  rows.data = image.pixel(0, first_row);
  if (image.counts) rows.counts = image.counts + skipped;
  if (image.variance_in_groups) rows.variance_in_groups = image.variance_in_groups + skipped * 3;
  return rows;
}

GroupedImage rows_of(const Film& film, int first_row, int n_rows) {
  const GroupedImage all{film.width(),
                         film.height(),
                         film.groups(),
                         film.groups_of(0, 0),
                         film.counts().data(),
                         film.mean_count(),
                         film.keeps_sample_variance() ? film.variance_in_groups().data() : nullptr};
  return rows_of(all, first_row, n_rows);
}

Image rows_of(const Image& image, int first_row, int n_rows) {
  Image rows(image.width, n_rows, image.channels);
  std::copy_n(image.pixel(0, first_row), rows.data.size(), rows.data.begin());
  return rows;
}

void throw_if_any(const std::string& name, const std::vector<std::string>& problems) {
  if (problems.empty()) return;
  std::string text = name + ": ";
  for (size_t i = 0; i < problems.size(); ++i) text += (i ? "; " : "") + problems[i];
  throw Error(ErrorCode::kUsage, text);
}

void check_inputs(const GroupedImage& crn, const GroupedImage& independent, int min_crn_groups,
                  int min_independent_groups, std::vector<std::string>& problems) {
  const auto check_not_empty = [&](const char* name, const GroupedImage& image) {
    if (image.width < 1 || image.height < 1 || image.groups < 1 || !image.data)
      problems.push_back(fmt::format("the {} is empty: {} x {} pixels, {}{}", name, image.width, image.height,
                                     counted(image.groups, "group"), image.data ? "" : ", no data"));
  };
  if (crn.data == independent.data && crn.width == independent.width) {
    const size_t n_others = problems.size();
    check_not_empty("image", independent);
    if (problems.size() > n_others) return;
  }
  check_not_empty("CRN image", crn);
  check_not_empty("independent image", independent);
  if (crn.width != independent.width || crn.height != independent.height)
    problems.push_back(
        fmt::format("the CRN image is {} x {} and the independent image {} x {}; they must have the same size",
                    crn.width, crn.height, independent.width, independent.height));
  if (crn.groups < min_crn_groups)
    problems.push_back(fmt::format("the CRN image has {}, at least {} are needed (12 are recommended)",
                                   counted(crn.groups, "group"), min_crn_groups));
  if (independent.groups < min_independent_groups)
    problems.push_back(fmt::format("the independent image has {}, at least {} are needed with these settings",
                                   counted(independent.groups, "group"), min_independent_groups));
  if (!problems.empty()) return;
  if (crn.data == independent.data) return check_counts("image", independent, problems);
  check_counts("CRN image", crn, problems);
  check_counts("independent image", independent, problems);
}

}  // namespace covary
