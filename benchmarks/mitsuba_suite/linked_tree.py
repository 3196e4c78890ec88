# SPDX-License-Identifier: Apache-2.0
"""A copy of Mitsuba's data repository in which scene files can be written and everything else is a link."""
import pathlib


def link_tree(folder, copy):
    """Makes the empty folder `copy` a tree like `folder`, whose folders of scenes are real, so that a file written
    there lies beside the files that it names."""
    folder, copy = pathlib.Path(folder), pathlib.Path(copy)
    for part in folder.iterdir():
        if part.name not in ("tests", "docs"):
            (copy / part.name).symlink_to(part.resolve())
    for scenes in [folder / "docs" / "scenes", *sorted((folder / "tests" / "scenes").iterdir())]:
        target = copy / scenes.relative_to(folder)
        target.mkdir(parents=True)
        for part in scenes.iterdir():
            (target / part.name).symlink_to(part.resolve())
