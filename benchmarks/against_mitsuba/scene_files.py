# SPDX-License-Identifier: Apache-2.0
"""Scenes of a folder, and a scene file with its film and path length replaced, as text, for Mitsuba.

Both renderers must see the same film. covary takes it from its command line; for Mitsuba the XML is edited in memory,
because not every scene has <default> parameters for it.
"""
import dataclasses
import hashlib
import math
import pathlib
import xml.etree.ElementTree as ET

FILE_NAMES = ("scene_v3.xml", "scene.xml")


class SceneError(Exception):
    """A folder or file that is not a scene; the message says which and why."""


@dataclasses.dataclass(frozen=True)
class Settings:
    """The settings of both renderers. max_depth None: the scene's own."""

    width: int
    height: int
    spp: int
    max_depth: int | None = None


def find(folder, names):
    """Scene files by name: sub-folders of `folder` holding scene_v3.xml or scene.xml, and `names` ending in .xml."""
    found = {}
    if folder is not None:
        for sub in sorted(pathlib.Path(folder).iterdir()):
            for file_name in FILE_NAMES:
                if (sub / file_name).is_file():
                    found[sub.name] = sub / file_name
                    break
    if not names:
        if not found:
            raise SceneError(f"no scene in '{folder}': no sub-folder holds {' or '.join(FILE_NAMES)}")
        return found
    chosen = {}
    for name in names:
        if name.endswith(".xml") and pathlib.Path(name).is_file():
            chosen[pathlib.Path(name).stem] = pathlib.Path(name)
        elif name in found:
            chosen[name] = found[name]
        else:
            raise SceneError(f"no scene '{name}'; '{folder}' holds {', '.join(found) or 'none'}")
    return chosen


def frame_size(path):
    """Width and height of the scene file, with <default> parameters resolved."""
    root = ET.parse(path).getroot()
    defaults = {d.get("name"): d.get("value") for d in root.iter("default")}
    size = {}
    for entry in root.find(".//film").findall("integer"):
        value = entry.get("value")
        size[entry.get("name")] = int(defaults[value[1:]] if value.startswith("$") else value)
    return size["width"], size["height"]


def scaled_size(path, pixels, multiple=8):
    """A frame of about `pixels` pixels and nearly the scene's aspect ratio, both sides divisible by `multiple`.

    A distorted aspect ratio changes the picture (for both renderers), so it counts ten times as much as a missed number
    of pixels."""
    width, height = frame_size(path)

    def cost(size):
        w, h = size
        return 10 * abs(math.log(w * height / (h * width))) + abs(math.log(w * h / pixels))

    sides = range(multiple, 8192 + 1, multiple)
    rounded = (max(multiple, round(w * height / width / multiple) * multiple) for w in sides)
    return min(zip(sides, rounded), key=cost)


def _set_integer(parent, name, value):
    for entry in parent.findall("integer"):
        if entry.get("name") == name:
            entry.set("value", str(value))
            return
    ET.SubElement(parent, "integer", name=name, value=str(value))


def _swap_checkerboards_of_one_channel(root):
    """Mitsuba 3.9.1 shows color1 where color0 belongs if a checkerboard is a weight or an opacity
    (docs/scene-format.md, differences). Exchanging them once more gives both renderers the same picture."""
    for texture in root.iter("texture"):
        colours = [e for e in texture.findall("float") if e.get("name") in ("color0", "color1")]
        if texture.get("type") == "checkerboard":
            for colour in colours:
                colour.set("name", "color1" if colour.get("name") == "color0" else "color0")


def mitsuba_text(path, settings):
    """The scene file with box filter and the film size and path length of `settings`."""
    root = ET.parse(path).getroot()
    _swap_checkerboards_of_one_channel(root)
    film = root.find(".//film")
    for entry in film.findall("rfilter"):
        film.remove(entry)
    ET.SubElement(film, "rfilter", type="box")
    _set_integer(film, "width", settings.width)
    _set_integer(film, "height", settings.height)
    if settings.max_depth is not None:
        _set_integer(root.find("integrator"), "max_depth", settings.max_depth)
    return ET.tostring(root, encoding="unicode")


def fingerprint(text):
    """Eight hex digits that change with the scene text (meshes and textures are not read)."""
    return hashlib.sha256(text.encode()).hexdigest()[:8]
