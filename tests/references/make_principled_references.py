#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Evaluates `principled` and `principledthin` with Mitsuba 3 (variant scalar_rgb) and writes principled.json, which
src/bsdfs/principled_test.cpp compares with. Run with any Python that has Mitsuba installed:

    python make_principled_references.py [output file]

The file is like bsdfs.json (see make_bsdf_references.py), with values [r, g, b] without density: our lobes are chosen
with other probabilities.
"""

import json
import random
import sys

import make_bsdf_references as base
import mitsuba as mi

RNG = random.Random(11)


def number(low=0.0, high=1.0):
    return round(RNG.uniform(low, high), 3)


def colour():
    return base.rgb(number(), number(), number())


def principled_cases():
    yield {}
    yield {"base_color": base.rgb(0, 0, 0), "sheen": 0.5, "sheen_tint": 1.0}
    yield {"specular": 0.0}
    yield {"specular": 0.0, "metallic": 0.7}
    yield {"specular": 0.0, "spec_trans": 0.6}
    yield {"eta": 1.0, "spec_trans": 1.0}
    yield {"eta": 0.7, "spec_tint": 0.8, "base_color": colour()}
    yield {"eta": 1.45, "roughness": 0.129629642, "spec_trans": 1.0, "base_color": base.rgb(0.64, 0.64, 0.64)}
    yield {"eta": 1.45, "roughness": 0.2, "metallic": 0.839125454}
    yield {"metallic": 1.0, "base_color": colour(), "roughness": 0.05}
    yield {"metallic": 1.0, "base_color": colour(), "roughness": 0.0}
    yield {"clearcoat": 1.0, "clearcoat_gloss": 1.0}
    for name in ["anisotropic", "spec_trans", "spec_tint", "sheen", "flatness", "clearcoat", "clearcoat_gloss"]:
        yield {name: 0.75, "base_color": colour(), "roughness": number(0.2, 0.8)}
    yield {"sheen": 1.0, "sheen_tint": 0.6, "base_color": colour(), "metallic": 0.3}
    yield {"flatness": 1.0, "base_color": colour(), "spec_trans": 0.5}
    for i in range(16):  # everything at once
        names = ["roughness", "anisotropic", "metallic", "spec_trans", "spec_tint", "sheen", "sheen_tint", "flatness",
                 "clearcoat", "clearcoat_gloss"]
        index = {"eta": number(1.05, 2.5)} if i % 3 else {"specular": number()}
        yield {**{name: number() for name in names}, "base_color": colour(), **index}


def thin_cases():
    yield {}
    yield {"base_color": base.rgb(0, 0, 0), "sheen": 0.5, "sheen_tint": 1.0, "spec_trans": 0.2}
    yield {"spec_trans": 1.0, "eta": 1.33, "roughness": 0.15}
    yield {"spec_trans": 1.0, "eta": 1.0, "roughness": 0.3}
    yield {"spec_trans": 0.5, "eta": 0.7, "roughness": 0.4, "spec_tint": 0.5, "base_color": colour()}
    yield {"diff_trans": 2.0, "base_color": colour()}
    for name in ["anisotropic", "spec_trans", "spec_tint", "sheen", "flatness", "diff_trans"]:
        yield {name: 0.75, "base_color": colour(), "roughness": number(0.2, 0.8)}
    for _ in range(10):
        names = ["roughness", "anisotropic", "spec_trans", "spec_tint", "sheen", "sheen_tint", "flatness"]
        yield {**{name: number() for name in names}, "base_color": colour(), "eta": number(1.05, 2.5),
               "diff_trans": number(0, 2)}


def evaluate(bsdf, importance, pairs):
    plugin = mi.load_dict(bsdf)
    context = mi.BSDFContext(mi.TransportMode.Importance if importance else mi.TransportMode.Radiance)
    values = [[base.digits(x) for x in plugin.eval(context, base.interaction(wo), wi)] for wo, wi in pairs]
    case = {"bsdf": bsdf, "values": [v if any(v) else 0 for v in values]}
    if importance:
        case["importance"] = True
    return case


def main():
    pairs = base.make_pairs()
    cases = []
    for more in principled_cases():
        for importance in [False, True] if "spec_trans" in more else [False]:
            cases.append(evaluate({"type": "principled", **more}, importance, pairs))
    for more in thin_cases():
        cases.append(evaluate({"type": "principledthin", **more}, False, pairs))
    with open(sys.argv[1] if len(sys.argv) > 1 else "principled.json", "w") as f:
        head = json.dumps({"mitsuba": mi.__version__, "pairs": pairs}, separators=(",", ":"))
        f.write(head[:-1] + ',"cases":[\n')
        f.write(",\n".join(json.dumps(c, separators=(",", ":")) for c in cases) + "\n]}\n")


if __name__ == "__main__":
    main()
