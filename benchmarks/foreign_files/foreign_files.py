#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What every command makes of EXR files of others: read, or refused in words. Prints a table of outcomes by folder and
command, and the words of each refusal; ends with code 1 if a command crashed or hung.

    foreign_files.py FOLDER... [--covary build/release/covary] [--commands info,convert]

Searches the folders for *.exr. A file is denoised and combined with a copy of itself (--force: the seeds are the same),
without a network."""
import argparse
import collections
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

COMMANDS = {
    "info": ("info", "FILE"),
    "denoise": ("denoise", "FILE", "COPY", "--oidn", "off", "--force", "-o", "o.exr", "--overwrite"),
    "combine": ("combine", "--independent", "FILE", "COPY", "--oidn", "off", "--force", "-o", "o.exr", "--overwrite"),
    "compare": ("compare", "COPY", "--reference", "FILE"),
    "convert": ("convert", "FILE", "o.png", "--overwrite"),
    "view": ("view", "FILE", "-o", "o.html"),
}
SECONDS = 600


def outcome(covary, command, path, copy, folder):
    """One of "done", "refused", "crashed", "hung", and the words of a refusal."""
    words = [{"FILE": str(path), "COPY": str(copy)}.get(word, word) for word in command]
    try:
        result = subprocess.run([covary, *words], cwd=folder, capture_output=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return "hung", ""
    said = result.stderr.decode(errors="replace")
    if result.returncode == 0:
        return "done", ""
    refused = result.returncode in (1, 2) and "covary: " in said and "internal error" not in said
    last = next((line for line in said.splitlines() if line.startswith("covary: ")), said[-300:])
    for name in (str(path), str(copy)):
        last = last.replace(name, "FILE")
    return "refused" if refused else "crashed", last


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--covary", default="build/release/covary")
    parser.add_argument("--commands", default=",".join(COMMANDS), help="default: all")
    options = parser.parse_args()
    covary = str(Path(shutil.which(options.covary) or options.covary).resolve())
    counts = collections.defaultdict(collections.Counter)
    refusals = collections.defaultdict(list)
    bad = False
    for folder in options.folders:
        for path in sorted(folder.rglob("*.exr")):
            with tempfile.TemporaryDirectory() as work:
                copy = Path(work) / "copy.exr"
                shutil.copy(path, copy)
                for name in options.commands.split(","):
                    command = COMMANDS[name]
                    what, words = outcome(covary, command, path.resolve(), copy, work)
                    counts[folder.name, name][what] += 1
                    if what != "done":
                        refusals[name, what, re.sub(r"[0-9]+", "N", words)].append((path.name, words))
                        bad |= what != "refused"
    print("| files | command | done | refused | crashed | hung |\n|---|---|---|---|---|---|")
    for (folder, name), counter in counts.items():
        print(f"| {folder} | {name} | " + " | ".join(str(counter[w]) for w in ("done", "refused", "crashed", "hung"))
              + " |")
    print()
    for (name, what, _), files in sorted(refusals.items()):
        print(f"{name}, {what}, {len(files)} files, such as {files[0][0]}: {files[0][1]}")
    return bad


if __name__ == "__main__":
    sys.exit(main())
