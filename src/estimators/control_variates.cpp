// SPDX-License-Identifier: Apache-2.0
// Tiles of the image are processed in parallel; within a tile, kLanes pixels at a time, one per lane. What a pixel
// contributes as a neighbour (its "record") is contiguous in memory, so that reading a neighbour takes a few vector
// loads and a transposition.
#include "estimators/control_variates.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/parallel.h"
#include "estimators/penalised_fit.h"
#include "estimators/pixel_records.h"
#include "filters/batch_algebra.h"
#include "filters/neighbours.h"

namespace covary {
namespace {

using namespace lanes;

constexpr int kTileWidth = 64, kTileHeight = 32;
/// Minimum fraction of the degrees of freedom assumed to remain after a fit, for the error estimate; a fit with less is
/// an interpolation.
constexpr float kMinFreedom = 0.1f;

/// Scratch memory of one thread.
struct Workspace : PenalisedFit {
  std::vector<vfloat> records;  ///< of the tile and its border
  std::vector<vint> keys;
  std::vector<uint16_t> chosen;
  std::vector<vfloat> tail;  ///< [neighbour][rest of the record]
  std::vector<vfloat> y_tail;
};

struct Tile {
  int x0, y0, x1, y1;
};

class Regression {
 public:
  Regression(const ControlVariateInput& input, const ControlVariateSettings& settings,
             const std::vector<unsigned char>& valid, EstimatorResult& result)
      : in_(input),
        s_(settings),
        valid_(valid),
        result_(result),
        T_(input.crn.groups),
        records_(input, settings, valid),
        layout_(records_.layout()),
        shape_{settings.k,      layout_.contrasts,  layout_.group_contrasts, input.crn.groups,
               settings.shared, settings.std_error, input.changes != nullptr},
        search_(settings.k, settings.window),
        radius_(settings.window / 2) {}

  void run_tile(const Tile& tile, Workspace& w) const {
    prepare(w);
    for (int y = tile.y0 - radius_; y < tile.y1 + radius_; ++y)
      for (int x = tile.x0 - radius_; x < tile.x1 + radius_; ++x) records_.fill(x, y, record(tile, x, y, w));
    for (int y = tile.y0; y < tile.y1; ++y)
      for (int x = tile.x0; x < tile.x1; x += kLanes) run_batch(tile, x, y, w);
  }

 private:
  int record_stride(const Tile& tile) const { return tile.x1 - tile.x0 + 2 * radius_; }
  float* record(const Tile& tile, int x, int y, Workspace& w) const {
    const ptrdiff_t index =
        static_cast<ptrdiff_t>(y - tile.y0 + radius_) * record_stride(tile) + (x - tile.x0 + radius_);
    return reinterpret_cast<float*>(w.records.data()) + index * layout_.stride;
  }

  void prepare(Workspace& w) const {
    if (!w.x.empty()) return;
    w.PenalisedFit::prepare(shape_);
    w.records.resize(static_cast<size_t>(kTileWidth + 2 * radius_) * (kTileHeight + 2 * radius_) *
                     (layout_.stride / kLanes));
    w.keys.resize(search_.offsets().size());
    w.chosen.resize(search_.chosen_size());
    w.tail.resize(static_cast<size_t>(s_.k) * (layout_.size - layout_.contrasts));
    w.y_tail.resize(layout_.size - layout_.contrasts);
  }

  /// Transposes the records at `source` (one per lane) into lanes: first the contrasts, then the tail.
  void gather(const float* const* source, vfloat* contrasts, vfloat* tail) const {
    for (int first = 0; first < layout_.size; first += kLanes) {
      vfloat block[kLanes];
      for (int l = 0; l < kLanes; ++l) block[l] = load(source[l] + first);
      transpose(block);
      for (int i = 0; i < std::min(kLanes, layout_.size - first); ++i) {
        const int element = first + i;
        (element < layout_.contrasts ? contrasts[element] : tail[element - layout_.contrasts]) = block[i];
      }
    }
  }

  vfloat tail_value(const vfloat* tail, int offset) const { return tail[offset - layout_.contrasts]; }

  void run_batch(const Tile& tile, int x, int y, Workspace& w) const {
    const int n_lanes = std::min(kLanes, tile.x1 - x), k = s_.k, n_tail = layout_.size - layout_.contrasts;
    search_.find(in_.crn_moments->mean, x, y, w.keys.data(), w.chosen.data());

    // Lanes beyond the tile repeat its last pixel's record; their results are discarded.
    const float* target[kLanes];
    for (int l = 0; l < kLanes; ++l) target[l] = record(tile, std::min(x + l, tile.x1 - 1), y, w);
    gather(target, w.y.data(), w.y_tail.data());
    const ptrdiff_t row = static_cast<ptrdiff_t>(record_stride(tile)) * layout_.stride;
    for (int i = 0; i < k; ++i) {
      const float* source[kLanes];
      for (int l = 0; l < kLanes; ++l) {
        const Offset o = search_.offsets()[w.chosen[l * k + i]];
        source[l] = target[l] + o.dy * row + o.dx * layout_.stride;
      }
      gather(source, w.x.data() + static_cast<size_t>(i) * layout_.contrasts,
             w.tail.data() + static_cast<size_t>(i) * n_tail);
    }

    for (int c = 0; c < 3; ++c) {
      if (!s_.shared || c == 0) fit(c, s_.shared ? 3 : 1, w);
      finish_channel(c, x, y, n_lanes, w);
      if (s_.probe && s_.probe->y == y && s_.probe->x >= x && s_.probe->x < x + n_lanes) answer(c, x, w);
    }
  }

  /// Stores the coefficients of channel c at the probe's pixel.
  void answer(int c, int x, const Workspace& w) const {
    const int lane = s_.probe->x - x;
    if (!valid_[static_cast<size_t>(s_.probe->y) * in_.crn.width + s_.probe->x]) return;
    std::vector<ControlVariate>& found = s_.probe->control_variates;
    size_t n = 0;
    for (int i = 0; i < s_.k; ++i) {
      const Offset o = search_.offsets()[w.chosen[lane * s_.k + i]];
      const int px = s_.probe->x + o.dx, py = s_.probe->y + o.dy;
      if (px < 0 || py < 0 || px >= in_.crn.width || py >= in_.crn.height) continue;
      if (c == 0) found.push_back({o.dx, o.dy, {}});
      found[n++].beta[c] = w.beta[i][lane];
    }
  }

  /// Sum of a tail element over the channels [first, first + count).
  vfloat channel_sum(const vfloat* tail, int offset, int first, int count) const {
    vfloat total = tail_value(tail, offset + first);
    for (int c = first + 1; c < first + count; ++c) total += tail_value(tail, offset + c);
    return total;
  }

  /// Same for a penalty: if channels share their coefficients, records already hold the sum of all channels.
  vfloat penalty_sum(const vfloat* tail, int offset, int first) const {
    return tail_value(tail, offset + (layout_.penalties == 1 ? 0 : first));
  }

  /// The soft constraint on the coefficients as a row of X and y (one per channel, like a contrast of the groups),
  /// scaled by sqrt(mean_constraint (T - 1) S / N). The CRN mean has an error as large as the light it lacks; the
  /// variance of a group is T times that of the mean.
  void scale_condition(int first, int count, Workspace& w) const {
    const int k = s_.k, n_tail = layout_.size - layout_.contrasts;
    vfloat S = {}, N = {};
    for (int i = 0; i < k; ++i) {
      S += penalty_sum(w.tail.data() + i * n_tail, layout_.group_variance, first);
      for (int c = first; c < first + count; ++c) {
        const vfloat missing = tail_value(w.tail.data() + i * n_tail, layout_.missing + c);
        S = fma(static_cast<float>(T_) * missing, missing, S);
        const vfloat g = w.x[static_cast<size_t>(i) * layout_.contrasts + layout_.group_contrasts + c];
        N = fma(g, g, N);
      }
    }
    const vfloat factor = lanes::sqrt(S / max(N, splat(1e-30f)) * (s_.mean_constraint * static_cast<float>(T_ - 1)));
    for (int c = first; c < first + count; ++c) {
      for (int i = 0; i < k; ++i)
        w.x[static_cast<size_t>(i) * layout_.contrasts + layout_.group_contrasts + c] *= factor;
      w.y[layout_.group_contrasts + c] *= factor;
    }
  }

  /// V_h,i of [YM2025] Eq. (10), summed over the channels [first, first + count).
  void find_penalties(int first, int count, Workspace& w) const {
    const int k = s_.k, n_tail = layout_.size - layout_.contrasts;
    vfloat homogeneous = {};
    if (!in_.error_of_h) {
      for (int i = 0; i < k; ++i) homogeneous += penalty_sum(w.tail.data() + i * n_tail, layout_.group_variance, first);
      homogeneous *= (s_.ridge > 0 ? s_.ridge : kNegligibleRidge) / static_cast<float>(k);
    }
    const vfloat own = penalty_sum(w.y_tail.data(), layout_.error, first);
    const float variance_share = s_.sample_fraction * static_cast<float>(T_);
    for (int i = 0; i < k; ++i) {
      const vfloat* tail = w.tail.data() + i * n_tail;
      vfloat penalty = homogeneous, smallest = {};
      if (in_.error_of_h) {
        const vfloat error = penalty_sum(tail, layout_.error, first);
        penalty = s_.symmetric ? 0.5f * (own + error) : error;  // [YM2025] Sec. 4, after Eq. (11)
        if (s_.sample_fraction > 0)
          penalty =
              (1 - s_.sample_fraction) * penalty + variance_share * channel_sum(tail, layout_.h_variance, first, count);
        smallest = kSmallestPenalty * penalty_sum(tail, layout_.group_variance, first);
      }
      if (s_.mean_constraint > 0) {
        vfloat squares = {};
        for (int c = first; c < first + count; ++c) {
          const vfloat element = w.x[static_cast<size_t>(i) * layout_.contrasts + layout_.group_contrasts + c];
          squares = fma(element, element, squares);
        }
        smallest = max(smallest, squares * (kSmallestPenalty / (s_.mean_constraint * static_cast<float>(T_ - 1))));
      }
      w.penalty[i] = max(penalty, smallest) + 1e-30f;
    }
  }

  /// The coefficients of the channels [first, first + count).
  void fit(int first, int count, Workspace& w) const {
    const int k = s_.k, n_tail = layout_.size - layout_.contrasts;
    if (s_.mean_constraint > 0) scale_condition(first, count, w);
    find_penalties(first, count, w);
    for (int c = first; shape_.wants_responses && c < first + count; ++c)
      for (int i = 0; i < k; ++i)
        w.responses[c * k + i] = tail_value(w.tail.data() + i * n_tail, layout_.difference + c);
    w.find_coefficients(shape_, first, count);
  }

  /// Eq. (7) for one channel, and Eq. (8) if requested.
  void finish_channel(int c, int x, int y, int n_lanes, Workspace& w) const {
    const int k = s_.k, n_tail = layout_.size - layout_.contrasts;
    vfloat estimate = load(in_.crn_moments->mean.row(c, y) + x);
    for (int i = 0; i < k; ++i)
      estimate = fnma(w.beta[i], tail_value(w.tail.data() + i * n_tail, layout_.difference + c), estimate);
    // Squares of values above 10^18 overflow; such pixels take the independent image.
    for (int l = 0; l < n_lanes; ++l)
      result_.estimate.pixel(x + l, y)[c] = std::isfinite(estimate[l]) ? estimate[l] : in_.h->row(c, y)[x + l];
    if (in_.changes) {
      const vfloat shared_noise = own_covariance(c, x, y, w);
      for (int l = 0; l < n_lanes; ++l)
        result_.covariance.pixel(x + l, y)[c] =
            std::isfinite(estimate[l] + shared_noise[l]) ? shared_noise[l] : in_.variance_of_h->row(c, y)[x + l];
    }
    if (!s_.std_error) return;
    const vfloat error = lanes::sqrt(crn_variance(c, w) + independent_variance(c, w));
    for (int l = 0; l < n_lanes; ++l)
      result_.std_error.pixel(x + l, y)[c] =
          std::isfinite(error[l]) ? error[l] : std::sqrt(in_.variance_of_h->row(c, y)[x + l]);
  }

  /// cov(F^, h) of own_noise.h; the target is the first of its neighbours.
  vfloat own_covariance(int c, int x, int y, const Workspace& w) const {
    const vfloat* const u = w.responses.data() + static_cast<ptrdiff_t>(c) * s_.k;
    vfloat of_all = {};
    for (int i = 0; i < s_.k; ++i) of_all = fma(u[i], w.beta[i], of_all);
    const vfloat of_target = u[0] * w.beta[0];
    const vfloat of_errors = s_.symmetric ? of_all + of_target : 2 * of_target;  // as in find_penalties()
    const auto at = [&](const Planes& planes) { return load(planes.row(c, y) + x); };
    const vfloat penalties = (1 - s_.sample_fraction) * of_errors * at(in_.changes->errors) +
                             s_.sample_fraction * of_target * at(in_.changes->variances);
    return fma(w.beta[0], at(*in_.variance_of_h), static_cast<float>(T_ - 1) * penalties);
  }

  /// The first three terms of [YM2025] Eq. (8): variance of f - sum_i beta_i g_i. The coefficients were fitted to the
  /// same groups, so that the residuals are too small; generalised cross-validation [GHW1979] corrects this by the
  /// degrees of freedom. Light missing from the CRN image is an error of f and all g_i at once.
  vfloat crn_variance(int c, const Workspace& w) const {
    const vfloat squares = batch::residual_squares(w.x.data() + c, layout_.contrasts, 3, w.y.data() + c, w.gamma.data(),
                                                   s_.k, layout_.group_contrasts / 3);
    const vfloat left = max(1.0f - w.freedom, splat(kMinFreedom));
    vfloat missing = tail_value(w.y_tail.data(), layout_.missing + c);
    for (int i = 0; i < s_.k; ++i)
      missing = fnma(w.beta[i], tail_value(w.tail.data() + i * (layout_.size - layout_.contrasts), layout_.missing + c),
                     missing);
    return squares / (static_cast<float>(T_ * (T_ - 1)) * left * left) + missing * missing;
  }

  /// The last term of Eq. (8): sum_i beta_i^2 var h_i. Penalties that contain the sample variance give large
  /// coefficients to pixels whose sample variance happens to be small; for that fraction, the mean variance of the
  /// neighbours is used instead.
  vfloat independent_variance(int c, const Workspace& w) const {
    const int n_tail = layout_.size - layout_.contrasts;
    vfloat own = {}, variances = {}, squares = {}, count = {};
    for (int i = 0; i < s_.k; ++i) {
      const vfloat variance = tail_value(w.tail.data() + i * n_tail, layout_.h_variance + c);
      own = fma(w.beta[i] * w.beta[i], variance, own);
      squares = fma(w.beta[i], w.beta[i], squares);
      variances += variance;
      count += w.beta[i] != 0.0f ? splat(1.0f) : vfloat{};  // pixels outside the frame have no coefficient
    }
    return (1 - s_.sample_fraction) * own + s_.sample_fraction * squares * variances / max(count, splat(1.0f));
  }

  const ControlVariateInput& in_;
  const ControlVariateSettings& s_;
  const std::vector<unsigned char>& valid_;
  EstimatorResult& result_;
  const int T_;
  const PixelRecords records_;
  const RecordLayout layout_;
  const FitShape shape_;
  const NeighbourSearch search_;
  const int radius_;
};

}  // namespace

void apply_control_variates(const ControlVariateInput& input, const ControlVariateSettings& settings,
                            const std::vector<unsigned char>& valid, EstimatorResult& result) {
  const int width = input.crn.width, height = input.crn.height;
  result.estimate = Image(width, height, 3);
  result.std_error = settings.std_error ? Image(width, height, 3) : Image();
  result.covariance = input.changes ? Image(width, height, 3) : Image();
  const Regression regression(input, settings, valid, result);
  const int columns = (width + kTileWidth - 1) / kTileWidth, rows = (height + kTileHeight - 1) / kTileHeight;
  PerThread<Workspace> workspaces;
  parallel_for(columns * rows, [&](int i) {
    const int x0 = i % columns * kTileWidth, y0 = i / columns * kTileHeight;
    regression.run_tile({x0, y0, std::min(x0 + kTileWidth, width), std::min(y0 + kTileHeight, height)},
                        workspaces.local());
  });
}

void check_k(int k, int window, std::vector<std::string>& problems) {
  if (!kWindowRange.contains(window))
    problems.push_back(
        fmt::format("window is {}, expected an odd number from {} to {}", window, kWindowRange.low, kWindowRange.high));
  if (k < 1 || k > window * window)
    problems.push_back(fmt::format("k is {}, expected 1 to {}, the number of pixels in a window of {} x {}", k,
                                   window * window, window, window));
}

}  // namespace covary
