# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``conformance`` as a process, over UDP, on a machine without ROS."""

from collections.abc import Callable, Iterator
import json
from pathlib import Path
import re
import signal
from xml.etree import ElementTree

from illuminator_ros.cli.conformance.run import FIND_TIMEOUT
import pytest
from support.ports import free_port
from support.processes import Program, python, run
from support.terminals import Terminal
from support.waiting import eventually

Start = Callable[..., Program]

CONFORMANCE = 'support.quick_conformance'

# A run that would keep the light at 100 % for an hour.
LONG = ('--yes', '--only', 'brightness', '--only', 'thermal-flags', '--heat', '3600')


@pytest.fixture
def url() -> str:
    return f'127.0.0.1:{free_port()}'


@pytest.fixture
def start() -> Iterator[Start]:
    """Return a function that starts a program, which is ended with the test."""
    started = []

    def one(module: str, *arguments: str) -> Program:
        started.append(python(module, *arguments))
        return started[-1]

    yield one
    for program in started:
        program.kill()


@pytest.fixture
def simulate(start: Start, url: str) -> Start:
    """Return a function that starts a simulator on the URL."""
    def one(*arguments: str) -> Program:
        program = start('illuminator_ros.simulator', f'udpin://{url}', *arguments)
        program.wait_for('link open')
        return program
    return one


def test_a_run_ends_with_its_verdict_and_its_reports_agree(
        url: str, start: Start, simulate: Start, tmp_path: Path) -> None:
    simulate('--fault', 'refuse=failed')
    program = start(
        CONFORMANCE, f'udpout://{url}', '--only', 'brightness', '--only', 'on', '--only',
        'address', '--skip', 'uptime=fixed in 2.1', '--only', 'uptime', '--junit',
        str(tmp_path / 'report.xml'), '--json', str(tmp_path / 'report.json'))
    assert program.wait() == 1
    assert 'FAIL    brightness ' in program.log
    # Without a terminal and without --yes the user cannot consent.
    assert 'switched on, it would shine at 100 %' in program.log
    assert re.search(r'1 passed, 1 failed, 2 skipped .*', program.log), program.log
    assert 'left out: fixed in 2.1' in program.log
    assert 'To change; a correct light ...' in program.log
    assert json.loads((tmp_path / 'report.json').read_text())['passed'] is False
    suite = ElementTree.parse(tmp_path / 'report.xml').getroot()
    assert len(suite.findall('testcase')) == 4
    assert [one.attrib['message'] for one in suite.findall('testcase/skipped')][-1] == (
        'left out: fixed in 2.1')
    assert len(suite.findall('testcase/failure')) == 1


def test_a_camera_is_checked_in_mavlink_1_and_takes_no_image_without_consent(
        url: str, start: Start, simulate: Start) -> None:
    camera = simulate('--payload', 'rededge', '--fault', 'extension')
    only = [text for name in ('ping', 'capture-feedback', 'mavlink-1', 'lengths')
            for text in ('--only', name)]
    arguments = (CONFORMANCE, '--payload', 'rededge', f'udpout://{url}', *only)
    without = start(*arguments)
    assert without.wait() == 0, without.log
    assert '3 passed, 0 failed, 1 skipped' in without.log
    assert camera.count('1 image ') == 0

    consenting = start(*arguments, '--yes')
    assert consenting.wait() == 1
    assert 'CAMERA_FEEDBACK with 47 bytes' in consenting.log
    assert 'as it was, besides its new images' in consenting.log
    camera.wait_for('1 image ')


def test_a_signal_restores_the_light_and_ends_with_status_1(
        url: str, start: Start, simulate: Start) -> None:
    simulator = simulate()
    program = start(CONFORMANCE, f'udpout://{url}', *LONG)
    simulator.wait_for('ON     100 %')
    program.send(signal.SIGQUIT)
    program.wait_for('restoring the light')
    # A closing terminal sends SIGHUP twice.
    program.send(signal.SIGHUP)

    assert program.wait() == 1
    assert program.log.rstrip().endswith('the light is as it was')
    assert 'Traceback' not in program.log
    eventually(lambda: 'off    100 %  no strobe' in simulator.lines[-1], 'not restored')


def test_a_second_signal_ends_at_once_and_says_that_the_light_is_changed(
        url: str, start: Start, simulate: Start) -> None:
    simulator = simulate()
    program = start(CONFORMANCE, f'udpout://{url}', *LONG)
    simulator.wait_for('ON     100 %')
    # Stop the light, so that it is not restored before the second signal.
    simulator.send(signal.SIGSTOP)
    program.send(signal.SIGINT)
    program.wait_for('restoring the light')
    program.send(signal.SIGINT)

    assert program.wait() == 1
    assert program.log.rstrip().endswith('ended; the light is not as it was')


def test_a_signal_before_a_light_is_found_speaks_of_no_restoring(url: str, start: Start) -> None:
    program = start(CONFORMANCE, f'udpin://{url}')
    program.wait_for('checking the light')
    program.send(signal.SIGTERM)

    assert program.wait() == 1
    assert 'restor' not in program.log
    assert program.log.rstrip().endswith('skipped in 0 s; nothing was changed')


def test_a_closed_terminal_leaves_the_light_as_it_was(url: str, simulate: Start) -> None:
    simulator = simulate()
    with Terminal(CONFORMANCE, f'udpout://{url}', *LONG) as screen:
        simulator.wait_for('ON     100 %')
        screen.hang_up()
        screen.send(signal.SIGHUP)
        screen.wait()
        eventually(lambda: 'off    100 %  no strobe' in simulator.lines[-1], 'not restored')


@pytest.mark.parametrize('arguments', ['--list', 'udpin://{url} --wait 0.1'])
def test_a_full_disk_is_reported_in_one_line_with_status_1(url: str, arguments: str) -> None:
    ended = run(CONFORMANCE, *arguments.format(url=url).split(), redirection='> /dev/full')

    assert ended.stderr == 'conformance: standard output: No space left on device\n'
    assert ended.returncode == 1


@pytest.mark.parametrize('redirection', ['<&- >&-', '2>&-'])
def test_closed_standard_streams_are_no_error(url: str, simulate: Start, redirection: str) -> None:
    simulate()
    ended = run(CONFORMANCE, f'udpout://{url}', '--only', 'strobe', '--only', 'address',
                redirection=redirection)

    assert ended.returncode == 0
    assert 'Traceback' not in ended.stderr


@pytest.mark.parametrize(('arguments', 'used', 'status', 'reason'), [
    ('udpin://{url} --wait 0.5', False, 1, 'no light was heard within 0.5 s'),
    ('tcp://127.0.0.1:1 --wait 0.5', False, 1, 'link not open: tcp://127.0.0.1:1: '),
    # This computer cannot open the link, which does not concern the light. The run ends at once.
    ('udpin://{url}', True, 2, 'several programs on one link); nothing was checked'),
    ('serial:///nowhere/tty:57600', False, 2, 'nothing was checked')])
def test_without_a_light_or_a_link_the_reason_is_reported_with_its_status(
        url: str, start: Start, simulate: Start, arguments: str, used: bool, status: int,
        reason: str) -> None:
    if used:
        simulate()
    program = start(CONFORMANCE, *arguments.format(url=url).split())

    assert program.wait(0.8 * FIND_TIMEOUT) == status
    assert reason in program.log
    assert ('0 passed, 1 failed' in program.log) == ('FAIL' in program.log) == (status == 1)
    # The reason is printed at most twice: while the program waits, and as the result.
    assert program.log.count(reason.partition(';')[0]) <= 3 - status
    assert 'trying again' not in program.log or status == 1
    assert len(program.log.splitlines()) < 10


@pytest.mark.parametrize(('arguments', 'reason'), [
    ([], 'the connection URL is missing'),
    (['udp:x:y'], "port 'y' is not a number"),
    (['udpin://:1', '--only', 'nope'], "invalid choice: 'nope'"),
    (['udpin://:1', '--skip', 'uptime'], '--skip uptime: it needs the name of a requirement and'),
    (['udpin://:1', '--skip', 'nope=x'], '--skip nope: it needs the name of a requirement and'),
    (['udpin://:1', '--payload', 'nope'], "invalid choice: 'nope'"),
    (['udpin://:1', '--target', '1'], "'1' is "),
    (['udpin://:1', '--junit', '/nowhere/at/all.xml'], 'there is no such directory'),
    (['udpin://:1', '--json', '/tmp'], '/tmp: it is a directory'),
    (['udpin://:1', '--json', ''], 'it is a directory'),
    (['udpin://:1', '--json', 'x' * 300 + '/report.json'], 'there is no such directory'),
    (['udpin://:1', '--signing-mode', 'sign'], 'key'),
    (['udpin://:1', '--mavlink-version', '1'], 'MAVLink 1 cannot carry ILLUMINATOR_STATUS'),
    # The name of a device in another encoding than UTF-8.
    (['serial:///nowhere/\udce4:1', '--wait', '0.1'],
     'cannot open /nowhere/\\udce4: there is no such port'),
])
def test_a_wrong_argument_is_named_in_one_line_with_status_2(
        arguments: list[str], reason: str) -> None:
    ended = run('illuminator_ros.conformance', *arguments)

    assert ended.returncode == 2
    assert reason in ended.stderr
    assert ended.stderr.count('\n') == 1


@pytest.mark.parametrize(('only', 'answers', 'reply'), [
    ('strobe', ['y'], 'PASS strobe'),
    ('strobe', ['maybe'], "'maybe' is neither y nor n: taken as no"),
    ('heartbeat', [], 'PASS heartbeat')])
def test_a_check_that_needs_consent_asks_after_it_named_the_lights_on_the_link(
        url: str, simulate: Start, only: str, answers: list[str], reply: str) -> None:
    simulate('--light', '1/7', '--light', '1/8')
    with Terminal(CONFORMANCE, f'udpout://{url}', '--target', '1/8', '--only', only, '--only',
                  'address') as screen:
        screen.wait_for('found light 1/8')
        screen.wait_for('not checked: light 1/7')
        for answer in answers:
            screen.wait_for(r'May light 1/8 strobe.*\[y/N\]')
            screen.type(f'{answer}\n')
        screen.wait_for(reply)
        assert screen.wait() == 0
    assert ('May light' in screen.raw) == bool(answers)
