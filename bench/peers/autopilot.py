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

"""An autopilot that sends to a UDP port, so many frames a second: ``autopilot.py PORT RATE``."""

from __future__ import annotations

from pathlib import Path
import sys

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

from bench.traffic import COMMON, frames, udp_line  # noqa: E402


def main() -> None:
    """Send until SIGINT, and say then how many frames were sent."""
    port, rate = map(int, sys.argv[1:])
    line, prepared = udp_line(port), frames(COMMON)
    print('ready', flush=True)
    try:
        while True:
            line.feed(prepared, rate, rate)
    except KeyboardInterrupt:
        print(f'frames {line.sent}', flush=True)


if __name__ == '__main__':
    main()
