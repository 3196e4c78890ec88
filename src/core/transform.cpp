// SPDX-License-Identifier: Apache-2.0
#include "core/transform.h"

#include <Eigen/Dense>
#include <cmath>

#include "core/error.h"

namespace covary {
namespace {

constexpr Matrix4 kIdentity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
using EigenMatrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

Matrix4 multiply(const Matrix4& a, const Matrix4& b) {
  Matrix4 c{};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k) c[i][j] += a[i][k] * b[k][j];
  return c;
}

/// The inverse of a matrix that appears singular beside a large translation, but is not without it.
Matrix4 inverted_affine(const EigenMatrix& m) {
  const Eigen::FullPivLU<Eigen::Matrix3d> lu(Eigen::Matrix3d(m.topLeftCorner<3, 3>()));
  if (m.row(3) != Eigen::RowVector4d(0, 0, 0, 1) || !lu.isInvertible())
    throw Error(ErrorCode::kInput, "the transformation matrix is singular");
  const Eigen::Matrix3d linear = lu.inverse();
  EigenMatrix inverse = EigenMatrix::Identity();
  inverse.topLeftCorner<3, 3>() = linear;
  inverse.topRightCorner<3, 1>() = -linear * m.topRightCorner<3, 1>();
  Matrix4 result;
  Eigen::Map<EigenMatrix>(result[0].data()) = inverse;
  return result;
}

Matrix4 inverted(const Matrix4& m) {
  const Eigen::Map<const EigenMatrix> a(m[0].data());
  const Eigen::FullPivLU<EigenMatrix> lu(a);
  if (!a.allFinite()) throw Error(ErrorCode::kInput, "the transformation matrix has an entry that is not finite");
  if (!lu.isInvertible()) return inverted_affine(a);
  Matrix4 result;
  Eigen::Map<EigenMatrix>(result[0].data()) = lu.inverse();
  return result;
}

}  // namespace

Transform::Transform() : m_(kIdentity), inverse_(kIdentity) {}
Transform::Transform(const Matrix4& matrix) : m_(matrix), inverse_(inverted(matrix)) {}

Transform Transform::translate(const Vec3& v) {
  Matrix4 m = kIdentity;
  for (int i = 0; i < 3; ++i) m[i][3] = v[i];
  return Transform(m);
}

Transform Transform::scale(const Vec3& v) {
  Matrix4 m = kIdentity;
  for (int i = 0; i < 3; ++i) m[i][i] = v[i];
  return Transform(m);
}

Transform Transform::rotate(const Vec3& axis, double degrees) {
  const Eigen::Vector3d a(axis.x, axis.y, axis.z);
  if (!(a.norm() > 0)) throw Error(ErrorCode::kInput, "the axis of a rotation has length zero");
  const Eigen::Matrix3d r = Eigen::AngleAxisd(degrees * M_PI / 180, a.normalized()).toRotationMatrix();
  Matrix4 m = kIdentity;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m[i][j] = r(i, j);
  return Transform(m);
}

Transform Transform::look_at(const Vec3& origin, const Vec3& target, const Vec3& up) {
  const Vec3 d = target - origin, x = cross(up, d);
  if (!(length(d) > 0)) throw Error(ErrorCode::kInput, "look_at: origin and target are the same point");
  if (!(length(x) > 1e-6f * length(d) * length(up)))
    throw Error(ErrorCode::kInput, "look_at: the up vector is zero or parallel to the viewing direction");
  const Vec3 z = normalize(d), left = normalize(x), y = cross(z, left);
  Matrix4 m = kIdentity;
  for (int i = 0; i < 3; ++i) m[i][0] = left[i], m[i][1] = y[i], m[i][2] = z[i], m[i][3] = origin[i];
  return Transform(m);
}

Vec3 Transform::point(const Vec3& p) const {
  double r[4];
  for (int i = 0; i < 4; ++i) r[i] = m_[i][0] * p.x + m_[i][1] * p.y + m_[i][2] * p.z + m_[i][3];
  return {static_cast<float>(r[0] / r[3]), static_cast<float>(r[1] / r[3]), static_cast<float>(r[2] / r[3])};
}

Vec3 Transform::vector(const Vec3& v) const {
  Vec3 r;
  for (int i = 0; i < 3; ++i) r[i] = static_cast<float>(m_[i][0] * v.x + m_[i][1] * v.y + m_[i][2] * v.z);
  return r;
}

Vec3 Transform::normal(const Vec3& n) const {
  Vec3 r;
  for (int i = 0; i < 3; ++i)
    r[i] = static_cast<float>(inverse_[0][i] * n.x + inverse_[1][i] * n.y + inverse_[2][i] * n.z);
  return r;
}

Transform Transform::inverse() const { return Transform(inverse_, m_); }
bool Transform::is_identity() const { return m_ == kIdentity; }

bool Transform::flips_handedness() const {
  return Eigen::Map<const EigenMatrix>(m_[0].data()).topLeftCorner<3, 3>().determinant() < 0;
}

Bounds3 Transform::bounds(const Bounds3& b) const {
  Bounds3 result;
  if (b.empty()) return result;
  for (int i = 0; i < 8; ++i)
    result.extend(point({i & 1 ? b.upper.x : b.lower.x, i & 2 ? b.upper.y : b.lower.y, i & 4 ? b.upper.z : b.lower.z}));
  return result;
}

Transform operator*(const Transform& a, const Transform& b) {
  return Transform(multiply(a.m_, b.m_), multiply(b.inverse_, a.inverse_));
}

}  // namespace covary
