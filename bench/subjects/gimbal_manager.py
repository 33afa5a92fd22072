# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
A gimbal manager: the path of a setpoint to the device, and 20 players that compete for control.

The setpoint of a MAVLink player goes over UDP to the manager, and from there to the device. The
peer is a forwarder in Python that reads no MAVLink.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import contextlib
import math
import socket
import time
from typing import Any

from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import decode, mavlink
from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.payload.rotation import Quaternion
from support.frames import Codec

from ..rig import Bench, bridge, free_port, peer
from ..rows import at_most, one, quantiles, Row, times

MANAGER, DEVICE = mav.Address(1, 194), mav.Address(1, 154)
PLAYERS = [mav.Address(255, 100 + number) for number in range(20)]
CLASSES: dict[int, type[mav.Message]] = {cls.id: cls for cls in (
    mav.CommandAck, gimbal.GimbalDeviceSetAttitude, gimbal.GimbalManagerStatus)}
WARM_UP = 50
RATE, SECONDS = 1000, 10.0
# s between setpoints, as players send them. Without pauses the ratio depends on the processors
# that are awake: 4.3 to 8.3.
PERIOD = 0.02
# rad between the yaws by which the setpoints of two players differ.
STEP = 0.1


class Line:
    """A UDP socket with MAVLink messages of any senders."""

    def __init__(self, port: int = 0) -> None:
        self.socket = socket.socket(type=socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind(('127.0.0.1', port))
        self._codec, self._decoder = Codec(), Decoder()

    def frame(self, source: mav.Address, message: mav.Message) -> bytes:
        """Return a message as a frame."""
        return self._codec.frame(source, message)

    def send(self, source: mav.Address, message: mav.Message, port: int) -> None:
        """Send a message."""
        self.socket.sendto(self.frame(source, message), ('127.0.0.1', port))

    def receive(self, timeout: float) -> list[Any]:
        """Return the messages of the next datagram, none after the time."""
        self.socket.settimeout(max(timeout, 1e-4))
        try:
            return self._messages(self.socket.recv(65536))
        except TimeoutError:
            return []

    def arrival(self, wanted: type[mav.Message]) -> float:
        """
        Wait for a message, and return the arrival time of its datagram, before decoding.

        :raises TimeoutError: if no datagram comes.
        """
        self.socket.settimeout(5.0)
        while True:
            data, now = self.socket.recv(65536), time.perf_counter()
            if any(isinstance(message, wanted) for message in self._messages(data)):
                return now

    def _messages(self, data: bytes) -> list[Any]:
        return [decode(CLASSES[frame.message_id], frame.payload)
                for frame in self._decoder.feed(data) if frame.message_id in CLASSES]

    def drain(self) -> None:
        """Drop the datagrams that have arrived."""
        self.socket.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                self.socket.recv(65536)


def configure(player: mav.Address) -> mav.CommandLong:
    """Return the command by which a player takes control."""
    return mav.CommandLong(
        *MANAGER, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, 0, *player, -1, -1, 0, 0, 0)


def setpoint(player: mav.Address, pitch: float = 0.0) -> gimbal.GimbalManagerSetPitchyaw:
    """Return a setpoint whose yaw belongs to one player."""
    return gimbal.GimbalManagerSetPitchyaw(
        *MANAGER, 0, 0, pitch, STEP * (PLAYERS.index(player) - 10), math.nan, math.nan)


@contextlib.contextmanager
def managed() -> Iterator[tuple[int, Line, Line]]:
    """Run a manager; yield its port, its device, and players of which the first has control."""
    port = free_port()
    device, players = Line(), Line()
    with bridge(f'udpin://127.0.0.1:{port}', name='gimbal_manager',
                payloads='[gimbal_manager]'):
        until = time.monotonic() + 20.0
        while time.monotonic() < until:
            device.send(DEVICE, mav.heartbeat(mavlink.MAV_TYPE_GIMBAL), port)
            players.send(PLAYERS[0], mav.heartbeat(mavlink.MAV_TYPE_GCS), port)
            players.send(PLAYERS[0], configure(PLAYERS[0]), port)
            device.receive(0.1)
            if any(isinstance(message, mav.CommandAck) and message.result == 0
                   for _ in range(20) for message in players.receive(0.01)):
                yield port, device, players
                break
        else:
            raise RuntimeError('the manager gives no control')
    device.socket.close()
    players.socket.close()


def measure(bench: Bench) -> Iterator[Row]:
    """Measure the path of a setpoint, then the competition."""
    yield _setpoints(bench)
    yield from _competition(bench)


def _setpoints(bench: Bench) -> Row:
    took: dict[str, list[float]] = {'manager': [], 'forwarder': []}
    far = Line().socket
    far.settimeout(5.0)
    with far, managed() as (port, device, players):
        forward = free_port()
        with peer('forwarder', str(forward), str(far.getsockname()[1])):
            beat = 0.0
            for number in range(bench.amount(400, 20)):
                if time.monotonic() >= beat:
                    beat = time.monotonic() + 0.5
                    device.send(DEVICE, mav.heartbeat(mavlink.MAV_TYPE_GIMBAL), port)
                    players.send(PLAYERS[0], mav.heartbeat(mavlink.MAV_TYPE_GCS), port)
                    time.sleep(0.01)
                data = players.frame(PLAYERS[0], setpoint(
                    PLAYERS[0], pitch=0.3 * math.sin(number)))
                time.sleep(PERIOD)
                device.drain()
                began = time.perf_counter()
                players.socket.sendto(data, ('127.0.0.1', port))
                took['manager'].append(
                    (device.arrival(gimbal.GimbalDeviceSetAttitude) - began) * 1e3)
                time.sleep(PERIOD)
                began = time.perf_counter()
                players.socket.sendto(data, ('127.0.0.1', forward))
                far.recv(2048)
                took['forwarder'].append((time.perf_counter() - began) * 1e3)
    ours, theirs = (quantiles(values[bench.amount(WARM_UP, 0):]) for values in took.values())
    return Row('setpoint of a MAVLink player through the manager to the device', 'ms', ours,
               {'bare UDP forwarder': theirs}, [times(ours, theirs, 3.0, 'p50')])


def _competition(bench: Bench) -> Iterator[Row]:
    seconds = bench.amount(SECONDS, 1.0)
    results: Counter[int] = Counter()
    obeyed: set[int] = set()
    holders: set[int] = set()
    statuses = sent = 0
    with managed() as (port, device, players):
        for line in (players, device):
            line.drain()
        began, beat = time.monotonic(), 0.0
        # One more second is for late answers.
        while (now := time.monotonic()) < began + seconds + 1.0:
            if now >= beat:
                beat = now + 0.5
                device.send(DEVICE, mav.heartbeat(mavlink.MAV_TYPE_GIMBAL), port)
                for player in PLAYERS:
                    players.send(player, mav.heartbeat(mavlink.MAV_TYPE_GCS), port)
            while sent < min(now - began, seconds) * RATE:
                player = PLAYERS[sent % len(PLAYERS)]
                players.send(player, configure(player), port)
                players.send(player, setpoint(player), port)
                sent += 1
            while received := players.receive(0.0):
                results.update(message.result for message in received
                               if isinstance(message, mav.CommandAck))
            for message in device.receive(0.001):
                if isinstance(message, gimbal.GimbalDeviceSetAttitude):
                    obeyed.add(round(Quaternion(*message.q).euler()[2] / STEP))
                elif isinstance(message, gimbal.GimbalManagerStatus):
                    statuses += now < began + seconds
                    holders.add(message.primary_control_compid)
    unanswered = sent - results.total()
    yield Row(f'{sent} commands of {len(PLAYERS)} players that compete for control, with as many '
              f'setpoints, {RATE} a second', 'commands', one(unanswered), targets=[
                  at_most(unanswered, 0, 'without an answer'),
                  at_most(max(len(obeyed), len(holders)) - 1, 0, 'instants with two players')],
              note=f'{results[0]} accepted, {results[2]} denied')
    rate = statuses / seconds
    yield Row('GIMBAL_MANAGER_STATUS meanwhile', 'Hz', one(rate), targets=[
        at_most(round(abs(rate - 5.0), 3), 0.5, 'Hz from 5')])
