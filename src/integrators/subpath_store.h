// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace covary {

/// The vertices of many subpaths that are traced together, for connections between them. While a batch advances one
/// edge at a time, vertices of different paths are interleaved; finish() groups them by path. Storage is reused from
/// batch to batch.
template <typename Vertex>
class SubpathStore {
 public:
  /// Removes all vertices and begins `n_paths` empty paths.
  void start(size_t n_paths) {
    arrived_.clear(), path_of_.clear();
    bounds_.assign(n_paths + 1, 0);
  }
  /// Adds the next vertex of a path, given by its index among the n_paths.
  void append(uint32_t path, const Vertex& vertex) {
    arrived_.push_back(vertex), path_of_.push_back(path);
    ++bounds_[path + 1];
  }
  /// Call once after the last append() and before path().
  void finish() {
    for (size_t path = 1; path < bounds_.size(); ++path) bounds_[path] += bounds_[path - 1];
    // A counting sort by path, stable within each: place_ runs from the first vertex of a path to its end.
    place_.assign(bounds_.begin(), bounds_.end());
    sorted_.resize(arrived_.size());
    for (size_t i = 0; i < arrived_.size(); ++i) sorted_[place_[path_of_[i]]++] = arrived_[i];
  }
  /// The vertices of a path in the order they were added.
  std::span<const Vertex> path(size_t path) const {
    return std::span(sorted_).subspan(bounds_[path], bounds_[path + 1] - bounds_[path]);
  }
  /// Same, writable.
  std::span<Vertex> path(size_t path) {
    return std::span(sorted_).subspan(bounds_[path], bounds_[path + 1] - bounds_[path]);
  }
  size_t n_paths() const { return bounds_.size() - 1; }
  size_t n_vertices() const { return arrived_.size(); }

 private:
  std::vector<Vertex> arrived_, sorted_;
  std::vector<uint32_t> path_of_;             // of each appended vertex
  std::vector<size_t> bounds_ = {0}, place_;  // path p has vertices bounds_[p] … bounds_[p + 1] - 1
};

}  // namespace covary
