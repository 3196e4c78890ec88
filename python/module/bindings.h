// SPDX-License-Identifier: Apache-2.0
// The parts of the extension module `covary._covary`, which the files of python/covary wrap.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

namespace covary::python {

namespace nb = nanobind;

/// Translates the library's exceptions: Error to those of covary.errors by its code, and std::bad_alloc to
/// MemoryError.
void bind_errors(nb::module_& module);
/// Estimators, their options, and metrics, from which the typed functions of the package are generated.
void bind_registry(nb::module_& module);
/// combine() and check_inputs().
void bind_combine(nb::module_& module);
/// Reading and writing images, metrics, denoise().
void bind_images(nb::module_& module);
/// Film.
void bind_film(nb::module_& module);
/// Scene and render().
void bind_render(nb::module_& module);
/// Pages of renders that run.
void bind_live(nb::module_& module);
/// Suites of experiments, and running the program.
void bind_experiment(nb::module_& module);

}  // namespace covary::python
