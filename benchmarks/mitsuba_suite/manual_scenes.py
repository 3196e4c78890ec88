# SPDX-License-Identifier: Apache-2.0
"""Which scenes of Mitsuba's manual covary and Mitsuba load, and the processor time that each takes.

    manual_scenes.py FOLDER [--out FILE]

FOLDER is a copy of github.com/mitsuba-renderer/mitsuba-data; its scenes are docs/scenes/*.xml. Mitsuba loads each in a
separate process, in its variant scalar_rgb. Parameters that a scene leaves to the command line are set to 16. Times are
user plus system time in seconds of loading alone: that of mitsuba.load_file(), and that of `covary info` minus that of
`covary --version`.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys

MITSUBA = """
import sys, time, mitsuba
mitsuba.set_variant("scalar_rgb")
mitsuba.set_log_level(mitsuba.LogLevel.Error)
mitsuba.load_dict({"type": "scene", "s": {"type": "sphere", "b": {"type": "diffuse"}}})
start = time.process_time()
mitsuba.load_file(sys.argv[1], **dict(pair.split("=") for pair in sys.argv[2:]))
print("seconds", time.process_time() - start)
"""


def run(command, **options):
    """Exit code, output and processor time of a child process."""
    before = os.times()
    result = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    after = os.times()
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    return result.returncode, result.stdout + result.stderr, seconds


def undefined(scene):
    """name=16 for each parameter that the scene leaves to the command line (they are numbers of samples)."""
    text = scene.read_text()
    defined = set(re.findall(r'<default\s+name="(\w+)"', text))
    return [f"{name}=16" for name in sorted(set(re.findall(r"\$(\w+)", text)) - defined)]


def load_with_mitsuba(scene):
    """Seconds, or None, and the last line of output."""
    code, text, _ = run([sys.executable, "-c", MITSUBA, str(scene), *undefined(scene)])
    lines = [line for line in text.splitlines() if line.strip()] or ["nothing"]
    if code == 0 and lines[-1].startswith("seconds"):
        return float(lines[-1].split()[1]), ""
    return None, lines[-1]


def load_with_covary(program, scene, idle):
    definitions = [word for pair in undefined(scene) for word in ("-D", pair)]
    code, text, seconds = run([program, "info", str(scene), *definitions])
    lines = text.strip().splitlines() or ["nothing"]
    return (max(seconds - idle, 0.0), "") if code == 0 else (None, lines[0].replace(str(scene.parent), ""))


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--covary", default="build/release/covary", metavar="PROGRAM")
    parser.add_argument("--out", default="manual_scenes.md", metavar="FILE")
    options = parser.parse_args(arguments)
    idle = min(run([options.covary, "--version"])[2] for _ in range(5))
    rows, lines = [], ["| scene | covary, s | Mitsuba, s | message |", "|---|---|---|---|"]
    for scene in sorted(pathlib.Path(options.folder, "docs", "scenes").glob("*.xml")):
        ours, our_message = load_with_covary(options.covary, scene, idle)
        theirs, their_message = load_with_mitsuba(scene)
        rows.append((ours, theirs))
        shown = ["does not load" if seconds is None else f"{seconds:.3f}" for seconds in (ours, theirs)]
        lines.append(f"| {scene.stem} | {shown[0]} | {shown[1]} | {our_message or their_message} |")
        print(lines[-1], flush=True)
    pathlib.Path(options.out).write_text("\n".join(lines) + "\n")
    both = [(ours, theirs) for ours, theirs in rows if ours is not None and theirs is not None]
    n_mitsuba = sum(theirs is not None for _, theirs in rows)
    n_covary = sum(ours is not None for ours, _ in rows)
    print(f"{len(rows)} scenes; covary loads {n_covary}, Mitsuba {n_mitsuba}, both {len(both)}; of these covary takes "
          f"{sum(ours for ours, _ in both):.2f} s, Mitsuba {sum(theirs for _, theirs in both):.2f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
