// SPDX-License-Identifier: Apache-2.0
// Lanes and batched algebra, against the standard library and Eigen in double precision.
#include "filters/batch_algebra.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <vector>

#include "estimators/test_images.h"

namespace covary {
namespace {

using lanes::kLanes;
using lanes::vfloat;

TEST(Lanes, ExpOfNonpositiveIsAccurate) {
  for (int i = 0; i < 6343; ++i) {
    const float x = -0.0137f * static_cast<float>(i);
    const double exact = std::exp(static_cast<double>(x));
    EXPECT_NEAR(lanes::exp_of_nonpositive(lanes::splat(x))[3] / exact, 1.0, 3e-7 - 1e-7 * x) << x;
  }
  EXPECT_EQ(lanes::exp_of_nonpositive(vfloat{})[0], 1.0f);
  EXPECT_EQ(lanes::exp_of_nonpositive(lanes::splat(-1e30f))[0], 0.0f);
  EXPECT_EQ(lanes::exp_of_nonpositive(lanes::splat(-INFINITY))[0], 0.0f);
}

TEST(Lanes, TinyProductsAreZeroWhileTheyAreFlushed) {
  volatile float tiny = 1e-30f, product = 1;
  {
    const lanes::FlushTiny flush;
    product = tiny * 1e-10f;
    EXPECT_EQ(product, 0.0f);
    product = tiny * 1e-7f;
    EXPECT_GT(product, 0.9e-37f);
  }
  product = tiny * 1e-10f;
  EXPECT_GT(product, 0.9e-40f);
}

TEST(Lanes, TransposeSwapsRowsAndLanes) {
  vfloat rows[kLanes];
  for (int i = 0; i < kLanes; ++i)
    for (int l = 0; l < kLanes; ++l) rows[i][l] = static_cast<float>(100 * i + l);
  lanes::transpose(rows);
  for (int i = 0; i < kLanes; ++i)
    for (int l = 0; l < kLanes; ++l) EXPECT_EQ(rows[i][l], static_cast<float>(100 * l + i));
}

/// Every size up to three register tiles and beyond, vectors stored by rows and by columns.
TEST(BatchAlgebra, GramAndSolveAgreeWithEigen) {
  for (int m : {1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13, 25, 33, 40}) {
    for (int n : {1, 5, 33}) {
      for (bool by_rows : {true, false}) {
        std::vector<vfloat> X(static_cast<size_t>(m) * n), G(batch::packed_size(m + 3)), b(m), inverse(m);
        const ptrdiff_t row = by_rows ? n : 1, sum = by_rows ? 1 : m;
        for (int i = 0; i < m; ++i)
          for (int s = 0; s < n; ++s)
            for (int l = 0; l < kLanes; ++l) X[i * row + s * sum][l] = test::noise(m, 1000 * i + s, l);
        for (int i = 0; i < m; ++i)
          for (int l = 0; l < kLanes; ++l) b[i][l] = test::noise(m + 50, i, l);
        batch::gram(X.data(), row, sum, m, n, G.data());
        std::vector<vfloat> x = b, solved = G;
        std::vector<vfloat> shift(m);
        for (int i = 0; i < m; ++i)
          for (int l = 0; l < kLanes; ++l) shift[i][l] = 0.8f + test::noise(m + 60, i, l);
        // Two more right-hand sides: the same, and twice it.
        vfloat* const more[] = {&solved[batch::packed(m + 1, 0)], &solved[batch::packed(m + 2, 0)]};
        for (int i = 0; i < m; ++i) more[0][i] = b[i], more[1][i] = 2 * b[i];
        batch::solve_shifted(solved.data(), shift.data(), m, x.data(), inverse.data(), 2);
        std::vector<vfloat> scratch(static_cast<size_t>(m) * batch::kColumnsAtOnce);
        const vfloat trace = batch::inverse_trace(solved.data(), inverse.data(), shift.data(), m, scratch.data());
        vfloat norm = {}, twice = {};  // b^T A^-1 b from L^-1 b
        for (int i = 0; i < m; ++i) norm += more[0][i] * more[0][i], twice += more[0][i] * more[1][i];
        for (int l : {0, 3, kLanes - 1}) {
          Eigen::MatrixXd A(m, n);
          Eigen::VectorXd rhs(m);
          for (int i = 0; i < m; ++i) {
            rhs(i) = b[i][l];
            for (int s = 0; s < n; ++s) A(i, s) = X[i * row + s * sum][l];
          }
          const Eigen::MatrixXd expected = A * A.transpose();
          Eigen::MatrixXd shifted = expected;
          for (int i = 0; i < m; ++i) shifted(i, i) += shift[i][l];
          const Eigen::VectorXd solution = shifted.ldlt().solve(rhs);
          const Eigen::MatrixXd inverted = shifted.inverse();
          double expected_trace = 0;
          for (int i = 0; i < m; ++i) expected_trace += shift[i][l] * inverted(i, i);
          ASSERT_NEAR(trace[l], expected_trace, 1e-5 * m) << "m " << m << " n " << n;
          ASSERT_NEAR(norm[l], rhs.dot(inverted * rhs), 1e-5 * m) << "m " << m << " n " << n;
          ASSERT_NEAR(twice[l], 2 * rhs.dot(inverted * rhs), 2e-5 * m) << "m " << m << " n " << n;
          for (int i = 0; i < m; ++i) {
            for (int j = 0; j <= i; ++j) ASSERT_NEAR(G[batch::packed(i, j)][l], expected(i, j), 1e-5) << m << " " << n;
            ASSERT_NEAR(x[i][l], solution(i), 2e-5) << "m " << m << " n " << n << " lane " << l;
          }
        }
      }
    }
  }
}

/// Products and residuals of vectors stored by rows and by columns, for every remainder of a register tile.
TEST(BatchAlgebra, ProductsAndResidualsAgreeWithEigen) {
  for (int m : {1, 2, 3, 4, 5, 7, 25})
    for (int n : {1, 2, 6, 11, 13, 36})
      for (bool by_rows : {true, false}) {
        const ptrdiff_t row = by_rows ? n : 1, sum = by_rows ? 1 : m;
        std::vector<vfloat> X(static_cast<size_t>(m) * n), y(X.size()), gamma(m), products(m);
        for (int l = 0; l < kLanes; ++l) {
          for (size_t i = 0; i < X.size(); ++i) X[i][l] = test::noise(m, i, l), y[i][l] = test::noise(m + 1, i, l);
          for (int i = 0; i < m; ++i) gamma[i][l] = test::noise(m + 2, i, l);
        }
        batch::multiply(X.data(), row, sum, y.data(), m, n, products.data());
        const vfloat squares = batch::residual_squares(X.data(), row, sum, y.data(), gamma.data(), m, n);
        for (int l : {0, kLanes - 1}) {
          Eigen::MatrixXd A(m, n);
          Eigen::VectorXd target(n), factors(m);
          for (int s = 0; s < n; ++s) {
            target(s) = y[s * sum][l];
            for (int i = 0; i < m; ++i) A(i, s) = X[i * row + s * sum][l], factors(i) = gamma[i][l];
          }
          const Eigen::VectorXd expected = A * target;
          for (int i = 0; i < m; ++i) ASSERT_NEAR(products[i][l], expected(i), 1e-5) << m << " x " << n;
          ASSERT_NEAR(squares[l], (target - A.transpose() * factors).squaredNorm(), 1e-5 * n) << m << " x " << n;
        }
      }
}

/// Rank 1 with 1e7 times the shift: rounding would make pivots negative; the solution must stay close to the exact one.
TEST(BatchAlgebra, SolveSurvivesNearlySingularSystems) {
  const int m = 12;
  std::vector<vfloat> X(m), G(batch::packed_size(m + 1)), b(m), inverse(m);
  for (int i = 0; i < m; ++i) X[i] = b[i] = lanes::splat(3000.0f + 10.0f * static_cast<float>(i));
  batch::gram(X.data(), 1, 1, m, 1, G.data());
  const std::vector<vfloat> shift(m, lanes::splat(1.0f));
  batch::solve_shifted(G.data(), shift.data(), m, b.data(), inverse.data());
  // x = X / (X.X + 1), so that X.x is 1 up to 1e-8.
  float product = 0;
  for (int i = 0; i < m; ++i) product += X[i][0] * b[i][0];
  EXPECT_NEAR(product, 1.0f, 1e-3f);
}

}  // namespace
}  // namespace covary
