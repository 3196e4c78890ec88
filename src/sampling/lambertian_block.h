// SPDX-License-Identifier: Apache-2.0
// Path vertices on triangle meshes whose surface is Lambertian, which most vertices of most scenes are, shaded side by
// side in the lanes of vector registers [Afra2016]. Same values as vertex by vertex, in the same order of operations.
#pragma once

#include <cstdint>
#include <vector>

#include "core/random.h"
#include "scene/lambertian.h"
#include "scene/mesh.h"
#include "scene/scene.h"

namespace covary {

/// A mesh that does not emit, in the world's own space, with its surface.
struct LambertianMesh {
  const TriangleMesh* mesh = nullptr;
  Lambertian model;
};

/// Which hits lie on such meshes. An object is for one thread and one scene, in which nothing moves meanwhile.
class LambertianMeshes {
 public:
  /// Null where the hit of `ray`, one that was found, lies on another surface.
  const LambertianMesh* find(const Scene& scene, const Ray& ray, const RayHit& hit) {
    if (hit.instance != RayHit::kNone) return nullptr;
    if (hit.geometry >= known_.size()) known_.resize(hit.geometry + 1);
    Known& known = known_[hit.geometry];
    if (!known.asked) ask(scene, ray, hit, known);
    return known.surface.mesh ? &known.surface : nullptr;
  }
  /// Of a hit for which find() was not null.
  const LambertianMesh& at(const RayHit& hit) const { return known_[hit.geometry].surface; }

 private:
  struct Known {
    bool asked = false;
    LambertianMesh surface;
  };
  static void ask(const Scene& scene, const Ray& ray, const RayHit& hit, Known& known);
  std::vector<Known> known_;  // by geometry
};

/// Some vertices of a batch as arrays, one for each number of a vertex. The functions work on the first `size` of them;
/// each is a loop without branches that compilers turn into vector instructions.
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
  /// Adds the vertex where the ray of path `index` of the batch met `surface`; `address`: of its random numbers.
  void add(uint32_t index, const Spectrum& path_throughput, float eta, const Ray& ray, const RayHit& hit,
           const LambertianMesh& surface, const PathRandom& random, uint32_t address);

  /// What TriangleMesh::fill() and Scene::resolve() find, reflectances, and on which side the path came.
  void find_surfaces(const Scene& scene);
  /// The random numbers of all vertices.
  void draw_numbers();
  /// Samples a light of each vertex for connect().
  void sample_lights(const Emitter* const* lights);
  /// Values of the surface for the light samples of sample_lights(), weighted against direction sampling;
  /// their shadow rays. `pmf`: probability with which a light was chosen.
  void connect(float pmf);
  /// Directions, drawn by the cosine, and what a path carries there.
  void scatter();
  /// Russian roulette; `survival`: probability of what each path carries.
  void survive(Sampling sampling);

  uint32_t index[kCapacity] = {};
  // Random numbers of the vertex.
  Floats u_choice, u_light_x, u_light_y, u_primitive, u_x, u_y, u_roulette;
  Vectors p;
  // By connect(): black where nothing is to be traced.
  Spectra contribution;
  Vectors shadow_o, shadow_d;
  Floats shadow_t;
  // By scatter() and survive().
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
  bool drawn_ = false;             // the random numbers are there, as points of sequences
  uint64_t keys_[kCapacity] = {};  // else: of the vertices' random numbers
  Vectors light_wi_;
  Floats light_distance_, light_pdf_;  // pdf 0: no sample
  Spectra light_radiance_;
  int32_t light_is_delta_[kCapacity] = {};
  Vectors light_origin_, light_dp_du_, light_dp_dv_, light_n_;  // of parallelograms
  Floats light_inverse_area_;
  Floats light_radius_, light_sign_;  // of spheres, whose centre is light_origin_
  Floats cone_x_, cone_y_, one_minus_cos_, one_minus_cos_max_, sphere_distance_;
  Vectors sphere_wi_;
  // Whether it is such a light; whether there is no sample yet.
  int32_t is_sphere_[kCapacity] = {}, is_open_[kCapacity] = {};
  struct Corner {
    Vectors p, n;
  };
  Corner corners_[3];
  Floats b1_, b2_, eta_;
  int32_t both_sides_[kCapacity] = {};
  Vectors wo_;  // in the world
  Spectra reflectance_;
  struct TexturedHit {
    int lane;
    const Texture* reflectance;
    SurfaceHit hit;  // what the texture may read is complete after find_surfaces()
  };
  int n_textured_ = 0;
  TexturedHit textured_[kCapacity];
  Vectors ng_, s_, t_, n_;
  Floats offset_, side_;  // side: 1 or -1; 0: black from there
};

}  // namespace covary
