# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``monitor`` as a process, with and without a terminal."""

import json
import os
import re
import signal
from typing import Any

import pytest
from support.light import eventually, free_port, ServedLight
from support.processes import is_running, run
from support.ros import Ros, running_bridge
from support.slow import CLOCK
from support.terminals import Terminal

MONITOR = 'illuminator_ros.monitor'


def domain(ros: Ros) -> dict[str, str]:
    return {'ROS_DOMAIN_ID': str(ros.domain)}


def monitor(ros: Ros, **how: Any) -> Terminal:
    """Run the monitor on a terminal, by the slow clock."""
    return Terminal('support.slow_program', MONITOR, env={**CLOCK.environment, **domain(ros)},
                    **how)


def test_keys_switch_and_dim_the_light(own_ros: Ros, port: int) -> None:
    with (running_bridge(own_ros.domain, port), ServedLight(port) as light,
          monitor(own_ros) as screen):
        screen.wait_for('/illuminator off')

        screen.type(' ')
        screen.wait_for('It can dazzle')
        screen.type('\r')
        screen.wait_for('on: done')
        screen.type('\x1b[D')
        screen.wait_for('brightness 90 %: done')

        assert (light.fake.fields['enable'], light.fake.fields['brightness']) == (1, 90.0)


@pytest.mark.parametrize('way', ['\x03', 'SIGTERM', 'SIGSEGV'])
def test_end_restores_the_terminal(own_ros: Ros, way: str) -> None:
    with monitor(own_ros) as screen:
        screen.wait_for('no devices in this ROS graph yet')

        if way.startswith('SIG'):
            screen.send(signal.Signals[way])
        else:
            screen.type(way)

        assert screen.wait() == 0
        eventually(lambda: screen.restored)
        assert 'Traceback' not in screen.raw


@pytest.mark.parametrize(('way', 'job'), [
    ('SIGTSTP', '"$@"'),
    # Another program waits for the monitor in the same job, as "ros2 run" does.
    ('\x1a', '("$@"; exit $?)'),
])
def test_stopped_monitor_restores_the_terminal_until_it_continues(
    own_ros: Ros, way: str, job: str,
) -> None:
    shell = f'{job} & echo pid $!; fg; echo in the shell; read line; fg'
    with monitor(own_ros, shell=shell) as screen:
        screen.wait_for('no devices in this ROS graph yet')

        if way == '\x1a':
            screen.type(way)
        else:
            [pid] = re.findall(r'pid (\d+)', screen.raw)
            os.kill(int(pid), signal.SIGTSTP)
        screen.wait_for('in the shell')
        assert screen.restored

        screen.forget()
        screen.type('\n')
        screen.wait_for('no devices in this ROS graph yet')
        screen.type('q')
        assert screen.wait() == 0
        eventually(lambda: screen.restored)


def test_signal_ends_a_stopped_monitor_without_the_terminal(own_ros: Ros) -> None:
    shell = '"$@" & echo pid $!; fg; echo in the shell; kill $!; kill -CONT $!; read line'
    with Terminal(MONITOR, env=domain(own_ros), shell=shell) as screen:
        screen.wait_for('no devices in this ROS graph yet')
        [pid] = re.findall(r'pid (\d+)', screen.raw)

        screen.type('\x1a')

        screen.wait_for('in the shell')
        eventually(lambda: not is_running(pid))
        assert screen.restored


def test_monitor_ends_with_status_0_when_its_terminal_closes(own_ros: Ros) -> None:
    with monitor(own_ros) as screen:
        screen.wait_for('no devices in this ROS graph yet')

        screen.hang_up()

        assert screen.wait() == 0


def test_bytes_that_are_not_utf_8_do_not_end_the_monitor(own_ros: Ros) -> None:
    with monitor(own_ros) as screen:
        screen.wait_for('no devices in this ROS graph yet')

        screen.type(b'\xff\xe4 ')

        def acts() -> bool:
            # Keys that come with such a byte are lost.
            screen.type('a')
            return 'ALL OFF: 0 of 0' in screen.raw

        eventually(acts)


def test_without_a_terminal_monitor_prints_a_table(own_ros: Ros) -> None:
    port = free_port()
    with (running_bridge(own_ros.domain, port, diagnostics_period=0.1) as bridge,
          ServedLight(port, brightness=30.0)):
        bridge.wait_for('connected')
        outcome = run(MONITOR, '--wait', '20', env=domain(own_ros))
        failed = run(MONITOR, '--once', '--wait', '20', env=domain(own_ros),
                     redirection='> /dev/full')
        loaded = run(MONITOR, '--json', '--wait', '20', env=domain(own_ros))

    [one] = json.loads(loaded.stdout)
    assert (one['name'], one['values']['brightness']) == ('/illuminator', 30.0)
    heading, row = outcome.stdout.splitlines()
    assert heading.split() == ['DEVICE', 'STATE', 'LEVEL', 'REPORT']
    assert row.split()[:5] == ['/illuminator', 'off', 'OK', '30', '%']
    assert (outcome.returncode, outcome.stderr) == (0, '')
    assert (failed.returncode, failed.stderr) == (
        1, 'monitor: standard output: No space left on device\n')


@pytest.mark.parametrize(('redirection', 'error'), [
    ('', 'monitor: no device found within 0.1 s: check that a bridge runs, with '
         'ROS_DOMAIN_ID={domain} as here\n'),
    ('>&-', 'monitor: standard output is closed\n')])
def test_failure_is_one_line_with_status_1(own_ros: Ros, redirection: str, error: str) -> None:
    outcome = run(MONITOR, '--once', '--wait', '0.1', env=domain(own_ros),
                  redirection=redirection)

    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (
        1, '', error.format(domain=own_ros.domain))


@pytest.mark.parametrize('name', ['a b', '/bow', 'cmd', ''])
def test_source_that_cannot_be_is_refused_in_one_line_with_status_2(name: str) -> None:
    outcome = run(MONITOR, '--source', name)

    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (
        2, '', f'monitor: argument --source: {name!r} is not a valid name of a source; '
               'see monitor --help\n')
