// SPDX-License-Identifier: Apache-2.0
#include "film/auxiliary_features.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>
#include <string>

namespace covary {
namespace {

// A layer has one meaning, and covary reads its own.
TEST(AuxiliaryFeatures, NamesDiffer) {
  std::set<std::string_view> names;
  for (const AuxiliaryFeature& feature : kAuxiliaryFeatures) {
    for (const std::string_view name : feature.names) EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_TRUE(names.contains(feature.layer)) << feature.layer;
  }
}

TEST(AuxiliaryFeatures, NamesAreDocumented) {
  std::ifstream file(std::string(COVARY_SOURCE_DIR) + "/docs/other-renderers.md");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  ASSERT_FALSE(page.empty());
  for (const AuxiliaryFeature& feature : kAuxiliaryFeatures)
    for (const std::string_view name : feature.names) EXPECT_NE(page.find(name), std::string::npos) << name;
}

}  // namespace
}  // namespace covary
