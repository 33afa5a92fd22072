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

"""``conformance`` and ``simulator`` as processes, over UDP, on a machine without ROS."""

import json
import os
import pty
import re
import signal
import subprocess
import sys
from xml.etree import ElementTree

from illuminator_ros.illuminator.checks.requirements import REQUIREMENTS
import pytest
from support.ports import free_port
from support.processes import environment, Program, ROOT, run
from support.waiting import eventually, PATIENCE

# Started like this, none of what `pip install` does not bring can be imported.
WITHOUT_ROS = (
    'import sys, support.no_ros\n'
    'sys.modules.update(dict.fromkeys(["yaml", "serial"]))\n'
    'from illuminator_ros.{0} import main\n'
    'sys.exit(main(sys.argv[1:]))\n')
# s; a whole run takes about 30.
WHOLE_RUN = 300.0


def start(module, *arguments):
    """Start one of the two without ROS."""
    path = os.pathsep.join((str(ROOT), str(ROOT / 'test')))
    return Program(sys.executable, '-c', WITHOUT_ROS.format(module), *arguments,
                   env={'PYTHONPATH': path})


@pytest.fixture
def url():
    return f'127.0.0.1:{free_port()}'


@pytest.fixture
def programs():
    """Return a function that starts a program, which is ended with the test."""
    started = []

    def keep(*arguments):
        started.append(start(*arguments))
        return started[-1]

    yield keep
    for one in started:
        one.kill()


@pytest.mark.timeout(WHOLE_RUN)
def test_a_whole_run_ends_and_its_reports_agree(url, programs, tmp_path):
    # That it finds nothing in the simulator is shown where no time passes (test/conformance): on
    # a machine that stands still for a second, it would find here that the simulator is slow.
    simulator = programs('simulator', f'udpin://{url}')
    simulator.wait_for('link open')
    conformance = programs(
        'conformance', f'udpout://{url}', '--yes', '--heat', '0', '--junit',
        str(tmp_path / 'report.xml'), '--json', str(tmp_path / 'report.json'))
    status = conformance.wait(WHOLE_RUN)
    match = re.search(r'(\d+) passed, (\d+) failed, 1 skipped', conformance.log)
    assert match, conformance.log
    passed, failed = map(int, match.groups())
    assert passed + failed + 1 == len(REQUIREMENTS)
    assert passed > len(REQUIREMENTS) / 2
    assert status == bool(failed)
    assert 'the light is as it was' in conformance.log
    content = json.loads((tmp_path / 'report.json').read_text())
    assert content['passed'] is (not failed)
    suite = ElementTree.parse(tmp_path / 'report.xml').getroot()
    assert len(suite.findall('testcase')) == len(REQUIREMENTS)
    assert len(suite.findall('testcase/failure')) == failed


def test_what_is_found_is_exit_status_1(url, programs):
    simulator = programs('simulator', f'udpin://{url}', '--fault', 'refuse=failed')
    simulator.wait_for('link open')
    conformance = programs('conformance', f'udpout://{url}', '--only', 'brightness')
    assert conformance.wait() == 1
    assert 'FAIL    brightness ' in conformance.log


def test_without_anybody_to_ask_a_light_that_cannot_be_dimmed_is_not_switched_on(url, programs):
    simulator = programs('simulator', f'udpin://{url}', '--fault', 'refuse=failed')
    simulator.wait_for('link open')
    conformance = programs('conformance', f'udpout://{url}', '--only', 'on')
    conformance.wait()
    assert 'switched on, it would shine at 100 %' in conformance.log


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_with_the_light_as_it_was(url, programs, number):
    simulator = programs('simulator', f'udpin://{url}')
    simulator.wait_for('link open')
    # It would take two hours.
    conformance = programs('conformance', f'udpout://{url}', '--yes', '--only', 'brightness',
                           '--only', 'thermal-flags', '--heat', '3600')
    simulator.wait_for('ON     100 %')
    conformance.send(number)
    assert conformance.wait() == 1
    assert conformance.log.rstrip().endswith('the light is as it was')
    assert 'Traceback' not in conformance.log
    eventually(lambda: 'off    100 %  no strobe' in simulator.lines[-1], 'not brought back')


@pytest.mark.parametrize('arguments', ['--list', 'udpin://{url} --wait 0.1'],
                         ids=['list', 'run'])
def test_a_full_disk_is_said_in_one_line_with_exit_status_1(url, arguments):
    ended = subprocess.run(
        f'{sys.executable} -m illuminator_ros.conformance {arguments.format(url=url)} > /dev/full',
        shell=True, cwd=ROOT, env=environment(), text=True, stderr=subprocess.PIPE,
        timeout=PATIENCE)
    assert ended.stderr == 'conformance: standard output: No space left on device\n'
    assert ended.returncode == 1


def test_under_nohup_it_outlives_its_terminal(url):
    program = Program('sh', '-c', 'trap "" HUP; exec "$@"', 'sh', sys.executable, '-m',
                      'illuminator_ros.conformance', f'udpout://{url}', '--yes')
    program.wait_for('checking the light')
    with open(f'/proc/{program.pid}/status') as status:
        [ignored] = [line.split()[1] for line in status if line.startswith('SigIgn:')]
    program.kill()
    assert int(ignored, 16) & 1 << signal.SIGHUP - 1


def test_without_a_light_it_is_exit_status_1(url, programs):
    conformance = programs('conformance', f'udpin://{url}', '--wait', '0.5')
    assert conformance.wait() == 1
    assert 'no light was heard within 0.5 s' in conformance.log
    assert '0 passed, 1 failed' in conformance.log


def test_a_link_that_cannot_be_opened_is_the_verdict_in_a_few_lines(programs):
    conformance = programs('conformance', 'tcp://127.0.0.1:1', '--wait', '0.5')
    assert conformance.wait() == 1
    *_, light, summary = conformance.log.splitlines()
    assert light.startswith('no light: link not open: tcp://127.0.0.1:1: ')
    assert summary.startswith('0 passed, 1 failed')
    assert f'SKIPPED {len(REQUIREMENTS) - 1} requirements: ' in conformance.log
    assert len(conformance.log.splitlines()) < 12


@pytest.mark.parametrize(('arguments', 'said'), [
    ([], 'the connection URL is missing'),
    (['udp:x:y'], "port 'y' is not a number"),
    (['udpin://:1', '--only', 'nope'], "invalid choice: 'nope'"),
    (['udpin://:1', '--target', '1'], "'1' is no address such as 1/243"),
    (['udpin://:1', '--junit', '/nowhere/at/all.xml'], 'there is no such directory'),
    (['udpin://:1', '--signing-mode', 'sign'], 'key'),
])
def test_a_wrong_argument_is_said_in_one_line_with_exit_status_2(arguments, said):
    ended = run('illuminator_ros.conformance', *arguments)
    assert ended.returncode == 2
    assert said in ended.stderr
    assert ended.stderr.count('\n') == 1


def test_the_requirements_can_be_listed():
    ended = run('illuminator_ros.conformance', '--list')
    assert ended.returncode == 0
    assert len(ended.stdout.splitlines()) == len(REQUIREMENTS)


def conversation(*arguments, answers):
    """Run a module on a terminal, type lines as they are asked for, and return what came."""
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, '-m', *arguments], stdin=slave, stdout=slave, stderr=slave, cwd=ROOT,
        env=environment(), start_new_session=True)
    os.close(slave)
    seen = ''
    try:
        for awaited, line in answers:
            while awaited not in seen:
                seen += os.read(master, 4096).decode()
            os.write(master, f'{line}\n'.encode())
        while True:
            try:
                seen += os.read(master, 4096).decode()
            except OSError:
                break
        return process.wait(PATIENCE), seen
    finally:
        process.kill()
        process.wait()
        os.close(master)


def test_on_a_terminal_it_asks_before_it_dazzles(url, programs):
    simulator = programs('simulator', f'udpin://{url}')
    simulator.wait_for('link open')
    status, seen = conversation(
        'illuminator_ros.conformance', f'udpout://{url}', '--only', 'strobe', '--only',
        'address', answers=[('[y/N]', 'n')])
    assert 'seizures' in seen
    assert 'SKIPPED strobe' in seen
    assert status == 0


def test_an_answer_that_is_neither_yes_nor_no_is_said_to_be_taken_as_no(url):
    _, seen = conversation(
        'illuminator_ros.conformance', f'udpin://{url}', '--wait', '0.1', '--only', 'strobe',
        answers=[('[y/N]', 'maybe')])
    assert "'maybe' is neither y nor n: taken as no" in seen


def test_it_does_not_ask_where_nothing_that_dazzles_is_to_be_checked(url):
    _, seen = conversation(
        'illuminator_ros.conformance', f'udpin://{url}', '--wait', '0.1', '--only', 'address',
        '--only', 'on', answers=[('', 'n')])
    assert 'no light was heard' in seen
    assert '[y/N]' not in seen


def test_the_simulator_is_operated_on_a_terminal(url):
    status, seen = conversation(
        'illuminator_ros.simulator', f'udpin://{url}', '--light', '1/7=bow',
        answers=[('1/7 bow', 'bow on'), ('ON ', 'quit')])
    assert status == 0
    assert '\x1b7' in seen


def test_the_simulator_is_operated_through_a_pipe(url):
    ended = subprocess.run(
        [sys.executable, '-m', 'illuminator_ros.simulator', f'udpin://{url}'], cwd=ROOT,
        env=environment(), input='on\nbrightness 40\nfault nope\nstatus\nquit\n', text=True,
        capture_output=True, timeout=PATIENCE)
    assert ended.returncode == 0
    assert "no fault 'nope'" in ended.stdout
    assert 'ON      40 %' in ended.stdout
    assert '\x1b' not in ended.stdout


def test_a_simulator_whose_input_has_ended_goes_on(url, programs):
    simulator = programs('simulator', f'udpin://{url}')
    simulator.wait_for('link open')
    assert simulator.running
    assert simulator.end() == 0
