# SPDX-License-Identifier: Apache-2.0
"""Less Monte Carlo noise by control variates and correlated sampling.

    import covary
    result = covary.render("room", spp=48)      # or your own scene file
    result.save("room.png")

result.image is a float32 array [H, W, 3] of linear Rec. 709 radiance. combine() takes images of any renderer as arrays
[T, H, W, 3]. docs/python.md is the manual.
"""
from . import errors, metrics, progress, scenes
from ._combine import InputReport, check_inputs, combine
from ._covary import version as __version__
from ._images import denoise, read_groups, read_image, write_image
from ._laboratory import Experiment, Samples, experiment
from ._program import program
from ._progressive import Step, render_progressively
from ._render import Scene, render, set_threads
from ._result import BadSample, RenderResult, Result
from ._sequence import render_frames
from .errors import BadSamplesWarning, CovaryWarning, Error, InputError, InternalError, IoError, UsageError
from .estimators import *  # noqa: F403
from .estimators import __all__ as _estimators
from .film import Film, film_from_groups, merge_films
from .notebook import View, view

__all__ = [
    "BadSample", "BadSamplesWarning", "CovaryWarning", "Error", "Experiment", "Film", "InputError", "InputReport",
    "InternalError", "IoError", "RenderResult", "Result", "Samples", "Scene", "Step", "UsageError", "View",
    "__version__", "check_inputs", "combine", "denoise", "errors", "experiment", "film_from_groups", "merge_films",
    "metrics", "program", "progress", "read_groups", "read_image", "render", "render_frames", "render_progressively",
    "scenes", "set_threads", "view", "write_image",
]
__all__ += _estimators
