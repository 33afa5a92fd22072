# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Two bridges on one link, and two lights behind one component."""

from collections.abc import Callable
import contextlib

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from illuminator_ros.payload.identity import Identity
from std_msgs.msg import Float32
from support.fake_light import FakeLight
from support.light import Address
from support.live_link import EndpointLink
from support.ports import free_port
from support.ros import Parameters, Ros, running_bridge, running_simulator, STREAM
from support.shared_address import SharedAddress
from support.slow import CLOCK, SlowLink, SPEED

CLASH = 'another sender uses our address 1/193'
SHARED = ('1/1 reports changing states: several lights with this address, or another '
          'controller')


def is_of(node: str) -> Callable[[DiagnosticArray], bool]:
    """Return a condition for arrays: they are those of a node."""
    return lambda array: array.status[0].name == f'{node}: link'


def test_two_bridges_of_different_addresses_share_the_lights_and_do_not_clash(
    own_ros: Ros,
) -> None:
    port = free_port()
    url = f'udpin://127.0.0.1:{port}'
    with contextlib.ExitStack() as stack:
        stack.enter_context(running_simulator(url, '--count', '2'))
        for name, component in (('first', 193), ('second', 195)):
            bridge = stack.enter_context(running_bridge(
                own_ros.domain, port, '-r', f'__node:={name}', component_id=component,
                connection_url=url.replace('udpin', 'udpout'), target_component=243))
            bridge.wait_for('connected', count=2)
        arrays = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

        first, second = (Parameters(own_ros, f'/{name}') for name in ('first', 'second'))
        first.wait(brightness=100.0)
        assert first.set(brightness=40.0)[0].successful
        second.wait(brightness=40.0)
        assert second.set(brightness=70.0)[0].successful
        first.wait(brightness=70.0)
        calls = [own_ros.start_enable(node=f'/{node}')
                 for node in ('first', 'second', 'first_1_244', 'second_1_244')]
        assert all(call.result().success for call in calls)

        for count in (1, 2, 3):
            CLOCK.forward(1.0)
            for name in ('first', 'second'):
                arrays.wait(is_of(name), count=count)
        assert not any(CLASH in array.status[0].message for array in arrays.messages)


def test_two_lights_at_one_address_are_a_warning_and_change_no_parameter(
    own_ros: Ros, port: int,
) -> None:
    lights = SharedAddress(
        FakeLight(Address(1, 1), heartbeat_type=None, stream=0.1 * SPEED, brightness=100.0),
        FakeLight(Address(1, 1), heartbeat_type=None, stream=0.1 * SPEED, brightness=40.0))
    with (running_bridge(own_ros.domain, port) as bridge,
          EndpointLink(f'udpout://127.0.0.1:{port}', lights, kind=SlowLink)):
        bridge.wait_for(f'{SHARED}; parameters stay as they are meanwhile')
        arrays = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        events = Parameters(own_ros).events()
        own_ros.subscribe(Float32, '/illuminator/brightness', STREAM).wait(count=30)
        CLOCK.forward(1.0)
        arrays.wait(lambda array: array.status[1].level == DiagnosticStatus.WARN
                    and SHARED in array.status[1].message)
        assert events.messages == []
        assert bridge.count('was changed') <= 4


def test_two_lights_with_one_address_are_an_error_and_a_log_line_with_their_serial_numbers(
    own_ros: Ros, port: int,
) -> None:
    lights = SharedAddress(FakeLight(Address(1, 243)), FakeLight(Address(1, 243)))
    for light, serial in zip(lights.lights, ('A-1', 'B-2'), strict=True):
        light.identity = Identity(serial_number=serial)
    shared = 'two lights use 1/243: serials A-1, B-2'
    with (running_bridge(own_ros.domain, port) as bridge,
          EndpointLink(f'udpout://127.0.0.1:{port}', lights, kind=SlowLink)):
        arrays = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        bridge.wait_for('connected')
        CLOCK.forward(1.0)
        bridge.wait_for(shared)
        CLOCK.forward(1.0)
        arrays.wait(lambda array: array.status[-1].level == DiagnosticStatus.ERROR
                    and shared in array.status[-1].message)
