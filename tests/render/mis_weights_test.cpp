// SPDX-License-Identifier: Apache-2.0
// The weights of all techniques that find a path sum to one, in the path tracer itself: at vertices of random paths,
// the direction sample is replaced by the direction of the light sample, so that both techniques find the same path,
// and the weights that the tracer computes for each are added. With Russian roulette from the first edge, delta lights
// and delta lobes. Exact up to rounding; no statistics.
#include <optional>

#include "integrators/path_tracer.h"
#include "render_fixture.h"

namespace covary {
namespace {

enum class Bug {
  kNone,
  kDirectionsNotWeighted,
  kLightPmfForgotten,  ///< in one of the techniques
  kRouletteInOneWeight,
  kDeltaLightWeighted,  ///< as if direction samples could find it
};

/// Records of the traced paths.
struct Log {
  std::vector<double> sums;           ///< of the weights of both techniques for one path
  std::vector<double> delta_weights;  ///< of light samples of delta lights
  int n_sums_after_refraction = 0;    ///< sums after a delta lobe

  // State of the current path.
  std::optional<double> light_weight;  // at the current vertex
  std::optional<double> to_be_added;   // of the vertex whose direction sample follows the light sample
  float survival = 1;
  bool met_delta = false;
};

struct LoggingParts : PathParts {
  const Scene* scene = nullptr;
  Log* log = nullptr;
  Bug bug = Bug::kNone;

  void prepare(const Scene& s) { scene = &s; }

  float light_weight_over_pdf(bool is_delta, float pdf_light, float pdf) const {
    const float weight = PathParts::light_weight_over_pdf(is_delta && bug != Bug::kDeltaLightWeighted, pdf_light, pdf);
    if (is_delta)
      log->delta_weights.push_back(weight * pdf_light);
    else
      log->light_weight = static_cast<double>(weight) * pdf_light;
    return weight;
  }

  BsdfSample sample_direction(const BsdfClosure& bsdf, const SurfaceHit& hit, const Vec3& wo, const PathRandom& random,
                              uint32_t vertex) const {
    log->to_be_added.reset();
    const std::optional<double> light_weight = std::exchange(log->light_weight, std::nullopt);
    if (light_weight && random.get_1d(vertex, Event::kTechnique) < 0.5f) {
      const EmitterSample light = UniformLights(*scene)
                                      .select(random.get_1d(vertex, Event::kLightChoice))
                                      .sample_towards(hit.p, random.get_2d(vertex, Event::kLightPosition),
                                                      random.get_1d(vertex, Event::kLightPrimitive));
      if (!scene->occluded(shadow_ray(hit, light))) {
        const Vec3 wi = hit.frame.to_local(light.wi);
        const BsdfValue f = eval_direction(bsdf, hit, wo, wi);
        log->to_be_added = light_weight;
        return {.wi = wi, .weight = f.value * (1 / f.pdf_solid_angle), .pdf = f.pdf_solid_angle, .flags = kSmooth};
      }
    }
    const BsdfSample next = PathParts::sample_direction(bsdf, hit, wo, random, vertex);
    log->met_delta |= next.valid() && next.is_delta();
    return next;
  }

  float direction_weight(float pdf, float pdf_light) const {
    if (bug == Bug::kLightPmfForgotten) pdf_light *= static_cast<float>(scene->emitters().size());
    if (bug == Bug::kRouletteInOneWeight) pdf *= log->survival;
    const float weight = bug == Bug::kDirectionsNotWeighted ? 1 : PathParts::direction_weight(pdf, pdf_light);
    if (log->to_be_added) {
      log->sums.push_back(*log->to_be_added + weight);
      log->n_sums_after_refraction += log->met_delta;
    }
    log->to_be_added.reset();
    return weight;
  }

  float survival_probability(const Spectrum& throughput, float eta, Sampling sampling) const {
    return log->survival = PathParts::survival_probability(throughput, eta, sampling);
  }
};

/// A room with several BSDFs and every kind of light.
std::string lights_and_materials() {
  const auto rectangle = [](const char* transform, const char* content) {
    return std::string("<shape type='rectangle'><transform name='to_world'>") + transform + "</transform>" + content +
           "</shape>";
  };
  const auto sphere = [](const char* x, const char* content) {
    return std::string("<shape type='sphere'><point name='center' x='") + x + "' y='-1' z='5'/>" + content + "</shape>";
  };
  return scene_text(
      rectangle("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-2' z='5'/>",
                "<bsdf type='diffuse'><rgb name='reflectance' value='0.6'/></bsdf>") +
          rectangle("<scale value='6'/><rotate x='1' angle='180'/><translate z='9'/>",
                    "<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf>") +
          rectangle("<rotate x='1' angle='90'/><translate y='3' z='4'/>",
                    "<emitter type='area'><rgb name='radiance' value='5'/></emitter>") +
          sphere("-3", "<bsdf type='plastic'/>") + sphere("0", "<bsdf type='dielectric'/>") +
          sphere("3", "<bsdf type='roughplastic'><float name='alpha' value='0.2'/></bsdf>") +
          "<shape type='sphere'><point name='center' x='-4' y='2' z='4'/><float name='radius' value='0.5'/>"
          "<emitter type='area'><rgb name='radiance' value='4'/></emitter></shape>"
          "<emitter type='constant'><rgb name='radiance' value='0.5'/></emitter>"
          "<emitter type='point'><point name='position' x='1' y='2' z='3'/></emitter>"
          "<emitter type='directional'><vector name='direction' x='1' y='-2' z='1'/></emitter>",
      24, 24, -1, "", "<integer name='rr_depth' value='1'/>");
}

/// Traces 8 paths per pixel, one at a time.
Log trace(Bug bug) {
  Log log;
  const TestScene scene = load_text(lights_and_materials(), 0, [&](const PathLengthSettings& lengths) {
    LoggingParts parts;
    parts.log = &log, parts.bug = bug;
    return std::make_shared<PathTracer<LoggingParts>>("path", lengths, parts);
  });
  PassSettings settings;
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 24; ++x)
      for (uint64_t sample = 0; sample < 8; ++sample) {
        log.met_delta = false, log.survival = 1;
        log.light_weight.reset(), log.to_be_added.reset();
        replay_sample(scene.scene(), scene.integrator(), settings, x, y, sample);
      }
  return log;
}

double worst(const std::vector<double>& sums) {
  double result = 0;
  for (const double sum : sums) result = std::max(result, std::abs(sum - 1));
  return result;
}

TEST(MisWeights, SumToOneAlongPaths) {
  const Log log = trace(Bug::kNone);
  EXPECT_GT(log.sums.size(), 500u);
  EXPECT_GT(log.n_sums_after_refraction, 50);
  EXPECT_GT(log.delta_weights.size(), 500u);
  // The densities of the point that a ray finds and of the sampled point differ by rounding.
  EXPECT_LT(worst(log.sums), 1e-2);
  EXPECT_LT(worst(log.delta_weights), 1e-6);
}

TEST(MisWeights, TheSumSeesPlantedBugs) {
  for (const Bug bug : {Bug::kDirectionsNotWeighted, Bug::kLightPmfForgotten, Bug::kRouletteInOneWeight})
    EXPECT_GT(worst(trace(bug).sums), 0.1) << static_cast<int>(bug);
  EXPECT_GT(worst(trace(Bug::kDeltaLightWeighted).delta_weights), 0.1);
}

}  // namespace
}  // namespace covary
