// SPDX-License-Identifier: Apache-2.0
#include "estimators/method.h"

#include "estimators/mean.h"

namespace covary {

MethodImage Method::image(const Samples& samples, const MethodSettings& settings) const {
  if (const PassPair* of = pair()) return of->image(samples.crn, samples.independent, settings);
  if (const OnePass* of = one_pass()) return of->image(samples.independent, settings);
  return mean_of_groups(samples.independent);
}

}  // namespace covary
