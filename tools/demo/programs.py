# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The programs of a demonstration: started with a log, and ended as Ctrl-C would."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import signal
import socket
import subprocess
import sys

ROOT = Path(__file__).resolve().parents[2]
# s for a program to end after SIGINT.
END_TIMEOUT = 5.0


def free_port() -> int:
    """Return an unused UDP port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def running(log: Path, *command: str, is_read: bool = False) -> Iterator[subprocess.Popen[str]]:
    """
    Run a Python program, and end it as Ctrl-C would.

    :param log: takes what it writes.
    :param is_read: whether its standard output is a pipe instead.
    """
    with log.open('w') as file:
        process = subprocess.Popen(
            [sys.executable, *command], cwd=ROOT, text=True, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE if is_read else file, stderr=file)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(END_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
