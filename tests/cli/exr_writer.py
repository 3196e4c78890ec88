# SPDX-License-Identifier: Apache-2.0
"""Writes uncompressed scanline EXR files with the standard library alone, so that the tests of the commands do not
depend on the code that they test. Layout: https://openexr.com/en/latest/OpenEXRFileLayout.html"""
import struct

UINT, HALF, FLOAT = 0, 1, 2


def attribute(name, kind, data):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data


def box(x, y, width, height):
    return struct.pack("<4i", x, y, x + width - 1, y + height - 1)


def chromaticities(*values):
    """Red x, y, green x, y, blue x, y, white x, y."""
    return attribute("chromaticities", "chromaticities", struct.pack("<8f", *values))


def exr(channels, frame, window=None, attributes=None, types=None, more=b""):
    """The bytes of a file. `channels`: name -> values, row by row; `frame`: (width, height); `window`: (x, y, width,
    height); `attributes`: name -> text; `types`: name -> pixel type, FLOAT where not given; `more`: bytes of further
    attributes."""
    window = window or (0, 0) + tuple(frame)
    types = types or {}
    x0, y0, width, height = window
    names = sorted(channels)
    listing = b"".join(n.encode() + b"\0" + struct.pack("<iB3xii", types.get(n, FLOAT), 0, 1, 1) for n in names) + b"\0"
    head = b"".join([
        attribute("channels", "chlist", listing),
        attribute("compression", "compression", b"\0"),
        attribute("dataWindow", "box2i", box(*window)),
        attribute("displayWindow", "box2i", box(0, 0, *frame)),
        attribute("lineOrder", "lineOrder", b"\0"),
        attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
    ] + [attribute(n, "string", t.encode()) for n, t in (attributes or {}).items()] + [more]) + b"\0"
    head = struct.pack("<ii", 20000630, 2) + head
    form = {UINT: "I", HALF: "e", FLOAT: "f"}
    rows = []
    for y in range(height):
        data = b"".join(struct.pack(f"<{width}{form[types.get(n, FLOAT)]}", *channels[n][y * width:(y + 1) * width])
                        for n in names)
        rows.append(struct.pack("<ii", y0 + y, len(data)) + data)
    offset = len(head) + 8 * height
    table = b""
    for row in rows:
        table += struct.pack("<Q", offset)
        offset += len(row)
    return head + table + b"".join(rows)


def film(seed, groups=2, size=(4, 3), samples=2, value=1.0, frame=None, window=None, **attributes):
    """A film as docs/file-formats.md describes it: group g has the value `value` * (g + 1)."""
    width, height = size
    n = width * height
    mean = value * (groups + 1) / 2
    channels = {c: [mean] * n for c in "RGB"}
    if groups > 1:
        for g in range(groups):
            for c in "RGB":
                channels[f"group{g:02d}.{c}"] = [value * (g + 1)] * n
    channels["samples"] = [samples * groups] * n
    facts = {"film": "1", "groups": str(groups), "samples": str(samples * groups), "seed": str(seed), "sampling": "crn",
             "scene_hash": "abc", "settings": "path", "complete": "true"}
    facts.update(attributes)
    return exr(channels, frame or size, window, {f"covary:{k}": v for k, v in facts.items()}, {"samples": UINT})


def multipart(parts, frame):
    """The bytes of a file of parts, each a dictionary: name, channels (as above) and, if needed, view, window,
    compression (a number; the pixels stay as they are)."""
    heads, blocks = b"", []
    for number, part in enumerate(parts):
        window = part.get("window", (0, 0) + tuple(frame))
        x0, y0, width, height = window
        names = sorted(part["channels"])
        listing = b"".join(n.encode() + b"\0" + struct.pack("<iB3xii", FLOAT, 0, 1, 1) for n in names) + b"\0"
        text = {"name": part["name"], "type": "scanlineimage", **({"view": part["view"]} if "view" in part else {})}
        heads += b"".join([
            attribute("channels", "chlist", listing),
            attribute("compression", "compression", bytes([part.get("compression", 0)])),
            attribute("dataWindow", "box2i", box(*window)),
            attribute("displayWindow", "box2i", box(0, 0, *frame)),
            attribute("lineOrder", "lineOrder", b"\0"),
            attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
            attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
            attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
            attribute("chunkCount", "int", struct.pack("<i", height)),
        ] + [attribute(n, "string", t.encode()) for n, t in text.items()]) + b"\0"
        rows = []
        for y in range(height):
            data = b"".join(struct.pack(f"<{width}f", *part["channels"][n][y * width:(y + 1) * width]) for n in names)
            rows.append(struct.pack("<iii", number, y0 + y, len(data)) + data)
        blocks.append(rows)
    heads = struct.pack("<ii", 20000630, 2 | 0x1000) + heads + b"\0"
    offset = len(heads) + 8 * sum(map(len, blocks))
    tables = data = b""
    for rows in blocks:
        for row in rows:
            tables += struct.pack("<Q", offset)
            offset += len(row)
            data += row
    return heads + tables + data
