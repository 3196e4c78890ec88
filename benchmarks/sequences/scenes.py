# SPDX-License-Identifier: Apache-2.0
"""Five sequences made of scenes/room.xml whose motion is known exactly: a moving camera, a turning box and its shadow,
a turning mirror, a lamp that is dimmed, and one in which nothing moves. A sixth moves the camera through Bitterli's
Kitchen, if --kitchen names its file.

NAME_0001.xml, NAME_0002.xml, … are static scenes, one for each frame. The references are renders of these, so that a
bug in the interpolation of motion shows as an error. A renderer of sequences takes one scene NAME.xml, with
<animation>s of box and mirror and a camera path camera.json beside it; for `lamp` it takes the scenes of the frames."""
import copy
import json
import math
from pathlib import Path
from xml.etree import ElementTree

import numpy

ROOM = Path(__file__).resolve().parents[2] / "scenes/room.xml"
NAMES = ["camera", "still", "box", "mirror", "lamp"]
#: origin and target at the first frame and at the last one, whatever their number
ENDS = {"camera": (((0.5, 1.45, 3.8), (-0.1, 0.95, -1)), ((-0.2, 1.35, 3.0), (0.3, 1.0, -1))),
        "kitchen": (((1.211, 1.80475, 3.85239), (-0.541, 1.638, 0.261)), ((1.17, 1.784, 3.315), (-0.35, 1.6, 0.2)))}


def part_of(frame, frames):
    """The fraction of the sequence that has passed, 0 to 1. Frames count from 1."""
    return (frame - 1) / max(1, frames - 1)


def fov(name):
    """The camera's horizontal field of view in degrees."""
    return 60 if name == "kitchen" else 54


def translate(x, y, z):
    matrix = numpy.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def scale(x, y, z):
    return numpy.diag([x, y, z, 1.0])


def rotate_y(degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    matrix = numpy.eye(4)
    matrix[0, 0], matrix[0, 2], matrix[2, 0], matrix[2, 2] = c, s, -s, c
    return matrix


def look_at(origin, target, up=(0, 1, 0)):
    """The matrix from camera to world space in Mitsuba's convention: x to the left of the image, y up, z along the
    view."""
    view = numpy.subtract(target, origin) / numpy.linalg.norm(numpy.subtract(target, origin))
    left = numpy.cross(up, view) / numpy.linalg.norm(numpy.cross(up, view))
    matrix = numpy.eye(4)
    matrix[:3] = numpy.stack([left, numpy.cross(view, left), view, origin], axis=1)
    return matrix


def camera(name, frame, frames):
    """The matrix from camera to world space; a camera that does not move has the room's own."""
    t = part_of(frame, frames) if name in ENDS else 0
    ends = [[numpy.array(point) for point in end] for end in ENDS.get(name, ENDS["camera"])]
    return look_at(*((1 - t) * first + t * last for first, last in zip(*ends)))


def box(frame, frames):
    """A quarter of a turn on the floor, 1.2 m to the right, through the light of the window."""
    t = part_of(frame, frames)
    return translate(-0.55 + 1.2 * t, 0.2, 0.5) @ rotate_y(90 * t) @ scale(0.2, 0.2, 0.2)


def mirror(frame, frames):
    """A standing mirror, which turns by 30 degrees."""
    return translate(1.2, 1.0, 0.6) @ rotate_y(-60 + 30 * part_of(frame, frames)) @ scale(0.4, 0.8, 1)


def dimming(frame, frames):
    """The fraction of the lamp's radiance that is left; it falls to a tenth."""
    return 10 ** -part_of(frame, frames)


def text_of(matrix):
    return ", ".join(f"{value:.9g}" for value in matrix.ravel())


#: shapes that move: what they are, and their matrices to the world
MOVING = {"box": ("cube", "wood", box), "mirror": ("rectangle", "silver", mirror)}


def add_shape(root, name):
    """Adds the shape that moves in the sequence, which has yet to be placed, and returns it."""
    kind, bsdf, _ = MOVING[name]
    shape = ElementTree.SubElement(root, "shape", type=kind)
    ElementTree.SubElement(shape, "ref", id=bsdf)
    return shape


def place(parent, matrix, **attributes):
    transform = ElementTree.SubElement(parent, "transform", attributes)
    ElementTree.SubElement(transform, "matrix", value=text_of(matrix))


def animate(shape, move, frames):
    animation = ElementTree.SubElement(shape, "animation", name="to_world")
    for frame in range(1, frames + 1):
        place(animation, move(frame, frames), time=str(frame))


def set_camera(root, matrix):
    transform = root.find("sensor/transform")
    transform.clear()
    transform.set("name", "to_world")
    ElementTree.SubElement(transform, "matrix", value=text_of(matrix))


def dim_lamp(root, factor):
    radiance = root.find("shape[@type='sphere']/emitter/rgb")
    values = [float(value) * factor for value in radiance.get("value").split(",")]
    radiance.set("value", ", ".join(f"{value:.9g}" for value in values))


def scene_of(room, name, frame, frames):
    """The room at this frame."""
    root = copy.deepcopy(room)
    set_camera(root, camera(name, frame, frames))
    if name in MOVING:
        place(add_shape(root, name), MOVING[name][2](frame, frames), name="to_world")
    if name == "lamp":
        dim_lamp(root, dimming(frame, frames))
    return root


def camera_path(name, frames):
    """What --camera-path reads."""
    return {"keyframes": [{"time": frame, "to_world": camera(name, frame, frames).tolist()}
                          for frame in range(1, frames + 1)]}


def still_name(name, frame):
    return f"{name}_{frame:04d}.xml"


def scene_file(path):
    """A scene whose textures and shapes are found from any folder."""
    root = ElementTree.parse(path).getroot()
    for name in root.iterfind(".//string[@name='filename']"):
        name.set("value", str((path.parent / name.get("value")).resolve()))
    return root


def write_sequence(name, frames, folder, kitchen=None):
    """Writes a sequence's files. Returns the name of the scene, or the pattern of names, that a renderer of sequences
    takes. `kitchen`: the scene file of that sequence."""
    room = scene_file(kitchen if name == "kitchen" else ROOM)
    for frame in range(1, frames + 1):
        ElementTree.ElementTree(scene_of(room, name, frame, frames)).write(folder / still_name(name, frame))
    if name == "lamp":
        return "lamp_####.xml", []
    root = scene_of(room, "still" if name in MOVING else name, 1, frames)
    if name in MOVING:
        animate(add_shape(root, name), MOVING[name][2], frames)
    ElementTree.ElementTree(root).write(folder / f"{name}.xml")
    if name not in ENDS:
        return f"{name}.xml", []
    path = folder / f"{name}.json"
    path.write_text(json.dumps(camera_path(name, frames), indent=1) + "\n")
    return f"{name}.xml", ["--camera-path", path]
