// SPDX-License-Identifier: Apache-2.0
// The world of a pbrt scene: shapes, lights, objects and their instances. Materials, media and lights are made at the
// end, when all names are known.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "pbrt/pbrt_objects.h"
#include "pbrt/pbrt_surfaces.h"

namespace covary {

/// Material or medium that a directive selects: a definition of its own, or a name, looked up at the end.
struct PbrtUse {
  PbrtDefinitionPtr own;
  std::string name;
  size_t order = 0;
  SourceLocation where;
};
using PbrtUsePtr = std::shared_ptr<const PbrtUse>;

/// AreaLightSource: made once, for all shapes after it.
struct PbrtAreaLight {
  std::string type;
  PbrtParameters parameters;
  bool made = false;
  ObjectPtr light;
};

/// What the directives so far mean for the next shape.
struct PbrtState {
  PbrtPlacement placement;
  PbrtUsePtr material, inside, outside;  ///< null: pbrt's default material, no medium
  std::shared_ptr<PbrtAreaLight> area_light;
  const ColourMatrix* rec709 = nullptr;  ///< of the colour space; null: sRGB
  /// Parameters that Attribute gives to all "shape", "light", "material", "medium", "texture" directives.
  std::map<std::string, std::shared_ptr<const std::vector<PbrtParameter>>> defaults;
};

class PbrtWorld {
 public:
  PbrtWorld(PbrtNames& names, PbrtMessages& messages, ObjectBuilder scene)
      : names_(names), messages_(messages), surfaces_(messages), scene_(std::move(scene)) {}

  void shape(const std::string& type, PbrtParameters& p, const PbrtState& state);
  void light(const std::string& type, PbrtParameters p, const Transform& to_world);
  void begin_object(const std::string& name, const SourceLocation& where);
  /// False if there is none to end.
  bool end_object();
  void place_instance(const std::string& name, const Transform& to_world, const SourceLocation& where);
  /// The medium around the camera.
  void camera_medium(const ObjectBuilder& sensor, const PbrtUsePtr& medium) { camera_ = {sensor, medium}; }
  /// Makes what was only named, and adds everything to the scene.
  void finish(const PbrtView& view);

 private:
  /// A shape whose surface is made at the end.
  struct Pending {
    ObjectBuilder shape;
    PbrtUv uv;
    Value alpha;
    PbrtUsePtr material, inside, outside;
    std::shared_ptr<PbrtAreaLight> light;
    bool in_group = false;
  };
  struct Group {
    ObjectBuilder object;
    std::vector<Pending> shapes;
    bool has_media = false;
  };
  struct Light {
    std::string type;
    PbrtParameters parameters;
    Transform to_world;
    ObjectBuilder place;  ///< in the scene, where it becomes the light
  };

  void add(const ObjectPtr& object);
  bool join_curves(const Pending& shape);
  /// In version 3, shadow rays end at surfaces without a material: what shines from inside of a light is not seen.
  bool is_bare_light(const ObjectPtr& material, const Pending& shape);
  void finish_shape(const Pending& shape, const PbrtView& view);
  void finish_lights(const PbrtView& view);
  /// Several lights from all around become one that holds them.
  void join_skies();
  ObjectPtr area_light(PbrtAreaLight& light, const PbrtView& view);
  /// Null for no use or after an error, which `failed` tells.
  ObjectPtr find(PbrtKind kind, const PbrtUsePtr& use, bool& failed);

  PbrtNames& names_;
  PbrtMessages& messages_;
  PbrtSurfaces surfaces_;
  ObjectBuilder scene_;
  std::vector<Pending> pending_;
  std::vector<Light> lights_;
  std::map<std::string, Group> groups_;
  Group* group_ = nullptr;  ///< the one that has begun
  std::pair<ObjectBuilder, PbrtUsePtr> camera_;
  Pending* curves_ = nullptr;  ///< the last ones, to which following ones of the same kind are joined
  std::set<std::string> reported_;
  size_t n_objects_ = 0;
  bool media_left_out_ = false;
};

}  // namespace covary
