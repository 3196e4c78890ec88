// SPDX-License-Identifier: Apache-2.0
#include "io/object_factory.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <span>
#include <vector>

#include "bsdfs/registry.h"
#include "emitters/registry.h"
#include "formats/spectrum_objects.h"
#include "io/sensor.h"
#include "media/registry.h"
#include "textures/registry.h"

namespace covary {
namespace {

/// Parts of a sensor have no registries of their own; they only hold settings.
std::span<const Plugin<SceneObject>> setting_plugins(const std::string& kind) {
  static constexpr auto kFilter = [](Parameters& p) -> std::shared_ptr<SceneObject> { return make_filter(p); };
  static constexpr auto kFilm = [](Parameters& p) -> std::shared_ptr<SceneObject> { return make_film(p); };
  static constexpr auto kSampler = [](Parameters& p) -> std::shared_ptr<SceneObject> { return make_sampler(p); };
  static constexpr auto kSensor = [](Parameters& p) -> std::shared_ptr<SceneObject> { return make_sensor(p); };
  static const Plugin<SceneObject> kFilters[] = {{"box", kFilter},     {"catmullrom", kFilter}, {"gaussian", kFilter},
                                                 {"lanczos", kFilter}, {"mitchell", kFilter},   {"tent", kFilter}};
  static const Plugin<SceneObject> kFilms[] = {{"hdrfilm", kFilm}};
  static const Plugin<SceneObject> kSamplers[] = {
      {"independent", kSampler}, {"halton", kSampler},     {"hammersley", kSampler}, {"ldsampler", kSampler},
      {"multijitter", kSampler}, {"orthogonal", kSampler}, {"sobol", kSampler},      {"stratified", kSampler}};
  static const Plugin<SceneObject> kSensors[] = {
      {"orthographic", kSensor}, {"perspective", kSensor}, {"spherical", kSensor}, {"thinlens", kSensor}};
  if (kind == "rfilter") return kFilters;
  if (kind == "film") return kFilms;
  if (kind == "sampler") return kSamplers;
  if (kind == "sensor") return kSensors;
  return {};
}

/// The type that takes the place of an unknown one if unknown ones are ignored; "": none, the object is left out.
const char* instead_of_unknown(std::string_view kind) {
  for (const auto& [of, type] :
       {std::pair("bsdf", "diffuse"), std::pair("film", "hdrfilm"), std::pair("phase", "isotropic"),
        std::pair("rfilter", "gaussian"), std::pair("sampler", "independent"), std::pair("sensor", "perspective")})
    if (kind == of) return type;
  return "";
}

/// Sensors that measure something else than a picture.
bool is_no_camera(const ObjectDescription& description) {
  return description.kind == "sensor" && (description.type == "distant" || description.type == "irradiancemeter" ||
                                          description.type == "radiancemeter" || description.type == "batch");
}

/// What to use instead of Mitsuba plugins that are not supported.
std::string advice(const ObjectDescription& description) {
  struct Advice {
    const char *kind, *type, *text;
  };
  static constexpr const char* kNoPicture = "it makes no picture; use 'perspective'";
  static constexpr const char* kSplats = "its integrator is not supported either";
  static constexpr Advice kAll[] = {
      {"sensor", "batch",
       "denoising would look across the edges of its pictures; render each of its sensors separately"},
      {"sensor", "distant", kNoPicture},
      {"sensor", "irradiancemeter", kNoPicture},
      {"sensor", "radiancemeter", kNoPicture},
      {"film", "specfilm", "rendering is in RGB; use 'hdrfilm'"},
      {"bsdf", "measured_polarized", "light is not polarised here; use 'measured' with the material's _rgb.bsdf"},
      {"emitter", "timed_sunsky", "nothing moves; use 'sunsky' with one of its times"},
      {"emitter", "directionalarea", "use 'directional'"},
      {"shape", "merge", "put the shapes that it holds in its place"},
      {"shape", "ellipsoids", kSplats},
      {"shape", "ellipsoidsmesh", kSplats},
  };
  for (const Advice& a : kAll)
    if (description.kind == a.kind && description.type == a.type) return a.text;
  return "";
}

}  // namespace

bool MadeObjects::find(const ObjectDescription* description, Object& object) const {
  const std::lock_guard lock(mutex_);
  const auto found = objects_.find(description);
  if (found == objects_.end()) return false;
  object = found->second;
  return true;
}

void MadeObjects::add(const ObjectDescription* description, Object object) {
  const std::lock_guard lock(mutex_);
  objects_.emplace(description, std::move(object));
}

void report_unknown_type(const ObjectDescription& description, std::vector<std::string> supported,
                         Diagnostics& diagnostics) {
  std::sort(supported.begin(), supported.end());
  std::string list;
  for (const std::string& name : supported) list += (list.empty() ? "'" : ", '") + name + "'";
  const std::string name = fmt::format("{} '{}'", description.kind, description.type);
  if (const std::string other = advice(description);
      !other.empty() && (!diagnostics.ignores_unknown() || is_no_camera(description))) {
    diagnostics.error(description.where, fmt::format("{} is not supported: {}. Supported: {}", name, other, list));
    return;
  }
  const std::string hint = did_you_mean(description.type, supported);
  const char* const type = instead_of_unknown(description.kind);
  diagnostics.unknown(description.where, name, fmt::format("{} Supported: {}", hint.empty() ? "." : hint, list),
                      *type ? fmt::format("becomes '{}'", type) : "is left out");
}

std::shared_ptr<const SceneObject> SceneFactory::make(const ObjectPtr& description) {
  std::shared_ptr<const SceneObject> object;
  if (made_.find(description.get(), object)) return object;
  object = create(*description);
  made_.add(description.get(), object);
  return object;
}

std::shared_ptr<const SceneObject> SceneFactory::create(const ObjectDescription& description) {
  const auto through = [&](auto plugins, auto... extra) -> std::shared_ptr<const SceneObject> {
    const auto* plugin = find_plugin(plugins, description, diagnostics_, extra...);
    if (!plugin) return create_instead(description);
    const bool replaceable = description.kind == "bsdf" && diagnostics_.ignores_unknown();
    Diagnostics own(true);
    Parameters parameters(description, *this, replaceable ? own : diagnostics_);
    // How often a light is sampled: its picture does not depend on it.
    if (description.kind == "emitter") parameters.get_float("sampling_weight", 1, 0);
    const auto made = make_checked(parameters, plugin->make);
    if (replaceable && own.has_errors() && !own.warnings().empty()) {  // the parameters are those of a fork
      diagnostics_.unknown(description.where, fmt::format("form of bsdf '{}'", description.type), "",
                           "becomes 'diffuse'");
      return create_instead(description);
    }
    if (replaceable) diagnostics_.append(own);
    if constexpr (requires { made->set_group(description.id); })
      if (made) made->set_group(description.id);
    return made;
  };
  if (description.kind == "texture") return through(texture_plugins(), spectrum_types());
  if (description.kind == "bsdf") return through(bsdf_plugins());
  if (description.kind == "emitter") return through(emitter_plugins());
  if (description.kind == "medium") return through(medium_plugins());
  if (description.kind == "phase") return through(phase_plugins());
  if (description.kind == "volume") return through(volume_plugins());
  const auto settings = setting_plugins(description.kind);
  if (!settings.empty()) return through(settings);
  diagnostics_.error(description.where, fmt::format("<{}> is not supported here", description.kind));
  return nullptr;
}

std::shared_ptr<const SceneObject> SceneFactory::create_instead(const ObjectDescription& unknown) {
  const char* const type = instead_of_unknown(unknown.kind);
  if (!diagnostics_.ignores_unknown() || !*type || is_no_camera(unknown)) return nullptr;
  ObjectDescription known = unknown;
  known.type = type;
  // Parameters of an unknown material mean something else: it is the default of the known one.
  if (known.kind == "bsdf" || known.kind == "phase") known.properties.clear();
  return create(known);
}

std::optional<std::string> SceneFactory::resolve_file(const std::string& name, const SourceLocation& where) {
  std::string path = files_.resolve(name, where, diagnostics_);
  if (path.empty()) return std::nullopt;
  return path;
}

namespace {

/// Type and value as text, numbers exactly.
struct ValueText {
  std::string operator()(bool v) const { return v ? "b1" : "b0"; }
  std::string operator()(int64_t v) const { return fmt::format("i{}", v); }
  std::string operator()(double v) const { return fmt::format("f{:a}", v); }
  std::string operator()(const std::string& v) const { return fmt::format("s{}:{}", v.size(), v); }
  std::string operator()(const Vec3& v) const { return fmt::format("v{:a},{:a},{:a}", v.x, v.y, v.z); }
  std::string operator()(const ColourValue& v) const {
    return fmt::format("c{:a},{:a},{:a}", v.rgb.r, v.rgb.g, v.rgb.b);
  }
  std::string operator()(const SampledSpectrum& v) const {
    std::string text = "l";
    for (const auto& [wavelength, value] : v.samples) text += fmt::format("{:a}:{:a},", wavelength, value);
    return text;
  }
  static std::string matrix(const Matrix4& m) {
    std::string text = "t";
    for (const auto& row : m)
      for (double entry : row) text += fmt::format("{:a},", entry);
    return text;
  }
  std::string operator()(const Transform& v) const { return matrix(v.matrix()); }
  std::string operator()(const KeyedTransformPtr& v) const {
    std::string text = "a";
    for (const TransformKey& key : v->keys()) text += fmt::format("{:a}{}", key.time, matrix(key.matrix));
    return text;
  }
  std::string operator()(const ObjectPtr& v) const { return fmt::format("o{}", fmt::ptr(v.get())); }
};

}  // namespace

std::string description_key(const ObjectDescription& object) {
  std::vector<std::string> parameters;
  for (const Property& property : object.properties)
    parameters.push_back(property.name + "=" + std::visit(ValueText{}, property.value) + "\n");
  std::sort(parameters.begin(), parameters.end());
  // File names are relative to the file that contains them.
  std::string key =
      object.kind + "\n" + object.type + "\n" + std::filesystem::path(object.where.file).parent_path().string() + "\n";
  for (const std::string& parameter : parameters) key += parameter;
  return key;
}

}  // namespace covary
