// SPDX-License-Identifier: Apache-2.0
// Grids of NanoVDB [Museth2021], whose headers read them; the build works without these.
#include "pbrt/pbrt_nanovdb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/memory_limit.h"

#if __has_include(<nanovdb/util/IO.h>)
#define COVARY_NANOVDB
#define NANOVDB_USE_ZIP
#include <iostream>  // which NanoVDB 10 forgets

#include <nanovdb/util/GridValidator.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/SampleFromVoxels.h>
#endif

namespace covary {

#ifdef COVARY_NANOVDB

bool has_nanovdb() { return true; }

namespace {

constexpr double kMaxCells = 1e8;

Error refusal(const std::string& path, const std::string& what) { return {ErrorCode::kInput, path + ": " + what}; }

Vec3 to_vec3(const nanovdb::Vec3d& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

/// The smallest box of cells of `step` voxels that covers the active ones, in world space.
DenseGrid layout_of(const nanovdb::FloatGrid& grid, const std::string& path) {
  const nanovdb::CoordBBox bounds = grid.indexBBox();
  const nanovdb::Coord low = bounds.min(), high = bounds.max();
  double n_voxels[3];
  for (int axis = 0; axis < 3; ++axis) n_voxels[axis] = 1.0 + high[axis] - low[axis];
  if (!(std::min({n_voxels[0], n_voxels[1], n_voxels[2]}) >= 1)) throw refusal(path, "holds an empty grid");
  DenseGrid result;
  const auto cells = [&](int axis) { return std::ceil(n_voxels[axis] / result.step); };
  while (cells(0) * cells(1) * cells(2) > kMaxCells) ++result.step;
  require_memory(path, "its grid", 12 * cells(0) * cells(1) * cells(2));
  Matrix4 m{};
  const nanovdb::Vec3d origin(low[0] - 0.5, low[1] - 0.5, low[2] - 0.5);
  const Vec3 o = to_vec3(grid.indexToWorld(origin));
  for (int axis = 0; axis < 3; ++axis) {
    result.size[axis] = static_cast<int>(cells(axis));
    nanovdb::Vec3d end = origin;
    end[axis] += static_cast<double>(result.size[axis]) * result.step;
    const Vec3 e = to_vec3(grid.indexToWorld(end)) - o;
    const auto column = static_cast<size_t>(axis);
    m[0][column] = e.x, m[1][column] = e.y, m[2][column] = e.z;
  }
  m[0][3] = o.x, m[1][3] = o.y, m[2][3] = o.z, m[3][3] = 1;
  result.box = Transform(m);
  return result;
}

}  // namespace

std::optional<DenseGrid> read_nanovdb(const std::string& path, const std::string& name, const DenseGrid* like) {
  nanovdb::GridHandle<nanovdb::HostBuffer> handle;
  try {
    handle = nanovdb::io::readGrid<nanovdb::HostBuffer>(path, name);
  } catch (const std::exception& error) {
    throw refusal(path, fmt::format("cannot be read as a NanoVDB file: {}", error.what()));
  }
  if (!handle) return std::nullopt;
  const nanovdb::FloatGrid* grid = handle.grid<float>();
  if (!grid) throw refusal(path, fmt::format("has a grid '{}' that is not one of floats", name));
  if (!nanovdb::isValid(*grid)) throw refusal(path, fmt::format("has a damaged grid '{}'", name));
  DenseGrid result = like ? DenseGrid{{like->size[0], like->size[1], like->size[2]}, {}, like->box, like->step}
                          : layout_of(*grid, path);
  const auto accessor = grid->getAccessor();
  const auto sampler = nanovdb::createSampler<1>(accessor);
  for (int z = 0; z < result.size[2]; ++z)
    for (int y = 0; y < result.size[1]; ++y)
      for (int x = 0; x < result.size[0]; ++x) {
        const auto centre = [&](int i, int axis) {
          return (static_cast<float>(i) + 0.5f) / static_cast<float>(result.size[axis]);
        };
        const Vec3 p = result.box.point({centre(x, 0), centre(y, 1), centre(z, 2)});
        const nanovdb::Vec3d index = grid->worldToIndex(nanovdb::Vec3d(p.x, p.y, p.z));
        result.values.push_back(sampler(index));
      }
  return result;
}

#else

bool has_nanovdb() { return false; }

std::optional<DenseGrid> read_nanovdb(const std::string& path, const std::string&, const DenseGrid*) {
  throw Error(ErrorCode::kInput, path + ": this program was built without NanoVDB (Debian: libnanovdb-dev)");
}

#endif

}  // namespace covary
