// SPDX-License-Identifier: Apache-2.0
#include "integrators/aov.h"

#include "core/parallel.h"

namespace covary {

void render_aovs(const Scene& scene, const PassSettings& settings, uint32_t spp, Film& film,
                 const std::atomic<bool>* stop) {
  Image albedo(film.width(), film.height(), 3), normal = albedo, position = albedo;
  const auto stopped = [&] { return stop && stop->load(std::memory_order_relaxed); };
  parallel_for(film.height(), [&](int y) {
    if (stopped()) return;
    for (int x = 0; x < film.width(); ++x) {
      const int frame_x = film.crop().x + x, frame_y = film.crop().y + y;
      Spectrum a;
      Vec3 n, p;
      for (uint32_t s = 0; s < spp; ++s) {
        const Ray ray = camera_sample(scene, settings, frame_x, frame_y, s).ray;
        SurfaceHit hit;
        if (!scene.intersect(ray, hit)) continue;
        a += hit.bsdf->albedo(hit);
        n += hit.frame.n;
        p += hit.p;
      }
      const float scale = 1 / static_cast<float>(spp);
      const float values[3][3] = {{a.r, a.g, a.b}, {n.x, n.y, n.z}, {p.x, p.y, p.z}};
      Image* images[3] = {&albedo, &normal, &position};
      for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 3; ++c) images[i]->pixel(x, y)[c] = values[i][c] * scale;
    }
  });
  if (stopped()) return;
  film.aovs["Albedo"] = std::move(albedo);
  film.aovs["N"] = std::move(normal);
  film.aovs["P"] = std::move(position);
}

}  // namespace covary
