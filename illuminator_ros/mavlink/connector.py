# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Repeated opening of a transport, in a thread beside the link's, since it may block."""

from __future__ import annotations

from collections.abc import Callable
import logging
import random
import threading
import time

from .retries import CONNECTION
from .transport import Channel, open_channel
from .url import Url

# s between the beginnings of two tries, at most: a try may itself take almost as long, and the
# link must be open within 1 s of the other side.
LONGEST_PERIOD = 0.9

_log = logging.getLogger(__name__)


class Backoff:
    """
    The pauses between tries.

    :param jitter: returns a number of 0..1, so that several bridges do not try in step.
    """

    def __init__(self, jitter: Callable[[], float] = random.random) -> None:
        self._jitter = jitter
        self._failures = 0

    def failed(self) -> None:
        """Note that a try has failed."""
        self._failures += 1

    def succeeded(self) -> None:
        """Note that the channel has lasted, so that the next try after its loss is immediate."""
        self._failures = 0

    def answered(self) -> None:
        """Note that a frame was received; if the channel does not last, the pause is short."""
        self._failures = min(self._failures, 1)

    def pause(self, spent: float) -> float:
        """
        Return how long to wait before the next try, s.

        :param spent: the time that the last try took, s.
        """
        if not self._failures:
            return 0.0
        pause = CONNECTION.wait(self._failures) * (0.5 + 0.5 * self._jitter())
        return min(pause, max(LONGEST_PERIOD - spent, CONNECTION.first))


class Connector:
    """
    Tries to open a connection URL, in a thread that ends when it has succeeded.

    Every try counts as failed until ``backoff.succeeded()`` is called: a channel that can be
    opened may be lost at once.

    :param opener: opens it in place of :func:`~.transport.open_channel`, until the event is set.
    :param report: called in that thread with the open channel, never after :meth:`stop`; with the
        reason after each failure; with None if the thread ends without a channel.
    """

    def __init__(
        self, url: Url, report: Callable[[Channel | str | None], None], *,
        opener: Callable[[threading.Event], Channel] | None = None,
        backoff: Backoff | None = None, clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._url = url
        self._opener = opener
        self._report = report
        self.backoff = backoff or Backoff()
        self._clock = clock
        self._stopping = threading.Event()
        # s that the last try took.
        self._spent = 0.0
        # Held while a channel is handed over, so that none is handed over after the stop.
        self._handing_over = threading.Lock()

    def start(self) -> None:
        """
        Start to try; the first try is immediate unless the last channel did not last.

        :raises RuntimeError: if no thread can be started.
        """
        threading.Thread(target=self._run, name='mavlink-open', daemon=True).start()

    def stop(self) -> None:
        """Give up; a channel that a running try still opens is closed again."""
        with self._handing_over:
            self._stopping.set()

    def _run(self) -> None:
        try:
            while not self._try():
                pass
        except BaseException:
            self._report(None)
            raise

    def _try(self) -> bool:
        """Try once, after the pause; return whether to end."""
        if self._stopping.wait(self.backoff.pause(self._spent)):
            return True
        self.backoff.failed()
        begun = self._clock()
        try:
            channel = (
                self._opener(self._stopping) if self._opener else open_channel(self._url))
        except OSError as error:
            self._report(error.strerror or str(error))
        except Exception as error:
            _log.exception('internal error while opening')
            self._report(repr(error))
        else:
            self._hand_over(channel)
            return True
        self._spent = self._clock() - begun
        return False

    def _hand_over(self, channel: Channel) -> None:
        with self._handing_over:
            if not self._stopping.is_set():
                self._report(channel)
                return
        channel.close()
