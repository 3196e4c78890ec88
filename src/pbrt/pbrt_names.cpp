// SPDX-License-Identifier: Apache-2.0
#include "pbrt/pbrt_names.h"

#include <fmt/format.h>

#include "pbrt/pbrt_objects.h"

namespace covary {

void PbrtNames::define(PbrtKind kind, const std::string& name, const std::string& type, PbrtParameters parameters,
                       const Transform& to_world) {
  all_[{kind, name}].push_back(
      std::make_shared<PbrtDefinition>(PbrtDefinition{kind, name, type, std::move(parameters), to_world}));
}

PbrtDefinitionPtr PbrtNames::find(PbrtKind kind, const std::string& name, size_t order) const {
  const auto found = all_.find({kind, name});
  if (found == all_.end()) return nullptr;
  PbrtDefinitionPtr best = found->second.front();
  for (const PbrtDefinitionPtr& definition : found->second)
    if (definition->parameters.order() < order) best = definition;
  return best;
}

ObjectPtr PbrtNames::make(PbrtDefinition& definition) {
  if (definition.state == PbrtDefinition::kMade) return definition.object;
  PbrtParameters& p = definition.parameters;
  if (definition.state == PbrtDefinition::kBeingMade || depth_ >= kMaxNesting) {
    p.error(definition.state == PbrtDefinition::kBeingMade ? "refers to itself" : "refers to too many others in a row");
    return nullptr;
  }
  definition.state = PbrtDefinition::kBeingMade;
  if (definition.kind == PbrtKind::kMaterial) p.set_kind(fmt::format("Material \"{}\"", definition.type));
  if (definition.kind == PbrtKind::kMedium) p.set_kind(fmt::format("medium '{}'", definition.type));
  ++depth_;
  ObjectBuilder made;
  if (definition.kind == PbrtKind::kMaterial)
    made = make_pbrt_material(definition.type, p, *this);
  else if (definition.kind == PbrtKind::kMedium)
    made = make_pbrt_medium(definition.type, p, definition.to_world, *this);
  else
    made = make_pbrt_texture(definition.type, p, definition.to_world, *this);
  --depth_;
  if (made)
    p.report_unknown(version_3);
  else
    p.ignore_all();
  if (made && !limit_.add(*made)) made = nullptr;
  if (made && made->id.empty()) made->id = definition.name;
  definition.state = PbrtDefinition::kMade;
  return definition.object = made;
}

std::vector<std::string> PbrtNames::known(PbrtKind kind) const {
  std::vector<std::string> names;
  for (const auto& [key, definitions] : all_)
    if (key.first == kind) names.push_back(key.second);
  return names;
}

void PbrtNames::check_unused() {
  for (const auto& [key, definitions] : all_)
    for (const PbrtDefinitionPtr& definition : definitions) {
      if (definition->state != PbrtDefinition::kOpen) continue;
      Diagnostics found;
      messages_.redirected(found, [&] { make(*definition); });
      if (found.has_errors())
        messages_.warn(definition->parameters.where(),
                       fmt::format("{} cannot be read; nothing uses it", definition->parameters.what()));
    }
}

}  // namespace covary
