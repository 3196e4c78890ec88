// SPDX-License-Identifier: Apache-2.0
#include "sampling/guiding_field.h"

#include <algorithm>
#include <array>

#include "core/content_hash.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "sampling/training_bytes.h"

namespace covary {
namespace {

bool usable(const GuidingSample& s) {
  return is_finite(s.position) && is_finite(s.direction) && std::isfinite(s.weight) && s.weight >= 0 &&
         std::isfinite(s.pdf) && s.pdf > 0 && std::isfinite(s.inverse_distance) && s.inverse_distance >= 0 &&
         std::isfinite(s.outgoing) && s.outgoing >= 0;
}

/// Mean and variance of the positions, per axis.
struct Extent {
  std::array<double, 3> mean = {}, variance = {};
};

Extent extent_of(std::span<const GuidingSample> samples) {
  Extent extent;
  const auto n = static_cast<double>(samples.size());
  for (const GuidingSample& s : samples)
    for (int i = 0; i < 3; ++i) extent.mean[i] += s.position[i] / n;
  for (const GuidingSample& s : samples)
    for (int i = 0; i < 3; ++i)
      extent.variance[i] += (s.position[i] - extent.mean[i]) * (s.position[i] - extent.mean[i]);
  return extent;
}

}  // namespace

uint32_t GuidingField::find(const Vec3& position) const {
  if (nodes_.empty()) return kNone;
  const Node* node = nodes_.data();
  while (node->axis != Node::kLeaf) {
    const float x = position[static_cast<int>(node->axis)];
    node = &nodes_[node->child + (x < node->position ? 0 : 1)];
  }
  return node->child;
}

void GuidingField::add(std::span<const GuidingSample> samples) {
  for (const GuidingSample& sample : samples) {
    if (!usable(sample)) {
      ++n_rejected_;
      continue;
    }
    if (n_samples_++ % stride_ != 0) continue;
    samples_.push_back(sample);
    if (samples_.size() < settings_.max_samples) continue;
    for (size_t i = 0; 2 * i < samples_.size(); ++i) samples_[i] = samples_[2 * i];
    samples_.resize((samples_.size() + 1) / 2);
    stride_ *= 2;
  }
}

/// Splits a range of samples at the mean position along the axis of largest variance, or makes it a leaf.
void GuidingField::split(const Range& range, std::vector<Range>& pending, std::vector<Range>& leaves) {
  const std::span<GuidingSample> samples = std::span(samples_).subspan(range.first, range.last - range.first);
  if (samples.size() > settings_.leaf_samples && range.depth < settings_.max_depth) {
    const Extent extent = extent_of(samples);
    const auto axis =
        static_cast<int>(std::max_element(extent.variance.begin(), extent.variance.end()) - extent.variance.begin());
    const auto position = static_cast<float>(extent.mean[axis]);
    const auto middle = std::stable_partition(samples.begin(), samples.end(),
                                              [&](const GuidingSample& s) { return s.position[axis] < position; });
    const auto n_left = static_cast<uint32_t>(middle - samples.begin());
    if (n_left > 0 && n_left < samples.size()) {
      const auto child = static_cast<uint32_t>(nodes_.size());
      nodes_[range.node] = {position, static_cast<uint32_t>(axis), child};
      nodes_.resize(nodes_.size() + 2);
      pending.push_back({child, range.first, range.first + n_left, range.depth + 1});
      pending.push_back({child + 1, range.first + n_left, range.last, range.depth + 1});
      return;
    }
  }
  nodes_[range.node].child = static_cast<uint32_t>(leaves.size());
  leaves.push_back(range);
}

GuidingLeaf GuidingField::fit_leaf(std::span<const GuidingSample> samples, const GuidingField& before) const {
  GuidingLeaf leaf;
  const Extent extent = extent_of(samples);
  leaf.mixture.pivot = {static_cast<float>(extent.mean[0]), static_cast<float>(extent.mean[1]),
                        static_cast<float>(extent.mean[2])};
  if (samples.size() < settings_.min_leaf_samples) return leaf;
  double outgoing = 0;
  for (const GuidingSample& s : samples) outgoing += s.outgoing;
  leaf.outgoing = static_cast<float>(outgoing / static_cast<double>(samples.size()));
  VmfMixture start;
  if (const uint32_t old = before.find(leaf.mixture.pivot); old != kNone && before.leaf(old).mixture.lobes.n > 0)
    start = before.leaf(old).mixture.moved_to(leaf.mixture.pivot);
  leaf.mixture = VmfFit(samples, leaf.mixture.pivot, settings_.fit).fit(start);
  return leaf;
}

void GuidingField::update() {
  if (samples_.empty()) return;
  const Stopwatch watch;
  GuidingField before;
  before.nodes_ = std::move(nodes_), before.leaves_ = std::move(leaves_);
  nodes_.assign(1, {});
  std::vector<Range> pending = {{0, 0, static_cast<uint32_t>(samples_.size()), 0}}, ranges;
  while (!pending.empty()) {
    const Range range = pending.back();
    pending.pop_back();
    split(range, pending, ranges);
  }
  leaves_.assign(ranges.size(), {});
  parallel_for(ranges.size(), [&](size_t i) {
    leaves_[i] = fit_leaf(std::span(samples_).subspan(ranges[i].first, ranges[i].last - ranges[i].first), before);
  });
  n_fitted_ += samples_.size();
  fit_seconds_ += watch.seconds();
}

void GuidingField::freeze() { std::vector<GuidingSample>().swap(samples_); }

void GuidingField::restart() { *this = GuidingField(settings_); }

uint64_t GuidingField::n_lobes() const {
  uint64_t n = 0;
  for (const GuidingLeaf& leaf : leaves_) n += static_cast<uint64_t>(leaf.mixture.lobes.n);
  return n;
}

size_t GuidingField::bytes() const {
  return nodes_.capacity() * sizeof(Node) + leaves_.capacity() * sizeof(GuidingLeaf) +
         samples_.capacity() * sizeof(GuidingSample);
}

uint64_t GuidingField::hash() const { return hash_bytes(body()); }

std::string GuidingField::body() const {
  std::string bytes;
  append_bytes(bytes, static_cast<uint32_t>(nodes_.size())), append_bytes(bytes, n_leaves());
  for (const Node& node : nodes_)
    append_bytes(bytes, node.position), append_bytes(bytes, node.axis), append_bytes(bytes, node.child);
  for (const GuidingLeaf& leaf : leaves_) {
    const VmfMixture& mixture = leaf.mixture;
    append_bytes(bytes, leaf.outgoing);
    append_bytes(bytes, mixture.pivot), append_bytes(bytes, mixture.lobes.n);
    for (int k = 0; k < mixture.lobes.n; ++k)
      append_bytes(bytes, mixture.lobes.weight[k]), append_bytes(bytes, mixture.lobes.lobe(k)),
          append_bytes(bytes, mixture.inverse_distance[k]);
  }
  return bytes;
}

GuidingField GuidingField::from_body(std::string_view bytes, const std::string& where) {
  ByteReader reader(bytes, where);
  GuidingField field;
  const auto n_nodes = reader.read<uint32_t>(), n_leaves = reader.read<uint32_t>();
  reader.check(n_nodes <= bytes.size() / sizeof(Node) && n_leaves <= bytes.size());
  field.nodes_.resize(n_nodes), field.leaves_.resize(n_leaves);
  for (uint32_t i = 0; i < n_nodes; ++i) {
    Node& node = field.nodes_[i];
    node.position = reader.read<float>(), node.axis = reader.read<uint32_t>(), node.child = reader.read<uint32_t>();
    const bool leaf = node.axis == Node::kLeaf;
    reader.check(leaf ? node.child < n_leaves : node.axis < 3 && node.child > i && node.child + 1 < n_nodes);
  }
  for (GuidingLeaf& leaf : field.leaves_) {
    VmfMixture& mixture = leaf.mixture;
    leaf.outgoing = reader.read<float>();
    mixture.pivot = reader.read<Vec3>();
    mixture.lobes.n = reader.read<int>();
    reader.check(mixture.lobes.n >= 0 && mixture.lobes.n <= VmfLobes::kMax && leaf.outgoing >= 0 &&
                 std::isfinite(leaf.outgoing));
    for (int k = 0; k < mixture.lobes.n; ++k) {
      const auto weight = reader.read<float>();
      const auto lobe = reader.read<Vmf>();
      mixture.inverse_distance[k] = reader.read<float>();
      reader.check(weight >= 0 && weight <= 1 && lobe.kappa >= 0 && lobe.kappa <= kMaxKappa &&
                   std::abs(length(lobe.mean) - 1) < 1e-3f && std::isfinite(mixture.inverse_distance[k]));
      mixture.lobes.set(k, weight, lobe);
    }
    mixture.lobes.pad();
  }
  reader.check(reader.rest().empty());
  return field;
}

}  // namespace covary
