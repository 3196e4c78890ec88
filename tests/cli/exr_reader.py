# SPDX-License-Identifier: Apache-2.0
"""Reads the EXR files that covary writes (scan lines, ZIP or uncompressed, 32-bit values) with the standard library
alone, so that tests do not depend on the code that they test. Layout:
https://openexr.com/en/latest/OpenEXRFileLayout.html"""
import array
import struct
import zlib

ROWS_PER_BLOCK = {0: 1, 3: 16}  # of the compressions none and ZIP
TYPES = {0: "I", 2: "f"}  # uint, float


def header(data):
    """Attributes, name -> bytes, and where they end."""
    at, attributes = 8, {}
    while data[at] != 0:
        end = data.index(b"\0", at)
        kind_end = data.index(b"\0", end + 1)
        size, = struct.unpack_from("<i", data, kind_end + 1)
        attributes[data[at:end].decode(errors="replace")] = data[kind_end + 5:kind_end + 5 + size]
        at = kind_end + 5 + size
    return attributes, at + 1


def channel_types(listing):
    """[(name, type)] in the order of the file."""
    channels, at = [], 0
    while listing[at] != 0:
        end = listing.index(b"\0", at)
        channels.append((listing[at:end].decode(), TYPES[struct.unpack_from("<i", listing, end + 1)[0]]))
        at = end + 17
    return channels


def unzipped(packed, size):
    if len(packed) == size:  # blocks that ZIP does not make smaller stand as they are
        return packed
    raw = bytearray(zlib.decompress(packed))
    for i in range(1, size):
        raw[i] = (raw[i - 1] + raw[i] - 128) & 255
    mixed, half = bytearray(size), (size + 1) // 2
    mixed[0::2], mixed[1::2] = raw[:half], raw[half:]
    return bytes(mixed)


def read_exr(data):
    """Channels, name -> values row by row."""
    attributes, at = header(data)
    channels = channel_types(attributes["channels"])
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    rows_per_block = ROWS_PER_BLOCK[attributes["compression"][0]]
    n_blocks = (height + rows_per_block - 1) // rows_per_block
    result = {name: [] for name, _ in channels}
    for block, offset in enumerate(struct.unpack_from(f"<{n_blocks}Q", data, at)):
        rows = min(rows_per_block, height - rows_per_block * block)
        size, = struct.unpack_from("<i", data, offset + 4)
        raw, line = unzipped(data[offset + 8:offset + 8 + size], rows * width * 4 * len(channels)), width * 4
        for start in range(0, len(raw), line):
            name, kind = channels[start // line % len(channels)]
            result[name] += array.array(kind, raw[start:start + line])
    return result
