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

"""The time stamps of signing continue after a restart of the program."""

from __future__ import annotations

from pathlib import Path

from illuminator_ros.mavlink.link import STORE_INTERVAL
from illuminator_ros.mavlink.signing import Signing, SigningMode
from illuminator_ros.mavlink.signing_files import TimestampStore
import pytest
from support.live_link import Jump, LiveLink, Run
from support.waiting import eventually


# Unix time, s: 1970, as on a computer whose clock was not set, and 2023.
@pytest.mark.parametrize('unix_time', [0.0, 1.7e9])
def test_link_stores_its_time_stamps_at_once_every_30_s_and_when_it_ends(
        run: Run, tmp_path: Path, unix_time: float) -> None:
    store, clock = TimestampStore('key', 'test', tmp_path), Jump()
    used = []
    for wall_clock in (unix_time, unix_time + 2 * STORE_INTERVAL):
        times = [wall_clock]
        signing = Signing(SigningMode.SIGN, bytes(32), timestamp=store.begin(wall_clock))
        link = run(LiveLink('memory://time_stamps', signing=signing, store=store, clock=clock,
                            wall_clock=lambda times=times: times[0]))
        link.wait_open()
        link.ask(lambda now: None)
        # The file that a crash would leave, now and after some time.
        assert store.load() > signing.timestamp > 0
        store.path.unlink()
        times[0] += STORE_INTERVAL
        clock.ahead += STORE_INTERVAL
        link.ask(lambda now: None)
        eventually(store.path.exists, 'stored again')
        assert store.load() > signing.timestamp
        link.stop()
        assert store.load() == signing.timestamp
        used.append(signing.timestamp)
    assert used[1] > used[0]
