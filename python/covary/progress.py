# SPDX-License-Identifier: Apache-2.0
"""Progress bars for `progress=`."""
from __future__ import annotations

import importlib
from typing import Any


def tqdm(**options: Any) -> Any:
    """A bar of tqdm (`pip install tqdm`), which takes the options: `render(…, progress=covary.progress.tqdm())`."""
    try:
        bar = importlib.import_module("tqdm.auto").tqdm(**options)
    except ImportError as error:
        raise ImportError("covary.progress.tqdm() needs the package tqdm: pip install tqdm") from error

    def update(done: int, total: int) -> None:
        bar.total = total
        bar.n = done
        bar.refresh()
        if done >= total:
            bar.close()

    return update
