// SPDX-License-Identifier: Apache-2.0
#include "core/perlin_noise.h"

#include <cmath>
#include <cstdint>

namespace covary {
namespace {

/// Perlin's permutation of 0 … 255 [Perlin2002].
constexpr uint8_t kPermutation[256] = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,  69,  142,
    8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,  94,  252, 219, 203,
    117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136, 171, 168, 68,  175, 74,  165,
    71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122, 60,  211, 133, 230, 220, 105, 92,  41,
    55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161, 1,   216, 80,  73,  209, 76,  132, 187, 208, 89,
    18,  169, 200, 196, 135, 130, 116, 188, 159, 86,  164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250,
    124, 123, 5,   202, 38,  147, 118, 126, 255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189,
    28,  42,  223, 183, 170, 213, 119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,
    129, 22,  39,  253, 19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,
    242, 193, 238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,  222, 114,
    67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180,
};

int hashed(int i) { return kPermutation[i & 255]; }

/// Dot product of (x, y, z) with one of twelve gradients, chosen by the lattice point.
float gradient(int ix, int iy, int iz, float x, float y, float z) {
  const int h = hashed(hashed(hashed(ix) + iy) + iz) & 15;
  const float u = h < 8 || h == 12 || h == 13 ? x : y, v = h < 4 || h == 12 || h == 13 ? y : z;
  return ((h & 1) != 0 ? -u : u) + ((h & 2) != 0 ? -v : v);
}

float fade(float t) { return t * t * t * (t * (6 * t - 15) + 10); }

/// Into the range of int, without a change nearer than 2^30.
float folded(float x) { return std::isfinite(x) ? std::fmod(x, static_cast<float>(1 << 30)) : 0; }

template <typename Octave>
float octaves(const Vec3& p, float omega, int count, const Octave& octave) {
  float sum = 0, lambda = 1, weight = 1;
  for (int i = 0; i < count; ++i, lambda *= 1.99f, weight *= omega) sum += weight * octave(perlin_noise(p * lambda));
  return sum;
}

}  // namespace

float perlin_noise(const Vec3& p) {
  const float q[3] = {folded(p.x), folded(p.y), folded(p.z)};
  int i[3];
  float d[3], w[3];
  for (int k = 0; k < 3; ++k) {
    const float floor = std::floor(q[k]);
    i[k] = static_cast<int>(floor), d[k] = q[k] - floor, w[k] = fade(d[k]);
  }
  const auto corner = [&](int x, int y, int z) {
    return gradient(i[0] + x, i[1] + y, i[2] + z, d[0] - static_cast<float>(x), d[1] - static_cast<float>(y),
                    d[2] - static_cast<float>(z));
  };
  const auto row = [&](int y, int z) { return lerp(w[0], corner(0, y, z), corner(1, y, z)); };
  return lerp(w[2], lerp(w[1], row(0, 0), row(1, 0)), lerp(w[1], row(0, 1), row(1, 1)));
}

float fractal_noise(const Vec3& p, float omega, int count) {
  return octaves(p, omega, count, [](float n) { return n; });
}

float turbulence(const Vec3& p, float omega, int count) {
  return octaves(p, omega, count, [](float n) { return std::abs(n); }) + 0.2f * std::pow(omega, count);
}

}  // namespace covary
