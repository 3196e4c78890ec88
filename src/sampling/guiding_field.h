// SPDX-License-Identifier: Apache-2.0
// Incident radiance distributions throughout a scene, learnt from samples [Ruppert2020]: a k-d tree over positions,
// with a mixture of von Mises-Fisher lobes in each leaf.
//
//     while a wave of samples is traced    find() and leaf() give the mixtures of earlier waves
//     after each tile, in order            add()
//     after the wave                       update(): rebuilds the tree and fits all leaves
//     after the last wave                  freeze(): keeps only the mixtures
//
// All samples are kept until training ends; above a maximum, every second one is dropped. Bit-identical for any number
// of threads, given the same samples in the same order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sampling/vmf_fit.h"

namespace covary {

struct GuidingSettings {
  VmfFitSettings fit{.max_steps = 10};  ///< each wave continues from the fit of the previous one
  uint32_t leaf_samples = 8000;         ///< a leaf with more is split
  uint32_t min_leaf_samples = 100;      ///< a leaf with fewer samples, including zeros, does not guide
  uint32_t max_depth = 32;              ///< of the tree
  uint32_t max_samples = 1u << 22;      ///< kept while training
};

/// The mixture of one leaf.
struct GuidingLeaf {
  VmfMixture mixture;  ///< without lobes: no guiding
  float outgoing = 0;  ///< mean of GuidingSample::outgoing; 0: too few samples
};

class GuidingField {
 public:
  static constexpr uint32_t kNone = ~0u;
  GuidingField() = default;
  explicit GuidingField(const GuidingSettings& settings) : settings_(settings) {}

  /// The leaf containing a position, or kNone before the first update().
  uint32_t find(const Vec3& position) const;
  const GuidingLeaf& leaf(uint32_t number) const { return leaves_[number]; }

  /// Adds samples. Those that are not finite, have negative weight or no density are ignored and counted.
  void add(std::span<const GuidingSample> samples);
  /// Builds the tree and fits all leaves, in parallel.
  void update();
  /// Discards the samples, which are needed only for training.
  void freeze();
  /// Discards everything.
  void restart();

  uint32_t n_leaves() const { return static_cast<uint32_t>(leaves_.size()); }
  uint64_t n_lobes() const;
  uint64_t n_samples() const { return n_samples_; }    ///< samples added
  uint64_t n_rejected() const { return n_rejected_; }  ///< samples ignored
  double fit_seconds() const { return fit_seconds_; }  ///< spent in update() so far
  uint64_t n_fitted() const { return n_fitted_; }      ///< samples fitted so far, counted once per update()
  /// Maximum size in bytes of the samples kept while training.
  size_t training_memory() const { return settings_.max_samples * sizeof(GuidingSample); }
  size_t bytes() const;  ///< of tree, leaves and samples
  uint64_t hash() const;

  /// Serialises tree and leaves (docs/file-formats.md), and back. from_body() throws Error(kInput) for invalid bytes;
  /// `where` names their source.
  std::string body() const;
  static GuidingField from_body(std::string_view bytes, const std::string& where);

 private:
  struct Node {
    float position = 0;     // of the plane
    uint32_t axis = kLeaf;  // or kLeaf
    uint32_t child = 0;     // index of the first child, followed by the other; for a leaf: its index
    static constexpr uint32_t kLeaf = 3;
  };
  struct Range {
    uint32_t node, first, last, depth;
  };
  void split(const Range& range, std::vector<Range>& pending, std::vector<Range>& leaves);
  GuidingLeaf fit_leaf(std::span<const GuidingSample> samples, const GuidingField& before) const;

  GuidingSettings settings_;
  std::vector<Node> nodes_;
  std::vector<GuidingLeaf> leaves_;
  std::vector<GuidingSample> samples_;
  uint32_t stride_ = 1;  // every stride_-th of n_samples_ is kept
  uint64_t n_samples_ = 0, n_rejected_ = 0, n_fitted_ = 0;
  double fit_seconds_ = 0;
};

}  // namespace covary
