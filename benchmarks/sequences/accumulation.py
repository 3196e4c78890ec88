# SPDX-License-Identifier: Apache-2.0
"""Exponential accumulation with reprojection, the baseline: each frame is blended with what the previous accumulated
frame shows of the same point. Where the point was follows from the layer P (position) and the known matrices of
scenes.py. So it also checks a renderer's motion vectors."""
import math

import numpy
import scenes

#: part of the present frame
ALPHA = 0.2
#: a pixel is another point if it lies further from the expected one, as a part of the distance to the camera
MOST_DISTANCE = 0.02
#: how near to a surface of the moving shape a point counts as on it, in the shape's own units
NEAR = 0.03
#: pixels that motion by a renderer may differ by from the known one
WITHIN = 0.25


def transformed(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def projected(points, to_world, width, height, fov=54):
    """Pixel coordinates (x, y), centres at halves, and the distance along the view."""
    local = transformed(numpy.linalg.inv(to_world), points)
    depth = local[..., 2]
    scale = width / 2 / math.tan(math.radians(fov / 2)) / numpy.where(depth > 1e-6, depth, numpy.inf)
    return numpy.stack([width / 2 - scale * local[..., 0], height / 2 - scale * local[..., 1]], -1), depth


def before(name, points, frame, frames):
    """Where points of this frame were in the previous frame, in world space."""
    if name not in ("box", "mirror"):
        return points
    move = getattr(scenes, name)
    now, then = move(frame, frames), move(frame - 1, frames)
    local = transformed(numpy.linalg.inv(now), points)
    if name == "box":
        moves = numpy.abs(numpy.abs(local).max(-1) - 1) < NEAR
    else:
        moves = (numpy.abs(local[..., 2]) < NEAR) & (numpy.abs(local[..., :2]).max(-1) < 1 + NEAR)
    return numpy.where(moves[..., None], transformed(then, local), points)


def motion(name, points, frame, frames):
    """Motion from each pixel to the position of its point in the previous frame, (height, width, 2) in pixels, x to the
    right and y down; and where the points were then. Frames count from 1."""
    height, width = points.shape[:2]
    then = before(name, points, frame, frames)
    here, there = (projected(place, scenes.camera(name, at, frames), width, height, scenes.fov(name))[0]
                   for place, at in ((points, frame), (then, frame - 1)))
    return there - here, then


def motion_agreement(name, positions, vectors):
    """The fraction of all pixels after the first frame whose motion by a renderer, (frames, height, width, 2 or more),
    is within WITHIN pixels of the known one. It fails at edges, where the layer P is a mean over surfaces."""
    frames = len(positions)
    apart = [numpy.abs(motion(name, positions[index], index + 1, frames)[0] - vectors[index][..., :2]).max(-1)
             for index in range(1, frames)]
    return float((numpy.stack(apart) < WITHIN).mean())


def bilinear(image, places):
    """Values of an image at pixel coordinates, and whether they lie inside."""
    height, width = image.shape[:2]
    x, y = places[..., 0] - 0.5, places[..., 1] - 0.5
    inside = (x > -0.5) & (y > -0.5) & (x < width - 0.5) & (y < height - 0.5)
    x, y = numpy.clip(x, 0, width - 1), numpy.clip(y, 0, height - 1)
    left, top = numpy.floor(x).astype(int), numpy.floor(y).astype(int)
    right, bottom = numpy.minimum(left + 1, width - 1), numpy.minimum(top + 1, height - 1)
    u, v = (x - left)[..., None], (y - top)[..., None]
    return ((1 - v) * ((1 - u) * image[top, left] + u * image[top, right])
            + v * ((1 - u) * image[bottom, left] + u * image[bottom, right])), inside


def accumulated(name, images, positions):
    """The accumulated images of a sequence's images and layers P, each (frames, height, width, 3)."""
    result, frames = [images[0]], len(images)
    height, width = images.shape[1:3]
    y, x = numpy.mgrid[0:height, 0:width] + 0.5
    for index in range(1, frames):
        vectors, expected = motion(name, positions[index], index + 1, frames)
        places = numpy.stack([x, y], -1) + vectors
        past, inside = bilinear(result[-1], places)
        column, row = (numpy.clip(places[..., axis].astype(int), 0, size - 1)
                       for axis, size in ((0, width), (1, height)))
        camera = scenes.camera(name, index, frames)[:3, 3]
        apart = numpy.linalg.norm(positions[index - 1][row, column] - expected, axis=-1)
        same = inside & (apart < MOST_DISTANCE * numpy.linalg.norm(expected - camera, axis=-1))
        part = numpy.where(same, ALPHA, 1)[..., None]
        result.append(part * images[index] + (1 - part) * past)
    return numpy.stack(result)
