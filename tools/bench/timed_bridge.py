# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A bridge that prints the CPU time of the turns of its link's thread, and the times of an OFF.

It prints ``turn MS`` every 0.1 s, the longest since the last line; ``taken S`` (monotonic) when
the executor has taken the request of an OFF; ``off COMPONENT S`` when an OFF has been sent.
"""

from __future__ import annotations

from collections.abc import Sequence
import os
import selectors
import sys
import threading
import time
from typing import Any

from illuminator_ros.cli import bridge

PERIOD = 0.1
# COMMAND_LONG, param1 = 0, MAV_CMD_ILLUMINATOR_ON_OFF.
OFF = (76).to_bytes(3, 'little'), bytes(4), (405).to_bytes(2, 'little')


class _TimedSelector(selectors.DefaultSelector):
    """Its waits separate the turns of the thread."""

    longest = 0.0

    def __init__(self) -> None:
        super().__init__()
        self._began: float | None = None

    def select(self, timeout: float | None = None) -> Any:
        if self._began is not None:
            type(self).longest = max(self.longest, time.thread_time() - self._began)
        ready = super().select(timeout)
        self._began = time.thread_time()
        return ready


def _print(line: str) -> None:
    # In one call: several threads print.
    os.write(1, f'{line}\n'.encode())


def _report() -> None:
    while True:
        time.sleep(PERIOD)
        longest, _TimedSelector.longest = _TimedSelector.longest, 0.0
        _print(f'turn {longest * 1e3:.3f}')


def _time_link_and_services() -> None:
    """Time the turns of the link's thread and the requests; there are no hooks for that."""
    # Slow to import, and not before the bridge has blocked the signals of its threads.
    from illuminator_ros.mavlink import line, lines, link, link_thread
    from illuminator_ros.mavlink.transport import Peer
    from illuminator_ros.ros import deferred_service, node
    from std_srvs.srv import SetBool

    class TimedService(deferred_service.DeferredService):

        def __init__(self, owner: Any, type_: Any, name: str, take: Any, *rest: Any) -> None:
            def timed(request: Any, respond: Any) -> None:
                if type_ is SetBool and not request.data:
                    _print(f'taken {time.monotonic()}')
                take(request, respond)

            super().__init__(owner, type_, name, timed, *rest)

    class TimedThread(link_thread.LinkThread):

        def __init__(
            self, work: Any, finish: Any, faults: Any, clock: Any, selector: Any, **options: Any,
        ) -> None:
            super().__init__(
                work, finish, faults, clock, selector or _TimedSelector(), **options)

    class TimedLine(line.Line):

        def write(self, frames: Sequence[bytes], peers: Sequence[Peer], now: float) -> None:
            super().write(frames, peers, now)
            for frame in frames:
                payload = frame[10:]
                # The message id; the payload has param1 first, and the command at byte 28.
                if (frame[7:10], payload[:4], payload[28:30]) == OFF:
                    _print(f'off {payload[31]} {time.monotonic()}')

    setattr(lines, 'Line', TimedLine)  # noqa: B010 - mypy forbids an assignment
    setattr(link, 'LinkThread', TimedThread)  # noqa: B010
    setattr(node, 'DeferredService', TimedService)  # noqa: B010
    threading.Thread(target=_report, daemon=True).start()


def main() -> int:
    """Run the bridge of a payload with a link whose thread is timed."""
    serve = bridge._serve

    def serve_timed(*arguments: Any) -> int:
        _time_link_and_services()
        return serve(*arguments)

    setattr(bridge, '_serve', serve_timed)  # noqa: B010
    return bridge.main(sys.argv[2:], payload=sys.argv[1])


if __name__ == '__main__':
    sys.exit(main())
