# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Messages on topics: a status to its subscribers, a rate to a gimbal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import functools
import itertools
import math
import socket
import struct
import time
from typing import Any

from geometry_msgs.msg import Vector3, Vector3Stamped
from illuminator_ros.gimbal import messages as of_gimbals
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.messages import GimbalDeviceAttitudeStatus
from std_msgs.msg import Bool, Float64
from support.fake_light import LIGHT, status_message
from support.ports import free_port
from support.waiting import eventually

from ..devices import Side
from ..rig import alternate, Bench, bridge, Client, peer, udp
from ..rows import Row, times

# s between two messages; longer than the path of one.
INTERVAL = 0.008


def status(bench: Bench) -> Iterator[Row]:
    """
    Measure the time from an ILLUMINATOR_STATUS on the wire to a subscriber.

    The peers are a bare publisher and subscriber: from before the call of ``publish`` to the
    subscriber, by CLOCK_MONOTONIC, which the processes of a machine share. A status makes seven
    messages, ``~/enabled`` first and ``~/uptime`` last. Each is measured with a subscriber of its
    own: the first message occupies a shared subscriber until after the last one arrives.
    """
    yield over(bench, 'enabled', Bool, 'first')
    yield over(bench, 'uptime', Float64, 'last')


def over(bench: Bench, topic: str, type_: type[Any], place: str) -> Row:
    """Measure bridge and peer in turn."""
    port, control_port, block = free_port(), free_port(), bench.amount(50, 3)
    arrived: list[tuple[float, Any]] = []
    with contextlib.ExitStack() as stack:
        stack.enter_context(bridge(udp(port)))
        stack.enter_context(peer('publisher', control_port))
        client = stack.enter_context(Client(bench))
        light = stack.enter_context(
            Side(port, mavlink.MAV_TYPE_ILLUMINATOR, LIGHT))
        control = stack.enter_context(socket.socket(type=socket.SOCK_DGRAM))
        control.connect(('127.0.0.1', control_port))

        def report() -> float:
            return light.send(status_message(int(time.monotonic() * 1000)))

        def collected() -> list[tuple[float, Any]]:
            eventually(lambda: len(arrived) >= block, 'all messages arrive')
            taken = arrived[:]
            arrived.clear()
            return taken

        def ours() -> list[float]:
            light.beat()
            light.drain()
            sent = []
            for _ in range(block):
                sent.append(report())
                time.sleep(INTERVAL)
            return [at - began for (at, _), began in zip(collected(), sent, strict=True)]

        def bare() -> list[float]:
            control.send(f'{block} {INTERVAL}'.encode())
            time.sleep(block * INTERVAL)
            return [at - began for at, began in collected()]

        def reaches(send: Callable[[], object]) -> bool:
            light.beat()
            send()
            time.sleep(0.1)
            return bool(arrived)

        for of_topic, name, send in (
                (Float64, '/publisher/time', functools.partial(control.send, b'1 0')),
                (type_, f'/illuminator/{topic}', report)):
            client.subscribe(of_topic, name, lambda message: arrived.append(
                (time.monotonic(), message.data)))
            # The first ones may get lost.
            eventually(functools.partial(reaches, send), f'messages on {name}')
            arrived.clear()
        found = alternate({'ours': ours, 'bare': bare}, *bench.amount((8, 2), (1, 1)))
    return Row(
        f'status on the wire to a subscriber of ~/{topic}, the {place} of seven topics', 'ms',
        found['ours'], {'bare publisher and subscriber': found['bare']},
        [times(found['ours'], found['bare'], 1.6, 'p50')])


MANAGER, BRIDGE = mav.Address(1, 1), mav.Address(1, 193)
NAN = math.nan


def reports() -> Iterator[mav.Message]:
    """Yield what a manager sends once a second, besides heartbeats."""
    yield of_gimbals.GimbalManagerInformation(0, 0xFFFF, 1, -1, 1, -1, 1, -1, 1)
    yield of_gimbals.GimbalManagerStatus(0, 0, 1, *BRIDGE, 0, 0)
    yield GimbalDeviceAttitudeStatus(
        0, 0, 0, mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME, (1, 0, 0, 0),
        NAN, NAN, NAN, 0, NAN, NAN, 1)


def gimbal(bench: Bench) -> Iterator[Row]:
    """
    Measure the time from a message on ``~/cmd/rate`` to the datagram.

    The peer is a bare subscriber that sends a datagram. The time runs from before the call of
    ``publish`` to the arrival of the datagram. This process takes all times.
    """
    port = free_port()
    with contextlib.ExitStack() as stack:
        manager = stack.enter_context(Side(port, mavlink.MAV_TYPE_QUADROTOR, MANAGER))
        bare = stack.enter_context(socket.socket(type=socket.SOCK_DGRAM))
        bare.bind(('127.0.0.1', 0))
        bare.settimeout(1.0)
        stack.enter_context(bridge(
            udp(port), 'gimbal', payloads='[gimbal]', setpoint_timeout=60.0))
        stack.enter_context(peer('subscriber', bare.getsockname()[1]))
        client = stack.enter_context(Client(bench))
        numbers = itertools.count(1)
        publishers = {name: client.node.create_publisher(Vector3Stamped, f'/{name}/cmd/rate', 10)
                      for name in ('gimbal', 'subscriber')}

        def path(name: str, rates: Callable[[], list[float]]) -> float:
            if manager.beat():
                for message in reports():
                    manager.send(message)
            time.sleep(INTERVAL)
            # The rates are exact in float32.
            rate = next(numbers) % 4096 / 65536
            message = Vector3Stamped(vector=Vector3(z=rate))
            began = time.monotonic()
            publishers[name].publish(message)
            while time.monotonic() < began + 1.0:
                if rate in rates():
                    return time.monotonic() - began
            return 0.0

        actions = {
            'gimbal': lambda: path('gimbal', lambda: [
                abs(message.angular_velocity_z) for message in manager.receive(1.0)
                if isinstance(message, of_gimbals.GimbalManagerSetAttitude)]),
            'subscriber': lambda: path(
                'subscriber', lambda: [*struct.unpack('<3f', bare.recv(2048))])}
        for name, action in actions.items():
            eventually(action, f'rates of {name} arrive')
        block = bench.amount(50, 3)
        found = alternate({name: lambda action=action: [  # type: ignore[misc]
            action() for _ in range(block)] for name, action in actions.items()},
            *bench.amount((12, 2), (1, 1)))
    yield Row('~/cmd/rate to the datagram', 'ms', found['gimbal'],
              {'bare subscriber that sends a datagram': found['subscriber']},
              [times(found['gimbal'], found['subscriber'], 1.5, 'p50')])
