// SPDX-License-Identifier: Apache-2.0
#include "denoising/weighed_candidate.h"

#include "denoising/mixed_rows.h"
#include "weighing/weighing.h"

namespace covary {

void add_weighing_maker(const Features& features, std::vector<CandidateMaker>& makers) {
  const WeighingNetwork* const network = WeighingNetwork::find(names_of(makers));
  if (!network) return;
  WeighingSurfaces seen;
  if (features.albedo && features.normal) {
    const Features second = network_features(features);
    seen = {features.albedo, features.normal, second.albedo, second.normal};
  }
  CandidateMaker maker;
  maker.names = {kWeighedName};
  maker.shares = [network, seen](const CandidateInput& in, const CandidateSet& set) {
    return network->shares({&set.base, set.candidates, in.std_error, seen});
  };
  makers.push_back(std::move(maker));
}

void add_weighed(const CandidateMaker& maker, const CandidateInput& in, CandidateSet& set) {
  set.shares = maker.shares(in, set);
  set.candidates.push_back(weighed({&set.base, set.candidates, in.std_error, {}}, set.shares));
}

}  // namespace covary
