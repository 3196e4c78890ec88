#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes measured_isotropic.bsdf, measured_half.bsdf and measured_quarter.bsdf beside this script: materials in the
format of RGL's database, tabulated from a coloured GGX conductor with a smooth base (no measurement), for
src/bsdfs/measured_test.cpp and make_bsdf_references.py. Run with any Python that has Mitsuba installed (its table of
visible normals is drawn from by Mitsuba's own classes):

    python make_measured_files.py

Tables are coarse, so that the files are small: they are materials of their own, no good fit of the conductor.
"""

import os

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

FOLDER = os.path.dirname(os.path.abspath(__file__))
TYPES = {np.dtype(np.uint8): 1, np.dtype(np.float32): 10}


def write_tensor_file(path, fields):
    """The container as src/tensors/tensor_file.h describes it."""
    fields = {name: np.ascontiguousarray(values) for name, values in fields.items()}
    place = 18 + sum(2 + len(name) + 11 + 8 * values.ndim for name, values in fields.items())
    head, body = b"tensor_file\0" + bytes([1, 0]) + np.uint32(len(fields)).tobytes(), b""
    for name, values in fields.items():
        padding = -(place + len(body)) % 8
        body += bytes(padding)
        head += np.uint16(len(name)).tobytes() + name.encode() + np.uint16(values.ndim).tobytes()
        head += bytes([TYPES[values.dtype]]) + np.uint64(place + len(body)).tobytes()
        head += np.array(values.shape, np.uint64).tobytes()
        body += values.tobytes()
    with open(path, "wb") as f:
        f.write(head + body)


def spherical(theta, phi):
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], -1)


def ggx(m, alpha):
    """Density of normals [Walter2007], stretched along x and y."""
    return 1 / (np.pi * alpha[0] * alpha[1] * ((m[..., 0] / alpha[0])**2 + (m[..., 1] / alpha[1])**2 + m[..., 2]**2)**2)


def masking(w, alpha):
    tan2 = ((alpha[0] * w[..., 0])**2 + (alpha[1] * w[..., 1])**2) / np.maximum(w[..., 2], 1e-6)**2
    return 2 / (1 + np.sqrt(1 + tan2))


def value(wo, wi, alpha):
    """f |cos| of the model that is tabulated, 0 below the surface."""
    m = wo + wi
    m = m / np.linalg.norm(m, axis=-1, keepdims=True)
    f0, base = np.array([0.9, 0.6, 0.25]), np.array([0.02, 0.05, 0.08])
    fresnel = f0 + (1 - f0) * (1 - np.clip((wo * m).sum(-1), 0, 1))[..., None]**5
    rough = ggx(m, alpha) * masking(wo, alpha) * masking(wi, alpha) / (4 * np.maximum(wo[..., 2], 1e-6))
    return np.where(wi[..., 2:] > 0, fresnel * rough[..., None] + base * np.maximum(wi[..., 2:], 0), 0)


def grid(n, m):
    """u and v of an n (rows, v) by m (columns, u) grid."""
    return np.meshgrid(np.linspace(0, 1, m), np.linspace(0, 1, n))


def normals_on(u, v, turn=0.0):
    return spherical(u**2 * np.pi / 2, (2 * v - 1) * np.pi + turn)


def tabulate(alpha, phi_i, theta_i, n_normals=12, n_spectra=8):
    u, v = grid(n_normals, n_normals)
    isotropic = len(phi_i) <= 2
    ndf = ggx(normals_on(u, v), alpha)
    # Projected area of the normals that a direction sees, by a fine quadrature.
    fine_u, fine_v = (np.arange(256) + 0.5) / 256, (np.arange(128) + 0.5) / 128
    fine_u, fine_v = np.meshgrid(fine_u, fine_v)
    fine, solid = normals_on(fine_u, fine_v), 2 * np.pi**2 * fine_u * np.sin(fine_u**2 * np.pi / 2)
    weights = ggx(fine, alpha) * solid / fine_u.size
    directions = normals_on(u, v)
    sigma = np.array([[(np.maximum(fine @ w, 0) * weights).sum() for w in row] for row in directions])

    def slices(make):
        return np.array([[make(p, t) for t in theta_i] for p in phi_i]).astype(np.float32)

    def visible(p, t):
        m = normals_on(u, v, p if isotropic else 0)
        return ggx(m, alpha) * np.maximum(m @ spherical(t, p), 0) * u * np.sin(u**2 * np.pi / 2) + 1e-4

    vndf = slices(visible)

    def density(m, w):
        return ggx(m, alpha) * np.maximum((m * w).sum(-1), 0)

    def spectra(p, t):
        """f cos 4 sigma / D on the grid of numbers that the visible normals are drawn with."""
        w = spherical(t, p)
        warp = mi.MarginalContinuous2D0(visible(p, t).astype(np.float32))
        su, sv = grid(n_spectra, n_spectra)
        at = np.array([[warp.sample([float(a), float(b)])[0] for a, b in zip(*row)] for row in zip(su, sv)])
        m = normals_on(at[..., 0], at[..., 1], p if isotropic else 0)
        wi = 2 * (m @ w)[..., None] * m - w
        area = (np.maximum(fine @ w, 0) * weights).sum()
        return value(np.broadcast_to(w, wi.shape), wi, alpha) * (4 * area / ggx(m, alpha))[..., None]

    rgb = np.moveaxis(slices(spectra), -1, 2)
    luminance = np.tensordot(rgb, np.array([0.2126, 0.7152, 0.0722]), axes=([2], [0])) + 1e-3
    f = np.float32
    return {"description": np.frombuffer(b"synthetic", np.uint8),
            "theta_i": theta_i.astype(f), "phi_i": phi_i.astype(f),
            "ndf": ndf.astype(f), "sigma": sigma.astype(f), "vndf": vndf, "luminance": luminance.astype(f),
            "rgb": rgb.astype(f), "jacobian": np.array([1], np.uint8)}


def main():
    theta = np.array([0, 20, 40, 60, 75, 87]) * np.pi / 180
    files = {
        "measured_isotropic": tabulate((0.4, 0.4), np.array([0.0]), theta),
        "measured_half": tabulate((0.25, 0.55), np.linspace(-np.pi, 0, 5), theta[::2]),
        "measured_quarter": tabulate((0.5, 0.3), np.linspace(-np.pi, -np.pi / 2, 4), theta[::2]),
    }
    for name, fields in files.items():
        write_tensor_file(os.path.join(FOLDER, name + ".bsdf"), fields)


if __name__ == "__main__":
    main()
