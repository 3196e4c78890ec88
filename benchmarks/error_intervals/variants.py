# SPDX-License-Identifier: Apache-2.0
"""The scenes that error intervals are fitted to: those of scenes/, easy and hard variants of them, and random rooms
(random_rooms.py). In variants, cameras are turned, lights are small, dim or bright, windows are narrow, glass covers
lights, and rooms are lit through a gap."""
from pathlib import Path

from random_rooms import random_room

PARTITION = """<shape type="cube">
    <transform name="to_world"><scale x="0.03" y="1.3" z="{depth}"/><translate x="-1.2" y="1.3" z="{z}"/></transform>
    <ref id="plaster"/></shape>
</scene>"""
PANE = """<shape type="cube">
    <transform name="to_world"><scale x="0.01" y="0.6" z="0.75"/><translate x="-1.9" y="1.55" z="-0.4"/></transform>
    <ref id="glass"/></shape>
</scene>"""
BALLS = "".join(f"""<shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/>
    <float name="radius" value="0.2"/><ref id="{material}"/></shape>""" for x, y, z, material in [
        (-0.9, 0.2, 1.3, "glass"), (-0.4, 0.2, 1.6, "silver"), (0.1, 0.2, 1.4, "glass"), (0.6, 0.2, 1.7, "brass"),
        (1.1, 0.2, 1.2, "glass"), (-0.1, 0.55, 1.5, "glass")]) + "\n</scene>"
HOLE = """<shape type="cube">
    <transform name="to_world"><scale x="0.02" y="{half}" z="1.5"/><translate x="-1.9" y="{y}" z="-0.4"/></transform>
    <ref id="plaster"/></shape>
"""


def changed(*pairs):
    """Replaces texts that must occur at least once."""
    def change(text):
        for old, new in pairs:
            assert old in text, old
            text = text.replace(old, new)
        return text
    return change


def window(scale, radiance):
    return ('<scale x="0.7" y="0.55"/>', f'<scale x="{0.7 * scale:g}" y="{0.55 * scale:g}"/>'), \
           ('value="5, 5.8, 7"', f'value="{5 * radiance:g}, {5.8 * radiance:g}, {7 * radiance:g}"')


def view(origin, target, old='origin="0.5, 1.45, 3.8" target="-0.1, 0.95, -1"'):
    return old, f'origin="{origin}" target="{target}"'


NO_LAMP = ('value="22, 14, 8"', 'value="0.2, 0.1, 0.05"')
DIM_WINDOW = ('value="5, 5.8, 7"', 'value="0.02, 0.02, 0.03"')
BARE_LAMP = ('<float name="radius" value="0.09"/>', '<float name="radius" value="0.012"/>')
BRIGHT_LAMP = ('value="22, 14, 8"', 'value="1200, 800, 500"')
END = "</scene>"

#: Name: scene, change of its text, values of its parameters.
VARIANTS = {
    "room": ("room", changed(), {}),
    "room-turned": ("room", changed(view("-1.5, 1.6, 3.4", "1.2, 0.7, -1.4")), {}),
    "room-low": ("room", changed(view("1.6, 0.5, 2.8", "-1.2, 0.9, -0.8")), {}),
    "room-close": ("room", changed(view("0.3, 1.3, 0.9", "-0.1, 0.85, -0.6")), {}),
    "room-narrow": ("room", changed(*window(0.12, 70), NO_LAMP), {}),
    "room-lamp": ("room", changed(DIM_WINDOW), {}),
    "room-bright-lamp": ("room", changed(DIM_WINDOW, BARE_LAMP, BRIGHT_LAMP), {}),
    "room-pane": ("room", changed(NO_LAMP, (END, PANE)), {}),
    "room-gap": ("room", changed(NO_LAMP, (END, PARTITION.format(depth=2.7, z=1.0))), {}),
    "room-wide-gap": ("room", changed((END, PARTITION.format(depth=1.6, z=1.2))), {}),
    "room-slit": ("room", changed(NO_LAMP, *window(1, 8), (END, HOLE.format(half=0.62, y=1.52) + END)), {}),
    "room-balls": ("room", changed((END, BALLS)), {}),
    "room-balls-night": ("room", changed(DIM_WINDOW, (END, BALLS), view("0.4, 1.2, 3.6", "0.1, 0.3, 0.9")), {}),
    "room-deep": ("room", changed(NO_LAMP), {"max_depth": 24}),
    "box": ("box", changed(), {}),
    "box-dim": ("box", changed(('value="17, 13, 8"', 'value="3, 2.4, 1.5"')), {}),
    "glossy-box": ("glossy-box", changed(), {}),
    "glossy-box-sharp": ("glossy-box", changed(), {"alpha": 0.04}),
    "materials": ("materials", changed(), {}),
    "materials-near": ("materials", changed(view("-3, 1.6, 4.2", "-0.8, 0.4, 0",
                                                 'origin="0, 4.2, 10" target="0, 0.35, 0"')), {}),
}
#: Names of rooms by their numbers.
RANDOM_ROOMS = {f"random-{number:02d}": number for number in range(1, 21)}
SCENES = [*VARIANTS, *RANDOM_ROOMS]

#: Film sizes, one scene after the other
SIZES = ["160x90", "128x96", "160x90", "96x54", "160x90", "240x136", "120x120"]


def family_of(name):
    """The scene whose variants form a family, which is left out together and counts as one, as does a random room."""
    return name if name in RANDOM_ROOMS else VARIANTS[name][0]


def size_of(name):
    place = RANDOM_ROOMS[name] + 3 if name in RANDOM_ROOMS else list(VARIANTS).index(name)
    return SIZES[place % len(SIZES)]


def write_variant(name, scenes, folder):
    """The scene file of a variant and its options, in `folder`."""
    path = Path(folder) / f"{name}.xml"
    if name in RANDOM_ROOMS:
        path.write_text(random_room(RANDOM_ROOMS[name]))
        return [str(path)]
    base, change, parameters = VARIANTS[name]
    path.write_text(change((Path(scenes) / f"{base}.xml").read_text()))
    return [str(path), *(word for key, value in parameters.items() for word in ("-D", f"{key}={value}"))]
