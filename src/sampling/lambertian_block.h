// SPDX-License-Identifier: Apache-2.0
// Path vertices on Lambertian triangle meshes, the most common case in most scenes, shaded together in SIMD lanes
// [Afra2016]. Results match shading vertex by vertex, with the same order of operations.
#pragma once

#include <cstdint>
#include <vector>

#include "core/random.h"
#include "scene/lambertian.h"
#include "scene/mesh.h"
#include "scene/scene.h"

namespace covary {

/// A non-emissive mesh without instance transform, with its BSDF.
struct LambertianMesh {
  const TriangleMesh* mesh = nullptr;
  Lambertian model;
};

/// Finds hits on such meshes. An object serves one thread and one scene, which must not change meanwhile.
class LambertianMeshes {
 public:
  /// Null if the hit of `ray`, which must exist, is on another surface.
  const LambertianMesh* find(const Scene& scene, const Ray& ray, const RayHit& hit) {
    if (hit.instance != RayHit::kNone) return nullptr;
    if (hit.geometry >= known_.size()) known_.resize(hit.geometry + 1);
    Known& known = known_[hit.geometry];
    if (!known.asked) ask(scene, ray, hit, known);
    return known.surface.mesh ? &known.surface : nullptr;
  }
  /// For hits where find() was not null.
  const LambertianMesh& at(const RayHit& hit) const { return known_[hit.geometry].surface; }

 private:
  struct Known {
    bool asked = false;
    LambertianMesh surface;
  };
  static void ask(const Scene& scene, const Ray& ray, const RayHit& hit, Known& known);
  std::vector<Known> known_;  // by geometry
};

/// Some vertices of a batch as structure of arrays. The functions process the first `size` vertices; each is a
/// branch-free loop that compilers vectorise.
class LambertianBlock {
 public:
  static constexpr int kCapacity = 64;
  struct alignas(64) Floats {
    float v[kCapacity] = {};
    float& operator[](int lane) { return v[lane]; }
    float operator[](int lane) const { return v[lane]; }
  };
  struct Vectors {
    Floats x, y, z;
    void set(int lane, const Vec3& a) { x[lane] = a.x, y[lane] = a.y, z[lane] = a.z; }
    Vec3 operator[](int lane) const { return {x[lane], y[lane], z[lane]}; }
  };
  struct Spectra {
    Floats r, g, b;
    void set(int lane, const Spectrum& a) { r[lane] = a.r, g[lane] = a.g, b[lane] = a.b; }
    Spectrum operator[](int lane) const { return {r[lane], g[lane], b[lane]}; }
  };

  int size() const { return size_; }
  bool full() const { return size_ == kCapacity; }
  void clear() { size_ = n_textured_ = 0; }
  /// Adds the vertex where the ray of path `index` of the batch hit `surface`; `address`: that of its random numbers.
  void add(uint32_t index, const Spectrum& path_throughput, float eta, const Ray& ray, const RayHit& hit,
           const LambertianMesh& surface, const PathRandom& random, uint32_t address);

  /// Computes what TriangleMesh::fill() does, reflectances, and the side from which the path came.
  void find_surfaces();
  /// Draws the random numbers of all vertices.
  void draw_numbers();
  /// Samples a light for each vertex, for connect().
  void sample_lights(const Emitter* const* lights);
  /// Contributions of the light samples of sample_lights(), MIS-weighted against direction sampling, and their shadow
  /// rays. `pmf`: probability with which a light was chosen.
  void connect(float pmf);
  /// Cosine-weighted directions, and the throughput along them.
  void scatter();
  /// Russian roulette; `survival`: each path's survival probability.
  void survive(Sampling sampling);

  uint32_t index[kCapacity] = {};
  // Random numbers of the vertex.
  Floats u_choice, u_light_x, u_light_y, u_primitive, u_x, u_y, u_roulette;
  Vectors p;
  // Set by connect(): black if no ray need be traced.
  Spectra contribution;
  Vectors shadow_o, shadow_d;
  Floats shadow_t;
  // Set by scatter() and survive().
  Spectra throughput;
  Floats pdf, survival;  // pdf 0: the path ends
  Vectors o, d;

 private:
  template <typename Body>
  void for_each_lane(const Body& body);
  template <typename One, typename Two>
  void set_numbers(int lane, const One& one, const Two& two);
  void set_light(int lane, const EmitterSample& light);
  void set_parallelogram(int lane, const ParallelogramLight& light);
  void sample_parallelograms();
  void set_sphere(int lane, const SphereLight& light);
  void sample_spheres();

  int size_ = 0;
  bool drawn_ = false;             // the random numbers are already set, as points of sequences
  uint64_t keys_[kCapacity] = {};  // otherwise: keys of the vertices' random numbers
  Vectors light_wi_, light_p_, light_n_;
  Floats light_distance_, light_offset_, light_pdf_;  // pdf 0: no sample
  Spectra light_radiance_;
  int32_t light_is_delta_[kCapacity] = {};
  Vectors light_origin_, light_dp_du_, light_dp_dv_;  // of parallelograms
  Floats light_inverse_area_, light_slack_;
  Floats light_radius_, light_sign_;  // of spheres, whose centre is light_origin_
  Floats cone_x_, cone_y_, one_minus_cos_, one_minus_cos_max_, sphere_distance_;
  Vectors sphere_wi_, sphere_outward_;
  // Whether it is such a light; whether there is no sample yet.
  int32_t is_sphere_[kCapacity] = {}, is_open_[kCapacity] = {};
  struct Corner {
    Vectors p, n;
  };
  Corner corners_[3];
  Floats b1_, b2_, eta_;
  int32_t both_sides_[kCapacity] = {};
  Vectors wo_;  // in world space
  Spectra reflectance_;
  struct TexturedHit {
    int lane;
    const Texture* reflectance;
    SurfaceHit hit;  // what textures may read is complete after find_surfaces()
  };
  int n_textured_ = 0;
  TexturedHit textured_[kCapacity];
  Vectors ng_, s_, t_, n_;
  Floats offset_, side_;  // side: 1 or -1; 0: black from that side
};

}  // namespace covary
