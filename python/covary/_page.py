# SPDX-License-Identifier: Apache-2.0
"""The live page of `covary render --live`, of a render in Python."""
from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _covary
from .progress import in_notebook

if TYPE_CHECKING:
    from types import TracebackType

HEIGHT = 900  # of the page in a notebook, in pixels


class LivePage:
    """Serves the page while the render runs, if one is wanted; `page` is None otherwise."""

    def __init__(self, live: bool | int, scene: str, output: str | None) -> None:
        self.page: Any = None
        if live is not False:
            self.page = _covary.Page(0 if live is True else live, Path(scene).stem, output or "")

    def __enter__(self) -> Any:
        if self.page is not None:
            self._show(self.page.address)
        return self.page

    @staticmethod
    def _show(address: str) -> None:
        """In the notebook, or, where there is none, its address."""
        if not in_notebook():
            print(f"live: {address}", file=sys.stderr, flush=True)
            return
        display = sys.modules["IPython"].display
        display.display(display.HTML(f'<a href="{address}" target="_blank">{address}</a>'))
        display.display(display.IFrame(address, width="100%", height=HEIGHT))

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self.page is not None:
            self.page.end("The render has ended." if error is None else f"The render has ended: {error or kind}")
