// SPDX-License-Identifier: Apache-2.0
#include "core/keyed_transform.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"

namespace covary {
namespace {

struct Parts {
  Eigen::Vector3d translation;
  Eigen::Quaterniond rotation;
  Eigen::Matrix3d scale;
};

/// M = R S by the singular value decomposition M = U D V^T: R = U V^T and S = V D V^T [Shoemake1992, §4]. If M contains
/// a reflection, it goes into S, so that R is a rotation.
Parts parts_of(const Matrix4& m) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(m[0].data());
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(linear, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = linear.determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d rotation = sign * svd.matrixU() * svd.matrixV().transpose();
  return {matrix.topRightCorner<3, 1>(), Eigen::Quaterniond(rotation), rotation.transpose() * linear};
}

Matrix4 matrix_of(const Parts& parts) {
  const Eigen::Matrix3d linear = parts.rotation.toRotationMatrix() * parts.scale;
  Matrix4 m{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m[i][j] = linear(i, j);
    m[i][3] = parts.translation[i];
  }
  m[3][3] = 1;
  return m;
}

void check(const std::vector<TransformKey>& keys) {
  const auto refuse = [](size_t key, const std::string& what) {
    throw Error(ErrorCode::kInput, fmt::format("keyframe {}: {}", key, what));
  };
  if (keys.empty()) throw Error(ErrorCode::kInput, "there are no keyframes");
  for (size_t i = 0; i < keys.size(); ++i) {
    if (!std::isfinite(keys[i].time)) refuse(i, "the time is not finite");
    if (i > 0 && keys[i].time <= keys[i - 1].time)
      refuse(i, fmt::format("the time {:g} is not after {:g}, that of the one before", keys[i].time, keys[i - 1].time));
    try {
      const Transform invertible(keys[i].matrix);
    } catch (const Error& error) {
      refuse(i, error.what());
    }
    if (keys[i].matrix[3] != std::array<double, 4>{0, 0, 0, 1})
      refuse(i, "the last row of the matrix is not 0 0 0 1; matrices are given by rows");
  }
}

}  // namespace

KeyedTransform::KeyedTransform(std::vector<TransformKey> keys) : keys_(std::move(keys)) { check(keys_); }

Transform KeyedTransform::at(double time) const {
  const auto after = std::upper_bound(keys_.begin(), keys_.end(), time,
                                      [](double t, const TransformKey& key) { return t < key.time; });
  if (after == keys_.begin()) return Transform(keys_.front().matrix);
  const TransformKey& a = *(after - 1);
  if (after == keys_.end() || time == a.time || a.matrix == after->matrix) return Transform(a.matrix);
  const TransformKey& b = *after;
  const double u = (time - a.time) / (b.time - a.time);
  const Parts from = parts_of(a.matrix), to = parts_of(b.matrix);
  // slerp() takes the shorter of the two arcs.
  return Transform(matrix_of({(1 - u) * from.translation + u * to.translation, from.rotation.slerp(u, to.rotation),
                              (1 - u) * from.scale + u * to.scale}));
}

}  // namespace covary
