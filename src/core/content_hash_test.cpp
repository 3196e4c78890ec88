// SPDX-License-Identifier: Apache-2.0
#include "core/content_hash.h"

#include <gtest/gtest.h>

#include <set>

namespace covary {
namespace {

TEST(ContentHash, AgreesWithPublishedValuesOfXxh64) {
  EXPECT_EQ(hash_bytes(std::string_view("")), 0xef46db3751d8e999ull);
  EXPECT_EQ(hash_bytes(std::string_view("a")), 0xd24ec4f1a98c6e5bull);
  EXPECT_EQ(hash_bytes(std::string_view("abc")), 0x44bc2cf5ad770999ull);
  // Longer than one 32-byte stripe, with tails of 8, 4 and 1 bytes.
  EXPECT_EQ(hash_bytes(std::string_view("Nobody inspects the spammish repetition")), 0xfbcea83c8a378bf1ull);
}

TEST(ContentHash, ChangesWithEveryByteAndLength) {
  std::set<uint64_t> seen;
  for (size_t length = 0; length < 100; ++length) seen.insert(hash_bytes(std::string(length, 'x')));
  for (size_t i = 0; i < 100; ++i) {
    std::string text(100, 'x');
    text[i] = 'y';
    seen.insert(hash_bytes(text));
  }
  EXPECT_EQ(seen.size(), 200u);
}

TEST(ContentHash, KeysAgreeWithPublishedValuesOfXxh3) {
  EXPECT_EQ(key_text(""), "99aa06d3014798d86001c324468d497f");
  std::set<std::string> seen;
  for (size_t length = 0; length < 300; ++length) seen.insert(key_text(std::string(length, 'x')));
  EXPECT_EQ(seen.size(), 300u);
  EXPECT_EQ(seen.begin()->size(), 32u);
}

TEST(ContentHash, IsWrittenAsSixteenDigits) { EXPECT_EQ(hash_text(0xabcull), "0000000000000abc"); }

}  // namespace
}  // namespace covary
