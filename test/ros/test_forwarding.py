# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The bridge with two links: a light on the second one, and a ground station on the first."""

from collections.abc import Callable
import socket

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from illuminator_ros.mavlink.messages import Address, CommandAck, CommandLong, heartbeat
from std_msgs.msg import Bool
from support.frames import Codec, LIGHT
from support.ports import free_port
from support.ros import Ros, running_bridge, running_simulator, STREAM
from support.slow import CLOCK

GROUND = Address(255, 190)
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
ON_OFF, CONFIGURE = 405, 406


def levels(**expected: bytes) -> Callable[[DiagnosticArray], bool]:
    """Return a condition for arrays: the statuses of links have these levels."""
    return lambda array: {
        status.name.partition(': ')[2].replace(' ', '_'): status.level
        for status in array.status if ': link' in status.name} == expected


def test_light_on_a_further_link_serves_ros_and_a_ground_station_on_the_first_link(
    own_ros: Ros,
) -> None:
    near, far = free_port(), free_port(socket.SOCK_STREAM)
    url = f'tcp://127.0.0.1:{far}'
    with (running_bridge(own_ros.domain, near, forward_urls=[url]) as bridge,
          socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground):
        arrays = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        connected = own_ros.subscribe(Bool, '/illuminator/connected')
        CLOCK.forward(1.0)
        array = arrays.wait(levels(link=WARN, link_2=ERROR))
        assert array.status[-1].hardware_id == url
        with running_simulator(f'tcp-l://127.0.0.1:{far}', '--status-interval', '0.1'):
            bridge.wait_for('light 1/243 connected')
            assert own_ros.enable(True).success
            arrays.wait(levels(link=OK, link_2=OK))

            codec, answers = Codec(), list[CommandAck]()
            ground.settimeout(10)
            ground.sendto(codec.frame(GROUND, heartbeat(6)), ('127.0.0.1', near))
            off = CommandLong(*LIGHT, ON_OFF, 0, 0, 0, 0, 0, 0, 0, 0)
            ground.sendto(codec.frame(GROUND, off), ('127.0.0.1', near))
            while not answers:
                answers += [message for source, message in codec.messages(ground.recv(65536))
                            if source == LIGHT and isinstance(message, CommandAck)]
            assert (answers[0].command, answers[0].result) == (ON_OFF, 0)
            bridge.wait_for('light 1/243 was switched off by another sender 255/190')
            # A later change is not an effect of our ON.
            CLOCK.forward(2.0)
            dim = CommandLong(*LIGHT, CONFIGURE, 0, 1, 40, 0, 0, 0, 0, 0)
            ground.sendto(codec.frame(GROUND, dim), ('127.0.0.1', near))
            bridge.wait_for('light 1/243 was changed: brightness 40 % by 255/190')

        # The light is lost with its link, and not after its heartbeat timeout.
        bridge.wait_for('link lost: tcp to 127.0.0.1')
        connected.wait(lambda message: not message.data)
        bridge.wait_for('light 1/243 lost: the link was lost')
        CLOCK.forward(1.0)
        arrays.clear()
        arrays.wait(levels(link=OK, link_2=ERROR))
        assert own_ros.enable(True).message.startswith('light 1/243 is lost')
