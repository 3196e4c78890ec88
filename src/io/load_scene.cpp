// SPDX-License-Identifier: Apache-2.0
// From a scene file to a Scene: the XML is read; then everything that reads files (textures, environment maps, meshes)
// is created in parallel; then the rest is assembled in file order. Problems are collected throughout and thrown once.
#include "io/load_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <unordered_set>

#include "core/content_hash.h"
#include "core/memory_limit.h"
#include "core/stopwatch.h"
#include "formats/file_resolver.h"
#include "io/default_sensor.h"
#include "io/media.h"
#include "io/nested_integrator.h"
#include "io/object_factory.h"
#include "io/scene_formats.h"
#include "io/scene_jobs.h"
#include "io/sensor.h"
#include "io/shapes.h"
#include "io/thin_shapes.h"
#include "scene/mesh.h"

namespace covary {
namespace {

class Loader {
 public:
  Loader(const LoadOptions& options, LoadedScene& result) : options_(options), result_(result) {}

  void load(std::string_view text, const std::string& name) {
    const Stopwatch watch;
    xml_ = read_scene_file({text, name, options_.defines, options_.time}, files_, diagnostics_);
    result_.is_animated = xml_.is_animated;
    is_model_ = scene_format_of(name).holds_models;
    sensor_ = chosen_sensor(*xml_.scene, options_.view, diagnostics_);
    jobs_.collect(*xml_.scene);
    jobs_.run(diagnostics_);
    assemble();
    for (const auto& file : files_.files()) result_.files.push_back(file.first);
    SceneView v = options_.view;  // the camera that is used without a name is no other by its name
    if (const ObjectPtr first = first_sensor(*xml_.scene); first ? sensor_ == first : is_model_) v.camera.clear();
    result_.files_hash = result_.content_hash = files_.content_hash(hash_text(xml_.hash) + text_of(v, result_.added));
    result_.warnings = diagnostics_.warnings();
    diagnostics_.throw_if_errors();
    require_table_memory(name, parts_);
    result_.read_seconds = watch.seconds();
    result_.has_delta_lights_and_surfaces = has_delta_lights_and_surfaces(parts_);
    result_.scene = std::make_unique<Scene>(std::move(parts_));
    result_.scene->move_to(sensor_made_->shutter_open);
    const auto name_of = [&](const Shape& shape) { return names_[&shape]; };
    warn_of_thin_shapes(*result_.scene, name_of, result_.warnings);
  }

 private:
  void assemble() {
    held_ = held_objects(*xml_.scene);
    for (const Property& property : xml_.scene->properties) {
      const ObjectPtr* pointer = std::get_if<ObjectPtr>(&property.value);
      if (!pointer) {
        diagnostics_.unknown(property.where, fmt::format("parameter '{}' of <scene>", property.name), "");
      } else if (*pointer && placed_.insert(pointer->get()).second) {
        place(*pointer);
      }
    }
    if (!integrator_) {  // as in Mitsuba
      auto description = std::make_shared<ObjectDescription>();
      description->kind = "integrator", description->type = "path", description->where = xml_.scene->where;
      place_integrator(description);
    }
    complete_view();
    jobs_.append_diagnostics_of_shapes(diagnostics_);
    degenerate_.tell(diagnostics_);
    if (!sensor_ && !diagnostics_.has_errors())
      diagnostics_.error(xml_.scene->where, is_model_ ? "no triangles, and no camera" : "the scene has no sensor");
    if (sensor_made_) set_up_camera(*sensor_made_);
  }

  /// Adds what the caller wants to see that the file does not have: a camera, surroundings.
  void complete_view() {
    const SceneView& view = options_.view;
    const SourceLocation where{xml_.scene->where.file, 0, 0};
    Orientation orientation = orientation_of(is_model_ || !sensor_made_ ? nullptr : &sensor_made_->camera);
    const Bounds3 bounds = bounds_of(parts_);
    if (!sensor_ && !bounds.empty() && (view.camera == "auto" || view.camera.empty())) {
      const ObjectPtr like = first_sensor(*xml_.scene);
      const auto made = like ? std::dynamic_pointer_cast<const SensorSettings>(factory_.make(like)) : nullptr;
      if (!is_model_ && made) orientation = orientation_of(&made->camera);
      const float aspect = aspect_of(made.get(), options_.width, options_.height);
      sensor_ = !is_model_ && view.camera.empty() ? default_sensor(*xml_.scene, bounds, diagnostics_)
                                                  : framed_sensor(bounds, orientation, like.get(), aspect, where);
      sensor_made_ = std::dynamic_pointer_cast<const SensorSettings>(factory_.make(sensor_));
      result_.added.push_back(sensor_);
      if (is_model_ && view.camera.empty()) diagnostics_.warn(where, kFramed);
    }
    result_.sensor = sensor_;
    if (!sensor_made_) return;
    const Surroundings around = surroundings(view, parts_, sensor_made_->camera, orientation, is_model_, where);
    for (const ObjectPtr& object : around.objects) {
      if (object->kind == "shape") jobs_.make_shape(object);
      place(object);
      result_.added.push_back(object);
    }
    if (!around.told.empty()) diagnostics_.warn(where, around.told);
    if (view.background)
      parts_.background = std::dynamic_pointer_cast<const Emitter>(
          factory_.make(make_object("emitter", "constant", where, {{"radiance", ColourValue{*view.background}}})));
  }

  void place(const ObjectPtr& object) {
    const std::string& kind = object->kind;
    if (kind == "shape") {
      if (object->type == "shapegroup") {
        group(object);
      } else if (object->type == "instance") {
        place_instance(object);
      } else {
        ShapeJob& job = *jobs_.shape(object.get());
        finish_shape(job);
        if (job.shape && job.to_world)
          place_copy(copies_of(job.shape, job.light, object->where), *job.shape, Transform(), job.to_world);
        else if (job.shape)
          parts_.shapes.push_back(job.shape);
      }
    } else if (kind == "emitter") {
      place_emitter(object);
    } else if (kind == "sensor") {
      if (object == sensor_) sensor_made_ = std::dynamic_pointer_cast<const SensorSettings>(factory_.make(object));
    } else if (kind == "integrator") {
      place_integrator(object);
    } else if (kind == "bsdf" || kind == "texture" || is_part_of_media(kind)) {
      factory_.make(object);  // even unused ones, so that their errors are found
    } else if ((kind == "sampler" || kind == "film" || kind == "rfilter") && !object->id.empty()) {
      factory_.make(object);
      if (!held_.contains(object.get())) warn_unused(*object);
    } else {
      diagnostics_.unknown(object->where, fmt::format("part <{}> of <scene>", kind), "");
    }
  }

  void finish_shape(ShapeJob& job) {
    Parameters& p = job.parameters;
    const auto bsdfs = p.children<Bsdf>("bsdf");
    if (bsdfs.size() > 1) p.error(fmt::format("has {} bsdfs; expected one", bsdfs.size()));
    const auto emitters = p.children<Emitter>("emitter");
    if (emitters.size() > 1) p.error(fmt::format("has {} emitters; expected one", emitters.size()));
    const ShapeMedia media = read_media(p, job.in_group);
    if (job.asked_everything) p.report_unknown();
    if (!job.shape) return;
    names_[job.shape.get()] = fmt::format("{}: shape '{}'", job.description->where.text(), job.description->type);

    for (const std::string& name : wanted_attributes(*job.description))
      if (!job.shape->has_attribute(name))
        p.warn(fmt::format("has no attribute '{}' for a texture 'mesh_attribute', which is white there", name));
    if (!emitters.empty()) require_emission(p, *job.shape);
    job.shape->set_bsdf(bsdfs.empty() ? default_bsdf(!emitters.empty()) : bsdfs[0]);
    use_media(media, p, *job.shape, bsdfs.empty(), parts_);
    if (!emitters.empty()) {
      const auto* area = dynamic_cast<const AreaLight*>(emitters[0].get());
      if (!area) {
        p.error("only an emitter 'area' can be part of a shape");
      } else if (job.in_group || job.to_world) {
        job.light = area;
      } else {
        const std::shared_ptr<AreaLight> light = area->clone();
        light->attach(job.shape.get());
        job.shape->set_emitter(light);
        parts_.emitters.push_back(light);
      }
    }
    degenerate_.see(*job.shape, job.description->where);
  }

  /// Adds the copy of `original` at `to_world`, or one moved by `animation`.
  void place_copy(std::function<ShapePtr(const Transform&)> copy_to, const Shape& original, const Transform& to_world,
                  const KeyedTransformPtr& animation) {
    try {
      const ShapePtr shape = copy_to(animation ? animation->at(0) : to_world);
      if (animation) parts_.movements.push_back({animation, parts_.shapes.size(), std::move(copy_to)});
      names_[shape.get()] = names_[&original];
      if (shape->emitter()) parts_.emitters.push_back(shape->shared_emitter());
      parts_.shapes.push_back(shape);
    } catch (const Error& error) {
      diagnostics_.error({}, error.what());
    }
  }

  /// BSDF of shapes that specify none, as in Mitsuba: diffuse with reflectance 0.5, or black if the shape emits light.
  BsdfPtr default_bsdf(bool emits) {
    DefaultBsdf& made = default_bsdfs_[emits];
    if (!made.bsdf) {
      auto description = std::make_shared<ObjectDescription>();
      description->kind = "bsdf", description->type = "diffuse", description->where = xml_.scene->where;
      if (emits) description->properties.push_back({"reflectance", 0.0, xml_.scene->where});
      made.description = description;
      made.bsdf = std::dynamic_pointer_cast<const Bsdf>(factory_.make(made.description));
    }
    return made.bsdf;
  }

  /// The shape group of a description; each is created once.
  std::shared_ptr<const ShapeGroup> group(const ObjectPtr& object) {
    std::shared_ptr<const SceneObject> made;
    if (made_.find(object.get(), made)) return std::dynamic_pointer_cast<const ShapeGroup>(made);
    auto shapes = std::make_shared<ShapeGroup>();
    for (const Property& property : object->properties) {
      const ObjectPtr* member = std::get_if<ObjectPtr>(&property.value);
      if (member && !*member) continue;
      ShapeJob* job = member ? jobs_.shape(member->get()) : nullptr;
      if (!job) {
        const bool shape = member && (*member)->kind == "shape";
        diagnostics_.error(property.where, shape
                                               ? fmt::format("a shapegroup cannot hold a shape '{}', only shapes that "
                                                             "have a surface of their own",
                                                             (*member)->type)
                                               : "a shapegroup can hold shapes only");
        continue;
      }
      finish_shape(*job);
      if (!job->shape) continue;
      if (job->light)
        group_lights_[shapes.get()].push_back({job->shape, job->light});
      else
        shapes->shapes.push_back(job->shape);
    }
    if (shapes->shapes.empty() && group_lights_[shapes.get()].empty())
      diagnostics_.error(object->where, "shape 'shapegroup': holds no shape");
    made_.add(object.get(), shapes);
    return shapes;
  }

  /// Called before the first instance of a group with emissive shapes: throws if the copies for all instances need too
  /// much memory.
  void check_copies(const ObjectDescription& instance, const ShapeGroup& group) {
    const auto lights = group_lights_.find(&group);
    if (lights == group_lights_.end() || !groups_checked_.insert(&group).second) return;
    const size_t n = n_instances_alike(*xml_.scene, instance);
    double bytes = 0;
    for (const GroupLight& light : lights->second) bytes += array_bytes(*light.shape) + table_bytes(*light.shape, true);
    require_memory(instance.where.text(),
                   fmt::format("{} instances of a shapegroup, of whose shapes those that emit light are copied,", n),
                   static_cast<double>(n) * bytes);
  }

  void place_instance(const ObjectPtr& object) {
    Parameters p(*object, factory_, diagnostics_);
    // Groups are created by the loader, not by the factory: register them before asking for children.
    for (const Property& property : object->properties)
      if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value))
        if (*child && (*child)->kind == "shape" && (*child)->type == "shapegroup") group(*child);
    Instance instance;
    const KeyedTransformPtr animation = p.find_animation("to_world");
    instance.to_world = animation ? animation->at(0) : p.get_transform("to_world");
    const bool only_groups =
        std::all_of(object->properties.begin(), object->properties.end(), [](const Property& property) {
          const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
          return !child || !*child || (*child)->kind != "shape" || (*child)->type == "shapegroup";
        });
    if (!only_groups) {
      p.error("must refer to a shapegroup");
      return;
    }
    const auto groups = p.children<ShapeGroup>("shape");
    p.report_unknown();
    if (groups.size() != 1) {
      p.error(fmt::format("refers to {} shapegroups; expected one", groups.size()));
      return;
    }
    check_copies(*object, *groups[0]);
    // Emissive shapes are copied, so that each copy is a light with its own area and position.
    for (const GroupLight& member : group_lights_[groups[0].get()])
      place_copy(copies_of(member.shape, member.light, object->where), *member.shape, instance.to_world, animation);
    instance.group = groups[0];
    if (instance.group->shapes.empty()) return;
    if (animation) parts_.movements.push_back({animation, parts_.instances.size(), {}});
    parts_.instances.push_back(std::move(instance));
  }

  void place_emitter(const ObjectPtr& object) {
    const auto emitter = std::dynamic_pointer_cast<const Emitter>(factory_.make(object));
    if (!emitter) return;
    if (dynamic_cast<const AreaLight*>(emitter.get())) {
      if (object->id.empty())
        diagnostics_.error(
            object->where,
            "emitter 'area' must stand inside the shape that emits, or have an id to which shapes refer");
      else if (!held_.contains(object.get()))
        warn_unused(*object);
      return;
    }
    if (emitter->is_environment()) {
      if (options_.view.replaces_environment() && !object->where.file.empty() && object->where.line > 0) {
        diagnostics_.warn(object->where, "this light from all around is replaced (`environment`)");
        return;
      }
      if (environment_)
        diagnostics_.error(object->where,
                           "a second emitter at infinity; the first is at " + environment_->where.text());
      environment_ = object;
    }
    parts_.emitters.push_back(emitter);
  }

  void warn_unused(const ObjectDescription& object) {
    diagnostics_.warn(object.where, fmt::format("{} '{}' is not used: nothing refers to the id '{}'", object.kind,
                                                object.type, object.id));
  }

  void place_integrator(const ObjectPtr& outer) {
    if (held_.contains(outer.get())) return;  // wrapped by another one
    const ObjectPtr object = rendered_integrator(outer, diagnostics_);
    if (!object) return;
    if (integrator_) {
      diagnostics_.error(object->where, "a second integrator; the first is at " + integrator_->where.text());
      return;
    }
    integrator_ = object;
    ObjectDescription changed = *object;
    name_path(changed, *xml_.scene, diagnostics_);
    result_.integrator_type = changed.type;
    if (!options_.make_integrator) return;
    for (const Property& property : options_.integrator_properties) {
      std::erase_if(changed.properties, [&](const Property& p) { return p.name == property.name; });
      changed.properties.push_back(property);
    }
    Parameters p(changed, factory_, diagnostics_);
    result_.integrator = make_checked(p, options_.make_integrator);
  }

  void set_up_camera(const SensorSettings& sensor) {
    if (sensor.medium) use_camera_medium(sensor.medium, *sensor_, parts_);
    FilmSettings film = sensor.film;
    if (options_.width > 0 || options_.height > 0) {
      if (options_.width > 0) film.width = options_.width;
      if (options_.height > 0) film.height = options_.height;
      film.crop_x = film.crop_y = 0, film.crop_width = film.width, film.crop_height = film.height;
    }
    result_.width = film.width, result_.height = film.height;
    result_.crop_x = film.crop_x, result_.crop_y = film.crop_y;
    result_.crop_width = film.crop_width, result_.crop_height = film.crop_height;
    result_.filter = film.filter, parts_.film_response = film.response;
    result_.spp = sensor.sampler.sample_count;
    result_.sampler_type = sensor.sampler.type;
    result_.camera_to_world = sensor.to_world;
    if (sensor.shutter_close > sensor.shutter_open && (sensor.to_world || !parts_.movements.empty()))
      options_.ignore_unknown ? diagnostics_.warn(sensor_->where, told_of_blur(sensor))
                              : diagnostics_.error(sensor_->where, told_of_blur(sensor));
    try {
      result_.camera = std::make_shared<Camera>(sensor.camera, film.width, film.height);
      parts_.camera = result_.camera;
    } catch (const Error& error) {
      diagnostics_.error(sensor_->where, fmt::format("sensor '{}': {}", sensor_->type, error.what()));
    }
  }

  const LoadOptions& options_;
  LoadedScene& result_;
  Diagnostics diagnostics_{options_.ignore_unknown};
  FileResolver files_;
  MadeObjects made_;
  SceneFactory factory_{made_, files_, diagnostics_};
  SceneXml xml_;
  SceneJobs jobs_{made_, files_, options_.ignore_unknown};
  std::unordered_set<const ObjectDescription*> placed_;
  std::unordered_set<const ObjectDescription*> held_;  // by objects other than the scene
  SceneParts parts_;
  struct GroupLight {
    ShapePtr shape;
    const AreaLight* light;
  };
  std::map<const ShapeGroup*, std::vector<GroupLight>> group_lights_;
  std::set<const ShapeGroup*> groups_checked_;
  struct DefaultBsdf {
    ObjectPtr description;
    BsdfPtr bsdf;
  };
  DefaultBsdf default_bsdfs_[2];  // of non-emissive and emissive shapes
  ObjectPtr sensor_, integrator_, environment_;
  bool is_model_ = false;
  std::shared_ptr<const SensorSettings> sensor_made_;
  std::map<const Shape*, std::string> names_;  // place in the file and type
  DegenerateTriangles degenerate_;
};

}  // namespace

LoadedScene load_scene_text(std::string_view xml, const std::string& name, const LoadOptions& options) {
  LoadedScene result;
  Loader(options, result).load(xml, name);
  return result;
}

LoadedScene load_scene(const std::string& path, const LoadOptions& options) {
  return load_scene_text(FileView(path).text(), path, options);
}

}  // namespace covary
