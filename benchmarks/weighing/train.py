# SPDX-License-Identifier: Apache-2.0
"""Trains a network that weighs candidates."""
import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")
import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy  # noqa: E402
import optax  # noqa: E402

import learning  # noqa: E402
import network  # noqa: E402

CAP = 4.0  # of relative squared errors, softly
FIRST = 2.5  # initial advantage of the first candidate
DECAY, BATCH, LARGEST_GRADIENT, AVERAGED = 0.05, 2, 2, 0.005
STEPS, FASTEST = 2978, 2e-3
BIAS = 0.7  # weight of the squared bias


def item(folder, samples):
    """Images and features of both seeds, target, weight of its pixels, and about the error of the first candidate."""
    pair = []
    for seed in (1, 2):
        images, variance, features = learning.load(folder / f"f{samples}-{seed}.exr", folder / "f16-1.exr",
                                                 folder / f"stages{samples}-{seed}")
        pair.append((numpy.stack(images, 2), learning.features(images, variance, features)))
    groups = learning.groups_of(learning.channels(folder / "reference.exr"))
    target = groups.mean(0)
    grey = numpy.maximum(learning.box(target.mean(-1), 1), 0)
    weight = (1 / (grey**2 + 0.01)).astype(numpy.float32)
    first = [p[0][:, :, 1] for p in pair]
    maps = [((first[0] - target) * (first[1] - target)).mean(-1), ((first[0] - first[1])**2).mean(-1) / 2,
            groups.var(0, ddof=1).mean(-1) / len(groups)]
    product, spread, noise = (numpy.minimum(m * weight, 2.0).mean() for m in maps)
    level = max(product - noise, 0) + spread + 0.05 * noise + 2e-4
    return (numpy.stack([p[0] for p in pair]), numpy.stack([p[1] for p in pair]), target, weight, numpy.float32(level))


def loss(weights, images, seen, target, weight, level):
    """Squared error, and the product of the errors of two seeds, which is squared bias. `images`: [n, 2, height, width,
    m, 3]."""
    n, two, height, width, m, _ = images.shape
    s = network.enlarged(network.shares(weights, seen.reshape(n * two, *seen.shape[2:])))
    mixed = jnp.einsum("nhwm,nhwmc->nhwc", s, images.reshape(n * two, height, width, m, 3))
    error = mixed.reshape(n, two, height, width, 3) - target[:, None]
    square = (error**2).mean(-1) * weight[:, None]
    limit = 1 / (1 + square / CAP)
    both = (error[:, 0] * error[:, 1]).mean(-1) * weight * jax.lax.stop_gradient(limit[:, 0] * limit[:, 1])
    return (((square * limit).mean((1, 2, 3)) + BIAS * both.mean((1, 2))) / level).mean()


def turned(r, images, seen, target, weight, level):
    """Mirrored, and with other colours and axes; some without auxiliary features."""
    if r.random() < 0.5:
        images, seen, target, weight = images[:, ::-1], seen[:, ::-1], target[::-1], weight[::-1]
    if r.random() < 0.5:
        images, seen, target, weight = images[:, :, ::-1], seen[:, :, ::-1], target[:, ::-1], weight[:, ::-1]
    p, f = r.permutation(3), seen.shape[-1] - 14  # f: the first of the features that are colours
    images, target, seen = images[..., p], target[..., p], seen.copy()
    seen[..., f:f + 3] = seen[..., f + p]
    if r.random() < 0.1:
        seen[..., f + 4:] = 0
    else:
        seen[..., f + 4:f + 7] = seen[..., f + 4 + p]
        signs = r.choice([-1, 1], 3).astype(numpy.float32)
        seen[..., f + 7:f + 10] = seen[..., f + 7 + r.permutation(3)] * signs
    return images, seen, target, weight, level


@jax.jit
def step(weights, state, average, speed, *batch):
    gradient = jax.grad(loss)(weights, *batch)
    factor = jnp.minimum(1, LARGEST_GRADIENT / optax.global_norm(gradient))
    update, state = optax.scale_by_adam().update(jax.tree.map(lambda g: g * factor, gradient), state)
    weights = jax.tree.map(lambda w, u: w - speed * (u + DECAY * w), weights, update)
    average = jax.tree.map(lambda a, w: a + AVERAGED * (w - a), average, weights)
    return weights, state, average


def train(folders, samples, result):
    r = numpy.random.default_rng(0)
    items = [item(folder, n) for folder in folders for n in samples]
    m, inputs = items[0][0].shape[3], items[0][1].shape[-1]
    weights = network.initial(inputs, m)
    weights["out"]["b"] = weights["out"]["b"].at[1].set(FIRST)
    average, state = weights, optax.scale_by_adam().init(weights)
    for i in range(STEPS):
        chosen = [turned(r, *items[k]) for k in r.integers(len(items), size=BATCH)]
        speed = FASTEST * (0.5 + 0.5 * numpy.cos(numpy.pi * i / STEPS)) + 2e-5
        weights, state, average = step(weights, state, average, speed, *map(numpy.stack, zip(*chosen)))
    learning.write_weights(result, {name: average[name] for name in learning.shapes(inputs, m)})
