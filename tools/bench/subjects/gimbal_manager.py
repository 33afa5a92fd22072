# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A gimbal manager: the path of a setpoint to the device.

The setpoint of a MAVLink player goes over UDP to the manager, and from there to the device. The
peer is a forwarder in Python that reads no MAVLink.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import itertools
import math
import socket
import time

from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink
from support.ports import free_port
from support.waiting import eventually

from ..devices import Side
from ..rig import alternate, Bench, bridge, peer, udp
from ..rows import Row, times

MANAGER, DEVICE, PLAYER = mav.Address(1, 193), mav.Address(1, 154), mav.Address(255, 100)
# s between setpoints, as players send them. Without pauses the ratio depends on the processors
# that are awake: 4.3 to 8.3.
PERIOD = 0.02


@contextlib.contextmanager
def managed() -> Iterator[tuple[int, Side, Side]]:
    """Run a manager; yield its port, its device, and the player in control."""
    port = free_port()

    def has_control() -> bool:
        device.beat()
        player.beat()
        player.send(mav.CommandLong(
            *MANAGER, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, 0, *PLAYER, -1, -1, 0, 0, 0))
        return any(isinstance(message, mav.CommandAck) and message.result == 0
                   for _ in range(20) for message in player.receive(0.01))

    with (Side(port, mavlink.MAV_TYPE_GIMBAL, DEVICE) as device,
          Side(port, mavlink.MAV_TYPE_GCS, PLAYER) as player,
          bridge(udp(port), 'gimbal_manager', payloads='[gimbal_manager]')):
        eventually(has_control, 'a player has control')
        yield port, device, player


def gimbal_manager(bench: Bench) -> Iterator[Row]:
    """Measure the path of a setpoint."""
    forward = free_port()
    with managed() as (port, device, player), socket.socket(type=socket.SOCK_DGRAM) as far:
        far.settimeout(5.0)
        far.bind(('127.0.0.1', 0))
        numbers = itertools.count()

        def path(to: int, arrival: socket.socket, kind: int) -> list[float]:
            device.beat()
            player.beat()
            data = player.frame(gimbal.GimbalManagerSetPitchyaw(
                *MANAGER, 0, 0, 0.3 * math.sin(next(numbers)), 0.0, math.nan, math.nan))
            time.sleep(PERIOD)
            device.drain()
            arrival.settimeout(5.0)
            began = time.perf_counter()
            player.socket.sendto(data, ('127.0.0.1', to))
            # The message id is in bytes 7 to 9 of a frame.
            while int.from_bytes(arrival.recv(2048)[7:10], 'little') != kind:
                pass
            return [time.perf_counter() - began]

        with peer('forwarder', forward, far.getsockname()[1]):
            found = alternate({
                'ours': lambda: path(port, device.socket, gimbal.GimbalDeviceSetAttitude.id),
                'forwarder': lambda: path(forward, far, gimbal.GimbalManagerSetPitchyaw.id)},
                bench.amount(400, 3), bench.amount(50, 1))
    yield Row('setpoint of a MAVLink player through the manager to the device', 'ms',
              found['ours'], {'bare UDP forwarder': found['forwarder']},
              [times(found['ours'], found['forwarder'], 3.0, 'p50')])
