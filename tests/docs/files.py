# SPDX-License-Identifier: Apache-2.0
"""The files that the documentation names and its readers have: small ones."""
import re
import shutil
import subprocess
from pathlib import Path

N_FRAMES = 48  # of the sequences on the pages
FRAMES = f"1-{N_FRAMES}"


def small_scene(source):
    text = (source / "scenes" / "room.xml").read_text(encoding="utf-8")
    for name, value in (("width", 64), ("height", 48), ("spp", 32)):
        text = re.sub(rf'(<default name="{name}" value=")\d+', rf"\g<1>{value}", text, count=1)
    return text


class Files:
    """Makes what is missing in `folder`."""

    def __init__(self, source, folder, blocks, environment):
        self.source, self.folder, self.environment = source, folder, environment
        self.named = {block.file: block.text for block in blocks if block.file}
        self.seed = 100
        for name in ("benchmarks", "docs", "suites", "tests"):
            (folder / name).symlink_to(source / name)
        shutil.copytree(source / "scenes", folder / "scenes")

    def covary(self, *words):
        subprocess.run(["covary", *words, "--quiet"], cwd=self.folder, env=self.environment, check=True)

    def make(self, name):
        """Makes the file, or those of the pattern, if it is one that readers have."""
        path = self.folder / name
        if path.exists() or ("#" in name and list(self.folder.glob(re.sub("#+", "*", name)))):
            return
        self.seed += 1
        seed = ("--seed", str(self.seed))
        render = ("render", "scene.xml", "--no-preview", "--estimator", "none", *seed)
        if name in self.named:
            path.write_text(self.named[name], encoding="utf-8")
        elif name in ("scene.xml", "room.xml"):
            path.write_text(small_scene(self.source), encoding="utf-8")
        elif name in ("scene.pbrt",):
            text = (self.source / "scenes" / "spheres.pbrt").read_text(encoding="utf-8")
            for name, value in (("xresolution", 64), ("yresolution", 48), ("pixelsamples", 8)):
                text = re.sub(rf'("integer {name}" *\[? *)\d+', rf"\g<1>{value}", text, count=1)
            path.write_text(text, encoding="utf-8")
        elif name == "model.glb":
            shutil.copy(self.source / "tests" / "fuzz" / "corpus" / "gltf" / "square.glb", path)
        elif name == "path.json":
            shutil.copy(self.source / "scenes" / "room-path.json", path)
        elif name == "room_####.xml":
            for frame in range(1, N_FRAMES + 1):
                (self.folder / f"room_{frame:04}.xml").write_text(small_scene(self.source), encoding="utf-8")
        elif name == "views.xml":
            self.views()
        elif re.fullmatch(r"(crn|independent)_####\.exr", name):
            self.pairs()
        elif re.fullmatch(r"\w+_####\.exr", name):
            self.make("scene.xml")
            self.covary(*render, "--spp", "16", "--aovs", "--frames", FRAMES, "-o", name)
        elif re.fullmatch(r"\w+\.exr", name):
            self.make("scene.xml")
            self.covary(*render, "--spp", "16", "--aovs", "-o", name)

    def views(self):
        """A scene with one of two sensors, in files of their own."""
        before, sensor, after = re.split(r"(<sensor.*?</sensor>)", small_scene(self.source), maxsplit=1, flags=re.S)
        (self.folder / "views.xml").write_text(f'{before}<include filename="$view.xml"/>{after}', encoding="utf-8")
        for view in ("left", "right"):
            (self.folder / f"{view}.xml").write_text(f'<scene version="3.0.0">{sensor}</scene>', encoding="utf-8")

    def pairs(self):
        self.make("scene.xml")
        self.covary("render", "scene.xml", "--no-preview", "--estimator", "iicv", "--spp", "24", "--frames", FRAMES,
                    "--passes", "pair_####", "-o", "pair_####.exr")
        for frame in range(1, N_FRAMES + 1):
            for kind in ("crn", "independent"):
                shutil.copy(self.folder / f"pair_{frame:04}" / f"{kind}.exr",
                            self.folder / f"{kind}_{frame:04}.exr")


#: Options whose values are written.
OUTPUTS = ("-o", "--json", "--save-training", "--passes", "--save-stages")


def inputs_of(words):
    """The words of a command that may be files to read."""
    if "convert-scene" in words:  # the last is written
        words = words[:-1]
    return [word for before, word in zip(["", *words], words)
            if before not in OUTPUTS and re.search(r"\.(xml|pbrt|glb|json|exr)$", word)]


def sandbox_environment(base, covary, python, folder):
    """With the programs under the names that the pages have for them."""
    programs = folder / "programs"
    programs.mkdir()
    (programs / "covary").write_text(f'#!/bin/sh\nexec {covary} "$@"\n')
    for name in ("python", "python3"):
        (programs / name).write_text(f'#!/bin/sh\nexec {python} "$@"\n')
    # Readers have a browser, here one that only looks whether the page is there.
    (programs / "xdg-open").write_text('#!/bin/sh\ncase "$1" in http:*) ;; *) test -s "${1#file://}";; esac\n')
    for file in programs.iterdir():
        file.chmod(0o755)
    return {**base, "PATH": f"{programs}:{base['PATH']}", "HOME": str(folder), "COVARY_PROGRAM": str(covary),
            "DISPLAY": ":0"}


__all__ = ["Files", "inputs_of", "sandbox_environment", "Path"]
