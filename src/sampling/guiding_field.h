// SPDX-License-Identifier: Apache-2.0
// Where light comes from at every place of a scene, learnt from samples [Ruppert2020]: a k-d tree over positions, with
// a mixture of von Mises-Fisher lobes in each leaf.
//
//     while a wave of samples is traced    find() and leaf() serve the mixtures of earlier waves
//     after each tile, in their order      add()
//     after the wave                       update(): builds the tree anew and fits all leaves
//     after the last wave                  freeze(): only the mixtures stay
//
// All samples of a training are kept until it ends, up to a number beyond which every second one is dropped. The same
// samples in the same order give the same bits for any number of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sampling/vmf_fit.h"

namespace covary {

struct GuidingSettings {
  VmfFitSettings fit{.max_steps = 10};  ///< each wave goes on where the one before it ended
  uint32_t leaf_samples = 8000;         ///< a leaf with more is split
  uint32_t min_leaf_samples = 100;      ///< a leaf with fewer samples, zero ones included, does not guide
  uint32_t max_depth = 32;              ///< of the tree
  uint32_t max_samples = 1u << 22;      ///< kept while training
  bool learn_fraction = false;          ///< find the best fraction of guided directions for each leaf
};

/// The mixture of one leaf.
struct GuidingLeaf {
  VmfMixture mixture;     ///< without lobes: does not guide
  float fraction = 0.5f;  ///< learned fraction of directions that are drawn from the mixture, where it is learned
};

class GuidingField {
 public:
  static constexpr uint32_t kNone = ~0u;
  GuidingField() = default;
  explicit GuidingField(const GuidingSettings& settings) : settings_(settings) {}

  /// The leaf at a position, or kNone before the first update().
  uint32_t find(const Vec3& position) const;
  const GuidingLeaf& leaf(uint32_t number) const { return leaves_[number]; }

  /// Adds samples. Those that are not finite, of negative weight or without density are left out and counted.
  void add(std::span<const GuidingSample> samples);
  /// Builds the tree and fits all leaves, in parallel.
  void update();
  /// Forgets the samples, which only training needs.
  void freeze();
  /// Forgets everything.
  void restart();

  uint32_t n_leaves() const { return static_cast<uint32_t>(leaves_.size()); }
  uint64_t n_lobes() const;
  uint64_t n_samples() const { return n_samples_; }    ///< that were added
  uint64_t n_rejected() const { return n_rejected_; }  ///< that were left out
  double fit_seconds() const { return fit_seconds_; }  ///< in update() so far
  uint64_t n_fitted() const { return n_fitted_; }      ///< samples that were fitted so far, once for each update()
  /// Bytes of samples that are kept while training, at most.
  size_t training_memory() const { return settings_.max_samples * sizeof(GuidingSample); }
  size_t bytes() const;  ///< of tree, leaves and samples
  uint64_t hash() const;

  /// Tree and leaves as bytes (docs/file-formats.md), and back. from_body() throws Error(kInput) for bytes that are no
  /// such thing; `where` names their source.
  std::string body() const;
  static GuidingField from_body(std::string_view bytes, const std::string& where);

 private:
  struct Node {
    float position = 0;     // of the plane
    uint32_t axis = kLeaf;  // or kLeaf
    uint32_t child = 0;     // number of the first child, the other comes next; of a leaf: its number
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
  uint32_t stride_ = 1;  // of n_samples_ every stride_-th one is kept
  uint64_t n_samples_ = 0, n_rejected_ = 0, n_fitted_ = 0;
  double fit_seconds_ = 0;
};

/// The fraction c of guided directions for which the mixture of densities (1 − c s) BSDF + c s guide matches the light
/// best in cross-entropy, −Σ w log: among multiples of 0.1 from 0.1 to 0.9; 0.5 where samples tell nothing. Only
/// samples drawn when there was a guide count, whose lobes were made of earlier ones. [Muller2019] seeks the same
/// minimum.
float best_guiding_fraction(std::span<const GuidingSample> samples);

}  // namespace covary
