# SPDX-License-Identifier: Apache-2.0
"""Scenes to learn from, determined by their number: rooms, views outdoors, and still lifes, with pictures as textures,
plants and hair of curves, glass, mirrors, rough metal, fog, many lights, lenses and skies. A folder holds the files
that they share."""
import math
import random
import re
import struct
import sys
import zlib
from pathlib import Path

import numpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "error_intervals"))
from random_rooms import HEAD, ball, box, clutter, colour, light, model, random_room, triple  # noqa: E402

N_PICTURES, N_SKIES, N_PLANTS, N_HAIRS, N_MESHES = 40, 8, 8, 6, 12


def write_png(path, rgb):
    rows = (numpy.clip(rgb, 0, 1) * 255 + 0.5).astype(numpy.uint8)
    height, width, _ = rows.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    raw = b"".join(b"\0" + row.tobytes() for row in rows)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


def write_pfm(path, rgb):
    """Rows from bottom to top."""
    path.write_bytes(f"PF\n{rgb.shape[1]} {rgb.shape[0]}\n-1.0\n".encode() + rgb[::-1].astype("<f4").tobytes())


def fractal(r, n, falloff):
    """Noise whose spectrum falls with frequency; mean 0, deviation 1; it repeats."""
    y, x = numpy.meshgrid(numpy.fft.fftfreq(n), numpy.fft.fftfreq(n), indexing="ij")
    size = numpy.maximum(numpy.hypot(x, y), 1 / n)**-falloff
    field = numpy.fft.ifft2(numpy.fft.fft2(r.standard_normal((n, n))) * size).real
    return (field - field.mean()) / field.std()


def picture(number, n=256):
    """An image for a texture: noise, wood, tiles, cloth, signs, or shapes one over another."""
    r = numpy.random.default_rng(number)
    y, x = numpy.meshgrid(numpy.arange(n) / n, numpy.arange(n) / n, indexing="ij")
    a, b = r.uniform(0.02, 0.9, 3), r.uniform(0.02, 0.9, 3)
    kind = number % 6
    if kind == 0:
        t = 0.5 + 0.5 * numpy.tanh(r.uniform(0.4, 3) * fractal(r, n, r.uniform(0.6, 1.8)))
    elif kind == 1:
        rings = r.integers(4, 24) * x + 0.6 * fractal(r, n, 2) + 0.08 * fractal(r, n, 0.5)
        t = 0.5 + 0.5 * numpy.sin(2 * math.pi * rings)
    elif kind == 2:
        rows, columns, gap = int(r.integers(3, 14)), int(r.integers(2, 10)), r.uniform(0.03, 0.12)
        shifted = x * columns + (numpy.floor(y * rows) % 2) * r.choice([0, 0.5])
        tile = (numpy.floor(y * rows) * 31 + numpy.floor(shifted) % columns).astype(int)
        is_gap = ((y * rows) % 1 < gap) | (shifted % 1 < gap * columns / rows)
        t = numpy.where(is_gap, 1, 0.15 + 0.35 * r.random(2000)[tile] + 0.06 * fractal(r, n, 0.7))
    elif kind == 3:
        k = int(r.integers(16, 64))
        t = 0.5 + 0.25 * (numpy.sin(2 * math.pi * k * x) + numpy.sin(2 * math.pi * k * y)) + 0.1 * fractal(r, n, 0.4)
    elif kind == 4:
        side = int(r.choice([4, 8, 16]))
        marks = (r.random((n // side, n // side)) < 0.45).repeat(side, 0).repeat(side, 1)
        t = marks * ((numpy.floor(y * n / side / 4) % 2) == 0)
    else:
        image = numpy.broadcast_to(a, (n, n, 3)).copy()
        for _ in range(60):
            cx, cy, size, turn = r.random(), r.random(), 10**r.uniform(-2, -0.5), r.uniform(0, math.pi)
            u = (x - cx) * math.cos(turn) + (y - cy) * math.sin(turn)
            v = (y - cy) * math.cos(turn) - (x - cx) * math.sin(turn)
            inside = numpy.hypot(u, v) < size if r.random() < 0.4 else (abs(u) < size) & (abs(v) < size * r.random())
            shade = r.uniform(0.02, 0.9, 3) * (0.7 + 0.6 * numpy.clip(u[inside] / size, -0.5, 0.5))[:, None]
            image[inside] = shade
        return image
    t = numpy.clip(t, 0, 1)[..., None]
    return numpy.clip(a * (1 - t) + b * t + 0.01 * fractal(r, n, 0.3)[..., None], 0.01, 0.95)


def sky(number, n=64):
    """Radiance by latitude and longitude: horizon, zenith, clouds, ground, and most often a sun."""
    r = numpy.random.default_rng(1000 + number)
    y = (numpy.arange(n) + 0.5) / n
    up = numpy.cos(math.pi * y)[:, None, None]
    zenith, horizon, ground = (numpy.array(c) for c in ([0.2, 0.4, 0.9], [0.9, 0.85, 0.8], [0.2, 0.18, 0.15]))
    image = numpy.where(up > 0, horizon + (zenith - horizon) * numpy.clip(up, 0, 1)**0.5, ground)
    image = numpy.broadcast_to(image, (n, 2 * n, 3)).copy()
    clouds = numpy.concatenate([fractal(r, n, 1.5)] * 2, 1)[..., None]
    image *= 1 + 0.6 * numpy.clip(clouds, 0, 2) * (up > 0)
    if number % 4:
        row, column = int(r.integers(n // 16, n // 2 - 2)), int(r.integers(2, 2 * n - 4))
        side = 1 if number % 2 else 3
        image[row:row + side, column:column + side] = numpy.array([1, 0.9, 0.75]) * 10**r.uniform(2.5, 3.6) / side**2
    return image * 10**r.uniform(-0.5, 0.3)


def curves(number, hair):
    """Control points of blades of grass on the ground, or of hair on a ball."""
    r = numpy.random.default_rng(2000 + number + 100 * hair)
    lines = []
    for _ in range(1500 if hair else 700):
        if hair:
            d = r.standard_normal(3)
            d /= numpy.linalg.norm(d)
            p, step, width = d, d * 0.12 + [0, 0.02, 0], 0.012
        else:
            p, width = numpy.array([r.uniform(-1, 1), 0, r.uniform(-1, 1)]), 0.012
            step = numpy.array([r.normal(0, 0.03), r.uniform(0.05, 0.13), r.normal(0, 0.03)])
        bend = r.normal(0, 0.02, 3) - [0, 0.02, 0]
        for k in range(6):
            lines.append(" ".join(f"{v:.4f}" for v in p) + f" {width * (1 - 0.15 * k):.5f}")
            p = p + step + bend * k
        lines.append("")
    return "\n".join(lines) + "\n"


def mesh(number):
    """An OBJ: leaves in a crown, a bumpy ball, or a torus."""
    r = numpy.random.default_rng(3000 + number)
    text, faces = [], []
    if number % 3 == 0:
        for i in range(500):
            at = r.standard_normal(3)
            at *= r.random()**0.4 / numpy.linalg.norm(at)
            u, v = r.standard_normal((2, 3)) * 0.06
            for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = at + s * u + t * v
                text.append(f"v {p[0]:.4f} {p[1]:.4f} {p[2]:.4f}\nvt {(s + 1) / 2} {(t + 1) / 2}")
            k = 4 * i
            faces.append(f"f {k+1}/{k+1} {k+2}/{k+2} {k+3}/{k+3} {k+4}/{k+4}")
    else:
        n, m = 48, 96
        waves = [(r.integers(1, 9), r.integers(1, 9), r.uniform(0, 6.3), r.uniform(0, 0.06)) for _ in range(5)]
        for i in range(n + 1):
            for j in range(m + 1):
                a, b = math.pi * i / n, 2 * math.pi * j / m
                bump = 1 + sum(h * math.sin(p * a + s) * math.sin(q * b) for p, q, s, h in waves)
                if number % 3 == 1:
                    p = numpy.array([math.sin(a) * math.cos(b), math.cos(a), math.sin(a) * math.sin(b)]) * bump
                else:
                    ring = 0.7 + 0.28 * bump * math.cos(2 * a)
                    p = numpy.array([ring * math.cos(b), 0.28 * bump * math.sin(2 * a), ring * math.sin(b)])
                text.append(f"v {p[0]:.4f} {p[1]:.4f} {p[2]:.4f}\nvt {2 * j / m:.4f} {i / n:.4f}")
        for i in range(n):
            for j in range(m):
                k = i * (m + 1) + j + 1
                faces.append(f"f {k}/{k} {k+m+1}/{k+m+1} {k+m+2}/{k+m+2} {k+1}/{k+1}")
    return "\n".join(text + faces) + "\n"


def write_shared_files(folder):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for i in range(N_PICTURES):
        write_png(folder / f"picture{i}.png", picture(i))
    for i in range(N_SKIES):
        write_pfm(folder / f"sky{i}.pfm", sky(i))
    for i in range(N_PLANTS):
        (folder / f"grass{i}.txt").write_text(curves(i, False))
    for i in range(N_HAIRS):
        (folder / f"hair{i}.txt").write_text(curves(i, True))
    for i in range(N_MESHES):
        (folder / f"mesh{i}.obj").write_text(mesh(i))


def with_pictures(text, r, how_often):
    """Replaces plain reflectances by pictures."""
    def replaced(match):
        if r.random() >= how_often:
            return match.group(0)
        scale = 2**r.uniform(-0.5, 2.5)
        return (f'<texture name="{match.group(1)}" type="bitmap"><string name="filename" value="picture'
                f'{r.randrange(N_PICTURES)}.png"/><transform name="to_uv"><scale x="{scale:.2f}" y="{scale:.2f}"/>'
                '</transform></texture>')
    return re.sub(r'<rgb name="((?:diffuse_)?reflectance)" value="[^"]*"/>', replaced, text)


def placed(kind, file, at, size, inner, turn=0.0):
    return (f'<shape type="{kind}"><string name="filename" value="{file}"/><transform name="to_world">'
            f'<scale value="{size:.4g}"/><rotate y="1" angle="{turn:.1f}"/><translate value="{triple(at)}"/>'
            f'</transform>{inner}</shape>\n')


def leaves(r):
    green = triple((r.uniform(0.05, 0.3), r.uniform(0.2, 0.5), r.uniform(0.02, 0.2)))
    if r.random() < 0.4:
        return (f'<bsdf type="difftrans"><rgb name="reflectance" value="{green}"/>'
                f'<rgb name="transmittance" value="{green}"/></bsdf>')
    return f'<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="{green}"/></bsdf></bsdf>'


def plants(r, at, size):
    """A patch of grass, a ball of hair, or a crown of leaves on a trunk."""
    kind = r.choice(["grass", "grass", "hair", "tree"])
    if kind == "grass":
        return placed("bsplinecurve", f"grass{r.randrange(N_PLANTS)}.txt", at, size, leaves(r),
                      r.uniform(0, 360))
    if kind == "hair":
        is_hair = r.random() < 0.5
        matt = "" if is_hair else f'<bsdf type="diffuse"><rgb name="reflectance" value="{colour(r)}"/></bsdf>'
        inner = '<bsdf type="hair"/>' if is_hair else matt
        x, y, z = at
        return (placed("bsplinecurve", f"hair{r.randrange(N_HAIRS)}.txt", (x, y + size, z), 0.7 * size, inner)
                + ball(0.69 * size, (x, y + size, z), model(r, 0)))
    x, y, z = at
    trunk = (f'<shape type="cylinder"><point name="p0" value="{triple(at)}"/><point name="p1" value="'
             f'{triple((x, y + 2 * size, z))}"/><float name="radius" value="{0.12 * size:.3g}"/>{model(r, 0)}'
             '</shape>\n')
    return trunk + placed("obj", f"mesh{3 * r.randrange(N_MESHES // 3)}.obj", (x, y + 2.3 * size, z), size, leaves(r))


def thing(r, at, size, glass):
    """A mesh that is no box and no ball."""
    number = r.choice([k for k in range(N_MESHES) if k % 3])
    return placed("obj", f"mesh{number}.obj", at, size, model(r, glass), r.uniform(0, 360))


def environment(r, number):
    return (f'<emitter type="envmap"><string name="filename" value="sky{number}.pfm"/><transform name="to_world">'
            f'<rotate y="1" angle="{r.uniform(0, 360):.1f}"/></transform></emitter>\n')


def rectangle(half, at, axis, angle, inner):
    return (f'<shape type="rectangle"><transform name="to_world"><scale x="{half[0]:.4g}" y="{half[1]:.4g}"/>'
            f'<rotate {axis}="1" angle="{angle}"/><translate value="{triple(at)}"/></transform>{inner}</shape>\n')


def outdoors(r):
    """Houses, plants and things on the ground below a sky."""
    origin = (r.uniform(-3, 3), r.uniform(0.8, 3.5), r.uniform(5, 9))
    target = (r.uniform(-1, 1), r.uniform(0.3, 1.6), 0)
    text = HEAD.format(depth=r.choice([5, 8, 12]), fov=r.uniform(35, 65), origin=triple(origin), target=triple(target))
    text += environment(r, r.randrange(N_SKIES)) + rectangle((40, 40), (0, 0, 0), "x", -90, model(r, 0))
    for _ in range(r.choice([1, 3, 6])):
        half = (r.uniform(0.4, 1.5), r.uniform(0.4, 2.2), r.uniform(0.4, 1.5))
        text += box(half, (r.uniform(-5, 5), half[1], r.uniform(-7, 0)), model(r, 0.1), r.uniform(0, 90))
    for _ in range(r.choice([2, 5, 10])):
        size = r.uniform(0.4, 1)
        text += plants(r, (r.uniform(-4, 4), 0, r.uniform(-4, 2.5)), size)
    for _ in range(r.choice([1, 3])):
        size = r.uniform(0.2, 0.7)
        text += thing(r, (r.uniform(-2, 2), size, r.uniform(-1, 3)), size, 0.4)
    if r.random() < 0.3:
        text += ball(0.1, (r.uniform(-2, 2), 2, r.uniform(0, 2)), light(40, 0.126))
    return text + "</scene>\n"


def still_life(r):
    """A table with things, near the camera, between walls that are open to lamps or to a sky."""
    origin = (r.uniform(-1, 1), r.uniform(0.4, 1.5), r.uniform(1.8, 3))
    text = HEAD.format(depth=r.choice([8, 12, 20]), fov=r.uniform(30, 50), origin=triple(origin),
                       target=triple((r.uniform(-0.2, 0.2), 0.3, 0)))
    text += rectangle((4, 4), (0, 0, 0), "x", -90, model(r, 0.02))
    text += rectangle((4, 3), (0, 2, -2), "y", 0, model(r, 0.05))
    for _ in range(r.choice([3, 6, 10])):
        size = r.uniform(0.1, 0.35)
        at = (r.uniform(-1, 1), size, r.uniform(-1.2, 0.8))
        kind = r.random()
        if kind < 0.5:
            text += thing(r, at, size, r.choice([0.1, 0.5]))
        elif kind < 0.7:
            text += plants(r, (at[0], 0, at[2]), size)
        else:
            text += ball(size, at, model(r, 0.4))
    if r.random() < 0.5:
        text += environment(r, r.randrange(N_SKIES))
    for _ in range(r.choice([1, 1, 2, 20])):
        half = 10**r.uniform(-1.7, 0)
        at = (r.uniform(-2, 2), r.uniform(1.5, 3), r.uniform(-1, 2))
        text += rectangle((half, half), at, "x", 90, light(10**r.uniform(0.3, 1.2), 4 * half * half))
    return text + "</scene>\n"


def furnished(r, text):
    """Plants and things in a room."""
    more = ""
    for _ in range(r.choice([0, 2, 5])):
        at = (r.uniform(-1.2, 1.2), 0.0, r.uniform(-2, 0.5))
        more += plants(r, at, r.uniform(0.15, 0.4)) if r.random() < 0.5 else thing(r, (at[0], 0.3, at[2]), 0.3, 0.3)
    return text.replace("</scene>", more + "</scene>")


def with_lens(r, text):
    """Depth of field."""
    more = (f'<float name="aperture_radius" value="{10**r.uniform(-2.2, -1.1):.4g}"/>'
            f'<float name="focus_distance" value="{r.uniform(1.5, 6):.3g}"/>')
    return text.replace('<sensor type="perspective">', '<sensor type="thinlens">' + more)


def with_fog(r, text):
    """A homogeneous medium in a large ball around everything."""
    fog = (f'<medium type="homogeneous" id="fog"><float name="sigma_t" value="{10**r.uniform(-1.8, -0.7):.4g}"/>'
           f'<rgb name="albedo" value="{colour(r, 0.7, 0.95)}"/>'
           '<phase type="hg"><float name="g" value="0.5"/></phase></medium>\n')
    hull = ('<shape type="sphere"><float name="radius" value="60"/><bsdf type="null"/>'
            '<ref name="interior" id="fog"/></shape>\n')
    text = re.sub(r'(<sensor [^>]*>)', lambda m: fog + m.group(1) + '<ref id="fog"/>', text)
    text = text.replace('<integrator type="path">', '<integrator type="volpath">')
    return text.replace("</scene>", hull + "</scene>")


def scene_to_learn(number):
    """The text of a scene file, for the folder of write_shared_files()."""
    r = random.Random(f"to learn {number}")
    kind = number % 4
    if kind < 2:
        text = furnished(r, random_room(10_000 + number))
    else:
        text = outdoors(r) if kind == 2 else still_life(r)
    text = with_pictures(text, r, r.choice([0.2, 0.5, 0.8]))
    if r.random() < 0.25:
        text = with_lens(r, text)
    if r.random() < 0.1:
        text = with_fog(r, text)
    return text


def write_scenes(folder, n):
    write_shared_files(folder)
    for number in range(n):
        (Path(folder) / f"s{number}.xml").write_text(scene_to_learn(number))
