// SPDX-License-Identifier: Apache-2.0
#include "denoising/weighed_candidate.h"

#include "denoising/mixed_rows.h"
#include "denoising/part_features.h"
#include "weighing/weighing.h"

namespace covary {
namespace {

WeighingSurfaces surfaces_of(const Features& features) {
  if (!features.albedo || !features.normal) return {};
  const Features second = network_features(features);
  return {features.albedo, features.normal, second.albedo, second.normal};
}

}  // namespace

void add_weighing_maker(const Features& features, std::vector<CandidateMaker>& makers) {
  const WeighingNetwork* const network = WeighingNetwork::find(names_of(makers));
  if (!network) return;
  CandidateMaker maker;
  maker.names = {kWeighedName};
  maker.shares = [network, features](const CandidateInput& in, const CandidateSet& set) {
    const PartFeatures of_part(features, in.part);
    return network->shares({&set.base, set.candidates, in.std_error, surfaces_of(of_part.view())});
  };
  makers.push_back(std::move(maker));
}

void add_weighed(const CandidateMaker& maker, const CandidateInput& in, CandidateSet& set) {
  set.shares = maker.shares(in, set);
  set.candidates.push_back(weighed({&set.base, set.candidates, in.std_error, {}}, set.shares));
}

}  // namespace covary
