// SPDX-License-Identifier: Apache-2.0
#include "passes/render_pass.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <tuple>

#include "core/error.h"
#include "core/in_place.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "core/warp.h"
#include "passes/pass_limits.h"
#include "passes/training.h"

namespace covary {
namespace {

constexpr int kTileSize = 16;
constexpr int kBatchSize = 256;  // paths traced together; larger ones leave the cache
constexpr size_t kMaxBadSamples = 10;
constexpr size_t kLearnerTiles = 128;  // tiles whose records are held at a time
constexpr double kRoundSeconds = 0.5;  // between checkpoints, if pixels are estimated from all their samples

/// Offset from the pixel centre, from a Gaussian with the given standard deviation truncated at `radius`, by inverting
/// its cumulative distribution: the inverse error function of [Giles2012], then one Newton step. Not a library
/// function: those differ between versions in the last bits, and with them every image.
float interval_to_gaussian(float u, float stddev, float radius) {
  const double tail = std::erf(radius / (stddev * std::sqrt(2.0)));  // mass inside the truncation
  const double p = std::clamp((2.0 * u - 1.0) * tail, -1 + 1e-15, 1 - 1e-15);
  double w = -std::log((1 - p) * (1 + p)), x;
  if (w < 5) {
    w -= 2.5;
    x = 2.81022636e-08;
    for (double c : {3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087, -0.00125372503, -0.00417768164,
                     0.246640727, 1.50140941})
      x = c + x * w;
  } else {
    w = std::sqrt(w) - 3;
    x = -0.000200214257;
    for (double c : {0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773, -0.0076224613, 0.00943887047,
                     1.00167406, 2.83297682})
      x = c + x * w;
  }
  x *= p;
  x -= (std::erf(x) - p) / (2 / std::sqrt(M_PI) * std::exp(-x * x));
  return static_cast<float>(x * stddev * std::sqrt(2.0));
}

/// Samples begin … end - 1 are to be taken of the film's pixel (x, y).
struct PixelWork {
  int x, y;
  uint32_t begin, end;
};

/// Everything one thread accumulates.
struct Worker {
  explicit Worker(const Integrator& integrator) : context(integrator), allows_negative(integrator.allows_negative()) {}

  PathContext context;
  bool allows_negative;
  std::vector<PixelWork> pixels;
  std::vector<CameraSample> samples;  // of these pixels, contiguous per pixel
  std::vector<Spectrum> importance;   // per sample, that of its pixel; empty if not used
  uint64_t n_samples = 0, n_not_finite = 0, n_negative = 0;
  std::vector<BadSample> bad_samples;
  double seconds = 0, estimate_seconds = 0;  // in tiles, and in settings.estimate
};

struct Tile {
  int x0, y0, x1, y1;  // in the film
};

std::vector<Tile> make_tiles(const Film& film) {
  std::vector<Tile> tiles;
  for (int y = 0; y < film.height(); y += kTileSize)
    for (int x = 0; x < film.width(); x += kTileSize)
      tiles.push_back({x, y, std::min(x + kTileSize, film.width()), std::min(y + kTileSize, film.height())});
  return tiles;
}

PathRandom sample_random(const PassSettings& settings, const Camera& camera, int x, int y, uint64_t sample) {
  const uint64_t pixel = static_cast<uint64_t>(y) * camera.width() + x;
  if (settings.sampler == Sampler::kIndependent)
    return {settings.sampling, settings.seed, settings.pass, pixel, sample};
  const auto groups = static_cast<uint32_t>(settings.groups);
  return PathRandom::sobol(settings.sampling, settings.seed, settings.pass, pixel,
                           static_cast<uint32_t>(sample % groups), static_cast<uint32_t>(sample / groups));
}

/// True when the sample may enter the film; otherwise it is counted and remembered.
bool is_good(const Spectrum& value, int x, int y, uint64_t sample, Worker& worker) {
  const bool finite = is_finite(value);
  if (finite && ((value.r >= 0 && value.g >= 0 && value.b >= 0) || worker.allows_negative)) [[likely]]
    return true;
  ++(finite ? worker.n_negative : worker.n_not_finite);
  worker.bad_samples.push_back({x, y, sample, value});
  if (worker.bad_samples.size() > 20 * kMaxBadSamples) keep_first(worker.bad_samples);
  return false;
}

/// Limits on the samples of pixels in one wave.
struct Wave {
  const SampleTarget& target;
  uint32_t end;  // no pixel beyond
  PixelWork work(const Film& film, int x, int y) const {
    const uint32_t begin = film.count(x, y);
    return {x, y, begin, std::max(begin, std::min(end, target.at(static_cast<size_t>(y) * film.width() + x)))};
  }
};

/// Traces the samples of worker.pixels and adds them to the film; if stopped, adds nothing.
void trace_pixels(const Scene& scene, const Integrator& integrator, const PassSettings& settings, Film& film,
                  Worker& worker) {
  size_t n_samples = 0;
  for (const PixelWork& pixel : worker.pixels) n_samples += pixel.end - pixel.begin;
  worker.samples.resize(n_samples, CameraSample{{}, PathRandom(settings.sampling, 0, 0, 0, 0), {}});
  CameraSample* next = worker.samples.data();
  for (const PixelWork& pixel : worker.pixels)
    for (uint32_t s = pixel.begin; s < pixel.end; ++s)
      make_in_place(
          *next++, [&] { return camera_sample(scene, settings, film.crop().x + pixel.x, film.crop().y + pixel.y, s); });
  worker.importance.clear();
  if (!settings.importance.empty())
    for (const PixelWork& pixel : worker.pixels)
      worker.importance.insert(worker.importance.end(), pixel.end - pixel.begin,
                               settings.importance[static_cast<size_t>(pixel.y) * film.width() + pixel.x]);
  for (size_t i = 0; i < n_samples; i += kBatchSize) {
    const size_t n = std::min<size_t>(kBatchSize, n_samples - i);
    worker.context.importance =
        std::span(worker.importance).subspan(worker.importance.empty() ? 0 : i, worker.importance.empty() ? 0 : n);
    integrator.trace(scene, std::span(worker.samples).subspan(i, n), worker.context);
    if (worker.context.stopped()) return;  // the samples may be incomplete
  }

  CameraSample* sample = worker.samples.data();
  for (const PixelWork& pixel : worker.pixels) {
    const std::span<const CameraSample> of_pixel(sample, pixel.end - pixel.begin);
    for (uint32_t s = pixel.begin; s < pixel.end; ++s, ++sample) {
      if (!is_good(sample->radiance, film.crop().x + pixel.x, film.crop().y + pixel.y, s, worker))
        sample->radiance = Spectrum(0);
      sample->radiance = scene.on_film(sample->radiance) * film_weight(settings.filter, sample->random);
      if (!settings.estimate) film.add(pixel.x, pixel.y, sample->radiance);
    }
    if (!settings.estimate) continue;
    const Stopwatch watch;
    film.set(pixel.x, pixel.y, pixel.end, settings.estimate(of_pixel));
    worker.estimate_seconds += watch.seconds();
  }
  worker.n_samples += n_samples;
}

/// Takes the samples that the wave still needs in a tile, whole pixels together; returns their number.
uint64_t render_tile(const Scene& scene, const Integrator& integrator, const PassSettings& settings, const Tile& tile,
                     const Wave& wave, Film& film, Worker& worker) {
  const uint64_t before = worker.n_samples;
  size_t n_samples = 0;
  const auto flush = [&] {
    if (n_samples > 0) trace_pixels(scene, integrator, settings, film, worker);
    worker.pixels.clear();
    n_samples = 0;
  };
  for (int y = tile.y0; y < tile.y1; ++y)
    for (int x = tile.x0; x < tile.x1; ++x) {
      const PixelWork pixel = wave.work(film, x, y);
      const size_t n = pixel.end - pixel.begin;
      if (n == 0) continue;
      if (n_samples + n > kBatchSize) flush();
      worker.pixels.push_back(pixel);
      n_samples += n;
    }
  flush();
  return worker.n_samples - before;
}

/// Passes the records of tiles on to a learner in the order of tiles. The thread that delivers the next one in turn
/// also absorbs those that wait for it, while they are in its cache.
class OrderedRecords {
 public:
  OrderedRecords(LearningIntegrator& learner, size_t n) : learner_(learner), records_(n), delivered_(n) {}

  size_t size() const { return records_.size(); }
  /// Delivers the record of tile i, which may be null. Thread-safe.
  void deliver(size_t i, std::unique_ptr<TrainingRecord> record) {
    std::unique_lock lock(mutex_);
    records_[i] = std::move(record), delivered_[i] = true;
    if (absorbing_) return;
    absorbing_ = true;
    for (; next_ < records_.size() && delivered_[next_]; ++next_) {
      std::unique_ptr<TrainingRecord> own = std::move(records_[next_]);
      if (!own) continue;
      lock.unlock();
      learner_.absorb(*own);
      own.reset();
      lock.lock();
    }
    absorbing_ = false;
  }

 private:
  LearningIntegrator& learner_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<TrainingRecord>> records_;
  std::vector<bool> delivered_;
  size_t next_ = 0;         // the tile whose turn it is
  bool absorbing_ = false;  // by some thread
};

/// Calls render(i) for each of n tiles. A learner gets the tiles' records, a batch of tiles at a time, and tiles are
/// begun in their order.
template <typename Render>
void render_tiles(size_t n, LearningIntegrator* learner, const Integrator& integrator, PerThread<Worker>& workers,
                  const Render& render) {
  if (!learner) return parallel_for(n, render);
  std::atomic<size_t> next{0};
  for (size_t first = 0; first < n; first += kLearnerTiles) {
    OrderedRecords records(*learner, std::min(kLearnerTiles, n - first));
    parallel_for(records.size(), [&](size_t) {
      const size_t i = next.fetch_add(1, std::memory_order_relaxed);
      render(i);
      records.deliver(i - first, learner->take_record(*workers.local(integrator).context.state));
    });
  }
}

/// Checks that an integrator that learns is trained, or learns from this pass.
void check_learner(const Integrator& integrator, const PassSettings& settings, const Film& film) {
  const LearningIntegrator* learning = integrator.learning();
  const LearningIntegrator* learner = settings.learner;
  COVARY_CHECK(!learning || learning == learner || learning->frozen(), "the integrator has not been trained");
  if (!learner) return;
  COVARY_CHECK(learner == learning && !learner->frozen() && !settings.estimate,
               "the integrator cannot learn in this pass");
  for (uint32_t count : film.counts())
    COVARY_CHECK(count == learner->trained_spp(), "the film has other samples than the integrator has learnt from");
}

}  // namespace

void keep_first(std::vector<BadSample>& samples) {
  std::sort(samples.begin(), samples.end(), [](const BadSample& a, const BadSample& b) {
    return std::tie(a.y, a.x, a.sample) < std::tie(b.y, b.x, b.sample);
  });
  if (samples.size() > kMaxBadSamples) samples.resize(kMaxBadSamples);
}

const char* sampling_name(Sampling sampling) { return sampling == Sampling::kCrn ? "crn" : "independent"; }

const char* sampler_name(Sampler sampler) { return sampler == Sampler::kSobol ? "sobol" : "independent"; }

uint32_t wave_end(uint32_t count, int groups) {
  const uint32_t size = static_cast<uint32_t>(groups) * std::max(1, 16 / groups);
  if (count >= size) return (count / size + 1) * size;
  auto end = static_cast<uint32_t>(groups);
  while (end <= count) end *= 2;
  return std::min(end, size);
}

Vec2 film_position(const FilterSettings& filter, int x, int y, const PathRandom& random) {
  const Vec2 u = random.get_2d(0, Event::kPixel);
  const Vec2 centre{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f};
  switch (filter.kind) {
    case FilterKind::kBox:
      return centre + Vec2{(2 * u.x - 1) * filter.radius, (2 * u.y - 1) * filter.radius};
    case FilterKind::kTent:
      return centre + Vec2{warp::interval_to_tent(u.x, filter.radius), warp::interval_to_tent(u.y, filter.radius)};
    case FilterKind::kGaussian:
      return centre + Vec2{interval_to_gaussian(u.x, filter.stddev, filter.radius),
                           interval_to_gaussian(u.y, filter.stddev, filter.radius)};
    case FilterKind::kLobed:
      return centre + Vec2{filter.lobed->sample(u.x).offset, filter.lobed->sample(u.y).offset};
  }
  throw Error(ErrorCode::kInternal, "unknown reconstruction filter");
}

float film_weight(const FilterSettings& filter, const PathRandom& random) {
  if (filter.kind != FilterKind::kLobed) return 1;
  const Vec2 u = random.get_2d(0, Event::kPixel);
  return filter.lobed->sample(u.x).weight * filter.lobed->sample(u.y).weight;
}

CameraSample camera_sample(const Scene& scene, const PassSettings& settings, int x, int y, uint64_t sample) {
  const PathRandom random = sample_random(settings, scene.camera(), x, y, sample);
  return {scene.camera().ray(film_position(settings.filter, x, y, random), random.get_2d(0, Event::kLens)), random, {}};
}

PassResult render_pass(const Scene& scene, const Integrator& integrator, const PassSettings& settings, Film& film) {
  COVARY_CHECK(settings.spp.fits(film), "the map of samples has another size than the film");
  COVARY_CHECK(!settings.estimate || film.groups() == 1, "an estimate from all samples of a pixel has no groups");
  COVARY_CHECK(film.frame_width() == scene.camera().width() && film.frame_height() == scene.camera().height(),
               "film and camera differ in size");
  COVARY_CHECK(settings.sampler == Sampler::kIndependent || settings.groups == film.groups(),
               "points of a sequence for each group follow from the film's number of groups");
  check_learner(integrator, settings, film);
  const std::vector<Tile> tiles = make_tiles(film);
  const uint32_t limit = settings.estimate ? UINT32_MAX : settings.limit;
  const uint32_t largest = std::min(settings.spp.largest(), limit);
  PassLimits limits(settings, settings.spp.missing(film, limit));
  uint32_t reached = settings.spp.reached(film);

  PerThread<Worker> workers;
  // Render in waves, so that all pixels advance together. If pixels are estimated from all their samples, their single
  // wave is split into timed rounds.
  while (reached < largest && !limits.ended()) {
    const Wave wave{settings.spp, settings.estimate
                                      ? largest
                                      : std::min(largest, wave_end(reached, settings.learner ? 1 : film.groups()))};
    const Stopwatch round_watch;
    std::atomic<bool> round_over{false};
    render_tiles(tiles.size(), settings.learner, integrator, workers, [&](size_t i) {
      if (limits.ended() || round_over.load(std::memory_order_relaxed)) return;
      Worker& worker = workers.local(integrator);
      worker.context.stop = settings.stop;
      const Stopwatch tile_watch;
      const uint64_t n_new = render_tile(scene, integrator, settings, tiles[i], wave, film, worker);
      if (n_new == 0) return;
      worker.seconds += tile_watch.seconds();
      if (settings.estimate && round_watch.seconds() >= kRoundSeconds) round_over = true;
      limits.advance(n_new);
    });
    if (limits.ended()) break;
    if (!round_over) reached = wave.end;
    if (settings.learner) settings.learner->end_wave(wave.end);
    if (settings.checkpoint) settings.checkpoint();
  }

  PassResult result;
  double busy_seconds = 0;
  workers.for_each([&](const Worker& worker) {
    busy_seconds += worker.seconds;
    result.estimate_seconds += worker.estimate_seconds;
    result.n_samples += worker.n_samples;
    result.n_rays += worker.context.n_rays;
    result.n_not_finite += worker.n_not_finite;
    result.n_negative += worker.n_negative;
    result.bad_samples.insert(result.bad_samples.end(), worker.bad_samples.begin(), worker.bad_samples.end());
  });
  keep_first(result.bad_samples);
  result.complete = settings.spp.missing(film, limit) == 0;
  result.seconds = limits.seconds();
  if (busy_seconds > 0) result.estimate_seconds *= result.seconds / busy_seconds;  // its share of the time
  return result;
}

ReplayedSample replay_sample(const Scene& scene, const Integrator& integrator, const PassSettings& settings, int x,
                             int y, uint64_t sample) {
  PathContext context(integrator);
  CameraSample traced = camera_sample(scene, settings, x, y, sample);
  integrator.trace(scene, {&traced, 1}, context);
  const float weight = film_weight(settings.filter, traced.random);
  return {film_position(settings.filter, x, y, traced.random), scene.on_film(traced.radiance) * weight, context.n_rays};
}

}  // namespace covary
