// SPDX-License-Identifier: Apache-2.0
#include "integrators/subpath_store.h"

#include <gtest/gtest.h>

#include <string>

namespace covary {
namespace {

std::vector<std::string> texts(const SubpathStore<std::string>& store, size_t path) {
  const auto vertices = store.path(path);
  return {vertices.begin(), vertices.end()};
}

TEST(SubpathStore, PutsTheVerticesOfAPathSideBySide) {
  SubpathStore<std::string> store;
  store.start(4);
  // In the order of a batch of paths: one edge of all active paths at a time; path 1 has no vertex.
  for (const auto& [path, text] : {std::pair{0u, "a0"}, {2u, "c0"}, {3u, "d0"}, {0u, "a1"}, {3u, "d1"}, {3u, "d2"}})
    store.append(path, text);
  store.finish();
  EXPECT_EQ(store.n_paths(), 4u);
  EXPECT_EQ(store.n_vertices(), 6u);
  EXPECT_EQ(texts(store, 0), (std::vector<std::string>{"a0", "a1"}));
  EXPECT_EQ(texts(store, 1), std::vector<std::string>{});
  EXPECT_EQ(texts(store, 2), std::vector<std::string>{"c0"});
  EXPECT_EQ(texts(store, 3), (std::vector<std::string>{"d0", "d1", "d2"}));
  store.path(3)[1] = "changed";
  EXPECT_EQ(texts(store, 3)[1], "changed");
}

TEST(SubpathStore, StartsAfresh) {
  SubpathStore<std::string> store;
  EXPECT_EQ(store.n_paths(), 0u);
  for (const size_t n : {3, 1, 2}) {
    store.start(n);
    store.append(0, "first");
    store.finish();
    EXPECT_EQ(store.n_paths(), n);
    EXPECT_EQ(texts(store, 0), std::vector<std::string>{"first"});
    EXPECT_TRUE(store.path(n - 1).empty() || n == 1);
  }
}

}  // namespace
}  // namespace covary
