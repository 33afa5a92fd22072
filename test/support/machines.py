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

"""Two machines on one cable: network namespaces, joined by a pair of virtual interfaces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import contextlib
import shutil
import subprocess
import sys

from support.processes import environment, Program

TOOLS = ('unshare', 'nsenter', 'ip')


class CannotBeMade(Exception):
    """This machine, or this user, cannot make network namespaces; the text says why."""


class Machine:
    """
    A network namespace, with an address on the cable.

    It has no name and is kept by one process, which the kernel ends with the tests: however
    they end, nothing is left of it, of its interfaces and of the programs on it.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self._keeper = Program('unshare', '--net', '--', 'sh', '-c', 'echo made; exec sleep 600')

    @property
    def pid(self) -> int:
        """Return the id of the process that keeps it."""
        return self._keeper.pid

    def wait(self) -> None:
        """Wait until it is there."""
        try:
            self._keeper.wait_for('made')
        except AssertionError as error:
            raise CannotBeMade(self._keeper.log.strip()) from error

    def command(self, *command: str) -> tuple[str, ...]:
        """Return a command that runs on it."""
        return ('nsenter', f'--net=/proc/{self.pid}/ns/net', '--', *command)

    def run(self, *command: str) -> str:
        """Run a command on it to its end, and return what it printed."""
        outcome = subprocess.run(self.command(*command), text=True, timeout=30,
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if outcome.returncode:
            raise CannotBeMade(f'{" ".join(command)}: {outcome.stdout.strip()}')
        return outcome.stdout

    def connect(self, other: Machine) -> None:
        """Lay a cable to another machine; multicast goes over it, as it does in a LAN."""
        self.run('ip', 'link', 'add', 'cable', 'type', 'veth', 'peer', 'name', 'cable', 'netns',
                 str(other.pid))
        for machine in (self, other):
            machine.run('ip', 'address', 'add', f'{machine.address}/24', 'dev', 'cable')
            for interface in ('lo', 'cable'):
                machine.run('ip', 'link', 'set', interface, 'up')
            machine.run('ip', 'route', 'add', '224.0.0.0/4', 'dev', 'cable')

    def python(
        self, module: str, *arguments: str, env: Mapping[str, str] | None = None,
    ) -> Program:
        """Start a module of ours on it."""
        return Program(*self.command(sys.executable, '-m', module, *arguments), env=env)

    def end(self) -> None:
        """Take it away."""
        self._keeper.kill()


@contextlib.contextmanager
def two_machines() -> Iterator[tuple[Machine, Machine]]:
    """Yield two machines on one cable; CannotBeMade where that is not possible."""
    missing = [tool for tool in TOOLS if shutil.which(tool, path=environment()['PATH']) is None]
    if missing:
        raise CannotBeMade(f'no {" and no ".join(missing)} on this machine')
    with contextlib.ExitStack() as stack:
        machines = []
        for address in ('10.77.0.1', '10.77.0.2'):
            machines.append(Machine(address))
            stack.callback(machines[-1].end)
        for machine in machines:
            machine.wait()
        machines[0].connect(machines[1])
        yield machines[0], machines[1]
