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

"""The options of message signing, which simulator and conformance have in common."""

from __future__ import annotations

from pathlib import Path

from illuminator_ros.cli.options import signing
from illuminator_ros.cli.simulator.options import parser
from illuminator_ros.mavlink.signing import Signing, SigningMode, ticks
from illuminator_ros.mavlink.signing_files import TimestampStore
import pytest

NAME = 'simulator 1/243'
# Of a run by a clock that was far ahead.
LATER = ticks(4e9)


@pytest.fixture
def key_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return a key file, whose time stamps are kept in a folder of the test's own."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    path = tmp_path / 'key'
    path.write_bytes(bytes(range(32)))
    path.chmod(0o600)
    return str(path)


def options(mode: str, key_file: str) -> tuple[Signing, TimestampStore | None]:
    return signing(
        parser().parse_args(['--signing-mode', mode, '--signing-key-file', key_file]), NAME)


def test_nothing_is_signed_unless_asked_for() -> None:
    one, store = signing(parser().parse_args([]), NAME)
    assert (one.mode, store) == (SigningMode.OFF, None)


@pytest.mark.parametrize('mode', ['sign', 'require'])
def test_the_key_is_that_of_the_file(key_file: str, mode: str) -> None:
    one, _ = options(mode, key_file)
    assert (one.mode.value, one.key) == (mode, bytes(range(32)))


def test_the_time_stamps_of_the_run_before_are_gone_on_from(key_file: str) -> None:
    TimestampStore(key_file, NAME).store(LATER, last=True)
    one, store = options('sign', key_file)
    assert one.timestamp == LATER
    assert store is not None and store.load() == LATER


def test_a_key_that_would_not_be_used_is_refused(key_file: str) -> None:
    with pytest.raises(ValueError, match='--signing-key-file is given, but'):
        options('off', key_file)


def test_the_first_run_begins_with_the_clock(key_file: str) -> None:
    one, _ = options('sign', key_file)
    assert one.timestamp > 0
