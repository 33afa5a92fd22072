# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The log of a light's life: each fact once, and no flood; parameters follow meanwhile."""

from collections.abc import Callable
from typing import Any

from illuminator_ros.mavlink.messages import ComponentInformationBasic, heartbeat
from rcl_interfaces.msg import LoggerLevel
from rcl_interfaces.srv import SetLoggerLevels
from std_msgs.msg import Bool
from std_srvs.srv import Trigger
from support.fake_light import status_message
from support.light import Address, CONFIGURE, ON_OFF, ServedLight
from support.ros import Parameters, Ros, running_bridge
from support.slow import CLOCK, pass_time_until, time_passes
from support.waiting import eventually

AUTOPILOT = 2
FLOOD = 1000
Message = Callable[[ServedLight, float, int], Any]
# s before a missing light is logged.
NO_LIGHT_GRACE = 10.0


def test_light_that_is_missed_found_changed_by_others_lost_and_restarted_is_logged_once_each(
    own_ros: Ros, port: int,
) -> None:
    light = ServedLight(port)
    with running_bridge(own_ros.domain, port, heartbeat_timeout=10) as bridge:
        CLOCK.forward(NO_LIGHT_GRACE)
        bridge.wait_for('no light connected: none heard yet on udp ')
        CLOCK.forward(5 * NO_LIGHT_GRACE)
        parameters = Parameters(own_ros)
        with light:
            bridge.wait_for('light 1/243 connected')
            light.send(heartbeat(AUTOPILOT), Address(1, 1))
            parameters.wait(brightness=100.0)
            assert parameters.set(brightness=80.0)[0].successful
            # The test must not receive the event of this change.
            own_ros.synchronize()
            events = parameters.events()
            light.forget()
            # Float32 rounding, heat and implausible values do not change parameters.
            for report in ({'brightness': 80.000003}, {'brightness': 40.0, 'error_status': 1},
                           {'brightness': float('nan'), 'error_status': 0}, {'mode': 0}):
                light.report(**report)
                # A flag is logged at most every 5 s.
                own_ros.outlast(5.0, ['/illuminator'])
            light.report(mode=1, brightness=36.0, strobe_period=2.0)
            parameters.wait(brightness=36.0, strobe_period=2.0)
            own_ros.catch_up()
            [event] = events.messages
            assert {one.name for one in event.changed_parameters} == {
                'brightness', 'strobe_period'}
            assert light.commands(CONFIGURE) == []
        pass_time_until(lambda: bridge.count('light 1/243 lost: no heartbeat for 1'))
        light.fake.boot = CLOCK()
        light.fake.fields |= {'brightness': 100.0, 'strobe_period': 0.0}
        with light:
            bridge.wait_for('light 1/243 configured: ')
            assert light.fake.fields['brightness'] == 36.0
        for severity, text in (
                ('WARN', 'no light connected'),
                ('INFO', 'light 1/243: thermal throttling cleared'),
                ('WARN', 'light 1/243: thermal throttling: dimmed because it is hot'),
                ('INFO', 'light 1/243 was changed: brightness 36 %, strobe_period 2 s'),
                ('WARN', 'light 1/243 lost: '), ('INFO', 'light 1/243 has restarted')):
            [line] = [line for line in bridge.lines if text in line]
            assert line.startswith(f'[{severity}]')
        assert (bridge.count('light 1/243 connected'), bridge.count('1/1 ')) == (2, 0)


def test_switch_is_logged_with_its_way_if_it_changes_the_light(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        Parameters(own_ros).wait(brightness=100.0)
        for _ in range(2):
            assert own_ros.enable().success
        for number, on in enumerate((True, False), 3):
            own_ros.publish(Bool, '/illuminator/cmd/enable', on)
            light.wait_for(ON_OFF, count=number)
            own_ros.catch_up()

        bridge.wait_for('light 1/243 was switched off by topic')
        assert bridge.count('was switched') == 2
        assert bridge.count('light 1/243 was switched on by service') == 1


def test_frames_are_logged_once_a_service_has_set_the_level_of_the_node(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port):
        bridge.wait_for('light 1/243 connected')
        assert not bridge.count('received from')
        levels = [LoggerLevel(name='illuminator', level=LoggerLevel.LOG_LEVEL_DEBUG)]
        answer = own_ros.call(SetLoggerLevels, '/illuminator/set_logger_levels',
                              SetLoggerLevels.Request(levels=levels))
        assert answer.results[0].successful
        with time_passes():
            bridge.wait_for('received from 1/243: ILLUMINATOR_STATUS')


def test_frames_at_debug_level_are_logged_by_the_node_of_their_light_and_no_other(
    own_ros: Ros, port: int,
) -> None:
    level = ('--log-level', 'illuminator_1_244:=debug')
    with (running_bridge(own_ros.domain, port, *level, system_id=7, component_id=42) as bridge,
          ServedLight(port)):
        # The first light that is heard gets the node without a number.
        Parameters(own_ros).wait(brightness=100.0)
        with ServedLight(port, Address(1, 244)):
            Parameters(own_ros, '/illuminator_1_244').wait(brightness=100.0)
            assert Parameters(own_ros, '/illuminator_1_244').set(brightness=40.0)[0].successful
            assert Parameters(own_ros).set(brightness=30.0)[0].successful
            bridge.wait_for(
                'illuminator_1_244]: sent from 7/42: COMMAND_LONG target_system=1 '
                'target_component=244 command=MAV_CMD_DO_ILLUMINATOR_CONFIGURE confirmation=0 '
                'param1=1 param2=40 ')
            bridge.wait_for(
                'illuminator_1_244]: received from 1/244: ILLUMINATOR_STATUS uptime_ms=')

    frames = [line for line in bridge.lines if '[DEBUG]' in line]
    assert all('[illuminator_1_244]' in line for line in frames)
    assert not any('1/243' in line or 'target_component=243' in line for line in frames)


def another_identity(light: ServedLight, now: float, step: int) -> Any:
    return ComponentInformationBasic(0, 0, 0, b'maker', b'', b'', b'', b'%d' % step)


def another_uptime(light: ServedLight, now: float, step: int) -> Any:
    return status_message(1_000_000 * (step % 2), enable=step % 2)


def another_brightness(light: ServedLight, now: float, step: int) -> Any:
    return status_message(light.fake.uptime_ms(now) + step, brightness=50.0 + step % 50)


def another_flag(light: ServedLight, now: float, step: int) -> Any:
    return status_message(light.fake.uptime_ms(now) + step, error_status=step % 2)


def test_flood_of_frames_is_not_a_flood_of_lines(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port, stream=0.0) as light:
        bridge.wait_for('light 1/243 is maker')
        own_ros.catch_up()
        for message in (another_identity, another_uptime, another_brightness, another_flag):
            before = len(bridge.lines)

            def send(now: float, message: Message = message) -> None:
                for step in range(FLOOD):
                    light.fake.send(message(light, now, step))

            light.do(send)
            # The flood may displace a frame of the refresh, which is then sent again.
            refresh = own_ros.start(Trigger, '/illuminator/refresh', Trigger.Request())
            pass_time_until(lambda: refresh.answered)  # noqa: B023
            own_ros.synchronize()
            eventually(lambda: len(bridge.lines) > before)  # noqa: B023

            assert len(bridge.lines) - before < 40


def test_a_fraction_as_limit_and_an_unusual_baud_rate_are_warned_of(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port, max_brightness=0.5, until=(
            'max_brightness is 0.5 %: it is a percentage, not a fraction'),
            forward_urls=['serial:///dev/ttyNONE:56700']) as bridge:
        bridge.wait_for('56700 baud is unusual: is the rate of /dev/ttyNONE 57600?')
        bridge.wait_for('cannot open /dev/ttyNONE: there is no such port: /dev/serial/by-id lists')
