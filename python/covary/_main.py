# SPDX-License-Identifier: Apache-2.0
"""The command `covary` of an installed package."""
from __future__ import annotations

import os
import sys

from ._program import program


def main() -> None:
    """Becomes the program, with the arguments of this process. Only `covary experiment … --cluster ADDRESS` is
    Python's."""
    if sys.argv[1:2] == ["experiment"] and any(word.partition("=")[0] == "--cluster" for word in sys.argv):
        from .distributed import main as on_cluster

        sys.exit(on_cluster(sys.argv[1:]))
    path = str(program())
    os.execv(path, [path, *sys.argv[1:]])
