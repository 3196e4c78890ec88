# SPDX-License-Identifier: Apache-2.0
"""Rooms of random size, light, clutter and material, determined by their number. So nobody chose these scenes, which
range from ones that any filter renders well to ones whose light hardly any path finds."""
import random

HEAD = """<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>
<sensor type="perspective"><float name="fov" value="{fov:.0f}"/>
<transform name="to_world"><lookat origin="{origin}" target="{target}" up="0, 1, 0"/></transform>
<sampler type="independent"/>
<film type="hdrfilm"><integer name="width" value="160"/><integer name="height" value="90"/><rfilter type="box"/></film>
</sensor>
"""


def triple(values):
    return ", ".join(f"{v:.4g}" for v in values)


def colour(r, low=0.08, high=0.85):
    grey = r.uniform(low, high)
    return triple(min(0.9, grey * r.uniform(0.6, 1.3)) for _ in range(3))


def texture(r, name):
    """A colour, or a checkerboard from coarse to finer than a pixel."""
    if r.random() < 0.6:
        return f'<rgb name="{name}" value="{colour(r)}"/>'
    scale = 2**r.uniform(1, 6.5)
    return (f'<texture name="{name}" type="checkerboard"><rgb name="color0" value="{colour(r)}"/>'
            f'<rgb name="color1" value="{colour(r)}"/>'
            f'<transform name="to_uv"><scale x="{scale:.1f}" y="{scale:.1f}"/></transform></texture>')


def model(r, glass):
    """A reflectance model; `glass`: how often it is glass or a mirror."""
    alpha = f'<float name="alpha" value="{r.uniform(0.03, 0.4):.3f}"/>'
    if r.random() < glass:
        return r.choice([
            '<bsdf type="dielectric"><string name="int_ior" value="bk7"/></bsdf>',
            '<bsdf type="dielectric"><string name="int_ior" value="bk7"/></bsdf>',
            f'<bsdf type="roughdielectric">{alpha}</bsdf>',
            '<bsdf type="twosided"><bsdf type="conductor"><string name="material" value="Ag"/></bsdf></bsdf>'])
    kind = r.choice(["diffuse", "diffuse", "diffuse", "plastic", "roughplastic", "roughconductor"])
    if kind == "diffuse":
        inner = f'<bsdf type="diffuse">{texture(r, "reflectance")}</bsdf>'
    elif kind == "roughconductor":
        metal = f'<string name="material" value="{r.choice(["Au", "Cu", "Al"])}"/>'
        inner = f'<bsdf type="roughconductor">{metal}{alpha}</bsdf>'
    else:
        roughness = alpha if kind == "roughplastic" else ""
        inner = f'<bsdf type="{kind}">{texture(r, "diffuse_reflectance")}{roughness}</bsdf>'
    return f'<bsdf type="twosided">{inner}</bsdf>'


def box(half, at, inner, turn=0.0):
    return (f'<shape type="cube"><transform name="to_world"><scale value="{triple(half)}"/>'
            f'<rotate y="1" angle="{turn:.1f}"/><translate value="{triple(at)}"/></transform>{inner}</shape>\n')


def ball(radius, at, inner):
    return (f'<shape type="sphere"><point name="center" value="{triple(at)}"/>'
            f'<float name="radius" value="{radius:.4g}"/>{inner}</shape>\n')


def light(power, area):
    """Radiance, warm to cold, of an area with this power."""
    warm = power / area
    return f'<emitter type="area"><rgb name="radiance" value="{triple((warm, 0.85 * warm, 0.7 * warm))}"/></emitter>'


def walls(r, w, h, d):
    thick = 0.05
    text = ""
    for half, at in [((w, thick, d), (0, -thick, 0)), ((w, thick, d), (0, h + thick, 0)),
                     ((thick, h / 2, d), (-w - thick, h / 2, 0)), ((thick, h / 2, d), (w + thick, h / 2, 0)),
                     ((w, h / 2, thick), (0, h / 2, -d - thick)), ((w, h / 2, thick), (0, h / 2, d + thick))]:
        text += box(half, at, model(r, 0.04))
    return text


def lights(r, w, h, d, hidden):
    """One to eight spherical lights, bare or in a globe of glass, and sometimes a window."""
    text = ""
    for _ in range(r.choice([1, 1, 1, 2, 3, 8])):
        radius = 10**r.uniform(-2, -0.6)
        at = (r.uniform(-0.8, 0.8) * w, r.uniform(0.6, 0.85) * h, r.uniform(-0.9, -0.55 if hidden else 0.5) * d)
        text += ball(radius, at, light(10**r.uniform(0.5, 1.7), 12.6 * radius * radius))
        if r.random() < hidden * 0.5:
            text += ball(radius * r.uniform(1.3, 3), at, '<bsdf type="dielectric"/>')
    if r.random() < 0.4:
        half = 10**r.uniform(-1.2, -0.1)
        at = (-w + 0.01, r.uniform(0.4, 0.7) * h, r.uniform(-0.5, 0.3) * d)
        text += box((0.005, half, half), at, light(10**r.uniform(0.4, 1.7), 8 * half * half))
    return text


def clutter(r, w, h, d, glass):
    text = ""
    for _ in range(r.choice([3, 6, 12, 40])):
        size = r.uniform(0.05, 0.35)
        at = (r.uniform(-0.85, 0.85) * w, size + r.choice([0, 0, 0, 0.7]), r.uniform(-0.85, 0.4) * d)
        if r.random() < 0.5:
            text += ball(size, at, model(r, glass))
        else:
            text += box((size, size, size * r.uniform(0.3, 1)), at, model(r, glass), r.uniform(0, 90))
    return text


def random_room(number):
    """The text of a scene file."""
    r = random.Random(number)
    w, h, d = r.uniform(1.5, 3), r.uniform(2.2, 3), r.uniform(2.5, 4)
    hidden = r.random() < 0.25  # the lights are behind a wall with a gap
    glass = r.choice([0.05, 0.15, 0.35])
    origin = (r.uniform(-0.7, 0.7) * w, r.uniform(0.35, 0.7) * h, 0.92 * d)
    target = (r.uniform(-0.5, 0.5) * w, r.uniform(0.2, 0.45) * h, r.uniform(-0.6, 0) * d)
    text = HEAD.format(depth=r.choice([5, 8, 12, 20]), fov=r.uniform(40, 70), origin=triple(origin),
                       target=triple(target))
    text += walls(r, w, h, d) + lights(r, w, h, d, hidden) + clutter(r, w, h, d, glass)
    if hidden:
        gap = r.uniform(0.05, 0.4) * w
        text += box(((2 * w - gap) / 2, h / 2, 0.02), (-gap / 2, h / 2, -0.45 * d), model(r, 0))
    if r.random() < 0.2:
        text += f'<emitter type="constant"><rgb name="radiance" value="{colour(r, 0.02, 0.2)}"/></emitter>\n'
    return text + "</scene>\n"
