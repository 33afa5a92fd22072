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

"""Opening a transport again and again, beside the link's thread: it may block."""

from __future__ import annotations

from collections.abc import Callable
import logging
import random
import threading

from .transport import Channel, open_channel
from .url import Url

# s between tries: the first, doubling up to the last. With connecting itself (0.8 s at most) a
# link is back within 1 s of the other side.
BACKOFF = (0.05, 0.5)

_log = logging.getLogger(__name__)


class Opener:
    """
    Tries to open a connection URL in a thread that ends when it has succeeded.

    :param opened: called in that thread with the open channel.
    :param failed: called in that thread with the reason, after each failure.
    """

    def __init__(
        self, url: Url, opened: Callable[[Channel], None], failed: Callable[[str], None],
    ) -> None:
        self._url = url
        self._opened = opened
        self._failed = failed
        self._stopping = threading.Event()
        self._failures = 0

    def start(self) -> None:
        """Start to try; the first try comes at once unless the last channel was of no use."""
        threading.Thread(target=self._run, name='mavlink-open', daemon=True).start()

    def stop(self) -> None:
        """Give up, after the try that is under way."""
        self._stopping.set()

    def succeeded(self) -> None:
        """Note that the channel works, so that the next loss is answered at once."""
        self._failures = 0

    def _run(self) -> None:
        while not self._stopping.wait(self._pause()):
            self._failures += 1
            try:
                channel = open_channel(self._url)
            except OSError as error:
                self._failed(error.strerror or str(error))
            except Exception as error:
                _log.exception('internal error while opening')
                self._failed(repr(error))
            else:
                if self._stopping.is_set():
                    channel.close()
                else:
                    self._opened(channel)
                return

    def _pause(self) -> float:
        if not self._failures:
            return 0.0
        first, last = BACKOFF
        longest = min(first * 2.0 ** min(self._failures - 1, 16), last)
        # Jitter, so that several bridges do not knock in step.
        return longest * random.uniform(0.5, 1.0)
