# SPDX-License-Identifier: Apache-2.0
"""Renders mutations of Mitsuba's scene files: every one must load or be refused with a message.

    mutations.py FOLDER [--count N] [--seed S]      exit code 1 where a process was killed by a signal

FOLDER is a copy of github.com/mitsuba-renderer/mitsuba-data; the files are those of tests/scenes and docs/scenes. A
mutation makes one to three changes: a number becomes a different or an extreme one; the name of a plugin or property
becomes one of another file; an element is left out, duplicated or exchanged; a byte changes; the end is cut off. It is
rendered at 12 x 12 pixels with two samples, within 2 GB (COVARY_MEMORY) and 60 s of processor time.
"""
import argparse
import collections
import os
import pathlib
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile

from linked_tree import link_tree

NUMBER = re.compile(r'(?<=")-?\d+\.?\d*(?:e-?\d+)?(?="| |,)')
TYPE = re.compile(r'(?<=type=")[a-z_]+')
NAME = re.compile(r'(?<= name=")[a-z_0-9]+')
EXTREMES = ["0", "-1", "1e30", "-1e30", "nan", "inf", "1e-30", "4294967296", "2", "0.5", ""]
SECONDS = 60


def replace_one(text, pattern, replacement):
    places = list(pattern.finditer(text))
    if not places:
        return text
    place = RANDOM.choice(places)
    return text[:place.start()] + replacement() + text[place.end():]


def change_lines(text):
    lines = text.splitlines(keepends=True)
    whole = [i for i, line in enumerate(lines) if line.rstrip().endswith("/>")] or [0]  # mostly elements
    i, j = RANDOM.choice(whole), RANDOM.choice(whole)
    kind = RANDOM.randrange(3)
    if kind == 0:
        del lines[i]
    elif kind == 1:
        lines.insert(j, lines[i])
    else:
        lines[i], lines[j] = lines[j], lines[i]
    return "".join(lines)


def mutate(text, types, names):
    for _ in range(RANDOM.randint(1, 3)):
        kind = RANDOM.randrange(20)
        if kind < 10:
            text = replace_one(text, NUMBER, lambda: RANDOM.choice(EXTREMES + [str(RANDOM.uniform(-10, 10))] * 8))
        elif kind < 13:
            text = replace_one(text, TYPE, lambda: RANDOM.choice(types))
        elif kind < 14:
            text = replace_one(text, NAME, lambda: RANDOM.choice(names))
        elif kind < 19 or not text:
            text = change_lines(text) if text else text
        elif RANDOM.randrange(2):
            i = RANDOM.randrange(len(text))
            text = text[:i] + chr(RANDOM.randrange(32, 127)) + text[i + 1:]
        else:
            text = text[:RANDOM.randrange(len(text) // 2, len(text) + 1)]
    return text


def limit_time():
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 5))


def outcome(program, scene, out):
    command = [program, "render", str(scene), "--resolution", "12x12", "--spp", "2", "--estimator", "none", "--groups",
               "1", "--no-preview", "--overwrite", "-o", str(out)]
    text = scene.read_text()
    for name, value in (("integrator", "path"), ("spp", "2")):
        if f"${name}" in text or f'<default name="{name}"' in text:  # others would be refused
            command += ["-D", f"{name}={value}"]
    result = subprocess.run(command, capture_output=True, preexec_fn=limit_time, check=False,
                            env={**os.environ, "COVARY_MEMORY": "2"})
    if result.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return "takes too long"
    if result.returncode < 0 or result.returncode > 3:
        return f"exit code {result.returncode}"
    if result.returncode and not result.stderr.strip():
        return "refused without a message"
    return "renders" if result.returncode == 0 else "refused"


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--covary", default="build/release/covary", metavar="PROGRAM")
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--progress", action="store_true", help="count on stderr although it is no terminal")
    parser.add_argument("--keep", type=pathlib.Path, metavar="DIR", help="folder of the files that are no success")
    options = parser.parse_args(arguments)
    scenes = sorted(options.folder.glob("docs/scenes/*.xml")) + sorted(options.folder.glob("tests/scenes/*/*.xml"))
    types, names = (sorted({word for scene in scenes for word in pattern.findall(scene.read_text())})
                    for pattern in (TYPE, NAME))
    counts = collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder)
        link_tree(options.folder, copy)
        for i in range(options.count):
            RANDOM.seed(options.seed * 1000003 + i)
            scene = scenes[i % len(scenes)]
            mutation = copy / scene.relative_to(options.folder).parent / "mutation.xml"
            mutation.write_text(mutate(scene.read_text(), types, names))
            what = outcome(options.covary, mutation, copy / "out.exr")
            counts[what] += 1
            if sys.stderr.isatty() or options.progress:
                print(f"\r{i + 1}", end="", file=sys.stderr, flush=True)
            if what not in ("renders", "refused"):
                print(f"{i} {scene.stem}: {what}", flush=True)
                if options.keep:
                    (options.keep / f"{i}-{scene.name}").write_text(mutation.read_text())
    print(f"{options.count} mutations of {len(scenes)} files, seed {options.seed}: " +
          ", ".join(f"{n} {what}" for what, n in sorted(counts.items())))
    return 1 if set(counts) - {"renders", "refused", "takes too long"} else 0


RANDOM = random.Random()

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
