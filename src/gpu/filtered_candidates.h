// SPDX-License-Identifier: Apache-2.0
// Candidates made by filters, denoising/candidates.h, on a device: of the mean of independent samples.
#pragma once

#include "denoising/candidates.h"
#include "gpu/denoising_parts.h"
#include "gpu/held_out.h"
#include "gpu/nl_means.h"
#include "gpu/regression.h"

namespace covary::gpu {

/// Auxiliary images on a device.
class FeatureBuffers {
 public:
  FeatureBuffers(Device& device, const Features& features, FilterKinds kinds);

  /// Null if there is none.
  const Buffer<float>* albedo() const { return albedo_ ? &albedo_ : nullptr; }
  const Buffer<float>* normal() const { return normal_ ? &normal_ : nullptr; }
  /// feature_of_light().
  const Buffer<float>* of_light() const { return of_light_ ? &of_light_ : nullptr; }
  /// Of the regression; null: without it.
  const FeatureBuffer* features() const { return features_.count > 0 ? &features_ : nullptr; }
  /// Whether the image itself is filtered by NL-means.
  bool nl_means() const { return nl_means_; }
  SurfaceBuffers surfaces() const;

 private:
  Buffer<float> albedo_, normal_, albedo_behind_, normal_behind_, of_light_;
  FeatureBuffer features_;
  bool nl_means_ = true;
};

/// Writes the candidates of filter_names() to `results`, one after another. `is_half`: with coarse regression.
/// `layer`: of a mean, filter this image, with the weights of the part's; null: the part's itself.
void filter(Device& device, const Groups& groups, const FeatureBuffers& features, CandidateBase base,
            const PartBuffers& part, bool is_half, const Place& results, const Buffer<float>* layer = nullptr);

}  // namespace covary::gpu
