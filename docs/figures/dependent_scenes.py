#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""dependent_scenes.py FOLDER: scenes with the numbers of patches that Csonka et al. 2002 state, whose own are not
available: FOLDER/dt-kitchen/scene.xml with 9,143 patches, two of which are lamps, and FOLDER/dt-room/scene.xml with
18,134, one of which is a lamp, and a floor with a specular part of 0.6 as rough as a Phong lobe with the exponent 15.

A patch is a triangle, but for the lamps, which are rectangles. Metres, y up; the camera looks along -z."""
import heapq
import math
import pathlib
import sys

COLOURS = {"wall": "0.75, 0.72, 0.66", "ceiling": "0.8, 0.8, 0.8", "floor": "0.55, 0.38, 0.25",
           "front": "0.65, 0.62, 0.50", "top": "0.30, 0.31, 0.33", "dark": "0.08, 0.08, 0.09",
           "red": "0.62, 0.12, 0.09", "blue": "0.14, 0.25, 0.52", "green": "0.16, 0.45, 0.18",
           "wood": "0.45, 0.27, 0.14", "steel": "0.6, 0.6, 0.62"}


class Patches:
    """Triangles by the name of their colour."""

    def __init__(self):
        self.of = {name: [] for name in COLOURS}

    def count(self):
        return sum(map(len, self.of.values()))

    def quad(self, name, a, b, c, d):
        self.of[name] += [(a, b, c), (a, c, d)]

    def box(self, name, low, high):
        """Of 12 triangles."""
        at = [[low[k], high[k]] for k in range(3)]
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for side in range(2):
                corners = []
                for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    point = [0, 0, 0]
                    point[axis], point[u], point[v] = at[axis][side], at[u][i], at[v][j]
                    corners.append(tuple(point))
                self.quad(name, *(corners if side else corners[::-1]))

    def turned(self, name, centre, profile, sides):
        """A surface of revolution about the vertical through `centre`; `profile`: (radius, height), from below."""
        def ring(radius, height):
            return [(centre[0] + radius * math.cos(2 * math.pi * i / sides), centre[1] + height,
                     centre[2] - radius * math.sin(2 * math.pi * i / sides)) for i in range(sides + 1)]
        rings = [ring(*point) for point in profile]
        for (low, high), (below, above) in zip(zip(rings, rings[1:]), zip(profile, profile[1:])):
            for i in range(sides):
                if below[0] > 0:
                    self.of[name].append((low[i], low[i + 1], high[i + 1]))
                if above[0] > 0:
                    self.of[name].append((low[i], high[i + 1], high[i]))

    def sphere(self, name, centre, radius, rings=8, sides=16):
        profile = [(radius * math.sin(math.pi * i / rings), -radius * math.cos(math.pi * i / rings))
                   for i in range(rings + 1)]
        self.turned(name, centre, [(0, -radius), *profile[1:-1], (0, radius)], sides)

    def refine(self, number):
        """Halves the longest edges until there are so many triangles."""
        def edge(triangle):
            return max(math.dist(triangle[i], triangle[(i + 1) % 3]) for i in range(3))
        assert self.count() <= number, f"{self.count()} triangles, wanted {number}"
        queue = [(-edge(triangle), name, triangle) for name, triangles in self.of.items() for triangle in triangles]
        heapq.heapify(queue)
        while len(queue) < number:
            _, name, triangle = heapq.heappop(queue)
            i = max(range(3), key=lambda k: math.dist(triangle[k], triangle[(k + 1) % 3]))
            a, b, c = (triangle[(i + k) % 3] for k in range(3))
            middle = tuple((p + q) / 2 for p, q in zip(a, b))
            for half in ((a, middle, c), (middle, b, c)):
                heapq.heappush(queue, (-edge(half), name, half))
        self.of = {name: sorted(triangle for _, own, triangle in queue if own == name) for name in self.of}

    def shell(self, width, height, depth):
        """Floor, ceiling and three walls, x from 0, z from 0 to -depth."""
        w, h, d = width, height, -depth
        self.quad("floor", (0, 0, 0), (w, 0, 0), (w, 0, d), (0, 0, d))
        self.quad("ceiling", (0, h, 0), (0, h, d), (w, h, d), (w, h, 0))
        self.quad("wall", (0, 0, d), (w, 0, d), (w, h, d), (0, h, d))
        self.quad("wall", (0, 0, 0), (0, 0, d), (0, h, d), (0, h, 0))
        self.quad("wall", (w, 0, 0), (w, h, 0), (w, h, d), (w, 0, d))


def kitchen():
    patches = Patches()
    patches.shell(4, 2.6, 4)
    for i in range(5):  # cupboards, an oven in the middle, and what hangs above them
        x = 0.5 + 0.6 * i
        oven = i == 2
        patches.box("steel" if oven else "front", (x + 0.01, 0.1, -4), (x + 0.59, 0.88, -3.4))
        patches.box("dark" if oven else "front", (x + 0.06, 0.2 if oven else 0.14, -3.4), (x + 0.54, 0.7, -3.38))
        patches.box("steel", (x + 0.1, 0.74, -3.38), (x + 0.5, 0.76, -3.34))
        if not oven:
            patches.box("front", (x + 0.01, 1.5, -4), (x + 0.59, 2.2, -3.65))
            patches.box("steel", (x + 0.1, 1.55, -3.65), (x + 0.14, 1.7, -3.62))
    patches.box("dark", (0.5, 0, -4), (3.5, 0.1, -3.45))
    patches.box("top", (0.48, 0.88, -4), (3.52, 0.92, -3.36))
    patches.box("steel", (1.75, 1.6, -4), (2.25, 1.75, -3.5))
    patches.box("steel", (1.9, 1.75, -4), (2.1, 2.6, -3.8))
    for i in range(4):  # knobs, pots and jars
        patches.sphere("dark", (1.8 + 0.12 * i, 0.82, -3.38), 0.025, 6, 10)
    for x, z, name in ((1.85, -3.8, "red"), (2.15, -3.6, "steel")):
        patches.turned(name, (x, 0.92, z), [(0, 0), (0.11, 0), (0.12, 0.14), (0.1, 0.14), (0.1, 0.02), (0, 0.02)], 24)
    for i in range(6):
        patches.turned(("blue", "red", "green")[i % 3], (2.6 + 0.14 * i, 0.92, -3.85),
                       [(0, 0), (0.05, 0), (0.055, 0.12), (0.03, 0.17), (0.035, 0.2), (0, 0.2)], 16)
    patches.box("wood", (1.2, 0.72, -2.4), (2.8, 0.76, -1.5))  # a table with fruit, and stools
    for x in (1.25, 2.69):
        for z in (-2.35, -1.61):
            patches.box("wood", (x, 0, z), (x + 0.06, 0.72, z + 0.06))
    patches.turned("blue", (2, 0.76, -2), [(0, 0), (0.1, 0), (0.22, 0.1), (0.2, 0.1), (0.1, 0.02), (0, 0.02)], 32)
    for i in range(5):
        patches.sphere(("red", "green")[i % 2], (2 + 0.1 * math.cos(i * 1.3), 0.85, -2 + 0.1 * math.sin(i * 1.3)), 0.05)
    for x in (0.9, 3.1):
        patches.turned("wood", (x, 0, -1.9),
                       [(0.18, 0), (0.03, 0.04), (0.03, 0.42), (0.2, 0.44), (0.2, 0.48), (0, 0.48)], 24)
    patches.refine(9143 - 2)
    return patches, "2, 1.5, 1.2", "2, 1, -3", [(1.2, 2.59, -1.8), (2.8, 2.59, -1.8)]


def room():
    patches = Patches()
    patches.shell(5, 3, 5)
    for i in range(4):  # shelves with books
        patches.box("wood", (0, 0.3 + 0.5 * i, -4.5), (0.35, 0.33 + 0.5 * i, -2))
        for k in range(24):
            z = -4.45 + 0.1 * k
            patches.box(("red", "blue", "green", "front")[(5 * k + i) % 4], (0.02, 0.33 + 0.5 * i, z),
                        (0.2, 0.55 + 0.5 * i + 0.05 * ((3 * k + i) % 4), z + 0.07))
    patches.box("wood", (1.6, 0.7, -3.6), (3.6, 0.75, -2.4))
    for x in (1.7, 3.5):
        for z in (-3.5, -2.5):
            patches.turned("wood", (x, 0, z), [(0, 0), (0.05, 0), (0.03, 0.35), (0.05, 0.7), (0, 0.7)], 16)
    for i in range(6):  # stools around the table
        angle = math.pi * (2 * i + 1) / 6
        patches.turned("front", (2.6 + 1.4 * math.cos(angle), 0, -3 + 1.0 * math.sin(angle)),
                       [(0.2, 0), (0.04, 0.05), (0.04, 0.4), (0.22, 0.42), (0.22, 0.47), (0, 0.47)], 32)
    for i in range(5):  # vases and balls
        patches.turned(("blue", "steel", "red")[i % 3], (1.9 + 0.35 * i, 0.75, -3),
                       [(0, 0), (0.08, 0), (0.12, 0.1), (0.1, 0.2), (0.04, 0.28), (0.07, 0.34), (0.06, 0.34), (0, 0.1)],
                       40)
    for x, z, radius in ((4.3, -4.2, 0.4), (0.9, -1.2, 0.25), (4.2, -1.5, 0.3)):
        patches.sphere("green", (x, radius, z), radius, 20, 40)
    patches.refine(18134 - 1)
    return patches, "2.5, 1.7, 1.6", "2.5, 0.9, -3", [(2.5, 2.99, -2.5)]


HEAD = """<?xml version="1.0" encoding="utf-8"?>
<!-- Made by docs/figures/dependent_scenes.py of covary. -->
<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="8"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="{origin}" target="{target}" up="0, 1, 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="64"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="600"/><integer name="height" value="600"/><rfilter type="box"/>
    </film>
  </sensor>
"""
MATT = '<bsdf type="diffuse"><rgb name="reflectance" value="{}"/></bsdf>'
GLOSSY = f"""<bsdf type="blendbsdf">
      <float name="weight" value="0.6"/>
      {MATT}
      <bsdf type="roughconductor"><string name="material" value="none"/><float name="alpha" value="0.343"/></bsdf>
    </bsdf>"""
LAMP = """  <shape type="rectangle">
    <transform name="to_world">
      <scale value="0.3"/><rotate x="1" angle="90"/><translate x="{}" y="{}" z="{}"/>
    </transform>
    <emitter type="area"><rgb name="radiance" value="16, 14, 11"/></emitter>
  </shape>
"""


def write(folder, patches, origin, target, lamps, floor=MATT):
    folder.mkdir(parents=True, exist_ok=True)
    scene = HEAD.format(origin=origin, target=target)
    for name, triangles in patches.of.items():
        if not triangles:
            continue
        vertices = [" ".join(f"{x:.5g}" for x in point) for triangle in triangles for point in triangle]
        faces = [f"3 {3 * i} {3 * i + 1} {3 * i + 2}" for i in range(len(triangles))]
        header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}", "property float x",
                  "property float y", "property float z", f"element face {len(faces)}",
                  "property list uchar int vertex_indices", "end_header"]
        (folder / f"{name}.ply").write_text("\n".join([*header, *vertices, *faces]) + "\n", encoding="ascii")
        bsdf = floor if name == "floor" else MATT
        scene += (f'  <shape type="ply">\n    <string name="filename" value="{name}.ply"/>\n'
                  f'    <boolean name="face_normals" value="true"/>\n    <bsdf type="twosided">\n    '
                  f'{bsdf.format(COLOURS[name])}\n    </bsdf>\n  </shape>\n')
    (folder / "scene.xml").write_text(scene + "".join(LAMP.format(*lamp) for lamp in lamps) + "</scene>\n",
                                      encoding="utf-8")


def main():
    folder = pathlib.Path(sys.argv[1])
    write(folder / "dt-kitchen", *kitchen())
    write(folder / "dt-room", *room(), floor=GLOSSY)


if __name__ == "__main__":
    main()
