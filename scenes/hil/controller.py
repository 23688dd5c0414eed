#!/usr/bin/env python3
"""Holds the pendulum of cart.toml upright: the other side of `odyn hil`. Nothing but Python's standard library.

    odyn hil scenes/hil/cart.toml --rate 1kHz --udp 9000 --for "60 s"
    python3 scenes/hil/controller.py --udp 9000

or with --shm NAME on both sides.
"""

import argparse
import signal
import socket
import struct
import sys
import time

HEAD = struct.Struct("<4sHHQdII")  # magic, version, kind, number, time, values, signature
INPUTS, OUTPUTS = 1, 2
# Per m, m/s, rad, rad/s of x, v, angle, rate: a linear quadratic regulator of the cart.
GAINS = (-3.0, -5.0, -45.0, -8.5)


def packet(number, values):
    return HEAD.pack(b"ODYN", 1, INPUTS, number, 0.0, len(values), 0) + struct.pack(f"<{len(values)}d", *values)


def unpack(data):
    """Number, time and values of a packet of outputs."""
    magic, version, kind, number, now, count, _ = HEAD.unpack_from(data)
    if (magic, version, kind) != (b"ODYN", 1, OUTPUTS):
        raise ValueError("no packet of outputs")
    return number, now, struct.unpack_from(f"<{count}d", data, HEAD.size)


class Udp:
    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.socket.settimeout(0.5)

    def send(self, data):
        try:
            self.socket.send(data)
        except ConnectionRefusedError:
            pass  # not there yet

    def receive(self):
        try:
            return self.socket.recv(65536)
        except (socket.timeout, ConnectionRefusedError):
            return None


class Shared:
    def __init__(self, name):
        import multiprocessing.shared_memory as shared_memory

        for _ in range(500):
            try:
                self.memory = shared_memory.SharedMemory(name)
                break
            except FileNotFoundError:
                time.sleep(0.01)
        # It belongs to `odyn`, which removes it.
        from multiprocessing import resource_tracker

        resource_tracker.unregister(self.memory._name, "shared_memory")
        self.bytes = self.memory.buf
        self.inputs, self.outputs = struct.unpack_from("<II", self.bytes, 8)
        self.seen = 0

    def send(self, data):
        counter = struct.unpack_from("<Q", self.bytes, self.inputs)[0] | 1
        struct.pack_into("<Q", self.bytes, self.inputs, counter)
        self.bytes[self.inputs + 8 : self.inputs + 8 + len(data)] = data
        struct.pack_into("<Q", self.bytes, self.inputs, counter + 1)

    def receive(self):
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            before = struct.unpack_from("<Q", self.bytes, self.outputs)[0]
            if before != self.seen and before % 2 == 0:
                count = struct.unpack_from("<I", self.bytes, self.outputs + 8 + 24)[0]
                data = bytes(self.bytes[self.outputs + 8 : self.outputs + 8 + HEAD.size + 8 * count])
                if struct.unpack_from("<Q", self.bytes, self.outputs)[0] == before:
                    self.seen = before
                    return data
            time.sleep(1e-4)
        return None


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--udp", type=int)
    arguments.add_argument("--shm")
    given = arguments.parse_args()
    link = Shared(given.shm) if given.shm else Udp(given.udp or 9000)
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    number, silent, largest, last = 1, 0, 0.0, 0.0
    link.send(packet(number, [0.0]))
    while True:
        data = link.receive()
        if data is None:
            silent += 1
            if last > 0.0 and silent > 2:
                break
            link.send(packet(0, [0.0]))
            continue
        silent = 0
        tick, last, values = unpack(data)
        largest = max(largest, abs(values[2]))
        number += 1
        link.send(packet(number, [-sum(gain * value for gain, value in zip(GAINS, values))]))
    print(f"until t = {last:.3f} s the angle was {largest:.4f} rad at most, and is {values[2]:.2e} rad at the end")


if __name__ == "__main__":
    main()
