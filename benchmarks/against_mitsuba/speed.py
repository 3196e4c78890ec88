# SPDX-License-Identifier: Apache-2.0
"""Times of whole renders: covary against Mitsuba variants in one run, in alternating order from round to round.

`render` is the time in seconds from the scene in memory to the EXR file on disk, `total` also includes reading the
scene and building its acceleration structure. Mitsuba compiles kernels on first use: `warm` is its second render in a
process, `cold` its first in the first round, when its kernel cache on disk is empty. Mitsuba's figures exclude Python's
start-up. Every figure is the median over the rounds (`cold`: one measurement).
"""
import math
import pathlib
import statistics
import tempfile

import renderers


def measure(covary, scene, settings, variants, rounds, threads):
    """Times of one scene: {'covary': {...}, variant: {...}, ...}, seconds."""
    runs = {who: [] for who in ("covary", *variants)}
    for number in range(rounds):
        order = ["covary", *variants]
        for who in order if number % 2 == 0 else reversed(order):
            if who == "covary":
                with tempfile.TemporaryDirectory() as folder:
                    facts, wall, peak = covary.render(scene, settings, number, pathlib.Path(folder) / "out.exr",
                                                      threads)
                seconds = facts["seconds"]
                runs[who].append({"load": seconds["load"] + seconds["build"],
                                  "render": seconds["render"] + seconds["write"], "wall": wall, "peak_bytes": peak})
            else:
                facts = renderers.mitsuba_times(who, scene, settings, threads, 2, empty_kernel_cache=number == 0)
                runs[who].append({"load": facts["load"], "cold": facts["render"][0], "render": facts["render"][1],
                                  "wall": facts["wall"], "peak_bytes": facts["peak_bytes"]})
    result = {"width": settings.width, "height": settings.height, "spp": settings.spp, "runs": runs}
    for who, list_of_runs in runs.items():
        summary = {key: statistics.median(r[key] for r in list_of_runs) for key in ("load", "render", "wall")}
        summary["peak_bytes"] = max(r["peak_bytes"] for r in list_of_runs)
        summary["total"] = statistics.median(r["load"] + r["render"] for r in list_of_runs)
        if who != "covary":
            summary["cold"] = list_of_runs[0]["cold"]
        summary["samples_per_second"] = settings.width * settings.height * settings.spp / summary["render"]
        result[who] = summary
    return result


def ratios(scene, variant):
    """How many times faster covary is: warm, cold, warm with loading."""
    ours, theirs = scene["covary"], scene[variant]
    return (theirs["render"] / ours["render"], theirs["cold"] / ours["render"], theirs["total"] / ours["total"])


def row(name, scene):
    variants = [who for who in scene["runs"] if who != "covary"]
    ours = scene["covary"]
    cells = [name, f"{scene['width']}x{scene['height']}, {scene['spp']}", f"{ours['samples_per_second'] / 1e6:.2f}",
             f"{ours['load']:.2f}", f"{ours['render']:.2f}", f"{ours['peak_bytes'] / 2**20:.0f}"]
    for variant in variants:
        theirs = scene[variant]
        cells.append(f"{theirs['load']:.2f} / {theirs['render']:.2f} / {theirs['cold']:.2f}")
        cells.append(" / ".join(f"{r:.2f}" for r in ratios(scene, variant)))
    return "| " + " | ".join(cells) + " |"


def table(scenes, variants, report):
    head = ["scene", "frame, spp", "covary M samples/s", "load s", "render s", "peak MiB"]
    for variant in variants:
        head += [f"{variant}: load / warm / cold s", "covary is faster by: warm / cold / warm + load"]
    machine = report["machine"]
    lines = [f"{report['covary']} on {machine['cpu']}, {machine['cores']} cores, {machine['date']}; "
             f"{report['rounds']} rounds; load average at start {machine['load']:.1f}", "",
             "| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += [row(name, scene) for name, scene in scenes.items()]
    cells = ["geometric mean", "", "", "", "", ""]
    for variant in variants:
        means = [math.exp(statistics.mean(math.log(r) for r in column))
                 for column in zip(*(ratios(scene, variant) for scene in scenes.values()))]
        cells += ["", " / ".join(f"**{m:.2f}**" for m in means)]
    return "\n".join(lines + ["| " + " | ".join(cells) + " |"]) + "\n"
