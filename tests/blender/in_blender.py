# SPDX-License-Identifier: Apache-2.0
"""in_blender.py CASE ADDON.zip FOLDER: what addon_test.py has Blender do, as `blender --python`, or by the package bpy.
Ends with an exit code other than 0 where something is not as it must be."""
import importlib
import os
import shutil
import sys
import traceback
from pathlib import Path
from types import SimpleNamespace

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from room import build_room, settings_of  # noqa: E402

CASE, ADDON, FOLDER = sys.argv[-3:]
MODULE = "covary_addon" if bpy.app.version < (4, 2, 0) else "bl_ext.user_default.covary"


def install():
    """As from Blender's window."""
    if bpy.app.version < (4, 2, 0):
        bpy.ops.preferences.addon_install(filepath=ADDON)
        assert bpy.ops.preferences.addon_enable(module=MODULE) == {"FINISHED"}
    else:
        bpy.ops.extensions.package_install_files(filepath=ADDON, repo="user_default", enable_on_install=True)
    assert MODULE in bpy.context.preferences.addons, "the add-on is not enabled"


def small_room():
    scene = build_room(bpy, reset=False)
    scene.render.resolution_x, scene.render.resolution_y, scene.covary.samples = 24, 16, 72
    scene.render.filepath = FOLDER + "/"
    return scene


def message_of(scene, **arguments):
    """The sentence that the operator says when it refuses."""
    before = settings_of(scene)
    try:
        bpy.ops.render.covary(**arguments)
    except RuntimeError as error:
        text = str(error).strip()
        assert text.count("\n") == 0 and "Traceback" not in text, text
        assert settings_of(scene) == before and not bpy.context.window_manager.covary.running
        return text
    raise AssertionError("nothing was refused")


def picture():
    """A picture, in the image "covary" and in a file, with the settings as before; another seed, another one."""
    scene = small_room()
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "VIDEO"
    scene.covary.samples = 73
    assert scene.covary.samples == 96, "rounded up to whole groups"
    before = settings_of(scene)
    assert bpy.ops.render.covary() == {"FINISHED"}
    file = Path(FOLDER) / "covary_0001.exr"
    first = file.read_bytes()
    assert settings_of(scene) == before
    image = bpy.data.images["covary"]
    assert tuple(image.size) == (24, 16) and image.is_float and Path(image.filepath) == file
    text = bpy.context.window_manager.covary.text
    assert str(file) in text and "Predicted error (relMSE) 0." in text, text
    scene.covary.seed, scene.covary.denoise = 1, "balanced"
    assert bpy.ops.render.covary() == {"FINISHED"}
    assert b"mixture --denoise auto" in first and b"iicv --denoise balanced" in file.read_bytes()
    assert [image.name for image in bpy.data.images if image.name.startswith("covary")] == ["covary"]
    assert not list(Path(bpy.app.tempdir).glob("covary-*")), "temporary files are left"


def plain_worlds():
    """All white, which looks clipped, and all black, where nothing has an error."""
    scene = small_room()
    for thing in [thing for thing in bpy.data.objects if thing.type != "CAMERA"]:
        bpy.data.objects.remove(thing)
    scene.world.use_nodes = True
    for value in (1, 0):
        scene.world.node_tree.nodes["Background"].inputs[0].default_value = (value, value, value, 1)
        assert bpy.ops.render.covary() == {"FINISHED"}
        assert bpy.data.images["covary"].pixels[:3] == (value, value, value)


def animation():
    """All frames, with noise of their own, and the current frame as before."""
    scene = small_room()
    scene.frame_start, scene.frame_end = 3, 4
    assert bpy.ops.render.covary(animation=True) == {"FINISHED"}
    assert sorted(file.name for file in Path(FOLDER).iterdir()) == ["covary_0003.exr", "covary_0004.exr"]
    assert scene.frame_current == 1
    values = [bpy.data.images.load(str(file)).pixels[:] for file in sorted(Path(FOLDER).iterdir())]
    assert values[0] != values[1]


def refused():
    """Sentences, never a traceback."""
    scene = small_room()
    camera, scene.camera = scene.camera, None
    assert "has no camera" in message_of(scene)
    scene.camera = camera
    scene.render.engine = "BLENDER_WORKBENCH"
    assert "only Cycles has common random numbers" in message_of(scene)
    scene.render.engine = "CYCLES"
    scene.render.filepath = "//picture"
    assert "has not been saved" in message_of(scene)
    scene.render.filepath = ADDON + "/below/a/file/"
    assert "cannot be written" in message_of(scene) and "output path" in message_of(scene)
    scene.render.filepath = FOLDER + "/"
    cycles = importlib.import_module(MODULE + "._cycles")
    cycles.OLDEST = (99, 1, 0)
    assert message_of(scene).endswith("99.1 or newer is needed")
    cycles.OLDEST = (3, 4, 0)
    jobs = importlib.import_module(MODULE + ".jobs")
    jobs.shutil = SimpleNamespace(disk_usage=lambda path: SimpleNamespace(free=5000))
    assert "has 0 MiB left" in message_of(scene)
    jobs.shutil = shutil
    preferences = bpy.context.preferences.addons[MODULE].preferences
    preferences.program = "/nowhere/covary"
    assert "there is no program '/nowhere/covary'" in message_of(scene)
    failing = Path(FOLDER) / "failing"
    failing.write_text("#!/bin/sh\n[ $1 = --version ] && echo covary 9 && exit\necho covary: out of luck >&2\nexit 1\n")
    failing.chmod(0o755)
    preferences.program = str(failing)
    assert message_of(scene).endswith("out of luck")
    failing.write_text("#!/bin/sh\necho 'covary: libmissing.so: cannot open' >&2\nexit 127\n")
    assert "does not run: libmissing.so: cannot open" in message_of(scene)
    failing.unlink()
    assert not list(Path(FOLDER).iterdir())


def missing_program():
    assert "the program covary is missing: install it" in message_of(small_room())


def disabled():
    bpy.ops.preferences.addon_disable(module=MODULE)
    assert not hasattr(bpy.types.Scene, "covary") and not hasattr(bpy.types, "RENDER_PT_covary")


def seen_in_window():
    """What a window shows, from step to step: a generator that goes on when Blender has handled its events."""
    scene, state = small_room(), bpy.context.window_manager.covary
    for area in bpy.context.screen.areas:  # what is slow to draw without a graphics card
        if area.type in ("VIEW_3D", "OUTLINER", "DOPESHEET_EDITOR"):
            area.type = "INFO"
    properties = next(area for area in bpy.context.screen.areas if area.type == "PROPERTIES")
    properties.spaces.active.context = "RENDER"
    region = next(region for region in properties.regions if region.type == "WINDOW")
    before, file = settings_of(scene), Path(FOLDER) / "covary_0001.exr"

    def press():
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=properties, region=region):
            assert bpy.ops.render.covary("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
            assert message_of_running(bpy.ops.render.covary) == "covary: renders already"

    yield
    press()
    shares = set()
    while state.running:  # the window is not frozen meanwhile
        shares.add(state.progress)
        yield
    assert len(shares) > 3 and settings_of(scene) == before, shares
    assert file.exists() and str(file) in state.text, state.text
    shown = [area.spaces.active.image.name for window in bpy.context.window_manager.windows
             for area in window.screen.areas if area.type == "IMAGE_EDITOR"]
    assert shown == ["covary"], shown
    assert bpy.context.preferences.view.render_display_type == "WINDOW"
    file.unlink()
    scene.covary.samples = 240
    yield
    press()
    while state.progress < 20:
        yield
    assert bpy.ops.render.covary_cancel() == {"FINISHED"}
    while state.running:
        yield
    assert state.text == "Cancelled; the settings are as before" and settings_of(scene) == before and not file.exists()


def message_of_running(operator):
    try:
        operator("INVOKE_DEFAULT")
    except RuntimeError as error:
        return str(error).strip().removeprefix("Error: ")
    return ""


def window():
    steps = seen_in_window()

    def step():
        try:
            next(steps)
            return 0.05
        except StopIteration:
            print("as it must be", flush=True)
            os._exit(0)
        except BaseException:  # noqa: BLE001  a timer's exception would end nothing
            traceback.print_exc()
            os._exit(3)

    bpy.app.timers.register(step, first_interval=1)


install()
globals()[CASE]()
if CASE != "window":
    print("as it must be", flush=True)
if sys.argv[0] == __file__:
    os._exit(0)  # the package bpy 4.2 crashes at its end wherever a class with a method was registered
