// SPDX-License-Identifier: Apache-2.0
#include "python/module/live.h"

#include <utility>
#include <vector>

#include "live/coarse.h"
#include "plans/plan.h"
#include "python/module/arrays.h"
#include "risk/predicted_error.h"

namespace covary::python {

Page::Page(int port, const std::string& title, const std::string& output)
    : live(port, {title, output, ""}, [this] {
        if (std::atomic<bool>* of_render = stop) *of_render = true;
      }) {}

void Steps::watch(RenderCallbacks& callbacks) {
  if (take_.is_none()) return;
  callbacks.small_waves = true;
  callbacks.wave = [this](std::span<const Pass> passes) { wave(passes); };
  callbacks.estimated = [this](const EstimatorResult& result, const std::optional<PredictedError>& predicted) {
    Step step{result.estimate, result.std_error, samples_, {}, {}};
    if (predicted) step.relmse = predicted->relmse, step.bounds = predicted->bounds;
    put(std::move(step));
  };
}

void Steps::wave(std::span<const Pass> passes) {
  samples_ = 0;
  std::vector<const Film*> films;
  for (const Pass& pass : camera_passes(passes)) films.push_back(&pass.film), samples_ += pass.film.mean_count();
  {
    const std::lock_guard lock(mutex_);
    if (next_) return;
  }
  if (cost_ > 0 && spent_ + cost_ > LiveRender::kShare * watch_.seconds()) return;
  const Stopwatch watch;
  const Pass* light = light_pass(passes);
  MeanAndError mean = mean_of_films(films, light ? &light->film : nullptr);
  Step step{std::move(mean.mean), std::move(mean.std_error), samples_, {}, {}};
  if (!step.std_error.data.empty()) {
    EstimatorResult result;
    result.estimate = step.image, result.std_error = step.std_error;
    step.relmse = predicted_relmse(result);
  }
  put(std::move(step));
  cost_ = watch.seconds(), spent_ += cost_;
}

void Steps::put(Step step) {
  const std::lock_guard lock(mutex_);
  next_ = std::move(step);
}

void Steps::deliver() {
  std::optional<Step> step;
  {
    const std::lock_guard lock(mutex_);
    step = std::exchange(next_, std::nullopt);
  }
  if (!step) return;
  nb::object bounds = nb::none();
  if (step->bounds) bounds = nb::make_tuple(step->bounds->low, step->bounds->high);
  take_(array_of(std::move(step->image)), array_of(std::move(step->std_error)), step->samples, step->relmse, bounds);
}

void bind_live(nb::module_& module) {
  using namespace nb::literals;
  nb::class_<Page>(module, "Page")
      .def(nb::init<int, const std::string&, const std::string&>(), "port"_a, "title"_a, "output"_a)
      .def_prop_ro("address", [](const Page& page) { return page.live.page().address(); })
      .def_prop_ro("stopped", [](const Page& page) { return page.live.stopped_here(); })
      .def(
          "end", [](Page& page, const std::string& text) { page.live.end(text); }, "text"_a,
          nb::call_guard<nb::gil_scoped_release>());
}

}  // namespace covary::python
