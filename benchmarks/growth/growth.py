# SPDX-License-Identifier: Apache-2.0
"""How the work of a render grows: a table of processor time and memory by the number of lights, triangles (of one mesh,
or of instances of one of 20,000) or pixels.

    growth.py lights|triangles|instances|pixels [--covary PROGRAM] [--numbers N...] [--spp N] [--repeat N]

Renders with plain path tracing on one thread, at 96 x 54 pixels unless the number of pixels grows. `read` is the
processor time of a render of one sample per pixel, including reading and building; `sample` that of each further sample
of a pixel; both are the minimum of --repeat runs. Exponents under the table: a column grows like N^p, with p fitted to
the second half of the rows, where constant parts count least. The best p is 0 for `sample`, 1 for the rest.
"""
import argparse
import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile

NUMBERS = {"lights": [1, 10, 100, 1000, 10000, 100000], "triangles": [200, 2000, 20000, 200000, 2000000],
           "instances": [100000, 1000000, 10000000, 100000000],
           "pixels": [230400, 921600, 3686400, 8294400, 33177600]}
SCENE = """<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0, 2, 5" target="0, 1, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="96"/><integer name="height" value="54"/>
      <rfilter type="box"/></film>
  </sensor>
{shapes}
</scene>
"""
FLOOR = """  <shape type="rectangle">
    <transform name="to_world"><scale value="10"/><rotate x="1" angle="-90"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
  </shape>"""


def lamp(x, z, size, radiance):
    return f"""  <shape type="rectangle">
    <transform name="to_world"><scale value="{size:.9g}"/><rotate x="1" angle="90"/>
      <translate x="{x:.9g}" y="3" z="{z:.9g}"/></transform>
    <emitter type="area"><rgb name="radiance" value="{radiance:.9g}"/></emitter>
  </shape>"""


def lights_scene(n):
    """n lamps in a square grid, whose total power does not depend on n."""
    side = math.ceil(math.sqrt(n))
    places = [((i % side + 0.5) / side * 8 - 4, (i // side + 0.5) / side * 8 - 4) for i in range(n)]
    return SCENE.format(shapes="\n".join([FLOOR] + [lamp(x, z, 0.5 / side, 40 * side * side / n) for x, z in places]))


def write_hills(path, n):
    """Writes a square mesh of about n triangles, binary PLY; returns their number."""
    side = max(1, round(math.sqrt(n / 2)))
    with open(path, "wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {(side + 1) ** 2}\nproperty float x\n"
                   f"property float y\nproperty float z\nelement face {2 * side * side}\n"
                   "property list uchar int vertex_indices\nend_header\n".encode())
        for j in range(side + 1):
            row = []
            for i in range(side + 1):
                x, z = 10 * i / side - 5, 10 * j / side - 5
                row += [x, 0.3 * math.sin(3 * x) * math.cos(2 * z), z]
            file.write(struct.pack(f"<{len(row)}f", *row))
        for j in range(side):
            faces = b""
            for i in range(side):
                a = j * (side + 1) + i
                faces += struct.pack("<B3iB3i", 3, a, a + side + 1, a + 1, 3, a + 1, a + side + 1, a + side + 2)
            file.write(faces)
    return 2 * side * side


def triangles_scene(n, folder):
    count = write_hills(folder / "hills.ply", n)
    mesh = """  <shape type="ply"><string name="filename" value="hills.ply"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>"""
    return SCENE.format(shapes=mesh + "\n" + lamp(0, 0, 1, 20)), count


def instances_scene(n, folder):
    """Instances of a mesh of 20,000 triangles in a square grid, n triangles in total."""
    count = write_hills(folder / "hills.ply", 20000)
    side = max(1, round(math.sqrt(n / count)))
    shapes = ["""  <shape type="shapegroup" id="hills"><shape type="ply"><string name="filename" value="hills.ply"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape></shape>"""]
    for i in range(side * side):
        x, z = (10 * (k + 0.5) / side - 5 for k in divmod(i, side))
        shapes.append(f"""  <shape type="instance"><ref id="hills"/>
    <transform name="to_world"><scale value="{1 / side:.9g}"/>
      <translate x="{x:.9g}" z="{z:.9g}"/></transform></shape>""")
    return SCENE.format(shapes="\n".join(shapes + [lamp(0, 0, 1, 20)])), count * side * side


def exponent(numbers, values):
    """p of values ~ numbers^p by least squares of logarithms, over the second half; NaN for less than two."""
    first = len(numbers) // 2 if len(numbers) > 2 else 0
    pairs = [(math.log(n), math.log(v)) for n, v in zip(numbers[first:], values[first:]) if v > 0]
    if len(pairs) < 2:
        return math.nan
    mean_x, mean_y = (sum(p[i] for p in pairs) / len(pairs) for i in (0, 1))
    return sum((x - mean_x) * (y - mean_y) for x, y in pairs) / sum((x - mean_x) ** 2 for x, _ in pairs)


def render(program, scene, spp, resolution):
    """(processor seconds, bytes of peak memory) of a render."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "render", str(scene), "--estimator", "none", "--integrator", "path", "--spp", str(spp),
                   "--groups", "1", "--threads", "1", "--quiet", "--no-preview", "-o", f"{folder}/image.exr", "--json",
                   f"{folder}/image.json"] + (["--resolution", resolution] if resolution else [])
        child = subprocess.Popen(command)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode != 0:
            sys.exit(f"growth.py: {' '.join(command)} ended with {child.returncode}")
        memory = json.loads(pathlib.Path(folder, "image.json").read_text())["peak_memory_bytes"]
        return usage.ru_utime + usage.ru_stime, memory


def measure(program, scene, spp, resolution, repeat, pixels):
    """Seconds of reading, microseconds of a sample, MiB."""
    least = [min(render(program, scene, n, resolution) for _ in range(repeat)) for n in (1, 1 + spp)]
    return least[0][0], max(0.0, least[1][0] - least[0][0]) / (spp * pixels) * 1e6, least[1][1] / 2**20


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=list(NUMBERS))
    root = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--covary", default=str(root / "build/release/covary"), help="program")
    parser.add_argument("--numbers", type=int, nargs="+")
    parser.add_argument("--spp", type=int, default=32, help="samples per pixel beyond the first, default 32")
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    rows = []
    print(f"| {arguments.what} | read s | sample us | memory MiB |\n|---|---|---|---|", flush=True)
    for n in arguments.numbers or NUMBERS[arguments.what]:
        with tempfile.TemporaryDirectory() as name:
            folder, resolution, pixels = pathlib.Path(name), "", 96 * 54
            if arguments.what == "lights":
                text = lights_scene(n)
            elif arguments.what in ("triangles", "instances"):
                text, n = (triangles_scene if arguments.what == "triangles" else instances_scene)(n, folder)
            else:
                text, height = lights_scene(4), round(math.sqrt(n * 9 / 16))
                width = round(n / height)
                resolution, pixels = f"{width}x{height}", width * height
            (folder / "scene.xml").write_text(text)
            rows.append((n, *measure(arguments.covary, folder / "scene.xml", arguments.spp, resolution,
                                     arguments.repeat, pixels)))
        print("| {} | {:.3f} | {:.3f} | {:.0f} |".format(*rows[-1]), flush=True)
    columns = list(zip(*rows))
    print("| exponent | " + " | ".join(f"{exponent(columns[0], column):.2f}" for column in columns[1:]) + " |")


if __name__ == "__main__":
    main()
