// SPDX-License-Identifier: Apache-2.0
#include "passes/motion.h"

#include <vector>

#include "core/parallel.h"

namespace covary {
namespace {

/// A camera as the map from points to film positions and depths.
class Projection {
 public:
  explicit Projection(const Camera& camera)
      : camera_(camera), origin_(camera.settings().to_world.point({0, 0, 0})), to_camera_(camera.settings().to_world) {
    to_camera_ = to_camera_.inverse();
  }

  float depth(const Vec3& p) const {
    if (!camera_.is_orthographic()) return length(p - origin_);
    const Vec3 local = to_camera_.point(p);
    return local.z * length(camera_.settings().to_world.vector({0, 0, 1}));
  }
  /// Returns false if `p` is behind the camera.
  bool position(const Vec3& p, Vec2& film) const {
    if (!camera_.is_orthographic()) return position_of_direction(normalize(p - origin_), film);
    const Vec3 local = to_camera_.point(p);
    const auto width = static_cast<float>(camera_.width()), height = static_cast<float>(camera_.height());
    film = {0.5f * (1 - local.x) * width, 0.5f * (1 - local.y * width / height) * height};
    return local.z > 0;
  }
  /// For a point at infinity; not for orthographic cameras.
  bool position_of_direction(const Vec3& d, Vec2& film) const {
    if (!(camera_.pdf_direction(d) > 0)) return false;
    film = camera_.project(origin_, d);
    return true;
  }

 private:
  const Camera& camera_;
  Vec3 origin_;
  Transform to_camera_;
};

struct PixelMotion {
  float depth = 0;
  Vec3 motion{0, 0, 0};
};

PixelMotion pixel_motion(const Scene& scene, std::span<const Transform> displacements, const Projection& now,
                         const Projection& before, Vec2 centre) {
  const Camera& camera = scene.camera();
  const Ray ray = camera.ray(centre, {0.5f, 0.5f});
  RayHit hit;
  scene.nearest(std::span(&ray, 1), std::span(&hit, 1), false);
  PixelMotion result;
  Vec2 old;
  bool seen;
  if (hit.found()) {
    const Vec3 p = ray.at(hit.t);
    result.depth = now.depth(p);
    const int movement = scene.movement_of(hit);
    const Vec3 q = movement < 0 ? p : displacements[static_cast<size_t>(movement)].point(p);
    seen = before.position(q, old);
    if (seen) result.motion.z = before.depth(q) - result.depth;
  } else {
    if (camera.is_orthographic()) return result;  // all pixels show the same point at infinity
    seen = before.position_of_direction(ray.d, old);
  }
  result.motion.x = seen ? old.x - centre.x : static_cast<float>(camera.width());
  result.motion.y = seen ? old.y - centre.y : 0;
  return result;
}

}  // namespace

MotionImages motion_images(const Scene& scene, const Camera& previous, double then, const CropWindow& window,
                           const std::atomic<bool>* stop) {
  MotionImages images{Image(window.width, window.height, 1), Image(window.width, window.height, 3)};
  const Projection now(scene.camera()), before(previous);
  const std::vector<Transform> displacements = scene.displacements(then);
  parallel_for(window.height, [&](int y) {
    if (stop && stop->load(std::memory_order_relaxed)) return;
    for (int x = 0; x < window.width; ++x) {
      const Vec2 centre{static_cast<float>(window.x + x) + 0.5f, static_cast<float>(window.y + y) + 0.5f};
      const PixelMotion at = pixel_motion(scene, displacements, now, before, centre);
      *images.depth.pixel(x, y) = at.depth;
      for (int c = 0; c < 3; ++c) images.motion.pixel(x, y)[c] = at.motion[c];
    }
  });
  return images;
}

}  // namespace covary
