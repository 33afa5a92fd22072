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

"""``conformance`` and ``simulator`` where their terminal is closed, or types what is no text."""

import contextlib
import os
import pty
import signal
import subprocess
import sys

import pytest
from support.ports import free_port
from support.processes import ended, environment, python, ROOT
from support.waiting import eventually, PATIENCE

# It would take two hours.
ARGUMENTS = ('--yes', '--only', 'thermal-flags', '--heat', '3600')


@pytest.fixture
def url():
    return f'127.0.0.1:{free_port()}'


@pytest.fixture
def simulator(url):
    with ended(python('illuminator_ros.simulator', f'udpin://{url}')) as program:
        program.wait_for('link open')
        yield program


def test_a_window_that_is_closed_leaves_the_light_as_it_was(url, simulator):
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, '-m', 'illuminator_ros.conformance', f'udpout://{url}', *ARGUMENTS],
        stdin=slave, stdout=slave, stderr=slave, cwd=ROOT, env=environment(),
        start_new_session=True)
    os.close(slave)
    try:
        simulator.wait_for('ON     100 %')
        os.close(master)
        process.send_signal(signal.SIGHUP)
        process.wait(PATIENCE)
        eventually(lambda: 'off    100 %  no strobe' in simulator.lines[-1], 'not brought back')
    finally:
        process.kill()
        process.wait()


def test_a_window_that_is_closed_may_send_several_signals(url, simulator):
    with ended(python('illuminator_ros.conformance', f'udpout://{url}', *ARGUMENTS)) as program:
        simulator.wait_for('ON     100 %')
        program.send(signal.SIGHUP)
        program.wait_for('bringing the light back')
        program.send(signal.SIGHUP)
        assert program.wait() == 1
        assert program.log.rstrip().endswith('the light is as it was')


def test_what_is_typed_into_the_simulator_and_is_no_text_does_not_end_its_console(url):
    process = subprocess.Popen(
        [sys.executable, '-m', 'illuminator_ros.simulator', f'udpin://{url}'], cwd=ROOT,
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
        env=environment({'PYTHONIOENCODING': 'utf-8:strict'}))

    def ended():
        # Again and again: one that is read together with what is no text is passed over with it.
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(b'quit\n')
            process.stdin.flush()
        return process.poll() is not None

    try:
        process.stdin.write(b'\xff\n')
        process.stdin.flush()
        eventually(ended, 'it does not take commands any more')
        assert process.returncode == 0
    finally:
        process.kill()
        process.wait()
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
