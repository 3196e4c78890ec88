// SPDX-License-Identifier: Apache-2.0
#include <set>
#include <string>

#include "support/model_checks.h"

namespace covary::testing {
namespace {

TEST(BsdfRegistry, IsSortedWithoutRepetition) {
  const auto plugins = bsdf_plugins();
  for (size_t i = 1; i < plugins.size(); ++i) EXPECT_LT(std::string(plugins[i - 1].name), plugins[i].name);
}

TEST(BsdfRegistry, EveryModelThatNeedsNothingElseHasDefaults) {
  const std::set<std::string> needs_more{"blendbsdf", "bumpmap",   "coating",      "mask",
                                         "measured",  "normalmap", "roughcoating", "twosided"};
  for (const Plugin<Bsdf>& plugin : bsdf_plugins()) {
    if (needs_more.count(plugin.name)) continue;
    const BsdfPtr bsdf = make_bsdf({{"type", plugin.name}});
    ASSERT_TRUE(bsdf) << plugin.name;
    Arena arena;
    const BsdfClosure* closure = bsdf->bind(flat_hit(), true, TransportMode::kRadiance, arena);
    EXPECT_EQ(closure->flags() & ~bsdf->flags(), 0u) << plugin.name;
    EXPECT_LE(closure->n_lobes(), kMaxLobes) << plugin.name;
    const Spectrum albedo = bsdf->albedo(flat_hit());
    EXPECT_GE(std::min(albedo.r, std::min(albedo.g, albedo.b)), 0) << plugin.name;
    EXPECT_LE(max_component(albedo), 1) << plugin.name;
  }
}

}  // namespace
}  // namespace covary::testing
