// SPDX-License-Identifier: Apache-2.0
#include "io/object_factory.h"

#include <gtest/gtest.h>

namespace covary {
namespace {

ObjectDescription bitmap(std::vector<Property> properties) {
  ObjectDescription object;
  object.kind = "texture", object.type = "bitmap", object.where = {"scene.xml", 3, 1};
  object.properties = std::move(properties);
  return object;
}

Property named(const std::string& name, Value value) { return {name, std::move(value), {}}; }

TEST(DescriptionKey, IsEqualForEqualThings) {
  ObjectDescription a = bitmap({named("filename", std::string("a.png")), named("raw", true)});
  ObjectDescription b = bitmap({named("raw", true), named("filename", std::string("a.png"))});
  b.id = "other", b.where.line = 9;
  EXPECT_EQ(description_key(a), description_key(b));
}

TEST(DescriptionKey, DiffersWhereAnyValueDiffers) {
  const std::vector<Value> values = {true,
                                     false,
                                     int64_t{1},
                                     int64_t{2},
                                     1.0,
                                     std::nextafter(1.0, 2.0),
                                     std::string("1"),
                                     std::string("1\nraw=b1"),
                                     Vec3{1, 2, 3},
                                     Vec3{1, 2, 4},
                                     ColourValue{{1, 2, 3}},
                                     SampledSpectrum{{{1, 2}}},
                                     SampledSpectrum{{{1, 2}, {3, 4}}},
                                     Transform(),
                                     Transform::scale({1, 2, 1})};
  for (size_t i = 0; i < values.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      EXPECT_NE(description_key(bitmap({named("p", values[i])})), description_key(bitmap({named("p", values[j])})))
          << i << " " << j;
  EXPECT_NE(description_key(bitmap({named("p", true)})), description_key(bitmap({named("q", true)})));
  ObjectDescription other = bitmap({});
  other.type = "checkerboard";
  EXPECT_NE(description_key(other), description_key(bitmap({})));
  other = bitmap({});
  other.where.file = "sub/scene.xml";  // there, the same relative name means another file
  EXPECT_NE(description_key(other), description_key(bitmap({})));
}

}  // namespace
}  // namespace covary
