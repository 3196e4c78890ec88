// SPDX-License-Identifier: Apache-2.0
#include <optional>

#include "core/error.h"
#include "estimators/held_out_error.h"
#include "estimators/pair_input.h"
#include "estimators/predicted_error.h"
#include "estimators/registry.h"
#include "plans/plan.h"
#include "python/module/arrays.h"
#include "python/module/bindings.h"
#include "python/module/work.h"

namespace covary::python {
namespace {

/// One of the two images: an array [T, H, W, 3], or a film, which lies as estimators read it.
class Input {
 public:
  Input(nb::handle object, const std::string& name) : name_(name) {
    if (object.is_none() || !nb::try_cast(object, film_)) groups_.emplace(object, name);
  }
  const Film* film() const { return film_; }
  GroupedImage view() { return film_ ? rows_of(*film_, 0, film_->height()) : groups_->view(); }
  double samples() const { return film_ ? film_->mean_count() : 0; }
  ImageOrigin origin() const {
    const auto text = [&](const char* key) {
      const auto found = film_->attributes.find(key);
      return found == film_->attributes.end() ? std::string() : found->second;
    };
    return {name_,
            {film_->frame_width(), film_->frame_height(), film_->crop()},
            text(film_key::kSampling),
            text(film_key::kSceneHash),
            text(film_key::kSettings)};
  }

 private:
  std::string name_;
  Film* film_ = nullptr;
  std::optional<Groups> groups_;
};

/// The two images and what an estimator of pairs is to make of them.
struct Pair {
  Input crn, independent;
  std::vector<Finding> findings;
  InputReport report;

  Pair(nb::handle crn_object, nb::handle independent_object)
      : crn(crn_object, "crn"), independent(independent_object, "independent") {
    if (crn.film() && independent.film()) check_origins(crn.origin(), independent.origin(), findings);
  }
  void check(const Estimator& estimator) {
    const GroupedImage g = crn.view(), h = independent.view();
    std::vector<std::string> problems;
    check_inputs(g, h, 1, 1, problems);
    if (!estimator.adaptive) throw_if_any("inputs", problems);
    report = examine_pair(estimator, g, h);
    findings.insert(findings.end(), report.findings.begin(), report.findings.end());
  }
  std::vector<std::string> warnings() const {
    std::vector<std::string> texts;
    for (const Finding& f : findings) texts.push_back(f.text);
    return texts;
  }
};

struct CombineRequest {
  std::string estimator;
  OptionValues options;
  bool force = false;
  std::optional<bool> std_error;
  std::optional<int> samples;
};

nb::tuple combine(nb::object crn, nb::object independent, const CombineRequest& request, nb::object progress) {
  const Estimator estimator = make_pair_estimator(request.estimator, request.options);
  Pair pair(crn, independent);
  const PairSettings settings = pair_settings(estimator, request.samples, pair.crn.samples(),
                                              request.std_error.value_or(estimator.predicts_error));
  EstimatorResult result;
  std::optional<double> predicted;
  const auto work = [&](WorkState& state) {
    state.total = 2;
    pair.check(estimator);
    if (const std::string errors = errors_text(pair.findings); !errors.empty() && !request.force)
      throw Error(ErrorCode::kInput, "the inputs do not fit: " + errors + " (force=True combines them nevertheless)");
    state.done = 1;
    const bool whole =
        run_stoppable(state, [&] { result = estimator.apply(pair.crn.view(), pair.independent.view(), settings); });
    if (!whole) return;
    calibrate(result);
    if (!result.std_error.data.empty()) predicted = predicted_relmse(result);
    state.done = 2;
  };
  run_work(work, progress);
  return nb::make_tuple(array_of(std::move(result.estimate)), array_of(std::move(result.std_error)), predicted,
                        pair.warnings(), result.nonfinite_pixels, estimator.text);
}

nb::object correlation(const Correlation& c) {
  if (c.pairs == 0) return nb::none();
  return nb::make_tuple(c.value, c.standard_error);
}

nb::dict check(nb::object crn, nb::object independent) {
  Pair pair(crn, independent);
  run_work([&](WorkState&) { pair.check({}); }, nb::none());
  nb::list errors, warnings, notes;
  for (const Finding& f : pair.findings)
    (f.severity == Finding::Severity::kError     ? errors
     : f.severity == Finding::Severity::kWarning ? warnings
                                                 : notes)
        .append(f.text);
  const InputReport& r = pair.report;
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
      [](nb::object crn, nb::object independent, const std::string& estimator, const OptionValues& options, bool force,
         std::optional<bool> std_error, std::optional<int> samples, nb::object progress) {
        return combine(crn, independent, {estimator, options, force, std_error, samples}, progress);
      },
      "crn"_a.none(), "independent"_a.none(), "estimator"_a, "options"_a, "force"_a, "std_error"_a.none(),
      "samples"_a.none(), "progress"_a.none(),
      nb::sig("def combine(crn: object, independent: object, estimator: str, options: dict[str, str], force: bool, "
              "std_error: bool | None, samples: int | None, progress: typing.Any) -> tuple[typing.Any, typing.Any, "
              "float | None, list[str], int, str]"));
  module.def("check_inputs", &check, "crn"_a.none(), "independent"_a.none(),
             nb::sig("def check_inputs(crn: object, independent: object) -> dict[str, typing.Any]"));
}

}  // namespace covary::python
