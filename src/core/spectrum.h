// SPDX-License-Identifier: Apache-2.0
// Colour: linear RGB with Rec. 709 primaries, the working space of the whole program.
#pragma once

#include "core/vec.h"

namespace covary {

/// Three channels of radiance, reflectance or throughput (linear Rec. 709 RGB).
struct Spectrum {
  float r = 0, g = 0, b = 0;
  Spectrum() = default;
  explicit Spectrum(float v) : r(v), g(v), b(v) {}
  Spectrum(float r_, float g_, float b_) : r(r_), g(g_), b(b_) {}
  float operator[](int i) const { return i == 0 ? r : (i == 1 ? g : b); }
  float& operator[](int i) { return i == 0 ? r : (i == 1 ? g : b); }
  Spectrum& operator+=(const Spectrum& o) {
    r += o.r, g += o.g, b += o.b;
    return *this;
  }
  Spectrum& operator*=(const Spectrum& o) {
    r *= o.r, g *= o.g, b *= o.b;
    return *this;
  }
  Spectrum& operator*=(float s) {
    r *= s, g *= s, b *= s;
    return *this;
  }
  bool operator==(const Spectrum&) const = default;
};
inline Spectrum operator+(const Spectrum& a, const Spectrum& b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
inline Spectrum operator-(const Spectrum& a, const Spectrum& b) { return {a.r - b.r, a.g - b.g, a.b - b.b}; }
inline Spectrum operator*(const Spectrum& a, const Spectrum& b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
inline Spectrum operator/(const Spectrum& a, const Spectrum& b) { return {a.r / b.r, a.g / b.g, a.b / b.b}; }
inline Spectrum operator*(const Spectrum& a, float s) { return {a.r * s, a.g * s, a.b * s}; }
inline Spectrum operator*(float s, const Spectrum& a) { return a * s; }
inline Spectrum operator/(const Spectrum& a, float s) { return a * (1 / s); }
inline Spectrum sqrt(const Spectrum& a) { return {safe_sqrt(a.r), safe_sqrt(a.g), safe_sqrt(a.b)}; }
inline Spectrum lerp(float t, const Spectrum& a, const Spectrum& b) { return a * (1 - t) + b * t; }

inline float max_component(const Spectrum& a) { return std::max(a.r, std::max(a.g, a.b)); }
inline float mean(const Spectrum& a) { return (a.r + a.g + a.b) * (1.0f / 3); }
/// Relative luminance Y of linear Rec. 709 RGB.
inline float luminance(const Spectrum& a) { return 0.212671f * a.r + 0.715160f * a.g + 0.072169f * a.b; }
inline bool is_black(const Spectrum& a) { return a.r == 0 && a.g == 0 && a.b == 0; }
inline bool is_finite(const Spectrum& a) { return std::isfinite(a.r) && std::isfinite(a.g) && std::isfinite(a.b); }

}  // namespace covary
