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

"""A minimal light that sends to the given UDP port and answers almost immediately."""

from __future__ import annotations

import contextlib
from pathlib import Path
import sys
import threading

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

from bench.light import MinimalLight  # noqa: E402


def main() -> None:
    """Serve until SIGINT."""
    light = MinimalLight(int(sys.argv[1]))
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt):
        light.serve(threading.Event())


if __name__ == '__main__':
    main()
