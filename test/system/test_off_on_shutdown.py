# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""With ``off_on_shutdown`` the node switches off every light at its end, within 1 s."""

from collections.abc import Callable, Iterator
import contextlib
import signal

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.link import Link
from illuminator_ros.ros.bridge import Bridge
import pytest
import rclpy
from std_msgs.msg import Bool
from support.embedded import embedded_bridge
from support.light import Address, CONFIGURE, ON_OFF, ServedLight
from support.processes import Program
from support.ros import (
    Parameters,
    repeated,
    Ros,
    start_bridge,
    start_slow_bridge,
)
from support.waiting import eventually


@contextlib.contextmanager
def lit(
    ros: Ros, port: int, start: Callable[..., Program] = start_slow_bridge, **parameters: object,
) -> Iterator[tuple[Program, ServedLight]]:
    """Run a bridge with a light that is on."""
    with ServedLight(port, enable=1) as light:
        program = start(ros.domain, port, **{'off_on_shutdown': True, **parameters})
        try:
            Parameters(ros).wait(brightness=100.0)
            yield program, light
        finally:
            program.kill()


def assert_goes_off(light: ServedLight) -> None:
    # The light may go off after the end of the bridge.
    eventually(lambda: light.fake.fields['enable'] == 0)


def assert_ends(program: Program, number: int = signal.SIGTERM) -> None:
    assert (program.end(number), 'Traceback' in program.log) == (0, False), program.log


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGRTMAX])
def test_every_light_is_switched_off_and_named(own_ros: Ros, port: int, number: int) -> None:
    with (lit(own_ros, port) as (program, light),
          ServedLight(port, source=Address(1, 244), enable=1) as other):
        Parameters(own_ros, '/illuminator_1_244').wait(brightness=100.0)

        assert_ends(program, number)

        for one in (light, other):
            assert_goes_off(one)
            assert program.count(f'light {one.fake.source} is off: off, confirmed') == 1
        assert program.count('was switched') == 0


def test_light_is_left_on_with_a_warning_without_the_parameter(own_ros: Ros, port: int) -> None:
    with lit(own_ros, port, off_on_shutdown=False) as (program, light):
        assert_ends(program)

        assert light.commands(ON_OFF) == []
        [line] = [line for line in program.lines if 'light 1/243 is left on' in line]
        assert line.startswith('[WARN]')


@pytest.mark.parametrize(('start', 'result', 'line'), [
    (start_slow_bridge, mavlink.MAV_RESULT_DENIED, 'refused: MAV_RESULT_DENIED'),
    (start_bridge, None, 'no confirmation in time'),
])
def test_light_that_is_not_confirmed_off_is_an_error_that_does_not_delay_the_end(
    own_ros: Ros, port: int, start: Callable[..., Program], result: int | None, line: str,
) -> None:
    with lit(own_ros, port, start=start) as (program, light):
        light.fake.results[ON_OFF] = result

        assert_ends(program)

        line = f'light 1/243 may still be on: {line}'
        assert [found[:7] for found in program.lines if line in found] == ['[ERROR]']


def test_off_is_the_last_change_whatever_is_requested_at_the_end(
    own_ros: Ros, port: int,
) -> None:
    with (ServedLight(port, link=Link, enable=1) as light,
          ServedLight(port, link=Link, source=Address(1, 244), enable=1) as other):
        program = start_bridge(
            own_ros.domain, port, off_on_shutdown=True,
            target_component=light.fake.source.component)
        try:
            for node in ('/illuminator', '/illuminator_1_244'):
                Parameters(own_ros, node).wait(brightness=100.0)
            first, second = (own_ros.publisher(Bool, f'{node}/cmd/enable') for node in (
                '/illuminator', '/illuminator_1_244'))
            with repeated(first, Bool(data=True)), repeated(second, Bool(data=True)):
                eventually(lambda: all(one.commands(ON_OFF) for one in (light, other)))
                own_ros.start_enable()
                Parameters(own_ros).start_set(brightness=20.0)
                assert_ends(program)
        finally:
            program.kill()

        for one in (light, other):
            assert_goes_off(one)
            # A busy machine may need more than 0.6 s.
            assert any(program.count(f'light {one.fake.source} {end}')
                       for end in ('may still be on', 'is off')), program.log
            changes = one.commands(ON_OFF, CONFIGURE)
            assert (changes[-1].command, changes[-1].param1) == (ON_OFF, 0.0)


def shut_down_context(bridge: Bridge, ros: Ros) -> None:
    """End as a program does that embeds the bridge."""
    rclpy.try_shutdown(context=bridge.node.context)


def fail(bridge: Bridge, ros: Ros) -> None:
    """Have the executor fail."""
    def exit_thread() -> None:
        raise SystemExit

    assert bridge.node.executor is not None
    bridge.node.executor.create_task(exit_thread)


@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
@pytest.mark.parametrize('end', [shut_down_context, fail])
def test_every_other_end_of_the_node_switches_the_light_off_too(
    own_ros: Ros, port: int, end: Callable[[Bridge, Ros], None],
) -> None:
    with (ServedLight(port, enable=1) as light,
          embedded_bridge(own_ros.domain, port, off_on_shutdown=True) as bridge):
        Parameters(own_ros).wait(brightness=100.0)

        end(bridge, own_ros)

        eventually(lambda: [one.param1 for one in light.commands(ON_OFF)][-1:] == [0.0])
        assert_goes_off(light)
