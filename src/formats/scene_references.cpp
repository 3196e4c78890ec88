// SPDX-License-Identifier: Apache-2.0
#include "formats/scene_references.h"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_map>

namespace covary {
namespace {

/// Limit on the objects that one may hold with every reference expanded: far above what scenes need.
constexpr size_t kMaxExpanded = 4096;

}  // namespace

void resolve_references(const SceneObjects& objects, ObjectIds ids, const std::vector<SceneAlias>& aliases,
                        Diagnostics& diagnostics) {
  // An alias may name another alias: iterate until nothing changes.
  std::vector<SceneAlias> open = aliases;
  for (bool progress = true; progress && !open.empty();) {
    progress = false;
    std::vector<SceneAlias> left;
    for (const SceneAlias& alias : open) {
      const auto source = ids.find(alias.id);
      if (source == ids.end()) {
        left.push_back(alias);
        continue;
      }
      progress = true;
      const std::shared_ptr<ObjectDescription> object = source->second;
      const auto [other, inserted] = ids.emplace(alias.as, object);
      if (!inserted)
        diagnostics.error(alias.where,
                          fmt::format("id '{}' is used twice; first at {}", alias.as, other->second->where.text()));
    }
    open = std::move(left);
  }
  std::vector<std::string> known;
  for (const auto& entry : ids) known.push_back(entry.first);
  std::sort(known.begin(), known.end());
  for (const SceneAlias& alias : open)
    diagnostics.error(alias.where,
                      fmt::format("alias of the unknown id '{}'{}", alias.id, did_you_mean(alias.id, known)));
  for (const auto& object : objects) {
    for (Property& property : object->properties) {
      const ObjectPtr* reference = std::get_if<ObjectPtr>(&property.value);
      if (!reference || !*reference || (*reference)->kind != "ref") continue;
      const std::string id = (*reference)->id;
      const auto found = ids.find(id);
      if (found == ids.end())
        diagnostics.error(property.where,
                          fmt::format("reference to the unknown id '{}'{}", id, did_you_mean(id, known)));
      property.value = found != ids.end() ? ObjectPtr(found->second) : ObjectPtr();
    }
  }
}

// References can form long chains, and a few objects that each hold another twice expand exponentially. Both are
// detected without recursion and cut, so that later steps can follow references one by one.

std::vector<ObjectDescription*> break_cycles(const SceneObjects& objects, Diagnostics& diagnostics) {
  std::unordered_map<const ObjectDescription*, ObjectDescription*> writable;
  for (const auto& object : objects) writable[object.get()] = object.get();
  std::vector<ObjectDescription*> done;
  enum class State { kOpen, kDone };
  std::unordered_map<const ObjectDescription*, State> states;
  struct Step {
    ObjectDescription* object;
    size_t next;
  };
  for (const auto& start : objects) {
    if (!states.emplace(start.get(), State::kOpen).second) continue;
    std::vector<Step> stack = {{start.get(), 0}};
    while (!stack.empty()) {
      Step& step = stack.back();
      if (step.next == step.object->properties.size()) {
        states[step.object] = State::kDone;
        done.push_back(step.object);
        stack.pop_back();
        continue;
      }
      Property& property = step.object->properties[step.next++];
      ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
      if (!child || !*child) continue;
      const auto [state, fresh] = states.emplace(child->get(), State::kOpen);
      if (fresh) {
        stack.push_back({writable.at(child->get()), 0});
      } else if (state->second == State::kOpen) {
        diagnostics.error(property.where, fmt::format("'{}' refers to itself", (*child)->id));
        child->reset();
      }
    }
  }
  return done;
}

bool ExpansionLimit::add(const ObjectDescription& object) {
  Expanded whole;
  for (const Property& property : object.properties) {
    const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
    if (!child || !*child) continue;
    auto found = expanded_.find(child->get());
    if (found == expanded_.end()) {
      if (!add(**child)) return false;
      found = expanded_.find(child->get());
    }
    whole.count += found->second.count;
    whole.depth = std::max(whole.depth, found->second.depth + 1);
  }
  if (object.kind == "shape") whole.count = 1;  // a group may be large: shapes are visited once
  if (object.kind == "bsdf" && object.type == "twosided") whole.count = 2 * whole.count - 1;  // both sides are visited
  const bool too_deep = whole.depth > max_nesting_, accepted = !too_deep && whole.count <= kMaxExpanded;
  expanded_[&object] = accepted ? whole : Expanded{};
  if (accepted) return true;
  diagnostics_.error(object.where,
                     too_deep ? fmt::format("{} '{}' holds {} objects inside each other when every reference is "
                                            "followed; at most {} are accepted",
                                            object.kind, object.type, whole.depth, max_nesting_)
                              : fmt::format("{} '{}' holds {} objects when every reference is followed; at most {} "
                                            "are accepted",
                                            object.kind, object.type, whole.count, kMaxExpanded));
  return false;
}

void limit_expansion(const std::vector<ObjectDescription*>& objects, size_t max_nesting, Diagnostics& diagnostics) {
  ExpansionLimit limit(max_nesting, diagnostics);
  for (ObjectDescription* object : objects)
    if (object->kind != "scene" && !limit.add(*object))
      for (Property& property : object->properties)
        if (ObjectPtr* child = std::get_if<ObjectPtr>(&property.value)) child->reset();
}

}  // namespace covary
