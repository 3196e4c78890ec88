# SPDX-License-Identifier: Apache-2.0
"""The network in JAX: a U-Net over cells of 2 x 2, 4 x 4 and 8 x 8 pixels."""
import jax
import jax.numpy as jnp
import numpy

from learning import shapes


def initial(inputs, outputs, seed=0):
    r = numpy.random.default_rng(seed)
    weights = {}
    for name, (side, i, o) in shapes(inputs, outputs).items():
        deviation = 0.05 if name == "out" else (2 / (side * side * i))**0.5
        weights[name] = {"w": jnp.asarray(r.standard_normal((side, side, i, o)) * deviation, jnp.float32),
                         "b": jnp.zeros(o, jnp.float32)}
    return weights


def convolved(layer, x):
    return jax.lax.conv_general_dilated(x, layer["w"], (1, 1), "SAME",
                                        dimension_numbers=("NHWC", "HWIO", "NHWC")) + layer["b"]


def halved(x):
    n, h, w, c = x.shape
    return x.reshape(n, h // 2, 2, w // 2, 2, c).mean((2, 4))


def doubled(x):
    return jnp.repeat(jnp.repeat(x, 2, 1), 2, 2)


def shares(weights, x):
    """Shares of the images in each cell: [n, rows, columns, images], whose sum is 1. Rows and columns: multiples of
    4."""
    def layer(name, y):
        return jax.nn.relu(convolved(weights[name], y))
    a = layer("a", layer("mix", x))
    b = layer("b2", layer("b", halved(a)))
    c = layer("c2", layer("c", halved(b)))
    d = layer("d", jnp.concatenate([doubled(c), b], -1))
    e = layer("e", jnp.concatenate([doubled(d), a], -1))
    y = convolved(weights["out"], e)
    p = 0.5 * y + jnp.sqrt(0.25 * y * y + 1)
    p = p * p
    p = p * p
    return p / p.sum(-1, keepdims=True)


def enlarged(s):
    """From cells to pixels, bilinearly."""
    def along(x, axis):
        first = jnp.concatenate([jax.lax.slice_in_dim(x, 0, 1, axis=axis),
                                 jax.lax.slice_in_dim(x, 0, x.shape[axis] - 1, axis=axis)], axis)
        last = jnp.concatenate([jax.lax.slice_in_dim(x, 1, None, axis=axis),
                                jax.lax.slice_in_dim(x, x.shape[axis] - 1, None, axis=axis)], axis)
        both = jnp.stack([0.75 * x + 0.25 * first, 0.75 * x + 0.25 * last], axis + 1)
        return both.reshape(*x.shape[:axis], 2 * x.shape[axis], *x.shape[axis + 1:])
    return along(along(s, 1), 2)
