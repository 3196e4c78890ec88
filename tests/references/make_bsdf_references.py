#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Evaluates reflectance models with Mitsuba 3 (variant scalar_rgb) and writes bsdfs.json, which
src/bsdfs/references_test.cpp compares with. Run with any Python that has Mitsuba installed:

    python make_bsdf_references.py [output file]

File: "mitsuba" version; "pairs": directions [wo, wi] in the local frame, pointing away from the surface; "cases",
each with
  "name", "bsdf"  a dictionary as Mitsuba's load_dict takes it
  "importance"    true: the value for light paths
  "tolerance"     relative error of the value accepted, and of the density where "density_tolerance" is not given
  "values"        for each pair [r, g, b, pdf] of f |cos theta_i|; 0 stands for four zeros
  "samples"       for models with delta lobes: [wo, u_lobe, wi, weight, pdf, eta]
  "gradient"      value derivatives (dh/du, dh/dv) of the texture named "bump", for bump maps

Tolerance: 1e-3 covers single precision. Mitsuba's masking term for the Beckmann distribution is a rational fit that is
off by 0.35 % per direction; ours is exact, hence 8e-3 there. Its transmittance table for roughplastic comes from a
quadrature that is off by 2e-4 for GGX (ours by 2e-5), which is 5e-3 of the small reflectance that the probabilities of
lobes come from. Its logarithm of the Bessel function I0 of hair is off by up to 0.5 %.
"""

import json
import math
import os
import random
import sys

import mitsuba as mi

mi.set_variant("scalar_rgb")

EXACT, BECKMANN, HAIR = 1e-3, 8e-3, 8e-3


def rgb(r, g, b):
    return {"type": "rgb", "value": [r, g, b]}


def spherical(theta_degrees, phi):
    t = math.radians(theta_degrees)
    return [math.sin(t) * math.cos(phi), math.sin(t) * math.sin(phi), math.cos(t)]


def normalized(v):
    length = math.sqrt(sum(x * x for x in v))
    return [round(x / length, 8) for x in v]


OUTGOING = [normalized(spherical(t, p)) for t, p in [(3, 0.4), (25, 1.9), (50, -2.4), (72, 0.9), (85, 3.0),
                                                      (110, -0.8), (140, 2.2), (170, 1.1)]]


def make_pairs():
    """Directions near the mirror and the refracted direction (eta about 1.5), and scattered ones on both sides."""
    rng = random.Random(7)
    pairs = []
    for wo in OUTGOING:
        def around(w, spread):
            return normalized([x + rng.gauss(0, spread) for x in w])

        mirror = [-wo[0], -wo[1], wo[2]]
        eta = 1.5 if wo[2] > 0 else 1 / 1.5
        sin2 = (1 - wo[2] ** 2) / eta**2
        wi = [mirror, around(mirror, 0.02), around(mirror, 0.15)]
        if sin2 < 1:
            refracted = [-wo[0] / eta, -wo[1] / eta, -math.copysign(math.sqrt(1 - sin2), wo[2])]
            wi += [around(refracted, 0.01), around(refracted, 0.1)]
        wi += [around([0, 0, 0], 1) for _ in range(3)]
        pairs += [[wo, normalized(w)] for w in wi]
    return pairs


def cases():
    def case(name, bsdf, tolerance=EXACT, **more):
        return {"name": name, "bsdf": bsdf, "tolerance": tolerance, **more}

    blue, warm = rgb(0.1, 0.27, 0.36), rgb(0.8, 0.5, 0.2)
    diffuse = {"type": "diffuse", "reflectance": rgb(0.2, 0.25, 0.7)}
    yield case("diffuse", {"type": "diffuse"})
    yield case("diffuse, coloured", diffuse)
    yield case("twosided", {"type": "twosided", "a": diffuse})
    yield case("twosided, two", {"type": "twosided", "a": diffuse, "b": {"type": "diffuse"}})
    yield case("twosided, plastic", {"type": "twosided", "a": {"type": "plastic"}}, samples=True)
    yield case("null", {"type": "null"}, samples=True)

    # Smooth interfaces.
    for more in [{}, {"int_ior": "water"}, {"int_ior": "air", "ext_ior": "water"}, {"int_ior": 1.7, "ext_ior": 1.7},
                 {"int_ior": "diamond", "specular_reflectance": blue, "specular_transmittance": warm}]:
        name = ", ".join(f"{k}={v if not isinstance(v, dict) else 'rgb'}" for k, v in more.items())
        yield case(f"dielectric {name}", {"type": "dielectric", **more}, samples=True)
        yield case(f"dielectric {name}, importance", {"type": "dielectric", **more}, samples=True, importance=True)
        yield case(f"thindielectric {name}", {"type": "thindielectric", **more}, samples=True)
    yield case("conductor", {"type": "conductor"}, samples=True)
    yield case("conductor, indices", {"type": "conductor", "eta": rgb(0.2, 0.9, 1.1), "k": rgb(3.9, 2.4, 2.1),
                                      "specular_reflectance": warm}, samples=True)
    for more in [{}, {"diffuse_reflectance": blue, "int_ior": 1.9}, {"diffuse_reflectance": blue, "nonlinear": True},
                 {"specular_reflectance": warm, "int_ior": "water", "nonlinear": True}]:
        yield case(f"plastic {list(more)}", {"type": "plastic", **more}, samples=True)

    # Rough interfaces.
    for distribution, tolerance in [("ggx", EXACT), ("beckmann", BECKMANN)]:
        for more in [{}, {"alpha": 0.02}, {"alpha": 0.4, "material": "Cu"},
                     {"alpha_u": 0.1, "alpha_v": 0.35, "material": "Al"},
                     {"alpha": 0.2, "sample_visible": False, "specular_reflectance": warm},
                     {"alpha_u": 0.3, "alpha_v": 0.15, "sample_visible": False, "eta": rgb(0.2, 0.9, 1.1),
                      "k": rgb(3.9, 2.4, 2.1)}]:
            yield case(f"roughconductor {distribution} {list(more)}",
                       {"type": "roughconductor", "distribution": distribution, **more}, tolerance)
        for more in [{}, {"alpha": 0.02}, {"alpha": 0.35}, {"alpha_u": 0.1, "alpha_v": 0.35, "int_ior": "water"},
                     {"alpha": 0.2, "int_ior": 1.0, "ext_ior": 1.5, "specular_transmittance": warm},
                     {"alpha": 0.2, "sample_visible": False, "specular_reflectance": warm}]:
            bsdf = {"type": "roughdielectric", "distribution": distribution, **more}
            yield case(f"roughdielectric {distribution} {list(more)}", bsdf, tolerance)
            yield case(f"roughdielectric {distribution} {list(more)}, importance", bsdf, tolerance, importance=True)
        for more in [{}, {"alpha": 0.02}, {"alpha": 0.4, "diffuse_reflectance": blue, "nonlinear": True},
                     {"alpha": 0.2, "int_ior": 1.9, "specular_reflectance": warm},
                     {"alpha": 0.2, "sample_visible": False, "diffuse_reflectance": blue}]:
            yield case(f"roughplastic {distribution} {list(more)}",
                       {"type": "roughplastic", "distribution": distribution, **more}, tolerance,
                       density_tolerance=8e-3)

    # Models of polarised light, as variants without it have them.
    for more in [{}, {"alpha": 0.3, "diffuse_reflectance": blue, "int_ior": 1.7},
                 {"alpha": 0.2, "specular_reflectance": warm}]:
        yield case(f"pplastic {list(more)}", {"type": "pplastic", "distribution": "ggx", **more})
    for model in ["polarizer", "circular", "retarder"]:
        yield case(model, {"type": model}, samples=True)
    yield case("polarizer, coloured", {"type": "polarizer", "transmittance": warm}, samples=True)

    # Fibres.
    for more in [{}, {"eumelanin": 0.2, "pheomelanin": 0.4}, {"sigma_a": rgb(0.2, 0.25, 0.7), "scale": 2.0},
                 {"longitudinal_roughness": 0.1, "azimuthal_roughness": 0.6, "scale_tilt": 4.0},
                 {"longitudinal_roughness": 0.8, "azimuthal_roughness": 0.15, "int_ior": 1.4}]:
        yield case(f"hair {list(more)}", {"type": "hair", **more}, HAIR)

    # Measured materials, of make_measured_files.py.
    for name in ["isotropic", "half", "quarter"]:
        yield case(f"measured, {name}", {"type": "measured", "filename": f"measured_{name}.bsdf"})

    # Wrappers.
    metal = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.25, "material": "Au"}
    yield case("mask", {"type": "mask", "opacity": 0.3, "nested": diffuse}, samples=True)
    yield case("mask, plastic", {"type": "mask", "opacity": 0.8, "nested": {"type": "plastic"}}, samples=True)
    yield case("mask, twosided", {"type": "mask", "nested": {"type": "twosided", "a": metal}}, samples=True)
    yield case("blendbsdf", {"type": "blendbsdf", "weight": 0.3, "a": diffuse, "b": metal})
    yield case("twosided blendbsdf", {"type": "twosided",
                                      "n": {"type": "blendbsdf", "weight": 0.9, "a": metal, "b": diffuse}})
    bumps = [(0.3, -0.5), (2.0, 1.0)]
    glass = {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.3}
    for gradient in bumps:
        for more in [{}, {"flip_invalid_normals": False}, {"use_shadowing_function": False}, {"scale": 2.5}]:
            for name, nested in [("metal", metal), ("twosided", {"type": "twosided", "n": diffuse}), ("glass", glass)]:
                if more and name != "metal":
                    continue
                yield case(f"bumpmap {gradient} {list(more)}, {name}", {"type": "bumpmap", "nested": nested, **more},
                           gradient=gradient)
    for normal in [(0.5, 0.5, 1.0), (0.7, 0.35, 0.9), (0.1, 0.6, 0.7)]:
        for more in [{}, {"flip_invalid_normals": False}, {"use_shadowing_function": False}]:
            for name, nested in [("metal", metal), ("diffuse", diffuse), ("glass", glass)]:
                if more and name != "metal":
                    continue
                yield case(f"normalmap {normal} {list(more)}, {name}",
                           {"type": "normalmap", "normalmap": rgb(*normal), "nested": nested, **more})


def interaction(wo):
    si = mi.SurfaceInteraction3f()
    si.t = 1
    si.p = [0, 0, 0]
    si.n = [0, 0, 1]
    si.sh_frame = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1])
    si.uv = [0.5, 0.5]
    si.dp_du, si.dp_dv = [1, 0, 0], [0, 1, 0]
    si.wi = wo
    return si


def digits(x):
    return float(f"{x:.6g}")


def for_mitsuba(bsdf, gradient):
    """The dictionary with textures that have the wanted derivative or the wanted value."""
    result = dict(bsdf)
    if gradient:
        # A 2 x 2 image is linear in u and v between the centres of its texels.
        u, v = gradient
        image = [[0.0, u / 2], [v / 2, (u + v) / 2]]
        result["bump"] = {"type": "bitmap", "raw": True, "filter_type": "bilinear", "wrap_mode": "clamp",
                          "data": mi.TensorXf([image[0][0], image[0][1], image[1][0], image[1][1]], shape=(2, 2, 1))}
    if "normalmap" in bsdf:
        colour = bsdf["normalmap"]["value"]
        result["normalmap"] = {"type": "bitmap", "raw": True, "data": mi.TensorXf(colour * 4, shape=(2, 2, 3))}
    return result


def evaluate(case, pairs):
    gradient = case.get("gradient")
    bsdf = mi.load_dict(for_mitsuba(case["bsdf"], gradient))
    mode = mi.TransportMode.Importance if case.get("importance") else mi.TransportMode.Radiance
    context = mi.BSDFContext(mode)
    if gradient:
        texture = mi.load_dict(for_mitsuba(case["bsdf"], gradient)["bump"])
        case["gradient"] = [digits(x) for x in texture.eval_1_grad(interaction([0, 0, 1]))]
        assert all(abs(a - b) < 1e-5 for a, b in zip(case["gradient"], gradient)), case["gradient"]
    values = []
    for wo, wi in pairs:
        value, pdf = bsdf.eval_pdf(context, interaction(wo), wi)
        row = [digits(x) for x in value] + [digits(pdf)]
        values.append(row if any(row) else 0)
    if any(values):
        case["values"] = values
    if case.pop("samples", False):
        case["samples"] = []
        for wo in OUTGOING:
            for u in (0.001, 0.02, 0.5, 0.97):
                s, weight = bsdf.sample(context, interaction(wo), u, [0.3, 0.6])
                delta = mi.has_flag(mi.BSDFFlags(s.sampled_type), mi.BSDFFlags.Delta) or mi.has_flag(
                    mi.BSDFFlags(s.sampled_type), mi.BSDFFlags.Null)
                if delta or s.pdf == 0:
                    case["samples"].append([wo, u, [digits(x) for x in s.wo], [digits(x) for x in weight],
                                            digits(s.pdf), digits(s.eta)])
    return case


def conductors():
    """Reflectance of every named conductor at 45 degrees."""
    folder = os.path.join(os.path.dirname(mi.__file__), "data", "ior")
    wo = spherical(45, 0.3)
    result = {}
    for file in sorted(os.listdir(folder)):
        if file.endswith(".eta.spd"):
            name = file[: -len(".eta.spd")]
            bsdf = mi.load_dict({"type": "conductor", "material": name})
            _, weight = bsdf.sample(mi.BSDFContext(), interaction(wo), 0.5, [0.5, 0.5])
            result[name] = [digits(x) for x in weight]
    return result


def main():
    mi.file_resolver().append(os.path.dirname(os.path.abspath(__file__)))
    pairs = make_pairs()
    reference = {"mitsuba": mi.__version__, "pairs": pairs, "conductors_at_45_degrees": conductors(),
                 "cases": [evaluate(c, pairs) for c in cases()]}
    with open(sys.argv[1] if len(sys.argv) > 1 else "bsdfs.json", "w") as f:
        head = {k: v for k, v in reference.items() if k != "cases"}
        f.write(json.dumps(head, separators=(",", ":"))[:-1] + ',"cases":[\n')
        f.write(",\n".join(json.dumps(c, separators=(",", ":")) for c in reference["cases"]))
        f.write("\n]}\n")


if __name__ == "__main__":
    main()
