// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <deque>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "combine/combine.h"
#include "combine/pair_input.h"
#include "combine/registry.h"
#include "core/error.h"
#include "denoising/denoise.h"
#include "denoising/mixed_denoising.h"
#include "denoising/render_features.h"
#include "film/splat_layer.h"
#include "gpu/target.h"
#include "python/module/arrays.h"
#include "python/module/bindings.h"
#include "python/module/work.h"
#include "settings/option_names.h"

namespace covary::python {
namespace {

using Counts = nb::ndarray<const uint32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// One of the two images: an array [T, H, W, 3], or a film, whose memory has the order that estimators read.
class Input {
 public:
  Input(nb::handle object, const std::string& name) : name_(name) {
    if (object.is_none() || !nb::try_cast(object, film_)) groups_.emplace(object, name);
    samples_ = film_ ? film_->mean_count() : 0;
  }
  const Film* film() const { return film_; }
  int width() const { return film_ ? film_->width() : groups_->width(); }
  int height() const { return film_ ? film_->height() : groups_->height(); }
  int groups() const { return film_ ? film_->groups() : groups_->groups(); }
  /// Samples per pixel, on average; 0 if not known.
  double samples() const { return samples_; }
  /// Samples of each pixel in all groups together. Raises if the image has its own.
  void take_counts(std::span<const uint32_t> counts) {
    if (film_)
      throw Error(ErrorCode::kInput, name_ +
                                         ": the film already says how many samples its pixels have; 'counts' is "
                                         "not needed");
    counts_.assign(counts.begin(), counts.end());
    samples_ = std::accumulate(counts_.begin(), counts_.end(), 0.0) / static_cast<double>(counts_.size());
  }
  GroupedImage view() {
    GroupedImage image = film_ ? rows_of(*film_, 0, film_->height()) : groups_->view();
    if (!counts_.empty()) image.counts = counts_.data(), image.mean_count = samples_;
    return image;
  }
  /// The origin of a film. Of an array, only the size is known: its place is `place` if that has the same size.
  ImageOrigin origin(const ImagePlace& place) const {
    const CropWindow& w = place.window;
    if (!film_ && w.width == width() && w.height == height()) return {name_, place, "", "", ""};
    return film_ ? origin_of(*film_, name_) : ImageOrigin{name_, {width(), height(), {0, 0, width(), height()}}};
  }
  static ImageOrigin origin_of(const Film& film, const std::string& name) {
    const auto text = [&](const char* key) {
      const auto found = film.attributes.find(key);
      return found == film.attributes.end() ? std::string() : found->second;
    };
    return {name,
            {film.frame_width(), film.frame_height(), film.crop()},
            text(film_key::kSampling),
            text(film_key::kSceneHash),
            text(film_key::kSettings),
            false,
            !text(film_key::kLightPaths).empty(),
            !text(film_key::kLight).empty(),
            true};
  }

 private:
  std::string name_;
  Film* film_ = nullptr;
  std::optional<Groups> groups_;
  std::vector<uint32_t> counts_;
  double samples_ = 0;
};

/// The two images, or the independent one alone, and the request for what to make of them.
struct Pair {
  std::optional<Input> crn;
  Input independent;
  std::deque<Input> layers;
  CombineRequest request;

  Pair(nb::handle crn_object, nb::handle independent_object, const Film* light)
      : independent(independent_object, "independent") {
    if (!crn_object.is_none()) crn.emplace(crn_object, "crn");
    // An array takes the place of a film given with it.
    const Film* film = light ? light : crn && crn->film() ? crn->film() : independent.film();
    const ImagePlace place = film ? Input::origin_of(*film, "").place : ImagePlace{};
    if (crn) request.crn = source_of(*crn, place);
    request.independent = source_of(independent, place);
    if (light)
      request.light = covary::source_of(rows_of(*light, 0, light->height()), Input::origin_of(*light, "light"));
    std::vector<Finding> findings;
    if (crn)
      check_light(request.crn->origin, request.independent.origin, light ? &request.light->origin : nullptr, findings);
  }
  /// An array for each name.
  void take_layers(const nb::dict& arrays) {
    for (const auto& [key, array] : arrays) {
      const auto name = nb::cast<std::string>(key);
      request.layers.push_back(
          {name, source_of(layers.emplace_back(array, "layers: " + name), request.independent.origin.place)});
    }
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;

  /// `samples`: samples per pixel of the CRN image, if that does not know them.
  void take_counts(const Counts& counts, std::optional<int> samples) {
    if (counts.shape(0) != static_cast<size_t>(independent.height()) ||
        counts.shape(1) != static_cast<size_t>(independent.width()))
      throw nb::value_error(fmt::format("counts: found the shape [{}, {}]; expected [{}, {}]", counts.shape(0),
                                        counts.shape(1), independent.height(), independent.width())
                                .c_str());
    independent.take_counts({counts.data(), counts.size()});
    if (!crn || crn->film()) return;
    if (!samples) throw Error(ErrorCode::kUsage, "`counts` needs `samples` N, the samples per pixel of the CRN image");
    crn->take_counts(std::vector(static_cast<size_t>(crn->width()) * crn->height(), static_cast<uint32_t>(*samples)));
  }
  double crn_samples() const { return crn ? crn->samples() : 0; }
  /// Arrays may have any shape, and any counts. Needs no GIL.
  void check_shapes() {
    if (!crn) return;
    std::vector<std::string> problems;
    check_inputs(crn->view(), independent.view(), 1, 1, problems);
    if (!request.estimator.adaptive) throw_if_any("inputs", problems);
  }

 private:
  /// Rows of arrays or films in place; views reorder them when they are first asked for.
  static GroupedSource source_of(Input& input, const ImagePlace& place) {
    GroupedSource source;
    source.origin = input.origin(place);
    source.width = input.width(), source.height = input.height(), source.groups = input.groups();
    source.samples = input.samples();
    source.rows = [&input](int first, int n) { return rows_of(input.view(), first, n); };
    return source;
  }
};

struct CombineArguments {
  std::string estimator;
  OptionValues options;
  std::string denoise, oidn, device;
  bool force = false;
  std::optional<bool> std_error;
  std::optional<int> samples;
};

/// Optional inputs besides the two images; None if not given.
struct ExtraInputs {
  nb::object counts, light, albedo, normal, denoising_albedo, denoising_normal, position;
  nb::dict layers;
  bool clean_features = false;
};

std::vector<std::string> texts_of(const std::vector<Finding>& findings) {
  std::vector<std::string> texts;
  for (const Finding& f : findings) texts.push_back(as_arguments(f.text));
  return texts;
}

/// The arguments, in the order of feature::Index.
constexpr const char* kFeatureArguments[] = {"albedo", "normal", "position", "denoising_albedo", "denoising_normal"};

/// `mode`: "": the usual one of the estimator.
DenoisingChoice denoising_of(const std::string& estimator, const std::string& mode, const std::string& oidn) {
  OptionValues values{{"denoise", mode.empty() ? default_denoising(estimator) : mode}};
  if (!oidn.empty()) values["oidn"] = oidn;
  DenoisingChoice choice = settings_from<DenoisingChoice>(values);
  if (choice.uses_oidn()) check_named_denoiser({choice.oidn});
  return choice;
}

constexpr size_t kAll = std::numeric_limits<size_t>::max();

/// The mean of a group's samples, or of all.
Image picture_of(const GroupedImage& image, size_t group) {
  Image picture(image.width, image.height, 3);
  const auto groups = static_cast<size_t>(image.groups);
  const size_t first = group == kAll ? 0 : group, end = group == kAll ? groups : group + 1;
  for (size_t i = 0; i < picture.data.size(); ++i)
    for (size_t g = first; g < end; ++g)
      picture.data[i] += image.data[3 * (i / 3 * groups + g) + i % 3] / static_cast<float>(end - first);
  return picture;
}

/// The features of --denoise: of all renders, or [T, H, W, 3] of each.
RenderFeatures features_from(const ExtraInputs& beside, const Method& estimator, Input& image) {
  const std::string shape = fmt::format("{}, {}, 3", image.height(), image.width());
  const std::pair<const nb::object&, feature::Index> arrays[] = {{beside.albedo, feature::kAlbedo},
                                                                 {beside.normal, feature::kNormal},
                                                                 {beside.position, feature::kPosition},
                                                                 {beside.denoising_albedo, feature::kDenoisingAlbedo},
                                                                 {beside.denoising_normal, feature::kDenoisingNormal}};
  RenderFeatures features;
  for (const auto& [array, kind] : arrays) {
    if (array.is_none()) continue;
    const std::string name = kFeatureArguments[kind];
    if (!estimator.reads_features)
      throw Error(ErrorCode::kUsage, name +
                                         ": auxiliary features are for denoising, with denoise='auto', 'bias', "
                                         "'balanced' or 'error'");
    std::vector<Image> renders = images_of(array, name, image.groups(), shape);
    for (size_t i = 0; i < renders.size(); ++i) {
      const bool has_lamps = kAuxiliaryFeatures[kind].is_colour && !beside.clean_features;  // as renderers show them
      const Image picture = has_lamps ? picture_of(image.view(), renders.size() > 1 ? i : kAll) : Image();
      features.add(kind, name, std::move(renders[i]), has_lamps ? &picture : nullptr);
    }
  }
  const auto needs = [&](feature::Index kind, feature::Index other, const char* other_name) {
    if (!features.has(kind) || features.has(other)) return;
    throw Error(ErrorCode::kUsage,
                fmt::format("{}: it has an effect only together with {}", kFeatureArguments[kind], other_name));
  };
  needs(feature::kNormal, feature::kAlbedo, "the albedo");
  needs(feature::kPosition, feature::kAlbedo, "the albedo");
  needs(feature::kDenoisingNormal, feature::kDenoisingAlbedo, "denoising_albedo");
  if (features.has(feature::kNormal)) needs(feature::kDenoisingAlbedo, feature::kDenoisingNormal, "denoising_normal");
  if (beside.clean_features && !features.has(feature::kAlbedo) && !features.has(feature::kDenoisingAlbedo))
    throw Error(ErrorCode::kUsage, "clean_features: it has an effect only together with the albedo");
  return features;
}

const Film* film_of(nb::handle light) {
  Film* film = nullptr;
  if (!light.is_none() && !nb::try_cast(light, film))
    throw nb::type_error(
        fmt::format("light: found {}; expected the covary.Film of a pass 'light'", describe(light)).c_str());
  return film;
}

/// The estimator for two images, or for an independent one that is denoised.
Method estimator_of(bool is_pair, const std::string& name, const OptionValues& options,
                    const DenoisingChoice& denoising, const MethodTarget& target = {}) {
  if (name == kDefaultEstimator && (is_pair || denoising.denoises()))
    return make_default_estimator(is_pair, options, denoising, target);
  if (is_pair) return with_denoising(make_pair_estimator(name, options, target), denoising, target);
  if (name != kDefaultEstimator && name != kNoEstimator) {
    make_pair_estimator(name, options);  // refuses unknown names
    throw Error(ErrorCode::kUsage,
                fmt::format("crn: found None; '{}' needs the image with common random numbers", name));
  }
  if (!denoising.denoises())
    throw Error(ErrorCode::kUsage,
                "denoise: found 'none'; without crn, images are only denoised: 'auto', 'bias', 'balanced' or 'error'");
  return with_denoising(make_estimator(kNoEstimator, options), denoising, target);
}

nb::dict combine(nb::object crn, nb::object independent, const ExtraInputs& beside, const CombineArguments& arguments,
                 nb::object progress) {
  const Film* light = film_of(beside.light);
  Pair pair(crn, independent, light);
  CombineRequest& request = pair.request;
  const MethodTarget target = gpu::Target::open(arguments.device);
  request.estimator = estimator_of(pair.crn.has_value(), arguments.estimator, arguments.options,
                                   denoising_of(arguments.estimator, arguments.denoise, arguments.oidn), target);
  const Method& estimator = request.estimator;
  const bool has_counts = !beside.counts.is_none();
  request.settings =
      pair_settings(estimator, needs_sample_count(estimator) || !has_counts ? arguments.samples : std::nullopt,
                    pair.crn_samples(), arguments.std_error.value_or(estimator.predicts_error));
  RenderFeatures features = features_from(beside, estimator, pair.independent);
  request.settings.features = features.view();
  request.settings.features.clean = beside.clean_features;
  pair.take_layers(beside.layers);
  if (has_counts) pair.take_counts(nb::cast<Counts>(beside.counts), arguments.samples);
  request.force = arguments.force;
  CombinedImage combined;
  const auto work = [&](WorkState& state) {
    state.total = 2;
    request.checked = [&](const InputFindings& inputs) {
      if (const std::string errors = errors_text(inputs.findings); !errors.empty() && !request.force)
        throw Error(ErrorCode::kInput, "the inputs do not fit: " + errors + " (force=True combines them anyway)");
      state.done = 1;
    };
    pair.check_shapes();
    if (run_stoppable(state, [&] { combined = covary::combine(request); })) state.done = 2;
  };
  run_work(work, progress);
  std::optional<double> samples;
  if ((!pair.crn || pair.crn_samples() > 0) && pair.independent.samples() > 0)
    samples = pair.crn_samples() + pair.independent.samples();
  nb::dict d;
  d["image"] = array_of(std::move(combined.image.estimate));
  d["std_error"] = array_of(std::move(combined.image.std_error));
  d["bias"] = array_of(std::move(combined.image.bias));
  add_prediction(combined.predicted, combined.image.note, d);
  nb::dict layers;
  for (auto& [name, layer] : combined.layers) layers[name.c_str()] = array_of(std::move(layer));
  for (size_t i = 0; i < feature::kCount; ++i)
    if (const auto kind = static_cast<feature::Index>(i); features.has(kind))
      if (const char* layer = kAuxiliaryFeatures[i].layer; !layers.contains(layer))
        layers[layer] = array_of(std::move(*features.take(kind)));
  d["aovs"] = layers;
  std::vector<std::string> warnings = texts_of(combined.inputs.findings);
  if (target && target->made_by().empty()) warnings.push_back(combined.image.note);  // why the processor took over
  d["warnings"] = warnings;
  d["nonfinite_pixels"] = combined.image.nonfinite_pixels;
  d["estimator"] = estimator.text;
  d["network"] = estimator.network;
  add_risks(combined.image, d);
  d["samples_per_pixel"] = samples;
  return d;
}

/// Throws what combine() would throw for the options with any images.
void check_pair_estimator(const std::string& name, const OptionValues& options, const std::string& denoise,
                          const std::string& oidn) {
  const Method estimator = estimator_of(true, name, options, denoising_of(name, denoise, oidn));
  const bool needs_count = needs_sample_count(estimator);
  pair_settings(estimator, needs_count ? std::optional(1) : std::nullopt, 1, estimator.predicts_error);
}

nb::object correlation(const Correlation& c) {
  if (c.pairs == 0) return nb::none();
  return nb::make_tuple(c.value, c.standard_error);
}

nb::dict check(nb::object crn, nb::object independent) {
  Pair pair(crn, independent, nullptr);
  InputFindings inputs;
  run_work(
      [&](WorkState&) {
        pair.check_shapes();
        inputs = examine(pair.request);
      },
      nb::none());
  nb::list errors, warnings, notes;
  for (const Finding& f : inputs.findings)
    (f.severity == Finding::Severity::kError     ? errors
     : f.severity == Finding::Severity::kWarning ? warnings
                                                 : notes)
        .append(f.text);
  const InputReport& r = inputs.report;
  nb::dict d;
  d["errors"] = errors;
  d["warnings"] = warnings;
  d["notes"] = notes;
  d["crn_horizontal"] = correlation(r.crn_horizontal);
  d["crn_vertical"] = correlation(r.crn_vertical);
  d["independent_horizontal"] = correlation(r.independent_horizontal);
  d["independent_vertical"] = correlation(r.independent_vertical);
  d["crn_independent"] = correlation(r.crn_independent);
  d["crn_mean"] = r.crn_mean;
  d["independent_mean"] = r.independent_mean;
  return d;
}

}  // namespace

void bind_combine(nb::module_& module) {
  using namespace nb::literals;
  module.def(
      "combine",
      [](nb::object crn, nb::object independent, nb::object counts, nb::object light, nb::object albedo,
         nb::object normal, nb::object denoising_albedo, nb::object denoising_normal, nb::object position,
         bool clean_features, nb::dict layers, const std::string& estimator, const OptionValues& options,
         const std::string& denoise, const std::string& oidn, const std::string& device, bool force,
         std::optional<bool> std_error, std::optional<int> samples, nb::object progress) {
        return combine(
            crn, independent,
            {counts, light, albedo, normal, denoising_albedo, denoising_normal, position, layers, clean_features},
            {estimator, options, denoise, oidn, device, force, std_error, samples}, progress);
      },
      "crn"_a.none(), "independent"_a.none(), "counts"_a.none(), "light"_a.none(), "albedo"_a.none(), "normal"_a.none(),
      "denoising_albedo"_a.none(), "denoising_normal"_a.none(), "position"_a.none(), "clean_features"_a, "layers"_a,
      "estimator"_a, "options"_a, "denoise"_a, "oidn"_a, "device"_a, "force"_a, "std_error"_a.none(),
      "samples"_a.none(), "progress"_a.none(),
      nb::sig("def combine(crn: object, independent: object, counts: object | None, light: object | None, albedo: "
              "object | None, normal: object | None, denoising_albedo: object | None, denoising_normal: object | None, "
              "position: object | None, clean_features: bool, layers: dict[str, typing.Any], estimator: str, options: "
              "dict[str, str], "
              "denoise: str, oidn: str, device: str, force: "
              "bool, std_error: bool | None, samples: int | None, progress: typing.Any) -> dict[str, typing.Any]"));
  module.def(
      "check_pair_estimator", &check_pair_estimator, "estimator"_a, "options"_a, "denoise"_a, "oidn"_a,
      nb::sig("def check_pair_estimator(estimator: str, options: dict[str, str], denoise: str, oidn: str) -> None"));
  module.def("check_inputs", &check, "crn"_a.none(), "independent"_a.none(),
             nb::sig("def check_inputs(crn: object, independent: object) -> dict[str, typing.Any]"));
}

}  // namespace covary::python
