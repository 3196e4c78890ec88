# SPDX-License-Identifier: Apache-2.0
"""The add-on of Blender: covary.blender, from the wheels that come with it."""
from covary.blender import register, unregister

__all__ = ["register", "unregister"]
