# SPDX-License-Identifier: Apache-2.0
"""The Blender add-on: an operator, render.covary, and its panel among the render properties of Cycles."""
from __future__ import annotations

from .panel import register, unregister

bl_info = {"name": "covary", "author": "The covary contributors", "version": (0, 1, 0), "blender": (3, 4, 0),
           "location": "Properties, Render, covary (with Cycles)", "category": "Render",
           "description": "Less noise of Cycles from the same number of samples"}

__all__ = ["register", "unregister"]
