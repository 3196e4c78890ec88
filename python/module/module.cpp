// SPDX-License-Identifier: Apache-2.0
#include <tbb/global_control.h>

#include <memory>
#include <mutex>

#include "core/error.h"
#include "film/film.h"
#include "plans/budget.h"
#include "python/module/bindings.h"
#include "settings/option_names.h"

namespace covary::python {
namespace {

const char* class_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::kUsage:
      return "UsageError";
    case ErrorCode::kInput:
      return "InputError";
    case ErrorCode::kIo:
      return "IoError";
    case ErrorCode::kInternal:
      return "InternalError";
  }
  return "Error";
}

void raise(const Error& error) {
  const nb::object type = nb::module_::import_("covary.errors").attr(class_of(error.code()));
  PyErr_SetString(type.ptr(), as_arguments(error.what()).c_str());
}

std::unique_ptr<tbb::global_control> g_threads;
std::mutex g_threads_mutex;

void set_threads(int n) {
  const std::lock_guard lock(g_threads_mutex);
  g_threads.reset();  // before the next, or the lower of both would hold
  if (n > 0) g_threads = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, size_t(n));
}

}  // namespace

void bind_errors(nb::module_&) {
  nb::register_exception_translator([](const std::exception_ptr& pointer, void*) {
    try {
      std::rethrow_exception(pointer);
    } catch (const Error& error) {
      raise(error);
    }
  });
}

}  // namespace covary::python

NB_MODULE(_covary, module) {
  using namespace covary::python;
  module.attr("version") = COVARY_VERSION;
  module.attr("most_samples") = covary::kMaxBudget;  // of a pixel
  module.attr("max_groups") = covary::Film::kMaxGroups;
  module.def("set_threads", &set_threads, nanobind::arg("n"));
  bind_errors(module);
  bind_registry(module);
  bind_images(module);
  bind_film(module);
  bind_combine(module);
  bind_live(module);
  bind_render(module);
  bind_experiment(module);
}
