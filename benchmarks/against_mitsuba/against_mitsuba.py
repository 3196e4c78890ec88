# SPDX-License-Identifier: Apache-2.0
"""Renders scenes with covary and with Mitsuba 3 at the same settings and compares images (`agree`) and times (`speed`).

    against_mitsuba.py agree --scenes DIR [NAME...]       exit code 1 where a scene does not agree
    against_mitsuba.py reference --scenes DIR [NAME...]   only fills the cache of Mitsuba renders
    against_mitsuba.py speed --scenes DIR [NAME...]
    against_mitsuba.py store SCENE.xml... --to DIR   block means of Mitsuba's renders as JSON, for tests

See ../README.md for what is compared, how, and how to read the tables.
"""
import argparse
import dataclasses
import datetime
import importlib.metadata
import json
import os
import pathlib
import platform
import sys

import numpy

import agreement
import renderers
import scene_files
import speed

DEFAULT_CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache")) / "covary-mitsuba"


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("names", nargs="*", metavar="NAME", help="scene names, or .xml files; all scenes when absent")
    common.add_argument("--scenes", metavar="DIR", help="folder with one sub-folder per scene")
    common.add_argument("--spp", type=int, help="samples per pixel (agree: 128 or more, speed: 32)")
    common.add_argument("--pixels", type=int, help="about so many pixels, aspect ratio kept (agree 9216, speed 230400)")
    common.add_argument("--max-depth", type=int, help="instead of the scenes' own")
    common.add_argument("--threads", type=int, default=0, help="for both renderers; 0: all cores")
    common.add_argument("--out", default="against_mitsuba_out", metavar="DIR", help="where reports and images go")
    program = argparse.ArgumentParser(add_help=False)
    program.add_argument("--covary", default="build/release/covary", metavar="PROGRAM")
    program.add_argument("--covary-option", action="append", default=[], metavar="OPTION", help="passed on; repeatable")
    seeds = argparse.ArgumentParser(add_help=False)
    seeds.add_argument("--seeds", type=int, default=16, help="renders of each side")
    seeds.add_argument("--target-error", type=float, default=0.0015, metavar="E",
                       help="multiply a scene's spp by 4, at most twice, until the relative error of Mitsuba's "
                       "image mean is below E (not with --spp)")
    seeds.add_argument("--cache", default=DEFAULT_CACHE, metavar="DIR", help="Mitsuba's renders are kept here")
    agree = commands.add_parser("agree", parents=[common, program, seeds])
    agree.add_argument("--suite-alpha", type=float, default=1e-3,
                       help="probability that any test of the run fails although all scenes agree")
    commands.add_parser("reference", parents=[common, seeds])
    store = commands.add_parser("store", parents=[common, seeds])
    store.add_argument("--to", required=True, metavar="DIR")
    timing = commands.add_parser("speed", parents=[common, program])
    timing.add_argument("--rounds", type=int, default=3, help="repetitions, in alternating order")
    timing.add_argument("--variants", nargs="+", default=["llvm_ad_rgb", "scalar_rgb"])
    return parser.parse_args(arguments)


def settings_of(scene, options, pixels, spp):
    width, height = scene_files.scaled_size(scene, options.pixels or pixels)
    return scene_files.Settings(width, height, options.spp or spp, options.max_depth)


def reference_stack(name, scene, options):
    """Mitsuba's renders of a scene, and the settings they were made with."""
    settings = settings_of(scene, options, 9216, 128)
    for factor in (1, 4, 16):
        scaled = dataclasses.replace(settings, spp=settings.spp * factor)
        stack = renderers.mitsuba_stack(name, scene, scaled, range(options.seeds), options.cache,
                                        threads=options.threads)
        grey = stack.mean(axis=(1, 2, 3), dtype=numpy.float64)
        error = grey.std(ddof=1) / len(grey) ** 0.5 / grey.mean()
        if options.spp or error < options.target_error:
            break
    return stack, scaled, grey.mean(), error


def machine():
    model = [line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")]
    return {"cpu": model[0] if model else platform.processor(), "cores": os.cpu_count(),
            "date": datetime.datetime.now().isoformat(timespec="seconds"), "load": os.getloadavg()[0]}


def save_error_images(folder, name, result):
    """The relative difference of the block means, and their t values, as EXR; red is covary brighter, blue darker in
    the PNG, full scale at twice the test's threshold."""
    import mitsuba

    folder.mkdir(parents=True, exist_ok=True)
    difference = numpy.nan_to_num(result.blocks.difference, posinf=1e3).astype(numpy.float32)
    mitsuba.Bitmap(difference).write(str(folder / f"{name}_difference.exr"))
    mitsuba.Bitmap(result.blocks.t.astype(numpy.float32)).write(str(folder / f"{name}_t.exr"))
    strongest = numpy.take_along_axis(
        result.blocks.t, numpy.abs(result.blocks.t).argmax(axis=2)[..., None], axis=2)[..., 0]
    scaled = numpy.clip(strongest / (2 * result.blocks.threshold), -1, 1)
    picture = numpy.stack([1 + numpy.minimum(scaled, 0), 1 - numpy.abs(scaled), 1 - numpy.maximum(scaled, 0)], axis=-1)
    picture = numpy.repeat(numpy.repeat(picture, 8, axis=0), 8, axis=1)
    mitsuba.Bitmap((picture * 255).astype(numpy.uint8)).write(str(folder / f"{name}_t.png"))


def worst_block(result):
    """Text: where |t| is largest, with its relative difference."""
    y, x, c = numpy.unravel_index(numpy.abs(result.blocks.t).argmax(), result.blocks.t.shape)
    return f"{result.blocks.difference[y, x, c]:+.1%} {'RGB'[c]} at ({8 * x},{8 * y})"


AGREE_HEADER = """\
| scene | frame, spp | ratio of means ± s.e. | p mean | finds mean | p blocks | finds block \
| worst block | p pixels | p all | verdict |
|---|---|---|---|---|---|---|---|---|---|---|"""


def agree_row(name, settings, result):
    finds_block = numpy.median(result.blocks.detectable[result.blocks.detectable > 0])
    verdict = result.verdict + (" (trace)" if result.trace and result.verdict == "agrees" else "")
    return (f"| {name} | {settings.width}x{settings.height}, {settings.spp} | {result.ratio:.4f} ± "
            f"{result.ratio_error:.4f} | {result.mean.p_value:.2g} | {result.mean.detectable[3]:.2%} | "
            f"{result.blocks.p_value:.2g} | {finds_block:.1%} | {worst_block(result)} | {result.pixels.p_value:.2g} | "
            f"{result.permutation_p:.2g} | {verdict} |")


def agree_json(settings, result):
    return {
        **dataclasses.asdict(settings), "seeds": result.seeds, "alpha": result.alpha, "power": 0.99,
        "ratio": result.ratio, "ratio_error": result.ratio_error, "verdict": result.verdict,
        "trace": bool(result.trace), "dropped_pixels": result.dropped_pixels,
        "mean": {"p": result.mean.p_value, "difference": result.mean.difference.tolist(),
                 "detectable": result.mean.detectable.tolist()},
        "blocks": {"p": result.blocks.p_value, "tests": result.blocks.tests, "threshold": result.blocks.threshold,
                   "detectable_median": float(numpy.median(result.blocks.detectable)),
                   "worst": worst_block(result)},
        "pixels": {"p": result.pixels.p_value, "tests": result.pixels.tests},
        "all": {"p": result.permutation_p},
    }


def agree(options):
    scenes = scene_files.find(options.scenes, options.names)
    covary = renderers.Covary(options.covary, tuple(options.covary_option))
    out = pathlib.Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    alpha = agreement.sidak_each(options.suite_alpha, 4 * len(scenes))
    lines = [f"{options.seeds} seeds of each renderer, box filter; alpha {alpha:.2g} per test "
             f"({options.suite_alpha:g} over {4 * len(scenes)} tests), power 0.99. {covary.version()}", "",
             AGREE_HEADER]
    print("\n".join(lines), flush=True)
    report, failed = {"machine": machine(), "covary": covary.version(), "scenes": {}}, False
    for name, scene in scenes.items():
        try:
            reference, settings, _, _ = reference_stack(name, scene, options)
            tested = covary.stack(scene, settings, range(options.seeds), options.threads)
            result = agreement.agreement(reference, tested, alpha)
            lines.append(agree_row(name, settings, result))
            report["scenes"][name] = agree_json(settings, result)
            failed |= result.verdict != "agrees"
            if result.verdict != "agrees":
                save_error_images(out, name, result)
        except renderers.RenderError as error:
            failed = True
            lines.append(f"| {name} | | | | | | | | | | failed |")
            report["scenes"][name] = {"verdict": "failed", "error": str(error)}
            print(error, file=sys.stderr)
        print(lines[-1], flush=True)
        (out / "agree.md").write_text("\n".join(lines) + "\n")
        (out / "agree.json").write_text(json.dumps(report, indent=1) + "\n")
    return 1 if failed else 0


def make_reference(options):
    for name, scene in scene_files.find(options.scenes, options.names).items():
        _, settings, mean, error = reference_stack(name, scene, options)
        print(f"{name}: {settings.width}x{settings.height}, {settings.spp} spp, mean {mean:.6g}, "
              f"standard error {error:.3%}",
              flush=True)
    return 0


def store(options):
    """Keeps what a test needs of Mitsuba's renders: mean and standard error of the image mean and of each block."""
    for name, scene in scene_files.find(options.scenes, options.names).items():
        stack, settings, _, _ = reference_stack(name, scene, options)
        blocks = agreement.block_means(stack)
        mean = stack.mean(axis=(1, 2), dtype=numpy.float64)

        def digits(values, count):
            return [float(f"{value:.{count}g}") for value in numpy.ravel(values)]

        def error(values):
            return digits(values.std(axis=0, ddof=1) / len(values) ** 0.5, 4)

        record = {
            "scene": name, "renderer": f"Mitsuba {importlib.metadata.version('mitsuba')} llvm_ad_rgb",
            **dataclasses.asdict(settings), "seeds": len(stack), "block": agreement.BLOCK,
            "layout": "blocks: rows, columns, then red, green, blue; errors: standard errors of the means over seeds",
            "mean": digits(mean.mean(axis=0), 7), "mean_errors": error(mean),
            "blocks": digits(blocks.mean(axis=0), 7), "block_errors": error(blocks),
        }
        path = pathlib.Path(options.to) / f"{name}.json"
        path.write_text(json.dumps(record).replace(', "', ',\n "') + "\n")
        print(f"{path}: {settings.width}x{settings.height}, {len(stack)} seeds of {settings.spp} spp")
    return 0


def measure_speed(options):
    scenes = scene_files.find(options.scenes, options.names)
    covary = renderers.Covary(options.covary, tuple(options.covary_option))
    out = pathlib.Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    sized = {name: (scene, settings_of(scene, options, 230400, 32)) for name, scene in scenes.items()}
    report = {"machine": machine(), "covary": covary.version(), "rounds": options.rounds, "scenes": {}}
    for name, (scene, settings) in sized.items():
        report["scenes"][name] = speed.measure(covary, scene, settings, options.variants, options.rounds,
                                               options.threads)
        print(speed.row(name, report["scenes"][name]), file=sys.stderr, flush=True)
        text = speed.table(report["scenes"], options.variants, report)
        (out / "speed.md").write_text(text)
        (out / "speed.json").write_text(json.dumps(report, indent=1) + "\n")
    print(text, end="")
    return 0


def main(arguments):
    options = parse(arguments)
    try:
        return {"agree": agree, "reference": make_reference, "store": store,
                "speed": measure_speed}[options.command](options)
    except (scene_files.SceneError, FileNotFoundError) as error:
        print(f"against_mitsuba: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
