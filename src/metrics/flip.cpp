// SPDX-License-Identifier: Apache-2.0
#include "metrics/flip.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace covary {
namespace {

constexpr double kPiD = 3.14159265358979323846;

/// One float per pixel.
struct Plane {
  int width, height;
  std::vector<float> v;
  Plane(int w, int h) : width(w), height(h), v(static_cast<size_t>(w) * h) {}
  float* row(int y) { return v.data() + static_cast<size_t>(y) * width; }
  const float* row(int y) const { return v.data() + static_cast<size_t>(y) * width; }
};
using Planes = std::array<Plane, 3>;

/// Separable convolution with an odd number of taps, along x, then y; borders replicate the last pixel.
Plane convolve(const Plane& in, const std::vector<float>& kx, const std::vector<float>& ky) {
  const int rx = static_cast<int>(kx.size() / 2), ry = static_cast<int>(ky.size() / 2);
  Plane horizontal(in.width, in.height), out(in.width, in.height);
  parallel_for(in.height, [&](int y) {
    std::vector<float> padded(in.width + 2 * rx);
    for (int x = -rx; x < in.width + rx; ++x) padded[x + rx] = in.row(y)[std::clamp(x, 0, in.width - 1)];
    float* target = horizontal.row(y);
    for (int k = 0; k <= 2 * rx; ++k)
      for (int x = 0; x < in.width; ++x) target[x] += kx[k] * padded[x + k];
  });
  parallel_for(in.height, [&](int y) {
    float* target = out.row(y);
    for (int k = -ry; k <= ry; ++k) {
      const float* source = horizontal.row(std::clamp(y + k, 0, in.height - 1));
      for (int x = 0; x < in.width; ++x) target[x] += ky[k + ry] * source[x];
    }
  });
  return out;
}

using Matrix3 = std::array<std::array<float, 3>, 3>;
/// Linear Rec. 709 RGB to XYZ, white point D65 (IEC 61966-2-1), and back.
constexpr Matrix3 kXyzFromRgb{
    {{0.4123908f, 0.3575843f, 0.1804808f}, {0.2126390f, 0.7151687f, 0.0721923f}, {0.0193308f, 0.1191948f, 0.9505322f}}};
constexpr Matrix3 kRgbFromXyz{{{3.2409699f, -1.5373832f, -0.4986108f},
                               {-0.9692436f, 1.8759675f, 0.0415551f},
                               {0.0556301f, -0.2039770f, 1.0569715f}}};

Vec3 multiply(const Matrix3& m, const Vec3& v) {
  return {m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z, m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
          m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
}

const Vec3 kWhite = multiply(kXyzFromRgb, {1, 1, 1});

/// XYZ relative to white to the linear opponent space Y Cx Cz, [Andersson2020] Eq. (2).
Vec3 opponent(const Vec3& rgb) {
  const Vec3 xyz = multiply(kXyzFromRgb, rgb);
  const Vec3 n{xyz.x / kWhite.x, xyz.y / kWhite.y, xyz.z / kWhite.z};
  return {116 * n.y - 16, 500 * (n.x - n.y), 200 * (n.y - n.z)};
}

Vec3 rgb_from_opponent(const Vec3& o) {
  const float y = (o.x + 16) / 116;
  return multiply(kRgbFromXyz, {(y + o.y / 500) * kWhite.x, y * kWhite.y, (y - o.z / 200) * kWhite.z});
}

/// CIELAB with chroma scaled by lightness for the Hunt effect: [Andersson2020] Eq. (5).
Vec3 hunt_lab(const Vec3& rgb) {
  const Vec3 xyz = multiply(kXyzFromRgb, rgb);
  const auto f = [](float t) {
    constexpr float kDelta = 6.0f / 29;
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0f / 29;
  };
  const float fx = f(xyz.x / kWhite.x), fy = f(xyz.y / kWhite.y), fz = f(xyz.z / kWhite.z);
  const float lightness = 116 * fy - 16;
  return {lightness, 0.01f * lightness * 500 * (fx - fy), 0.01f * lightness * 200 * (fy - fz)};
}

/// Distance for large colour differences, [Andersson2020] Eq. (6).
float hyab(const Vec3& a, const Vec3& b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

/// Contrast sensitivity function as a filter: a sum of two Gaussians a sqrt(pi/b) exp(-pi^2 x^2 / b), x in degrees.
struct Sensitivity {
  double a1, b1, a2, b2;
};
constexpr std::array<Sensitivity, 3> kSensitivity{{{1, 0.0047, 0, 1e-5},         // achromatic
                                                   {1, 0.0053, 0, 1e-5},         // red-green
                                                   {34.1, 0.04, 13.5, 0.025}}};  // blue-yellow, [Andersson2020] Table 1

/// Filters an opponent channel by its contrast sensitivity; each Gaussian is separable, and the kernel sums to one.
Plane filter_by_sensitivity(const Plane& in, const Sensitivity& s, double pixels_per_degree) {
  // All channels share the radius of the widest Gaussian.
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(0.04 / (2 * kPiD * kPiD)) * pixels_per_degree));
  const auto gaussian = [&](double b, double& sum) {
    std::vector<double> kernel;
    sum = 0;
    for (int i = -radius; i <= radius; ++i) {
      const double x = i / pixels_per_degree;
      kernel.push_back(std::exp(-kPiD * kPiD * x * x / b));
      sum += kernel.back();
    }
    std::vector<float> normalised;
    for (double k : kernel) normalised.push_back(static_cast<float>(k / sum));
    return normalised;
  };
  double sum1, sum2;
  const std::vector<float> k1 = gaussian(s.b1, sum1), k2 = gaussian(s.b2, sum2);
  const double w1 = s.a1 * std::sqrt(kPiD / s.b1) * sum1 * sum1, w2 = s.a2 * std::sqrt(kPiD / s.b2) * sum2 * sum2;
  Plane out = convolve(in, k1, k1);
  if (s.a2 == 0) return out;
  const Plane second = convolve(in, k2, k2);
  const float f1 = static_cast<float>(w1 / (w1 + w2)), f2 = static_cast<float>(w2 / (w1 + w2));
  for (size_t i = 0; i < out.v.size(); ++i) out.v[i] = f1 * out.v[i] + f2 * second.v[i];
  return out;
}

/// Responses to edges (first derivative) and to points and lines (second derivative).
struct Features {
  Plane edge, point;
};

Features features(const Plane& luminance, double pixels_per_degree) {
  const double sigma = 0.5 * 0.082 * pixels_per_degree;  // half the peak-to-valley distance, [Andersson2020] Sec. 4.2
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> smooth, first, second;
  for (int i = -radius; i <= radius; ++i) {
    const double g = std::exp(-0.5 * i * i / (sigma * sigma));
    smooth.push_back(g), first.push_back(-i * g), second.push_back((i * i / (sigma * sigma) - 1) * g);
  }
  // Positive weights are normalised to sum to 1, negative ones to -1.
  const auto normalise = [](const std::vector<double>& kernel) {
    double positive = 0, negative = 0;
    for (double k : kernel) (k > 0 ? positive : negative) += k;
    std::vector<float> result;
    for (double k : kernel) result.push_back(static_cast<float>(k > 0 ? k / positive : k < 0 ? k / -negative : 0));
    return result;
  };
  const std::vector<float> s = normalise(smooth), d1 = normalise(first), d2 = normalise(second);
  const auto magnitude = [](const Plane& x, Plane y) {
    for (size_t i = 0; i < y.v.size(); ++i) y.v[i] = std::hypot(x.v[i], y.v[i]);
    return y;
  };
  return {magnitude(convolve(luminance, d1, s), convolve(luminance, s, d1)),
          magnitude(convolve(luminance, d2, s), convolve(luminance, s, d2))};
}

/// What FLIP compares: filtered colours in a perceptually uniform space, and features.
struct Perceived {
  Image lab;
  Features features;
};

Perceived perceive(const Image& image, double pixels_per_degree) {
  Planes planes{Plane(image.width, image.height), Plane(image.width, image.height), Plane(image.width, image.height)};
  Plane luminance(image.width, image.height);
  for (size_t i = 0; i < luminance.v.size(); ++i) {
    const float* p = image.data.data() + i * 3;
    const Vec3 o = opponent({clamp01(p[0]), clamp01(p[1]), clamp01(p[2])});
    for (int c = 0; c < 3; ++c) planes[c].v[i] = o[c];
    luminance.v[i] = (o.x + 16) / 116;
  }
  for (int c = 0; c < 3; ++c) planes[c] = filter_by_sensitivity(planes[c], kSensitivity[c], pixels_per_degree);
  Image lab(image.width, image.height, 3);
  parallel_for(image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const Vec3 rgb = rgb_from_opponent({planes[0].row(y)[x], planes[1].row(y)[x], planes[2].row(y)[x]});
      const Vec3 value = hunt_lab({clamp01(rgb.x), clamp01(rgb.y), clamp01(rgb.z)});
      for (int c = 0; c < 3; ++c) lab.pixel(x, y)[c] = value[c];
    }
  });
  return {std::move(lab), features(luminance, pixels_per_degree)};
}

/// [Andersson2020] Sec. 4.1.3: a power of the distance, compressed above a fraction of the largest distance.
float colour_difference(const Vec3& a, const Vec3& b) {
  constexpr float kPower = 0.7f, kKnee = 0.4f, kValueAtKnee = 0.95f;
  static const float largest = std::pow(hyab(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1})), kPower);
  const float difference = std::pow(hyab(a, b), kPower), knee = kKnee * largest;
  if (difference < knee) return kValueAtKnee / knee * difference;
  return kValueAtKnee + (difference - knee) / (largest - knee) * (1 - kValueAtKnee);
}

/// The rational approximation k(x) = (a x^2 + b x) / (c x^2 + d x + e) of the ACES tone curve used by [Andersson2021].
constexpr float kAcesA = 0.6f * 0.6f * 2.51f, kAcesB = 0.6f * 0.03f, kAcesC = 0.6f * 0.6f * 2.43f,
                kAcesD = 0.6f * 0.59f, kAcesE = 0.14f;

float aces(float x) {
  x = std::clamp(x, 0.0f, 1e9f);  // the curve has reached 1 long before; larger squares overflow
  return clamp01((kAcesA * x * x + kAcesB * x) / (kAcesC * x * x + kAcesD * x + kAcesE));
}

Image exposed(const Image& image, float stops) {
  const float factor = std::exp2(stops);
  Image result = image;
  for (float& v : result.data) v = aces(v * factor);
  return result;
}

}  // namespace

Image flip_ldr(const Image& image, const Image& reference, float pixels_per_degree) {
  COVARY_CHECK(image.width == reference.width && image.height == reference.height && image.channels == 3 &&
                   reference.channels == 3,
               "images of one size with 3 channels");
  const Perceived t = perceive(image, pixels_per_degree), r = perceive(reference, pixels_per_degree);
  Image result(image.width, image.height, 1);
  parallel_for(image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const float *a = t.lab.pixel(x, y), *b = r.lab.pixel(x, y);
      const float colour = colour_difference({a[0], a[1], a[2]}, {b[0], b[1], b[2]});
      const float edge = std::abs(t.features.edge.row(y)[x] - r.features.edge.row(y)[x]);
      const float point = std::abs(t.features.point.row(y)[x] - r.features.point.row(y)[x]);
      const float feature = std::sqrt(std::max(edge, point) / std::sqrt(2.0f));  // [Andersson2020] Eq. (14)
      *result.pixel(x, y) = std::pow(colour, 1 - feature);                       // [Andersson2020] Eq. (15)
    }
  });
  return result;
}

namespace {

float luminance(const Image& image, size_t p) {
  const float* rgb = image.data.data() + 3 * p;
  return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];
}

/// Maps floats to integers of the same order.
constexpr uint32_t kSign = 1u << 31;
uint32_t rising(float value) {
  const auto bits = std::bit_cast<uint32_t>(value);
  return bits & kSign ? ~bits : bits | kSign;
}
float float_of(uint32_t rising) { return std::bit_cast<float>(rising & kSign ? rising & ~kSign : ~rising); }

/// Counts of values.
class Histogram {
 public:
  void add(uint16_t value) { ++counts_[value]; }
  /// The value at position `rank` in sorted order; `rank` becomes its position among values in the same bin.
  uint32_t value_at(uint64_t& rank) const {
    uint32_t value = 0;
    while (rank >= counts_[value]) rank -= counts_[value++];
    return value;
  }

 private:
  std::vector<uint64_t> counts_ = std::vector<uint64_t>(size_t{1} << 16);
};

}  // namespace

FlipExposures flip_exposures(const Image& reference) {
  return flip_exposures([&](const std::function<void(const Image&)>& give) { give(reference); });
}

FlipExposures flip_exposures(const VisitImages& visit) {
  // Median by two histograms: of the upper half of the bits, then of the lower.
  Histogram upper, lower;
  uint64_t rank = 0;
  float brightest = -std::numeric_limits<float>::infinity();
  visit([&](const Image& image) {
    for (size_t p = 0; p < image.data.size() / 3; ++p) {
      upper.add(static_cast<uint16_t>(rising(luminance(image, p)) >> 16));
      brightest = std::max(brightest, luminance(image, p));
    }
    rank += image.data.size() / 3;
  });
  rank /= 2;
  const uint32_t high = upper.value_at(rank);
  visit([&](const Image& image) {
    for (size_t p = 0; p < image.data.size() / 3; ++p)
      if (const uint32_t bits = rising(luminance(image, p)); bits >> 16 == high)
        lower.add(static_cast<uint16_t>(bits & 0xffff));
  });
  const float middle = float_of(high << 16 | lower.value_at(rank));
  // If the reference is all or mostly black, these are undefined; the smallest positive value stands in.
  constexpr float kSmallest = 1e-7f;
  const float median = std::clamp(middle, kSmallest, std::numeric_limits<float>::max());
  const float largest =
      std::clamp(brightest, median, std::numeric_limits<float>::max());  // a sum of three may overflow
  // The luminance that the tone curve maps to 0.85, [Andersson2021] Sec. 3: the positive root of k(x) = t.
  constexpr double kTarget = 0.85;
  const double a = kAcesA - kTarget * kAcesC, b = kAcesB - kTarget * kAcesD, c = -kTarget * kAcesE;
  const double x = (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a);
  FlipExposures result;
  result.start = static_cast<float>(std::log2(x / largest));
  result.stop = static_cast<float>(std::log2(x / median));
  result.count = std::max(2, static_cast<int>(std::ceil(result.stop - result.start)));
  return result;
}

Image flip_hdr(const Image& image, const Image& reference) {
  return flip_hdr(image, reference, flip_exposures(reference));
}

Image flip_hdr(const Image& image, const Image& reference, const FlipExposures& exposures, float pixels_per_degree) {
  Image result(image.width, image.height, 1);
  for (int i = 0; i < exposures.count; ++i) {
    const float stops =
        lerp(static_cast<float>(i) / static_cast<float>(exposures.count - 1), exposures.start, exposures.stop);
    const Image map = flip_ldr(exposed(image, stops), exposed(reference, stops), pixels_per_degree);
    for (size_t p = 0; p < map.data.size(); ++p) result.data[p] = std::max(result.data[p], map.data[p]);
  }
  return result;
}

}  // namespace covary
