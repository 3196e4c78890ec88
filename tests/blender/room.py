# SPDX-License-Identifier: Apache-2.0
"""A closed room with an area light, a mirror and matt objects, in any Blender."""


def material(bpy, colour, metallic=0.0, roughness=1.0):
    made = bpy.data.materials.new("material")
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Metallic"].default_value = metallic
    shader.inputs["Roughness"].default_value = roughness
    return made


def build_room(bpy, reset=True):
    """A box around the camera, in place of all that is there; with `reset` also of the preferences."""
    if reset:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.context.object.data.materials.append(material(bpy, (0.7, 0.6, 0.5)))
    for x, look in ((-0.7, ((0.8, 0.2, 0.1), 0.0, 1.0)), (0.7, ((0.9, 0.9, 0.9), 1.0, 0.2))):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(x, 0.6, -1.4))
        bpy.context.object.data.materials.append(material(bpy, *look))
    bpy.ops.object.light_add(type="AREA", location=(0.5, -0.5, 1.9))
    bpy.context.object.data.energy, bpy.context.object.data.size = 60, 1
    bpy.ops.object.camera_add(location=(0, -1.9, 0), rotation=(1.45, 0, 0))
    bpy.context.object.data.lens = 20
    scene.camera = bpy.context.object
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 80, 48, 100
    scene.cycles.device = "CPU"
    return scene


def settings_of(scene):
    return {(owner.rna_type.name, p.identifier): str(getattr(owner, p.identifier))
            for owner in (scene, scene.cycles, scene.render, scene.render.image_settings)
            for p in owner.rna_type.properties if p.type in ("BOOLEAN", "INT", "FLOAT", "ENUM", "STRING")}
