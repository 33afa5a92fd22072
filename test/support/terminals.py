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

"""Programs on a terminal: a pseudo-terminal whose other side is the test."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import contextlib
import os
import pty
import subprocess
import sys

from support.processes import environment, prepare_child, ROOT
from support.waiting import PATIENCE


@contextlib.contextmanager
def on_terminal(*arguments: str) -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """Run ``python -m ARGUMENTS`` on a terminal; return the process and the other side of it."""
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, '-m', *arguments], stdin=slave, stdout=slave, stderr=slave, cwd=ROOT,
        env=environment(), start_new_session=True, preexec_fn=prepare_child)
    os.close(slave)
    try:
        yield process, master
    finally:
        process.kill()
        process.wait()
        with contextlib.suppress(OSError):
            os.close(master)


def conversation(*arguments: str, answers: Iterable[tuple[str, str]]) -> tuple[int, str]:
    """
    Run ``python -m ARGUMENTS`` on a terminal; return its exit status and its output.

    :param answers: lines to type, each after a text that must have been printed.
    """
    with on_terminal(*arguments) as (process, master):
        seen = b''
        for awaited, line in answers:
            while awaited.encode() not in seen:
                seen += os.read(master, 4096)
            os.write(master, f'{line}\n'.encode())
        # Reading fails when the program has closed its terminal.
        with contextlib.suppress(OSError):
            while data := os.read(master, 4096):
                seen += data
        return process.wait(PATIENCE), seen.decode()
