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

"""The bridge; it prints for how long garbage collections stop it, ms."""

from __future__ import annotations

import gc
from pathlib import Path
import sys
import threading
import time

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from illuminator_ros.cli.bridge import main  # noqa: E402

# s from the start until the bridge serves its light.
DELAY = 3.0


def collect(count: int) -> None:
    """Collect all garbage ``count`` times, as the interpreter sometimes does."""
    for _ in range(count):
        began = time.perf_counter()
        gc.collect()
        print(f'collected in {(time.perf_counter() - began) * 1e3:.3f} ms', flush=True)


if __name__ == '__main__':
    timer = threading.Timer(DELAY, collect, (int(sys.argv.pop(1)),))
    timer.daemon = True
    timer.start()
    print('ready', flush=True)
    sys.exit(main())
