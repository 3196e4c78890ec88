// SPDX-License-Identifier: Apache-2.0
#include "core/keyed_transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/error.h"

namespace covary {
namespace {

Matrix4 moved(double x, double degrees, double scale = 1) {
  return (Transform::translate({static_cast<float>(x), 0, 0}) * Transform::rotate({0, 0, 1}, degrees) *
          Transform::scale({static_cast<float>(scale), 1, 1}))
      .matrix();
}

void expect_near(const Matrix4& a, const Matrix4& b) {
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) EXPECT_NEAR(a[i][j], b[i][j], 1e-12) << i << ' ' << j;
}

std::string problem_of(std::vector<TransformKey> keys) {
  try {
    const KeyedTransform made(std::move(keys));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInput);
    return error.what();
  }
  return "";
}

TEST(KeyedTransform, GivesTheMatricesOfKeysAndRestsOutside) {
  const Matrix4 a = moved(0.1, 3, 0.7), b = moved(0.3, 50, 1.3);
  const KeyedTransform path({{2, a}, {4, b}});
  EXPECT_EQ(path.at(2).matrix(), a);
  EXPECT_EQ(path.at(-7).matrix(), a);
  EXPECT_EQ(path.at(4).matrix(), b);
  EXPECT_EQ(path.at(9).matrix(), b);
  EXPECT_EQ(path.first_time(), 2);
  EXPECT_EQ(path.last_time(), 4);
}

TEST(KeyedTransform, TurnsEvenlyAndMovesStraight) {
  const KeyedTransform path({{0, moved(0, 10)}, {1, moved(4, 90)}, {3, moved(4, 90)}});
  expect_near(path.at(0.25).matrix(), moved(1, 30));
  expect_near(path.at(0.5).matrix(), moved(2, 50));
  EXPECT_EQ(path.at(2).matrix(), moved(4, 90));
}

TEST(KeyedTransform, TakesTheShorterArc) {
  const KeyedTransform path({{0, moved(0, 350)}, {1, moved(0, 370)}});
  expect_near(path.at(0.5).matrix(), moved(0, 0));
}

TEST(KeyedTransform, InterpolatesScalesAndKeepsMirrors) {
  const KeyedTransform growing({{0, moved(0, 0, 1)}, {1, moved(0, 90, 3)}});
  expect_near(growing.at(0.5).matrix(), moved(0, 45, 2));
  const KeyedTransform mirrored({{0, moved(0, 0, -1)}, {1, moved(0, 90, -1)}});
  const Transform between = mirrored.at(0.5);
  EXPECT_TRUE(between.flips_handedness());
  expect_near(between.matrix(), moved(0, 45, -1));
}

TEST(KeyedTransform, NamesTheKeyThatIsWrong) {
  const Matrix4 good = moved(0, 0);
  Matrix4 flat = good, projective = good;
  flat[0][0] = 0, projective[3][0] = 1;
  EXPECT_EQ(problem_of({}), "there are no keyframes");
  EXPECT_EQ(problem_of({{0, good}, {0, good}}), "keyframe 1: the time 0 is not after 0, that of the one before");
  EXPECT_EQ(problem_of({{NAN, good}}), "keyframe 0: the time is not finite");
  EXPECT_EQ(problem_of({{0, good}, {1, flat}}), "keyframe 1: the transformation matrix is singular");
  EXPECT_EQ(problem_of({{0, projective}}),
            "keyframe 0: the last row of the matrix is not 0 0 0 1; matrices are given by rows");
}

}  // namespace
}  // namespace covary
