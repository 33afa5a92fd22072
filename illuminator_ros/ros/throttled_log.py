# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The log of a node: lines of one kind are limited in rate, and those left out are counted."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
import logging
import math
import re
import threading
import time

from rclpy.logging import LoggingSeverity

from .rclpy_private import RcutilsLogger
from ..mavlink.messages import Address

# Lines of one kind in PERIOD, s; the last of those left out is written after it.
BURST = 10
PERIOD = 10.0
# s; failures of a stream that follow each other so closely are one failure that lasts.
REPETITION = 2.0
# How many kinds are limited separately.
MAX_KINDS = 256
# Characters of such a line, enough for a traceback: a frame_id may have megabytes.
MAX_LENGTH = 8000


@dataclass
class _Kind:
    since: float
    lines: int = 0
    left_out: int = 0
    last: tuple[int, str] = (logging.INFO, '')


class NodeLog:
    """
    Writes to the logger of a node, from any thread.

    Writing never waits for the reader of stderr, which leads to an
    :class:`~illuminator_ros.cli.output_queue.OutputQueue`.
    """

    def __init__(
        self, logger: RcutilsLogger, clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._logger = logger
        self._clock = clock
        self._kinds: dict[str, _Kind] = {}
        self._conditions: dict[str, frozenset[str]] = {}
        # The last failure of each stream without its numbers, and when it was reported, s.
        self._failures: dict[str, tuple[str, float]] = {}
        self._lock = threading.Lock()

    def info(self, text: str, kind: str = '') -> None:
        """See :meth:`write`."""
        self.write(logging.INFO, text, kind)

    def warning(self, text: str, kind: str = '') -> None:
        """See :meth:`write`."""
        self.write(logging.WARNING, text, kind)

    def error(self, text: str, kind: str = '') -> None:
        """See :meth:`write`."""
        self.write(logging.ERROR, text, kind)

    def write(self, severity: int, text: str, kind: str = '') -> None:
        """
        Write a line.

        :param severity: of :mod:`logging`.
        :param kind: names the lines that are limited together. Each line that another program
            can cause must have one; '' is not limited.
        """
        if kind and severity > logging.DEBUG:
            if len(text) > MAX_LENGTH:
                text = f'{text[:MAX_LENGTH]}...'
            with self._lock:
                note = self._admit(severity, text, kind)
            if note is None:
                return
            text += note
        self._emit(severity, text)

    def write_conditions(self, texts: Iterable[str], kind: str) -> None:
        """Warn of each condition of a kind that begins, and note each that ends."""
        before, now = self._conditions.get(kind, frozenset()), frozenset(texts)
        self._conditions[kind] = now
        for text in sorted(now - before):
            self.warning(text, kind)
        for text in sorted(before - now):
            self.info(f'no longer: {text}', kind)

    def stream_failed(self, text: str, stream: str) -> None:
        """
        Warn that a message of a stream has failed, once for each reason.

        The reason is the same if it differs in numbers only, such as the age of a heartbeat. It is
        new after a pause of :data:`REPETITION`.

        :param stream: such as the name of its topic.
        """
        reason, now = re.sub(r'[0-9.]+', '', text[:MAX_LENGTH]), self._clock()
        with self._lock:
            last, at = self._failures.get(stream, ('', -math.inf))
            self._failures[stream] = reason, now
        if reason != last or now >= at + REPETITION:
            self.warning(text, stream)

    def flush(self) -> None:
        """Write the last line of each kind that was limited, once its period has ended."""
        now = self._clock()
        with self._lock:
            due = [name for name, kind in self._kinds.items() if now >= kind.since + PERIOD]
            ended = [self._kinds.pop(name) for name in due]
        for kind in ended:
            if kind.left_out:
                severity, text = kind.last
                self._emit(severity, text + _note(kind.left_out - 1))

    @property
    def debugs(self) -> bool:
        """Whether lines for debugging are shown."""
        return bool(self._logger.is_enabled_for(LoggingSeverity.DEBUG))

    def _admit(self, severity: int, text: str, name: str) -> str | None:
        """Return the text to add to the line, None if the line must be left out."""
        now = self._clock()
        kind = self._kinds.get(name)
        note = ''
        if kind is None or now >= kind.since + PERIOD:
            if kind is not None:
                note = _note(kind.left_out)
            elif len(self._kinds) >= MAX_KINDS:
                return None
            kind = self._kinds[name] = _Kind(now)
        if kind.lines >= BURST:
            kind.left_out += 1
            kind.last = severity, text
            return None
        kind.lines += 1
        return note

    def _emit(self, severity: int, text: str) -> None:
        # One call each: rclpy refuses another severity from the same line.
        if severity >= logging.ERROR:
            self._logger.error(text)
        elif severity >= logging.WARNING:
            self._logger.warning(text)
        elif severity >= logging.INFO:
            self._logger.info(text)
        else:
            self._logger.debug(text)


class LogForwarder(logging.Handler):
    """
    Writes the log lines of the modules without ROS to the logs of nodes.

    It takes the place of an earlier forwarder.

    :param log: for the lines that concern no device with a node.
    """

    def __init__(self, log: NodeLog) -> None:
        super().__init__()
        self._log = log
        self._logs: dict[Address, NodeLog] = {}
        self._logger = logging.getLogger('illuminator_ros')
        for handler in list(self._logger.handlers):
            self._logger.removeHandler(handler)
        self._logger.addHandler(self)
        self._logger.propagate = False
        self.adjust()

    def assign(self, address: Address, log: NodeLog | None) -> None:
        """Write the lines that concern an address to the log of its node, None to end that."""
        self._logs.pop(address, None)
        if log is not None:
            self._logs[address] = log
        self.adjust()

    def adjust(self) -> None:
        """Follow the levels of the nodes' loggers."""
        debugs = any(log.debugs for log in (self._log, *self._logs.copy().values()))
        self._logger.setLevel(logging.DEBUG if debugs else logging.INFO)

    def emit(self, record: logging.LogRecord) -> None:
        """See :meth:`logging.Handler.emit`."""
        log = self._logs.get(getattr(record, 'address', Address(0, 0)), self._log)
        log.write(record.levelno, self.format(record), str(record.msg))


def _note(left_out: int) -> str:
    return f' ({left_out} similar lines left out)' if left_out > 0 else ''
