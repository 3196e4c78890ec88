// SPDX-License-Identifier: Apache-2.0
#include "tensors/tensor_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "support/files.h"
#include "support/tensor_text.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::float_field;
using test_support::message_of;
using test_support::tensor_text;
using test_support::test_file;

std::string write(const std::string& bytes) {
  const std::string path = test_file("t.bsdf");
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}
std::string refused(const std::string& bytes) {
  const std::string path = write(bytes);
  return message_of([&] { TensorFile file(path); }, ErrorCode::kInput).substr(path.size());
}

const std::vector<test_support::TensorField> kFields{
    float_field("a", {2, 3}, {1, 2, 3, 4, 5, 6}), {"text", {4}, "grey", 1}, {"number", {}, std::string(8, '\0'), 11}};

TEST(TensorFile, ReadsFields) {
  const TensorFile file(write(tensor_text(kFields)));
  EXPECT_TRUE(file.has("a"));
  EXPECT_FALSE(file.has("b"));
  EXPECT_EQ(file.shape("a"), (std::vector<uint64_t>{2, 3}));
  EXPECT_EQ(file.floats("a"), (std::vector<float>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(file.bytes("text"), (std::vector<uint8_t>{'g', 'r', 'e', 'y'}));
  EXPECT_TRUE(file.shape("number").empty());
  EXPECT_EQ(file.n_bytes(), tensor_text(kFields).size());
}

TEST(TensorFile, ReadsWhatMitsubaReads) {  // written in Python, values aligned to 8 bytes
  const TensorFile file(COVARY_SOURCE_DIR "/tests/references/measured_isotropic.bsdf");
  EXPECT_EQ(file.shape("rgb"), (std::vector<uint64_t>{1, 6, 3, 8, 8}));
  EXPECT_FLOAT_EQ(file.floats("theta_i")[2], 40 * static_cast<float>(M_PI) / 180);
}

TEST(TensorFile, WrongFieldsAreNamed) {
  const std::string path = write(tensor_text(kFields));
  const TensorFile file(path);
  EXPECT_EQ(message_of([&] { file.floats("b"); }, ErrorCode::kInput), path + ": has no field 'b'");
  EXPECT_EQ(message_of([&] { file.floats("text"); }, ErrorCode::kInput),
            path + ": has values of type 1 in field 'text'; expected 10, 32-bit floats");
  const std::string infinite = write(tensor_text({float_field("a", {2}, {1, INFINITY})}));
  EXPECT_EQ(message_of([&] { TensorFile(infinite).floats("a"); }, ErrorCode::kInput),
            infinite + ": value 1 of field 'a' is not finite");
  EXPECT_EQ(message_of([&] { TensorFile("/no/such/file"); }, ErrorCode::kIo), "/no/such/file: cannot be read");
}

TEST(TensorFile, DamagedFilesAreRefused) {
  EXPECT_EQ(refused(""), ": is not a tensor file: expected one that begins with 'tensor_file'");
  EXPECT_EQ(refused("tensor_fool\0\1\0"), ": is not a tensor file: expected one that begins with 'tensor_file'");
  const std::string whole = tensor_text(kFields);
  std::string other = whole;
  other[12] = 2;
  EXPECT_EQ(refused(other), ": is a tensor file of version 2.0; expected 1.0");
  other = whole;
  other[23] = 12;  // type of the first field, after 18 bytes, its name (2 + 1) and 2 more
  EXPECT_EQ(refused(other), ": has values of unknown type 12 in field 1");
  EXPECT_EQ(refused(tensor_text({kFields[0], kFields[0]})), ": has two fields of one name, the second is field 2");
  // Every truncated file is rejected without reading past its end.
  for (size_t length = 0; length < whole.size(); ++length) EXPECT_NE(refused(whole.substr(0, length)), "");
}

/// Sizes that overflow, or exceed the file, are detected before anything is allocated.
TEST(TensorFile, HugeFieldsAreRefused) {
  constexpr uint64_t kHuge = uint64_t{1} << 33;
  for (const std::vector<uint64_t>& shape : {std::vector<uint64_t>{kHuge, kHuge, 2}, {kHuge}, {1000}}) {
    auto fields = kFields;
    fields[0].shape = shape;
    EXPECT_TRUE(contains(refused(tensor_text(fields)),
                         "but its field 1 says it has " + shape_text(shape) + " values at byte "));
  }
  auto empty = kFields;
  empty[0].shape = {0, kHuge, kHuge};
  EXPECT_TRUE(TensorFile(write(tensor_text(empty))).floats("a").empty());
  std::string far = tensor_text(kFields);
  far[24 + 6] = 1;  // offset of the first field's values
  EXPECT_TRUE(contains(refused(far), "values at byte 281474976710"));
}

}  // namespace
}  // namespace covary
