// SPDX-License-Identifier: Apache-2.0
#include "sampling/light_clusters.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>

#include "core/error.h"

namespace covary {
namespace {

constexpr uint32_t kNone = ~0u;

/// A node of the light tree: a light, or a pair of nodes.
struct Node {
  Bounds3 bounds;
  Vec3 axis;
  double half_angle = 0;  // radians, of the cone that holds all normals
  double power = 0;
  uint32_t first = kNone, second = kNone;  // children
  double cost = 0;                         // dissimilarity of its lights
};

/// The smallest cone that contains two cones.
void merge_cones(const Node& a, const Node& b, Node& result) {
  const Node& wide = a.half_angle >= b.half_angle ? a : b;
  const Node& narrow = a.half_angle >= b.half_angle ? b : a;
  const double between = std::acos(std::clamp(static_cast<double>(dot(wide.axis, narrow.axis)), -1.0, 1.0));
  result.axis = wide.axis, result.half_angle = wide.half_angle;
  if (between + narrow.half_angle <= wide.half_angle) return;
  result.half_angle = 0.5 * (wide.half_angle + between + narrow.half_angle);
  const Vec3 across = narrow.axis - wide.axis * dot(wide.axis, narrow.axis);
  if (result.half_angle >= kPi || !(length_squared(across) > 1e-12f)) {
    result.half_angle = kPi;
    return;
  }
  const double turn = result.half_angle - wide.half_angle;
  result.axis = normalize(wide.axis * static_cast<float>(std::cos(turn)) +
                          normalize(across) * static_cast<float>(std::sin(turn)));
}

class Builder {
 public:
  Builder(std::span<const ClusterLight> lights, float scene_diagonal)
      : scene_diagonal_squared_(static_cast<double>(scene_diagonal) * scene_diagonal) {
    nodes_.reserve(2 * lights.size());
    for (const ClusterLight& light : lights) {
      Node node{light.bounds, light.axis, std::acos(std::clamp<double>(light.cos_half_angle, -1, 1)), light.power};
      if (node.bounds.empty()) node.bounds.extend(Vec3{0, 0, 0});
      nodes_.push_back(node);
    }
  }

  /// The tree over the lights `order`, sorted along a space-filling curve.
  uint32_t build(std::span<const uint32_t> order) {
    std::vector<uint32_t> top = agglomerate(order);
    combine(top, 1);
    return top[0];
  }
  const Node& node(uint32_t i) const { return nodes_[i]; }

 private:
  static constexpr size_t kTogether = 16;  // at most this many lights are compared with each other

  /// Number of nodes kept for n lights when they are combined with a neighbouring part, [Gu2013] Sec. 3.2.
  static size_t kept(size_t n) {
    return std::max<size_t>(
        1, static_cast<size_t>(std::lround(0.5 * std::pow(kTogether, 0.6) * std::pow(static_cast<double>(n), 0.4))));
  }

  std::vector<uint32_t> agglomerate(std::span<const uint32_t> order) {
    std::vector<uint32_t> nodes;
    if (order.size() <= kTogether) {
      nodes.assign(order.begin(), order.end());
    } else {
      nodes = agglomerate(order.first(order.size() / 2));
      const std::vector<uint32_t> others = agglomerate(order.subspan(order.size() / 2));
      nodes.insert(nodes.end(), others.begin(), others.end());
    }
    combine(nodes, kept(order.size()));
    return nodes;
  }

  /// Merges the most similar pair of `nodes` until `n` are left.
  void combine(std::vector<uint32_t>& nodes, size_t n) {
    struct Partner {
      size_t index = 0;
      double cost = 0;
    };
    std::vector<Partner> best(nodes.size());
    const auto search = [&](size_t i) {
      best[i] = {i, std::numeric_limits<double>::infinity()};
      for (size_t j = 0; j < nodes.size(); ++j) {
        if (j == i) continue;
        const double cost = joined(nodes[std::min(i, j)], nodes[std::max(i, j)]).cost;
        if (cost < best[i].cost || best[i].index == i) best[i] = {j, cost};
      }
    };
    if (nodes.size() > n)
      for (size_t i = 0; i < nodes.size(); ++i) search(i);
    while (nodes.size() > n) {
      size_t i = 0;
      for (size_t k = 1; k < nodes.size(); ++k)
        if (best[k].cost < best[i].cost) i = k;
      const size_t j = std::max(i, best[i].index);
      i = std::min(i, best[i].index);
      nodes_.push_back(joined(nodes[i], nodes[j]));
      nodes[i] = static_cast<uint32_t>(nodes_.size() - 1);
      // Move the last one into the free slot.
      const size_t last = nodes.size() - 1;
      nodes[j] = nodes[last], best[j] = best[last];
      nodes.pop_back(), best.pop_back();
      for (size_t k = 0; k < nodes.size(); ++k) {
        const size_t partner = best[k].index;
        if (k == i || partner == i || partner == j) {
          search(k);
          continue;
        }
        if (partner == last) best[k].index = j;
        const double cost = joined(nodes[std::min(k, i)], nodes[std::max(k, i)]).cost;
        if (cost < best[k].cost) best[k] = {i, cost};
      }
    }
  }

  /// [Walter2005] Sec. 3.1: I (diagonal² + scene diagonal² (1 − cos angle)²).
  Node joined(uint32_t a, uint32_t b) const {
    Node node = nodes_[a];
    node.first = a, node.second = b;
    node.bounds.extend(nodes_[b].bounds);
    node.power += nodes_[b].power;
    merge_cones(nodes_[a], nodes_[b], node);
    const double turned = 1 - std::cos(node.half_angle);
    node.cost = node.power * (static_cast<double>(length_squared(node.bounds.upper - node.bounds.lower)) +
                              scene_diagonal_squared_ * turned * turned);
    if (!(node.cost >= 0)) node.cost = std::numeric_limits<double>::infinity();
    return node;
  }

  double scene_diagonal_squared_;
  std::vector<Node> nodes_;
};

/// Order of the lights' centres along a Morton curve through their bounds.
std::vector<uint32_t> curve_order(std::span<const ClusterLight> lights) {
  Bounds3 bounds;
  for (const ClusterLight& light : lights)
    if (!light.bounds.empty()) bounds.extend(light.bounds.center());
  const Vec3 size = bounds.upper - bounds.lower;
  std::vector<std::pair<uint64_t, uint32_t>> keys(lights.size());
  for (uint32_t i = 0; i < lights.size(); ++i) {
    const Vec3 offset = lights[i].bounds.empty() ? Vec3{} : lights[i].bounds.center() - bounds.lower;
    uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float x = size[axis] > 0 ? offset[axis] / size[axis] : 0;
      const auto cell = static_cast<uint64_t>(clamp01(x) * 0xfffff);
      for (int bit = 0; bit < 20; ++bit) key |= (cell >> bit & 1) << (3 * bit + axis);
    }
    keys[i] = {key, i};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<uint32_t> order;
  for (const auto& [key, light] : keys) order.push_back(light);
  return order;
}

}  // namespace

LightClusters cluster_lights(std::span<const ClusterLight> lights, uint32_t limit, float scene_diagonal) {
  COVARY_CHECK(limit >= 1, "no clusters");
  const auto n = static_cast<uint32_t>(lights.size());
  LightClusters result;
  result.cluster_of.resize(n);
  if (n <= limit) {
    std::iota(result.cluster_of.begin(), result.cluster_of.end(), 0u);
    result.n_clusters = n;
    return result;
  }
  Builder tree(lights, scene_diagonal);
  // Cut the tree where lights are least similar, until there are `limit` parts.
  using Part = std::pair<double, uint32_t>;
  std::priority_queue<Part> parts;
  const auto push = [&](uint32_t node) {
    parts.emplace(tree.node(node).first == kNone ? -1 : tree.node(node).cost, node);
  };
  push(tree.build(curve_order(lights)));
  while (parts.size() < limit) {
    const Node node = tree.node(parts.top().second);
    parts.pop();
    push(node.first), push(node.second);
  }
  // Number clusters in the order of their first lights.
  std::vector<uint32_t> part_of(n, kNone), number(n, kNone);
  for (; !parts.empty(); parts.pop()) {
    std::vector<uint32_t> todo{parts.top().second};
    const auto part = static_cast<uint32_t>(parts.size() - 1);
    while (!todo.empty()) {
      const uint32_t i = todo.back();
      todo.pop_back();
      if (tree.node(i).first == kNone)
        part_of[i] = part;
      else
        todo.push_back(tree.node(i).first), todo.push_back(tree.node(i).second);
    }
  }
  for (uint32_t i = 0; i < n; ++i) {
    uint32_t& own = number[part_of[i]];
    if (own == kNone) own = result.n_clusters++;
    result.cluster_of[i] = own;
  }
  return result;
}

}  // namespace covary
