// SPDX-License-Identifier: Apache-2.0
#include "statistics/closure_checks.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace covary::statistics {

namespace {

BsdfSample draw(const BsdfClosure& closure, const Vec3& wo, const PathRandom& random) {
  return closure.sample(wo, random.get_1d(0, Event::kLobe), random.get_2d(0, Event::kDirection));
}

double mixture_pdf(const BsdfClosure& closure, const Vec3& wo, const Vec3& wi, const float* pmfs) {
  std::array<float, kMaxLobes> pdfs{};
  closure.lobe_pdfs(wo, wi, pdfs.data());
  double sum = 0;
  for (int l = 0; l < closure.n_lobes(); ++l) sum += double(pmfs[l]) * pdfs[l];
  return sum;
}

bool close(double a, double b, double relative) { return std::abs(a - b) <= relative * std::abs(b) + 1e-7; }

/// The first inconsistency between a sample and eval() and the densities of its direction; "" if there is none.
std::string inconsistency(const BsdfClosure& closure, const Vec3& wo, const BsdfSample& s, const float* pmfs,
                          double tolerance) {
  const auto at = [&](const std::string& what) {
    return fmt::format("{} at wo = ({}, {}, {}), wi = ({}, {}, {}), lobe {}", what, wo.x, wo.y, wo.z, s.wi.x, s.wi.y,
                       s.wi.z, s.lobe);
  };
  if (!std::isfinite(s.pdf) || !is_finite(s.weight)) return at("the sample is not finite");
  if (std::abs(length(s.wi) - 1) > 1e-4f) return at("the sampled direction is not a unit vector");
  if (s.lobe >= static_cast<uint32_t>(closure.n_lobes())) return at("the lobe's index is out of range");
  if (s.flags == 0 || (s.flags & closure.flags()) != s.flags) return at("the lobe's flags are not the closure's");
  if ((s.flags & kReflection) && s.wi.z * wo.z < 0) return at("a reflection crosses the surface");
  if ((s.flags & kTransmission) && s.wi.z * wo.z > 0) return at("a transmission stays on its side");
  if (s.is_delta()) return close(s.pdf, pmfs[s.lobe], tolerance) ? "" : at("a delta sample's pdf is not its pmf");

  const BsdfValue v = closure.eval(wo, s.wi);
  if (!close(v.pdf_solid_angle, s.pdf, tolerance))
    return at(fmt::format("eval gives density {}, sample {}", v.pdf_solid_angle, s.pdf));
  const double sum = mixture_pdf(closure, wo, s.wi, pmfs);
  if (!close(sum, s.pdf, tolerance)) return at(fmt::format("sum of pmf pdf is {}, density of sample {}", sum, s.pdf));
  for (int c = 0; c < 3; ++c)
    if (!close(v.value[c] / s.pdf, s.weight[c], tolerance))
      return at(fmt::format("value / density is {}, weight {}", v.value[c] / s.pdf, s.weight[c]));
  return "";
}

}  // namespace

std::vector<std::string> check_closure(const BsdfClosure& closure, const Vec3& wo, const Chi2Options& options,
                                       double value_tolerance) {
  std::vector<std::string> failures;
  const int n_lobes = closure.n_lobes();
  std::array<float, kMaxLobes> pmfs{};
  closure.lobe_pmfs(wo, pmfs.data());
  double pmf_sum = 0;
  for (int l = 0; l < n_lobes; ++l) pmf_sum += pmfs[l];
  if (pmf_sum > 1 + 1e-5)
    failures.push_back(fmt::format("{}: the lobes' probabilities sum to {}", options.name, pmf_sum));

  // Item 2 for the first samples; counts for all of them.
  std::array<double, kMaxLobes> n_delta{}, n_smooth{};
  for (int i = 0; i < options.n_samples; ++i) {
    const BsdfSample s = draw(closure, wo, PathRandom(Sampling::kIndependent, options.seed, 0, 0, i));
    if (!s.valid()) continue;
    if (i < options.n_samples / 20) {
      if (const std::string why = inconsistency(closure, wo, s, pmfs.data(), value_tolerance); !why.empty()) {
        failures.push_back(options.name + ": " + why);
        break;
      }
    }
    ++(s.is_delta() ? n_delta : n_smooth)[std::min<uint32_t>(s.lobe, kMaxLobes - 1)];
  }

  const auto chi2 = [&](const std::string& name, int lobe) {
    Chi2Options o = options;
    o.name += name;
    const Chi2Result result = chi2_sphere(
        [&](const PathRandom& random) -> std::optional<Vec3> {
          const BsdfSample s = draw(closure, wo, random);
          if (!s.valid() || s.is_delta() || (lobe >= 0 && s.lobe != static_cast<uint32_t>(lobe))) return std::nullopt;
          return s.wi;
        },
        [&](const Vec3& wi) -> double {
          if (lobe < 0) return closure.eval(wo, wi).pdf_solid_angle;
          std::array<float, kMaxLobes> pdfs{};
          closure.lobe_pdfs(wo, wi, pdfs.data());
          return double(pmfs[lobe]) * pdfs[lobe];
        },
        o);
    if (!result.accepted) failures.push_back(result.message);
  };
  if (closure.flags() & kSmooth) {
    chi2(" (mixture)", -1);
    for (int l = 0; l < n_lobes && n_lobes > 1; ++l)
      if (n_smooth[l] > 0 || n_delta[l] == 0) chi2(fmt::format(" (lobe {})", l), l);
  }
  for (int l = 0; l < n_lobes; ++l) {
    if (n_delta[l] == 0) continue;
    const TestResult result = binomial_test(n_delta[l], options.n_samples, pmfs[l], options.alpha);
    if (!result.accepted) failures.push_back(fmt::format("{} (delta lobe {}): {}", options.name, l, result.message));
  }
  return failures;
}

Spectrum smooth_albedo(const BsdfClosure& closure, const Vec3& wo) {
  Spectrum result;
  for (int c = 0; c < 3; ++c)
    result[c] = static_cast<float>(
        integrate_sphere([&](const Vec3& wi) -> double { return closure.eval(wo, wi).value[c]; }, 1e-4));
  return result;
}

Spectrum sampled_albedo(const BsdfClosure& closure, const Vec3& wo, int n, uint64_t seed, double* variance_of_mean) {
  std::array<Moments, 3> moments;
  for (int i = 0; i < n; ++i) {
    const BsdfSample s = draw(closure, wo, PathRandom(Sampling::kIndependent, seed, 2, 0, i));
    for (int c = 0; c < 3; ++c) moments[c].add(s.valid() ? s.weight[c] : 0);
  }
  if (variance_of_mean) *variance_of_mean = moments[1].variance_of_mean();
  return {static_cast<float>(moments[0].mean()), static_cast<float>(moments[1].mean()),
          static_cast<float>(moments[2].mean())};
}

}  // namespace covary::statistics
