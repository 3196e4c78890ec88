// SPDX-License-Identifier: Apache-2.0
#include "sampling/lambertian_block.h"

#include <cmath>

#include "core/frame.h"
#include "core/warp.h"
#include "sampling/environment_queue.h"
#include "sampling/mis.h"
#include "sampling/roulette.h"

namespace covary {

/// Calls body(lane) for all vertices, rounded up to whole vectors; the excess results are unused.
template <typename Body>
void LambertianBlock::for_each_lane(const Body& body) {
  constexpr int kLanes = 16;
  for (int first = 0; first < size_; first += kLanes) {
#pragma GCC ivdep
    for (int lane = 0; lane < kLanes; ++lane) body(first + lane);
  }
}

void LambertianMeshes::ask(const Scene& scene, const Ray& ray, const RayHit& found, Known& known) {
  known.asked = true;
  SurfaceHit hit;
  scene.resolve(ray, found, hit);
  const Lambertian* model = lambertian_of(*hit.bsdf);
  if (model && !hit.emitter) known.surface = {dynamic_cast<const TriangleMesh*>(hit.shape), *model};
}

void LambertianBlock::add(uint32_t i, const Spectrum& path_throughput, float eta, const Ray& ray, const RayHit& hit,
                          const LambertianMesh& surface, const PathRandom& random, uint32_t address) {
  const int l = size_++;
  const TriangleMesh& mesh = *surface.mesh;
  index[l] = i;
  for (int k = 0; k < 3; ++k) {
    const TriangleMesh::Vertex& vertex = mesh.vertices()[mesh.triangles()[hit.primitive][k]];
    corners_[k].p.set(l, vertex.p);
    corners_[k].n.set(l, vertex.n);
  }
  b1_[l] = hit.barycentric.x, b2_[l] = hit.barycentric.y;
  both_sides_[l] = surface.model.both_sides;
  wo_.set(l, -ray.d);
  reflectance_.set(l, surface.model.reflectance);
  if (const Texture* texture = surface.model.texture) {
    TexturedHit& textured = textured_[n_textured_++];
    textured.lane = l, textured.reflectance = texture;
    textured.hit.shape = &mesh;
    textured.hit.primitive = hit.primitive, textured.hit.barycentric = hit.barycentric;
    textured.hit.uv = mesh.uv_at(hit.primitive, hit.barycentric);
    texture->prefetch(textured.hit.uv);
  }
  throughput.set(l, path_throughput);
  eta_[l] = eta;
  keys_[l] = random.vertex_key(address);
  drawn_ = random.in_sequence();
  if (drawn_)
    set_numbers(
        l, [&](Event event) { return random.get_1d(address, event); },
        [&](Event event) { return random.get_2d(address, event); });
}

/// `one`, `two`: return one number, or two, of an event at the vertex.
template <typename One, typename Two>
void LambertianBlock::set_numbers(int l, const One& one, const Two& two) {
  const Vec2 light = two(Event::kLightPosition), direction = two(Event::kDirection);
  u_choice[l] = one(Event::kLightChoice);
  u_light_x[l] = light.x, u_light_y[l] = light.y;
  u_primitive[l] = one(Event::kLightPrimitive);
  u_x[l] = direction.x, u_y[l] = direction.y;
  u_roulette[l] = one(Event::kRoulette);
}

void LambertianBlock::draw_numbers() {
  if (drawn_) return;
  for_each_lane([&](int l) {
    const uint64_t key = keys_[l];
    set_numbers(
        l, [key](Event event) { return PathRandom::first_number(key, event); },
        [key](Event event) { return PathRandom::two_numbers(key, event); });
  });
}

void LambertianBlock::find_surfaces() {
  for_each_lane([&](int l) {
    const float b1 = b1_[l], b2 = b2_[l], b0 = 1 - b1 - b2;
    const Vec3 p0 = corners_[0].p[l], p1 = corners_[1].p[l], p2 = corners_[2].p[l];
    const Vec3 e1 = p1 - p0, e2 = p2 - p0, normal = cross(e1, e2);
    const float inverse = 1 / length(normal), margin = edge_margin(p0, e1, e2, inverse);
    const Vec3 d1 = e1 * lerp(margin, b1, 1.0f / 3), d2 = e2 * lerp(margin, b2, 1.0f / 3);
    const Vec3 at = p0 + (d1 + d2), ng = normal * inverse;
    const Vec3 interpolated = corners_[0].n[l] * b0 + corners_[1].n[l] * b1 + corners_[2].n[l] * b2;
    const float l2 = length_squared(interpolated);
    const float scale = 1 / std::sqrt(l2);
    const bool smooth = l2 > 0;  // zero vectors if the mesh has no normals
    const Vec3 n{smooth ? interpolated.x * scale : ng.x, smooth ? interpolated.y * scale : ng.y,
                 smooth ? interpolated.z * scale : ng.z};
    const Frame frame(n);
    p.set(l, at), ng_.set(l, ng);
    s_.set(l, frame.s), t_.set(l, frame.t), n_.set(l, frame.n);
    offset_[l] = surface_offset(at, ng, plane_slack(abs(d1) + abs(d2), e1, e2, inverse));
    const float cosine = dot(wo_[l], frame.n);
    side_[l] = cosine > 0 ? 1 : (both_sides_[l] && -cosine > 0 ? -1 : 0);
  });
  for (int i = 0; i < n_textured_; ++i) {
    auto& [l, reflectance, hit] = textured_[i];
    hit.p = p[l], hit.ng = ng_[l], hit.frame = Frame(s_[l], t_[l], n_[l]);
    reflectance_.set(l, reflectance->eval(hit));
  }
}

void LambertianBlock::sample_lights(const Emitter* const* lights) {
  bool parallelograms = false, spheres = false;
  const Emitter* environment = nullptr;
  for (int l = 0; l < size_; ++l) {
    is_open_[l] = true, is_sphere_[l] = false;
    if (const ParallelogramLight* parallelogram = lights[l]->parallelogram())
      set_parallelogram(l, *parallelogram), is_open_[l] = false, parallelograms = true;
    else if (const SphereLight* sphere = lights[l]->sphere())
      set_sphere(l, *sphere), spheres = true;
    else if (lights[l]->is_environment())
      environment = lights[l];
  }
  if (parallelograms) sample_parallelograms();
  if (spheres) sample_spheres();
  for (int l = 0; l < size_; ++l)
    if (is_open_[l] && lights[l] != environment)
      set_light(l, lights[l]->sample_towards(p[l], {u_light_x[l], u_light_y[l]}, u_primitive[l]));
  if (!environment) return;
  EnvironmentQueue queue(*environment);
  const auto set = [this](uint32_t l, const EmitterSample& sample) { set_light(static_cast<int>(l), sample); };
  for (int l = 0; l < size_; ++l)
    if (lights[l] == environment) queue.add(static_cast<uint32_t>(l), {u_light_x[l], u_light_y[l]}, set);
  queue.finish(set);
}

void LambertianBlock::set_parallelogram(int l, const ParallelogramLight& light) {
  const Parallelogram& surface = light.surface;
  light_origin_.set(l, surface.origin), light_n_.set(l, surface.n);
  light_dp_du_.set(l, surface.dp_du), light_dp_dv_.set(l, surface.dp_dv);
  light_inverse_area_[l] = surface.inverse_area, light_slack_[l] = surface.slack;
  light_radiance_.set(l, light.radiance);
  light_is_delta_[l] = false;
}

/// As TriangleMesh::sample_uv(), Shape::towards() and AreaLight::sample_towards(); also run for lanes with other
/// lights, whose results are unused.
void LambertianBlock::sample_parallelograms() {
  for_each_lane([&](int l) {
    const Vec3 at = light_origin_[l] + (light_dp_du_[l] * u_light_x[l] + light_dp_dv_[l] * u_light_y[l]);
    const Vec3 to = at - p[l];
    const float d2 = length_squared(to), inverse = 1 / std::sqrt(d2);
    const Vec3 wi = to * inverse;
    const float facing = dot(wi, light_n_[l]), cosine = std::abs(facing);
    const bool seen = d2 > 0 && facing < 0 && cosine > Shape::kGrazing;
    const float density = light_inverse_area_[l] * d2 / cosine;
    light_wi_.set(l, wi), light_p_.set(l, at);
    light_distance_[l] = d2 * inverse, light_offset_[l] = surface_offset(at, light_n_[l], light_slack_[l]);
    light_pdf_[l] = seen ? density : 0;
  });
}

void LambertianBlock::set_sphere(int l, const SphereLight& light) {
  is_sphere_[l] = true;
  light_origin_.set(l, light.surface.center);
  light_radius_[l] = light.surface.radius, light_sign_[l] = light.surface.sign;
  light_radiance_.set(l, light.radiance);
  light_is_delta_[l] = false;
}

/// As Sphere::sample_towards() and AreaLight::sample_towards(), from outside; other lanes stay as they are. In several
/// loops, because compilers would round some sums otherwise than there.
void LambertianBlock::sample_spheres() {
  for_each_lane([&](int l) {
    const Ball ball{light_origin_[l], light_radius_[l], light_sign_[l]};
    const float sin2_max = ball.squared_sine(p[l]);
    is_sphere_[l] = is_sphere_[l] && sin2_max < 1;
    const Vec2 place = warp::square_to_disk({u_light_x[l], u_light_y[l]});
    cone_x_[l] = place.x, cone_y_[l] = place.y;
    const float most = Ball::one_minus_cos(sin2_max);
    one_minus_cos_max_[l] = most;
    one_minus_cos_[l] = (place.x * place.x + place.y * place.y) * most;
  });
  for_each_lane([&](int l) {
    const Ball ball{light_origin_[l], light_radius_[l], light_sign_[l]};
    const float most = one_minus_cos_max_[l];
    sphere_wi_.set(l, ball.direction(p[l], warp::disk_to_cone({cone_x_[l], cone_y_[l]}, one_minus_cos_[l], most)));
  });
  for_each_lane([&](int l) {
    const Ball ball{light_origin_[l], light_radius_[l], light_sign_[l]};
    const Vec3 from = p[l], wi = sphere_wi_[l];
    sphere_distance_[l] = ball.distance(from, wi);
    sphere_outward_.set(l, ball.outward(from, wi, sphere_distance_[l]));
  });
  for_each_lane([&](int l) {
    const bool taken = is_sphere_[l];
    const Ball ball{light_origin_[l], light_radius_[l], light_sign_[l]};
    const Vec3 wi = sphere_wi_[l], outward = sphere_outward_[l], at = ball.center + outward * ball.radius;
    const Vec3 n = outward * ball.sign;
    const float density = warp::cone_pdf_solid_angle(one_minus_cos_max_[l]);
    const float seen = dot(n, wi) < 0 ? density : 0;
    const auto take = [&](Vectors& to, const Vec3& from) {
      to.x[l] = taken ? from.x : to.x[l], to.y[l] = taken ? from.y : to.y[l], to.z[l] = taken ? from.z : to.z[l];
    };
    take(light_wi_, wi), take(light_p_, at), take(light_n_, n);
    light_distance_[l] = taken ? sphere_distance_[l] : light_distance_[l];
    light_offset_[l] = taken ? surface_offset(at, n, ball.slack()) : light_offset_[l];
    light_pdf_[l] = taken ? seen : light_pdf_[l];
    is_open_[l] = taken ? 0 : is_open_[l];
  });
}

void LambertianBlock::set_light(int l, const EmitterSample& light) {
  light_wi_.set(l, light.wi), light_p_.set(l, light.p), light_n_.set(l, light.n);
  light_distance_[l] = light.distance, light_offset_[l] = light.offset, light_pdf_[l] = light.pdf_solid_angle;
  light_radiance_.set(l, light.radiance);
  light_is_delta_[l] = light.is_delta;
}

void LambertianBlock::connect(float pmf) {
  for_each_lane([&](int l) {
    const Vec3 wi = light_wi_[l];
    const float cosine = dot(wi, n_[l]) * side_[l];
    const float pdf_direction = cosine > 0 ? cosine * kInvPi : 0;
    const Spectrum f = reflectance_[l] * pdf_direction;
    const float pdf_light = pmf * light_pdf_[l];
    const float weight = light_is_delta_[l] ? 1 / pdf_light : mis::power_over_pdf(pdf_light, pdf_direction);
    const Spectrum value = throughput[l] * f * light_radiance_[l] * weight;
    const bool counts = light_pdf_[l] > 0 && !is_black(f);
    contribution.r[l] = counts ? value.r : 0, contribution.g[l] = counts ? value.g : 0;
    contribution.b[l] = counts ? value.b : 0;

    const Vec3 origin = offset_origin(p[l], ng_[l], offset_[l], wi);
    const bool infinite = light_distance_[l] == kInfinity;
    const Vec3 target = offset_target(light_p_[l], light_n_[l], light_offset_[l], wi, light_distance_[l]);
    const Ray ray = ray_between(origin, target);
    shadow_o.set(l, origin);
    shadow_d.x[l] = infinite ? wi.x : ray.d.x, shadow_d.y[l] = infinite ? wi.y : ray.d.y;
    shadow_d.z[l] = infinite ? wi.z : ray.d.z;
    shadow_t[l] = infinite ? kInfinity : ray.t_max;
  });
}

void LambertianBlock::scatter() {
  for_each_lane([&](int l) {
    const Vec3 wi = warp::square_to_cosine_hemisphere({u_x[l], u_y[l]});
    const float density = warp::cosine_hemisphere_pdf_solid_angle(wi.z);
    const Spectrum reflectance = reflectance_[l];
    pdf[l] = side_[l] != 0 && !is_black(reflectance) ? density : 0;
    throughput.set(l, throughput[l] * reflectance);
    const Vec3 out = Frame(s_[l], t_[l], n_[l]).to_world({wi.x, wi.y, wi.z * side_[l]});
    d.set(l, out);
    o.set(l, offset_origin(p[l], ng_[l], offset_[l], out));
  });
}

void LambertianBlock::survive(Sampling sampling) {
  for_each_lane([&](int l) {
    const Spectrum before = throughput[l];
    const float probability = roulette::survival_probability(before, eta_[l], sampling);
    survival[l] = pdf[l] > 0 ? probability : 0;
    const bool survives = u_roulette[l] < probability;
    pdf[l] = survives ? pdf[l] : 0;
    const Spectrum after = before * roulette::survivor_weight(probability);
    throughput.r[l] = survives ? after.r : before.r, throughput.g[l] = survives ? after.g : before.g;
    throughput.b[l] = survives ? after.b : before.b;
  });
}

}  // namespace covary
