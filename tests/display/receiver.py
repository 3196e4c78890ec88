# SPDX-License-Identifier: Apache-2.0
"""A viewer without a window that takes the packets of tev's protocol (https://github.com/Tom94/tev, README "Over the
Network"; its include/tev/Ipc.h names the types) and keeps the images they make."""
import array
import socket
import struct
import threading

CREATE_IMAGE, UPDATE_IMAGE_V3 = 4, 6


class Packet:
    def __init__(self, data):
        self.data, self.at = data, 0

    def number(self, form):
        value, = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize(form)
        return value

    def text(self):
        end = self.data.index(b"\0", self.at)
        text = self.data[self.at:end].decode()
        self.at = end + 1
        return text

    def list(self, read, count):
        return [read() for _ in range(count)]


class Image:
    def __init__(self, width, height, channels):
        self.width, self.height = width, height
        self.channels = {name: [float("nan")] * (width * height) for name in channels}


class Receiver:
    """Listens on a free port of this machine. `stop_after`: closes the connection after this many packets."""

    def __init__(self, stop_after=None):
        self.images, self.packets, self.problems, self.stop_after = {}, [], [], stop_after
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self.socket.getsockname()[1]
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        connection, _ = self.socket.accept()
        try:
            with connection, connection.makefile("rb") as stream:
                while self.stop_after is None or len(self.packets) < self.stop_after:
                    head = stream.read(4)
                    if not head:
                        return
                    length, = struct.unpack("<I", head)
                    data = stream.read(length - 4)
                    if len(data) != length - 4:
                        raise ValueError(f"a packet of {length} bytes ends after {len(data) + 4}")
                    self.take(Packet(data))
        except (ValueError, KeyError, struct.error) as error:
            self.problems.append(error)

    def take(self, packet):
        kind = packet.number("B")
        self.packets.append(kind)
        {CREATE_IMAGE: self.create, UPDATE_IMAGE_V3: self.update}[kind](packet)
        if packet.at != len(packet.data):
            raise ValueError(f"{len(packet.data) - packet.at} bytes too many in a packet of type {kind}")

    def create(self, packet):
        packet.number("B")  # grab focus
        name = packet.text()
        width, height, n = packet.list(lambda: packet.number("i"), 3)
        self.images[name] = Image(width, height, packet.list(packet.text, n))

    def update(self, packet):
        packet.number("B")
        image = self.images[packet.text()]
        names = packet.list(packet.text, packet.number("i"))
        x0, y0, width, height = packet.list(lambda: packet.number("i"), 4)
        offsets = packet.list(lambda: packet.number("q"), len(names))
        strides = packet.list(lambda: packet.number("q"), len(names))
        n_floats = max(o + (width * height - 1) * s + 1 for o, s in zip(offsets, strides))
        values = array.array("f", packet.data[packet.at:packet.at + 4 * n_floats])
        packet.at += 4 * n_floats
        for name, offset, stride in zip(names, offsets, strides):
            for i in range(width * height):
                image.channels[name][(y0 + i // width) * image.width + x0 + i % width] = values[offset + i * stride]

    def finish(self):
        self.thread.join(10)
        self.socket.close()
