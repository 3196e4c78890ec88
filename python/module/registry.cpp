// SPDX-License-Identifier: Apache-2.0
#include "combine/combine_settings.h"

#include "dependent_tests/dependent_tests.h"
#include "integrators/registry.h"
#include "metrics/metrics.h"
#include "plans/render_settings.h"
#include "python/module/bindings.h"
#include "settings/option_names.h"

namespace covary::python {
namespace {

const char* name_of(Option::Type type) {
  switch (type) {
    case Option::Type::kFlag:
      return "flag";
    case Option::Type::kWhole:
      return "whole";
    case Option::Type::kReal:
      return "real";
    case Option::Type::kChoice:
      return "choice";
    case Option::Type::kText:
      return "text";
  }
  return "";
}

const char* passes_of(const Method& method) {
  if (method.pair()) return "pair";
  if (method.pixel_pass()) return "samples";
  return method.is_mean() ? "any" : "independent";
}

nb::dict option_dict(const Option& option) {
  nb::dict d;
  d["name"] = option.name;
  d["type"] = name_of(option.type);
  d["default"] = option.default_value;
  d["range"] = option.range.text();
  d["choices"] = option.choices;
  d["is_path"] = option.names == OptionNames::kFile || option.names == OptionNames::kFolder;
  d["help"] = as_arguments(option.help);
  d["of_passes"] = is_adaptive_option(option.name);
  return d;
}

nb::list list_of(const std::vector<Option>& options) {
  nb::list list;
  for (const Option& option : options) list.append(option_dict(option));
  return list;
}

nb::list estimators() {
  nb::list list;
  for (const std::string& name : estimator_names()) {
    const Method estimator = make_estimator(name);
    nb::dict d;
    d["name"] = name;
    d["summary"] = estimator.summary;
    d["passes"] = passes_of(estimator);
    d["predicts_error"] = estimator.predicts_error;
    d["is_default"] = name == kDefaultEstimator;
    d["is_default_of_pairs"] = name == kDefaultOfPairs;
    d["adaptive"] = estimator.adaptive.has_value();
    d["denoises"] = can_be_denoised(estimator);
    d["min_groups"] = estimator.min_groups;
    d["options"] = list_of(options_of_estimator(name));
    list.append(d);
  }
  return list;
}

nb::list metric_list() {
  nb::list list;
  for (const MetricInfo& metric : metrics()) {
    nb::dict d;
    d["name"] = metric.name;
    d["formula"] = metric.formula;
    d["formula_two"] = metric.formula_two;
    list.append(d);
  }
  return list;
}

}  // namespace

void bind_registry(nb::module_& module) {
  module.def("estimators", &estimators, nb::sig("def estimators() -> list[dict[str, typing.Any]]"));
  module.def(
      "render_options", [] { return list_of(options_of<RenderSettings>()); },
      nb::sig("def render_options() -> list[dict[str, typing.Any]]"));
  module.def(
      "combine_options", [] { return list_of(options_of<CombineSettings>()); },
      nb::sig("def combine_options() -> list[dict[str, typing.Any]]"));
  module.def(
      "integrator_options",
      [] {
        nb::dict lists;
        for (const std::string& name : integrator_names()) lists[name.c_str()] = list_of(options_of_integrator(name));
        return lists;
      },
      nb::sig("def integrator_options() -> dict[str, list[dict[str, typing.Any]]]"));
  module.def("metrics", &metric_list, nb::sig("def metrics() -> list[dict[str, str]]"));
}

}  // namespace covary::python
