# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A gimbal manager: the path of a setpoint to the device, and 20 players that compete for control.

The setpoint of a MAVLink player goes over UDP to the manager, and from there to the device. The
peer is a forwarder in Python that reads no MAVLink.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import contextlib
import itertools
import math
import socket
import time

from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.rotation import Quaternion
from support.ports import free_port

from ..devices import Side
from ..rig import alternate, Bench, bridge, peer, udp, wait_until
from ..rows import at_most, Row, times

MANAGER, DEVICE = mav.Address(1, 193), mav.Address(1, 154)
PLAYERS = [mav.Address(255, 100 + number) for number in range(20)]
RATE, SECONDS = 1000, 10.0
# s between setpoints, as players send them. Without pauses the ratio depends on the processors
# that are awake: 4.3 to 8.3.
PERIOD = 0.02
# rad between the yaws by which the setpoints of two players differ.
STEP = 0.1


def configure(player: mav.Address) -> mav.Message:
    """Return the command by which a player takes control."""
    return mav.CommandLong(
        *MANAGER, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, 0, *player, -1, -1, 0, 0, 0)


def setpoint(player: mav.Address, pitch: float = 0.0) -> mav.Message:
    """Return a setpoint whose yaw belongs to one player."""
    return gimbal.GimbalManagerSetPitchyaw(
        *MANAGER, 0, 0, pitch, STEP * (PLAYERS.index(player) - 10), math.nan, math.nan)


@contextlib.contextmanager
def managed() -> Iterator[tuple[int, Side, Side]]:
    """Run a manager; yield its port, its device, and players of which the first has control."""
    port = free_port()

    def has_control() -> bool:
        device.beat()
        players.beat()
        players.send(configure(PLAYERS[0]))
        return any(isinstance(message, mav.CommandAck) and message.result == 0
                   for _ in range(20) for message in players.receive(0.01))

    with (Side(port, mavlink.MAV_TYPE_GIMBAL, DEVICE) as device,
          Side(port, mavlink.MAV_TYPE_GCS, *PLAYERS) as players,
          bridge(udp(port), 'gimbal_manager', payloads='[gimbal_manager]')):
        wait_until(has_control, 'a player has control')
        yield port, device, players


def gimbal_manager(bench: Bench) -> Iterator[Row]:
    """Measure the path of a setpoint, then the competition."""
    yield _setpoints(bench)
    yield from _competition(bench)


def _setpoints(bench: Bench) -> Row:
    forward = free_port()
    with managed() as (port, device, players), socket.socket(type=socket.SOCK_DGRAM) as far:
        far.settimeout(5.0)
        far.bind(('127.0.0.1', 0))
        numbers = itertools.count()

        def path(to: int, arrival: socket.socket, kind: int) -> list[float]:
            device.beat()
            players.beat()
            data = players.frame(setpoint(PLAYERS[0], 0.3 * math.sin(next(numbers))))
            time.sleep(PERIOD)
            device.drain()
            arrival.settimeout(5.0)
            began = time.perf_counter()
            players.socket.sendto(data, ('127.0.0.1', to))
            # The message id is in bytes 7 to 9 of a frame.
            while int.from_bytes(arrival.recv(2048)[7:10], 'little') != kind:
                pass
            return [time.perf_counter() - began]

        with peer('forwarder', forward, far.getsockname()[1]):
            found = alternate({
                'ours': lambda: path(port, device.socket, gimbal.GimbalDeviceSetAttitude.id),
                'forwarder': lambda: path(forward, far, gimbal.GimbalManagerSetPitchyaw.id)},
                bench.amount(400, 3), bench.amount(50, 1))
    return Row('setpoint of a MAVLink player through the manager to the device', 'ms',
               found['ours'], {'bare UDP forwarder': found['forwarder']},
               [times(found['ours'], found['forwarder'], 3.0, 'p50')])


def _competition(bench: Bench) -> Iterator[Row]:
    seconds = bench.amount(SECONDS, 1.0)
    results: Counter[int] = Counter()
    obeyed: set[int] = set()
    holders: set[int] = set()
    statuses = sent = 0
    with managed() as (_, device, players):
        players.drain()
        device.drain()
        began = time.monotonic()
        # One more second is for late answers.
        while (now := time.monotonic()) < began + seconds + 1.0:
            device.beat()
            players.beat()
            while sent < min(now - began, seconds) * RATE:
                player = PLAYERS[sent % len(PLAYERS)]
                players.send(configure(player), player)
                players.send(setpoint(player), player)
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
    yield Row(f'{RATE} commands a second of {len(PLAYERS)} players that compete for control, with '
              'as many setpoints', 'commands unanswered', {'': unanswered}, targets=[
                  at_most(unanswered, 0, 'unanswered'),
                  at_most(max(len(obeyed), len(holders)) - 1, 0, 'instants with two players')],
              note=f'{results[0]} accepted, {results[2]} denied')
    rate = statuses / seconds
    yield Row('GIMBAL_MANAGER_STATUS meanwhile', 'Hz', {'': rate}, targets=[
        at_most(round(abs(rate - 5.0), 3), 0.5, 'Hz from 5')])
