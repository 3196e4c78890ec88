// SPDX-License-Identifier: Apache-2.0
#include "denoising/mixed_rows.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/parallel.h"
#include "estimators/result_rows.h"
#include "risk/held_out_bias.h"
#include "risk/image_risk.h"
#include "risk/predicted_error.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

/// HeldOutInput::error_over_variance
double typical_error(const std::vector<CandidateMaker>& makers) {
  double typical = 0.5;
  for (const CandidateMaker& maker : makers) typical = std::max(typical, maker.error_over_variance);
  return typical;
}

ErrorKind kind_of(const std::vector<CandidateMaker>& makers, bool is_mean) {
  const bool network = has_network(makers);
  if (is_mean) return network ? ErrorKind::kNetwork : ErrorKind::kFilters;
  return network ? ErrorKind::kPairNetwork : ErrorKind::kPairFilters;
}

std::vector<MixedRows::BaseRow> rows_of_base(const DenoisingParts& parts, const Image& guide) {
  std::vector<MixedRows::BaseRow> rows(static_cast<size_t>(guide.height));
  parallel_for(guide.height, 8, [&](int y) {
    MixedRows::BaseRow& row = rows[static_cast<size_t>(y)];
    for (int x = 0; x < guide.width; ++x) {
      if (!parts.valid[static_cast<size_t>(y) * guide.width + x]) continue;
      const float weight = relative_weight(guide.pixel(x, y));
      for (int c = 0; c < 3; ++c) row.error += weight * sqr(parts.whole.image.std_error.pixel(x, y)[c]);
      row.valid += 1;
    }
  });
  return rows;
}

/// relMSE of the mixture, the base and each candidate: the mixture's prediction plus differences that held-out samples
/// measure.
MeasuredRisks risks_of(const MixedRows& all, const std::vector<std::string>& names, const std::string& base,
                       double predicted) {
  double error = 0, valid = 0;
  for (const MixedRows::BaseRow& row : all.of_base) error += row.error, valid += row.valid;
  const HalvesRisk mixed = risk_of_halves(all.error.rows, valid);
  MeasuredRisks risks{.held_out = mixed.of_whole(), .bias_share = 0, .images = {}};
  if (predicted > 0) risks.bias_share = std::clamp(1 - 0.5 * mixed.variance / predicted, 0.0, 1.0);
  risks.images.push_back({base, valid > 0 ? error / (3 * valid) : 0});
  for (size_t p = 0; p < names.size(); ++p) {
    const HalvesRisk risk = risk_of_halves(all.of_candidates[p], valid);
    risks.images.push_back({names[p], std::max(predicted + risk.of_whole() - mixed.of_whole(), 0.5 * risk.variance)});
  }
  return risks;
}

template <typename Row>
void append_to(const std::vector<Row>& part, int skipped, int n, std::vector<Row>& whole) {
  if (!part.empty()) whole.insert(whole.end(), part.begin() + skipped, part.begin() + skipped + n);
}

}  // namespace

std::vector<std::string> names_of(const std::vector<CandidateMaker>& makers) {
  std::vector<std::string> names;
  for (const CandidateMaker& maker : makers) names.insert(names.end(), maker.names.begin(), maker.names.end());
  return names;
}

MixedRows mixed_rows(const DenoisingParts& parts, const MixedParts& mixed, const std::vector<CandidateMaker>& makers,
                     bool with_error) {
  const Mixture& mixture = mixed.mixture;
  const std::vector<unsigned char>& valid = parts.valid;
  MixedRows rows;
  rows.result.estimate = mixture.image;
  rows.result.nonfinite_pixels = parts.whole.image.nonfinite_pixels;
  rows.result.risk_kind = kind_of(makers, parts.is_mean);
  if (!with_error) return rows;
  const std::array<const Image*, 2> images = {&mixture.halves[0], &mixture.halves[1]};
  const std::array<const Moments*, 2> independent = {&parts.halves[0].independent, &parts.halves[1].independent};
  const Image& guide = guide_of(mixed.whole);
  HeldOutInput held_out{images, independent, &guide, &valid};
  rows.error = held_out_parts(held_out);
  rows.disagreement = disagreement(mixed.whole, guide, mixture.image, valid);
  rows.result.bias =
      held_out_bias({images, {&guide_of(mixed.halves[0]), &guide_of(mixed.halves[1])}, independent, &valid});
  rows.result.risk_rows = image_risk(
      {&mixture.image, images, &parts.whole.independent, independent, &parts.groups, &guide, &valid, parts.features});
  rows.of_base = rows_of_base(parts, guide);
  for (size_t p = 0; p < mixed.whole.candidates.size(); ++p) {
    held_out.halves = {&mixed.halves[0].candidates[p], &mixed.halves[1].candidates[p]};
    rows.of_candidates.push_back(held_out_rows(held_out));
  }
  return rows;
}

void append(const MixedRows& part, int skipped, int y, int n, int height, MixedRows& whole) {
  append_rows(part.result, skipped, y, n, height, whole.result);
  copy_rows(part.error.relative, skipped, y, n, height, whole.error.relative);
  copy_rows(part.error.weight, skipped, y, n, height, whole.error.weight);
  append_to(part.error.rows, skipped, n, whole.error.rows);
  copy_rows(part.disagreement, skipped, y, n, height, whole.disagreement);
  append_to(part.of_base, skipped, n, whole.of_base);
  whole.of_candidates.resize(part.of_candidates.size());
  for (size_t p = 0; p < part.of_candidates.size(); ++p)
    append_to(part.of_candidates[p], skipped, n, whole.of_candidates[p]);
}

MethodImage finish(MixedRows whole, const std::vector<CandidateMaker>& makers, const std::string& base) {
  if (whole.of_base.empty()) return std::move(whole.result);
  const std::vector<HeldOutRow> rows = whole.error.rows;
  whole.result.std_error = held_out_error(std::move(whole.error), whole.disagreement, typical_error(makers));
  whole.error.rows = rows;
  whole.result.risks = risks_of(whole, names_of(makers), base, predicted_relmse(whole.result));
  return std::move(whole.result);
}

}  // namespace covary
