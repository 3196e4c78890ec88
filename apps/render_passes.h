// SPDX-License-Identifier: Apache-2.0
// The passes of a plan while they are rendered: films, where they are kept, and what they cost.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "film/film.h"
#include "integrators/render_pass.h"
#include "io/load_scene.h"
#include "render_options.h"

namespace covary {

struct Pass {
  PassSettings settings;  ///< spp: samples per pixel to reach
  Film film;
  std::string path;    ///< the file that keeps the film
  uint32_t count = 0;  ///< samples that every pixel has
  PassResult result;   ///< of all calls together, earlier ones included where --passes keeps them

  std::string name() const { return settings.sampling == Sampling::kCrn ? "crn" : "independent"; }
};

struct RenderLimits {
  const std::atomic<bool>* stop = nullptr;  ///< stop at the next tile
  /// Where given, asked before each wave once every pixel has samples of every pass: seconds that are left.
  std::function<double()> seconds_left;
  std::function<void(uint64_t done, uint64_t total)> progress;  ///< samples of all passes together
  std::function<void()> checkpoint;                             ///< called between waves
};

/// The passes that the options ask for, with `budget` samples per pixel together, which decides how many groups there are;
/// with --resume, films that are there are continued. Throws Error(kInput) where such a film belongs to another render.
std::vector<Pass> make_passes(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator,
                              uint32_t budget);

/// The budget that decides how many groups the passes have: `budget`, or with --time what half of the time is enough for, so
/// that no more groups are begun than can be filled. The speed is measured all over the window, in some ten milliseconds.
uint32_t affordable_budget(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator,
                           uint32_t budget);

/// Sets the samples per pixel of each pass for a budget of `total`, rounded up to whole groups.
void set_budget(const RenderOptions& options, uint32_t total, std::vector<Pass>& passes);

/// The part of the frame that is rendered.
CropWindow crop_window(const RenderOptions& options, const LoadedScene& scene);

/// Where the films are while the plan runs.
std::filesystem::path passes_folder(const RenderOptions& options);
/// A plain render without --passes has its film in the output.
bool output_is_film(const RenderOptions& options);

/// Keeps the films, so that --resume can go on from here.
void save_passes(const RenderOptions& options, std::vector<Pass>& passes, bool complete);
/// Removes films that were kept for --resume alone.
void remove_passes(const RenderOptions& options, const std::vector<Pass>& passes);

/// Renders all passes up to their settings.spp. The pass with the smallest part of its samples is next, one wave at a time,
/// so that the passes advance together.
void render_passes(const Scene& scene, const Integrator& integrator, std::vector<Pass>& passes,
                   const RenderLimits& limits);

}  // namespace covary
