// SPDX-License-Identifier: Apache-2.0
#include "passes/training_image.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "film/groups.h"

namespace covary {
namespace {

constexpr double kTrimmed = 0.001;      // fraction of largest squares ignored: a few bright samples say little
constexpr size_t kMinValues = 3 * 128;  // with fewer, waves are weighted by their samples

size_t colour_of(const Film& film, size_t pixel) {
  const auto width = static_cast<size_t>(film.width());
  return (pixel % width + pixel / width) & 1;
}

/// Mean without the largest values; 1 if there are too few values, or all are zero.
double trimmed_mean(std::vector<float>& values) {
  const size_t n = values.size() - static_cast<size_t>(kTrimmed * static_cast<double>(values.size()));
  if (values.size() < kMinValues) return 1;
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(n - 1), values.end());
  double sum = 0;
  for (size_t i = 0; i < n; ++i) sum += values[i];
  return sum > 0 ? sum / static_cast<double>(n) : 1;
}

/// The samples of a film with two groups that came after the first `begin` ones.
struct WaveView {
  const Film& film;
  std::span<const float> before;  // the film's groups after these
  uint32_t begin, end;
  uint32_t n(int group) const { return group_size(end, 2, group) - group_size(begin, 2, group); }
  double sum(size_t pixel, int group, int c) const {
    const size_t i = (2 * pixel + static_cast<size_t>(group)) * 3 + static_cast<size_t>(c);
    const double old = begin > 0 ? static_cast<double>(group_size(begin, 2, group)) * before[i] : 0;
    return static_cast<double>(group_size(end, 2, group)) * film.data()[i] - old;
  }
};

/// Variance of a sample, relative if `importance` is given, averaged over the pixels of each colour.
std::array<double, 2> sample_variances(const WaveView& wave, std::span<const Spectrum> importance) {
  std::array<std::vector<float>, 2> squares;
  const double scale = 1 / (1.0 / wave.n(0) + 1.0 / wave.n(1));
  for (size_t p = 0; p < wave.film.counts().size(); ++p)
    for (int c = 0; c < 3; ++c) {
      const double difference = wave.sum(p, 0, c) / wave.n(0) - wave.sum(p, 1, c) / wave.n(1);
      const double factor = importance.empty() ? 1.0 : importance[p][c];
      const double square = scale * difference * difference * factor * factor;
      squares[colour_of(wave.film, p)].push_back(std::isfinite(square) ? static_cast<float>(square) : 0.0f);
    }
  return {trimmed_mean(squares[0]), trimmed_mean(squares[1])};
}

}  // namespace

void WaveCombination::add(const Film& film, std::span<const Spectrum> importance) {
  COVARY_CHECK(film.groups() == 2 && !film.counts().empty(), "a film of training has two groups");
  const WaveView wave{film, before_, end_, film.counts()[0]};
  const bool shows_variance = wave.n(0) > 0 && wave.n(1) > 0;
  if (!shows_variance && end_ == 0) return;
  if (weights_ == WaveWeights::kVariance && shows_variance) {
    const auto [even, odd] = sample_variances(wave, importance);
    last_variance_ = {odd, even};
  }
  if (sum_.data.empty()) sum_ = Image(film.width(), film.height(), 3);
  for (size_t colour = 0; colour < 2; ++colour)
    weight_sums_[colour] += (wave.end - wave.begin) / last_variance_[colour];
  for (size_t p = 0; p < film.counts().size(); ++p)
    for (int c = 0; c < 3; ++c)
      sum_.data[3 * p + static_cast<size_t>(c)] +=
          static_cast<float>((wave.sum(p, 0, c) + wave.sum(p, 1, c)) / last_variance_[colour_of(film, p)]);
  before_ = film.data(), end_ = wave.end;
}

TrainingImage WaveCombination::result() const {
  TrainingImage result{sum_, {}};
  // Earlier waves are no better than the last: if they seem so, the last one met rare bright samples.
  for (size_t colour = 0; colour < 2; ++colour)
    result.samples[colour] = std::min<double>(end_, weight_sums_[colour] * last_variance_[colour]);
  for (int y = 0; y < sum_.height; ++y)
    for (int x = 0; x < sum_.width; ++x)
      for (int c = 0; c < 3; ++c)
        result.mean.pixel(x, y)[c] /= static_cast<float>(weight_sums_[static_cast<size_t>((x + y) & 1)]);
  return result;
}

Image with_training(const Film& film, const TrainingImage& image) {
  Image result = film.mean_image();
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x) {
      const double n = film.count(x, y), trained = image.samples_at(x, y);
      const auto part = static_cast<float>(trained / (n + trained));
      for (int c = 0; c < 3; ++c) {
        float& value = result.pixel(x, y)[c];
        value += part * (image.mean.pixel(x, y)[c] - value);
      }
    }
  return result;
}

}  // namespace covary
