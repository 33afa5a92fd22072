# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The link: added bytes, reconnection, loss, and many lights without ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import itertools
import math
from pathlib import Path
import socket
import tempfile
import time

from illuminator_ros.illuminator.events import LightEvent, StatusReceived
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, heartbeat
from support.client import Client
from support.fake_light import FakeLight
from support.frames import Codec, frame_of
from support.live_link import EndpointLink
from support.lossy_line import COMMANDS, CONFIRMED, Run
from support.ports import free_port
from support.ptys import PtyDevice
from support.simulated_link import SimulatedLink
from support.waiting import eventually, PATIENCE
from support.wire import Faults

from ..rig import Bench, bridge, interleaved, udp
from ..rows import at_most, quantiles, Row, times

# s; the requests to a light that was just discovered are not counted.
SETTLING, COUNTED = 6.0, 10.0


def overhead(bench: Bench) -> Iterator[Row]:
    """Count the bytes of MAVLink that the bridge adds to a link with one light."""
    port = free_port()
    seconds = bench.amount(COUNTED, 0.2)
    with bridge(udp(port)), EndpointLink(f'udpout://127.0.0.1:{port}', FakeLight()) as light:
        time.sleep(bench.amount(SETTLING, 0.2))
        before = light.state().traffic.bytes_received
        time.sleep(seconds)
        rate = (light.state().traffic.bytes_received - before) / seconds
    yield Row('bytes added to the link by the bridge', 'B/s', {'': rate},
              targets=[at_most(rate, 60, 'B/s')], note='without UDP and IP headers')


# s for which the other side is absent; the pauses between attempts grow with it.
ABSENCES = (0.2, 1.0, 4.0)
# s for which the other side is present; longer than the time that proves a connection.
LASTING = 1.2
HELLO = frame_of(heartbeat(mavlink.MAV_TYPE_ILLUMINATOR), 0)


def tcp(absences: tuple[float, ...], lasting: float) -> Iterator[float]:
    """Restart a TCP server."""
    port = free_port(socket.SOCK_STREAM)
    with bridge(f'tcp://127.0.0.1:{port}', until='not open'):
        for absence in (0.0, *absences):
            time.sleep(absence)
            with socket.create_server(('127.0.0.1', port)) as server:
                began = time.monotonic()
                server.settimeout(PATIENCE)
                connection, _ = server.accept()
                with connection:
                    connection.recv(4096)
                    yield time.monotonic() - began
                    time.sleep(lasting)


def serial(absences: tuple[float, ...], lasting: float) -> Iterator[float]:
    """Pull a serial device out, and plug it in again."""
    with tempfile.TemporaryDirectory() as directory:
        device = PtyDevice(Path(directory))
        with bridge(f'serial://{device.path}:57600'):
            device.read(PATIENCE)
            for absence in (0.0, *absences):
                time.sleep(lasting)
                device.pull_out()
                time.sleep(absence)
                device.plug_in()
                began = time.monotonic()
                eventually(lambda: device.read(0.001), 'the serial port is opened again')
                yield time.monotonic() - began
        device.pull_out()


def moved(absences: tuple[float, ...], lasting: float) -> Iterator[float]:
    """Move a UDP light to another port."""
    port = free_port()
    with bridge(udp(port)):
        for absence in (0.0, *(lasting + absence for absence in absences)):
            time.sleep(absence)
            with socket.socket(type=socket.SOCK_DGRAM) as light:
                light.settimeout(PATIENCE)
                light.connect(('127.0.0.1', port))
                began = time.monotonic()
                light.send(HELLO)
                light.recv(4096)
                yield time.monotonic() - began


KINDS: dict[str, Callable[[tuple[float, ...], float], Iterator[float]]] = {
    'TCP server restarted': tcp, 'serial device plugged in again': serial,
    'UDP light on another port': moved}


def reconnection(bench: Bench) -> Iterator[Row]:
    """
    Measure the time that the link needs to recover after the return of the other side.

    It runs from that return (a TCP server listens, a serial device exists, a UDP light sends from
    another port) to the first frame of the bridge that arrives there.
    """
    for kind, times_of in KINDS.items():
        # The first return is the first opening.
        took = [seconds * 1e3 for seconds in
                [*times_of(*bench.amount((ABSENCES, LASTING), ((0.1,), 0.1)))][1:]]
        yield Row(f'link up again, {kind}', 'ms', quantiles(took, 0.5, 1),
                  targets=[at_most(max(took), 1000, 'ms')])


SHARE = 0.3


def loss(bench: Bench) -> Iterator[Row]:
    """Send commands over a line that loses, repeats and reorders 30 % of the frames each way."""
    faults = Faults(**dict.fromkeys(('drop', 'duplicate', 'reorder'), SHARE))
    run = Run(faults, faults, 'bench', commands=bench.amount(COMMANDS, 20))
    several = sum(len(request.answer.results) != 1 for request in run.requests)
    yield Row('commands confirmed with 30 % drop, duplication and reordering each way', '%',
              {'': 100 * run.outcomes[CONFIRMED] / len(run.requests)},
              targets=[at_most(len([*run.untruths()]), 0, 'outcomes untrue'),
                       at_most(several, 0, 'with no or several outcomes')])


COUNTS = (1, 4, 16)
# Frames per second, half of them statuses; the same for any number of lights, so that only the
# number differs.
RATE = 800
# Frames before the measurement, until the requests for identity have ended, and in each part of
# the measurement: those of 1 s, so that each part has the work that is due once a second.
WARM_UP, PART = 10 * RATE, RATE
ROUNDS = 75
PEER = '127.0.0.1', 14550


class Lights:
    """
    A link with some lights.

    :ivar least: CPU time for a status and a heartbeat, us, in the part of the measurement in which
        other load on the machine has added least to it.
    """

    def __init__(self, number: int, warm_up: int) -> None:
        # The lights do not answer, and the client soon gives up its first requests.
        client = Client(Address(1, 193), LightSettings(), command_timeout=0.05, command_retries=0)
        client.events.subscribe(self._count)
        self._link = SimulatedLink(client, lambda data, peer: None)
        self._frames = frames(number)
        self._statuses = 0
        self.least = math.inf
        self.measure(warm_up)
        self.least = math.inf

    def _count(self, event: LightEvent) -> None:
        self._statuses += isinstance(event, StatusReceived)

    def measure(self, count: int) -> None:
        """Receive some frames, and measure the CPU time."""
        received = [(frame, PEER) for frame in itertools.islice(self._frames, count)]
        before, began = self._statuses, time.thread_time()
        for datagram in received:
            self._link.receive(datagram)
            self._link.run(1 / RATE)
        self.least = min(
            self.least, 1e6 * (time.thread_time() - began) / (self._statuses - before))


def frames(lights: int) -> Iterator[bytes]:
    """Yield what lights send: heartbeats and statuses, RATE a second in all."""
    codec = Codec()
    for number in itertools.count():
        source = Address(2 + number % lights // 250, 1 + number % lights % 250)
        yield codec.frame(source, heartbeat(mavlink.MAV_TYPE_ILLUMINATOR))
        yield codec.frame(source, IlluminatorStatus(
            100_000 + int(number * 2000 / RATE), 1, 3, 0, 1, 50.0, 0.0, 0.0, 25.0, 0.05, 10.0))


def lights(bench: Bench) -> Iterator[Row]:
    """
    Measure the CPU time for a status with 1, 4 and 16 lights on one link.

    The link runs without ROS and without sockets, and does everything except publishing. Time is
    simulated, so that the numbers of lights are compared in turn within milliseconds: on a shared
    machine, the processor's speed and caches change the cost by half from one second to the next.
    """
    found = {str(count): Lights(count, bench.amount(WARM_UP, RATE)) for count in COUNTS}
    for name in interleaved([*found], bench.amount(ROUNDS, 1)):
        found[name].measure(bench.amount(PART, 20))
    one, *others = ({'': lights.least} for lights in found.values())
    for count, cost in zip(COUNTS[1:], others, strict=True):
        yield Row(f'CPU for a status and a heartbeat, without ROS, {count} lights', 'us', cost,
                  {'one light': one}, [times(cost, one, 1.2)])
