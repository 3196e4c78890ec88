# SPDX-License-Identifier: Apache-2.0
"""Layers of covary's EXR files as arrays, for the benchmarks."""
import sys
from pathlib import Path

import numpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests/cli"))

from exr_reader import header, read_exr  # noqa: E402


def read_layers(path, *names):
    """Layers of an EXR file of covary, each (height, width, 3); "" is the image itself."""
    data = Path(path).read_bytes()
    x0, y0, x1, y1 = numpy.frombuffer(header(data)[0]["dataWindow"], "<i4")
    channels = read_exr(data)
    result = []
    for name in names:
        parts = [f"{name}.{end}" if name else end for end in ("XYZ" if f"{name}.X" in channels else "RGB")]
        if any(part not in channels for part in parts):
            raise SystemExit(f"{path}: found no layer {name or 'RGB'}; it has {', '.join(channels)}")
        result.append(numpy.stack([numpy.array(channels[part], float).reshape(y1 - y0 + 1, x1 - x0 + 1)
                                   for part in parts], -1))
    return result


def read_image(path):
    """The image itself."""
    return read_layers(path, "")[0]
