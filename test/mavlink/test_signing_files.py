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

"""Key files, and the time stamp that outlives a run."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink.signing import NEW_STREAM_TICKS, Signing, TICKS_PER_SECOND
from illuminator_ros.mavlink.signing_files import (
    KeyFileError,
    load_key,
    MAX_KEY_FILE,
    TimestampKeeper,
    TimestampStore,
)
import pytest
from support.frames import frame_of
from support.signers import checker, KEY, LAST_STAMP, NOW, signed, stamp_at

RAW = bytes(range(100, 132))
PASSPHRASE = 'correct horse battery staple'


def key_file(directory: Path, content: bytes, mode: int = 0o600) -> str:
    """Write a key file."""
    path = directory / 'signing.key'
    path.write_bytes(content)
    path.chmod(mode)
    return str(path)


def of_passphrase(passphrase: str) -> bytes:
    """Return the key as MAVProxy and Mission Planner make it of a passphrase."""
    return hashlib.sha256(passphrase.encode()).digest()


# Contents of a key file

@pytest.mark.parametrize(('content', 'key'), [
    pytest.param(RAW, RAW, id='32 raw bytes'),
    pytest.param(bytes(32), bytes(32), id='32 zeros'),
    pytest.param(RAW[:31] + b'\n', RAW[:31] + b'\n', id='32 raw bytes that end as a line'),
    pytest.param(RAW.hex().encode(), RAW, id='64 hexadecimal digits'),
    pytest.param(RAW.hex().upper().encode() + b'\n', RAW, id='64 digits, capitals, a line'),
    pytest.param(RAW.hex().encode() + b'\r\n', RAW, id='64 digits, a line of Windows'),
    pytest.param(PASSPHRASE.encode(), of_passphrase(PASSPHRASE), id='passphrase'),
    pytest.param(f'{PASSPHRASE}\n'.encode(), of_passphrase(PASSPHRASE), id='passphrase, a line'),
    pytest.param(b'12345678', of_passphrase('12345678'), id='shortest passphrase'),
    pytest.param(b'x' * 32, of_passphrase('x' * 32), id='passphrase of 32 characters'),
    pytest.param(b'x' * 31 + b'\n', of_passphrase('x' * 31), id='one of 31 and a line'),
    pytest.param('ä'.encode() * 16, of_passphrase('ä' * 16), id='passphrase of 32 bytes, UTF-8'),
    pytest.param(b'g' + RAW.hex().encode()[1:], of_passphrase('g' + RAW.hex()[1:]),
                 id='64 characters, not all digits'),
])
def test_key_is_read(tmp_path: Path, content: bytes, key: bytes) -> None:
    assert load_key(key_file(tmp_path, content)) == key


@pytest.mark.parametrize('content', [
    pytest.param(b'', id='empty'),
    pytest.param(b'\n', id='an empty line'),
    pytest.param(b'1234567', id='7 characters'),
    pytest.param(b'1234567\n', id='7 characters and a line'),
    pytest.param(RAW[:31], id='31 raw bytes'),
    pytest.param(RAW + b'\0', id='33 raw bytes'),
    pytest.param(RAW * 2, id='64 raw bytes'),
    pytest.param(b'two lines\nof text', id='two lines'),
    pytest.param(PASSPHRASE.encode('utf-16'), id='UTF-16'),
])
def test_what_is_no_key_is_refused_with_its_length(tmp_path: Path, content: bytes) -> None:
    path = key_file(tmp_path, content)
    with pytest.raises(KeyFileError, match=f'holds {len(content)} bytes') as caught:
        load_key(path)
    assert path in str(caught.value)


@pytest.mark.parametrize('mode', [0o640, 0o604, 0o660, 0o644, 0o610, 0o602, 0o777])
def test_file_that_is_open_to_others_is_refused_with_the_remedy(
        tmp_path: Path, mode: int) -> None:
    path = key_file(tmp_path, RAW, mode)
    with pytest.raises(KeyFileError, match=f'{mode:04o}.*chmod 600') as caught:
        load_key(path)
    assert path in str(caught.value)


@pytest.mark.parametrize('mode', [0o600, 0o400, 0o700])
def test_file_of_the_owner_alone_is_taken(tmp_path: Path, mode: int) -> None:
    assert load_key(key_file(tmp_path, RAW, mode)) == RAW


@pytest.mark.parametrize('size', [MAX_KEY_FILE + 1, 3_000_000])
def test_huge_file_is_refused(tmp_path: Path, size: int) -> None:
    with pytest.raises(KeyFileError, match=f'longer than {MAX_KEY_FILE} bytes'):
        load_key(key_file(tmp_path, b'x' * size))


def test_longest_passphrase_is_taken(tmp_path: Path) -> None:
    text = 'x' * MAX_KEY_FILE
    assert load_key(key_file(tmp_path, text.encode())) == of_passphrase(text)


def test_missing_file_is_named(tmp_path: Path) -> None:
    path = str(tmp_path / 'none.key')
    with pytest.raises(KeyFileError, match='No such file') as caught:
        load_key(path)
    assert path in str(caught.value)


def test_directory_is_no_key_file(tmp_path: Path) -> None:
    with pytest.raises(KeyFileError, match='Is a directory') as caught:
        load_key(str(tmp_path))
    assert str(tmp_path) in str(caught.value)


def test_no_path_is_said_to_be_none() -> None:
    with pytest.raises(KeyFileError, match='no key file is given'):
        load_key('')


def test_impossible_path_is_refused() -> None:
    with pytest.raises(KeyFileError, match='null byte'):
        load_key('key\0file')


@given(st.one_of(
    st.binary(max_size=80), st.text(max_size=80).map(str.encode),
    st.binary(min_size=32, max_size=32)))
@settings(derandomize=True, deadline=None, max_examples=200)
def test_any_content_is_a_key_of_32_bytes_or_refused_without_showing_it(
        tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = key_file(tmp_path_factory.getbasetemp(), content)
    try:
        key = load_key(path)
    except KeyFileError as error:
        said = str(error).replace(path, '')
        for part in (content.hex(), repr(content)[2:-1], content.decode(errors='replace')):
            assert len(part) < 8 or part not in said
    else:
        assert len(key) == 32


# The time stamp that outlives a run

@pytest.fixture
def store(tmp_path: Path) -> TimestampStore:
    return TimestampStore('signing.key', 'bridge 1/194', tmp_path / 'state')


def next_run(store: TimestampStore, unix_time: float = 0.0) -> int:
    """Return the first time stamp that is used in the next run, whose clock may be wrong."""
    signing = checker(timestamp=store.load())
    signing.sign(frame_of(signed=True), unix_time)
    return signing.timestamp


def run(store: TimestampStore, unix_time: float) -> Signing:
    """Sign something at a time."""
    signing = checker(timestamp=store.load())
    signing.sign(frame_of(signed=True), unix_time)
    return signing


def test_time_stamps_go_on_after_a_restart_without_a_clock(store: TimestampStore) -> None:
    signing = run(store, NOW)
    store.store(signing.timestamp, last=True)
    assert next_run(store) == signing.timestamp + 1


def test_crash_before_the_next_store_repeats_no_time_stamp(store: TimestampStore) -> None:
    signing = run(store, NOW)
    store.store(signing.timestamp, NOW)
    signing.sign(frame_of(signed=True), NOW + 44.9)
    assert next_run(store) > signing.timestamp


def test_many_crashes_in_a_row_do_not_add_up(store: TimestampStore) -> None:
    for second in range(20):
        store.store(run(store, NOW + second).timestamp, NOW + second)
    assert next_run(store, NOW + 20) - stamp_at(NOW + 20) < NEW_STREAM_TICKS


def test_clock_that_was_ahead_for_a_moment_locks_no_light_out(store: TimestampStore) -> None:
    store.store(run(store, NOW + 7200).timestamp, NOW + 7200)
    signing = checker(timestamp=store.load())
    assert signing.accepts(signed(stamp_at(NOW)), NOW)


def test_failed_write_is_logged_once_and_tried_again(
        store: TimestampStore, caplog: pytest.LogCaptureFixture) -> None:
    store.path.parent.parent.mkdir(parents=True, exist_ok=True)
    store.path.parent.write_text('a file where the directory must be')
    signing = checker(timestamp=5)
    keeper = TimestampKeeper(signing, store)
    keeper.keep(NOW)
    keeper.keep(NOW)
    assert 'trying again' in caplog.text
    assert len(caplog.records) == 1
    store.path.parent.unlink()
    keeper.keep(NOW)
    assert store.load() > 5


def test_pipe_as_state_file_is_read_as_no_time_stamp(store: TimestampStore) -> None:
    store.path.parent.mkdir(parents=True, exist_ok=True)
    os.mkfifo(store.path)
    assert store.load() == 0


def test_same_key_file_has_one_state_file_however_it_is_named(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('HOME', str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert len({TimestampStore(name, 'x').path for name in (
        'key', './key', '~/key', str(tmp_path / 'key'))}) == 1


def test_missing_home_directory_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home() -> Path:
        raise RuntimeError('Could not determine home directory.')

    monkeypatch.delenv('ROS_HOME', raising=False)
    monkeypatch.setattr(Path, 'home', no_home)
    with pytest.raises(KeyFileError, match='set HOME or ROS_HOME'):
        TimestampStore(str(tmp_path / 'key'), 'x')


@pytest.mark.parametrize('blank', [b' ', b'\n', b' \r\n', b'\t'])
def test_digits_of_a_key_are_digits_with_a_blank_behind_them_too(
        tmp_path: Path, blank: bytes) -> None:
    path = tmp_path / 'key'
    path.write_bytes(KEY.hex().encode() + blank)
    path.chmod(0o600)
    assert load_key(str(path)) == KEY


def test_clock_that_has_gone_on_is_followed(store: TimestampStore) -> None:
    store.store(run(store, NOW).timestamp)
    assert next_run(store, NOW + 3600) == stamp_at(NOW + 3600)


def test_many_restarts_do_not_run_ahead_of_the_clock(store: TimestampStore) -> None:
    for second in range(20):
        signing = run(store, NOW + second)
        store.store(signing.timestamp)
        store.store(signing.timestamp, last=True)
    assert next_run(store, NOW + 20) == stamp_at(NOW + 20)


def test_one_crash_leaves_others_with_the_right_time_believed(store: TimestampStore) -> None:
    # A light that follows our time stamps refuses new streams a minute behind them.
    store.store(run(store, NOW).timestamp)
    assert next_run(store, NOW + 1) - stamp_at(NOW + 1) < NEW_STREAM_TICKS


def test_first_run_starts_from_the_clock(store: TimestampStore) -> None:
    assert store.load() == 0
    assert next_run(store, NOW) == stamp_at(NOW)


@pytest.mark.parametrize('content', [
    b'', b'nonsense', b'-5', b'\xff\xfe', b'9' * 5000, str(LAST_STAMP + 1).encode()])
def test_spoilt_file_counts_as_none(store: TimestampStore, content: bytes) -> None:
    store.store(1)
    store.path.write_bytes(content)
    assert store.load() == 0


def test_last_time_stamp_there_is_can_be_stored(store: TimestampStore) -> None:
    store.store(LAST_STAMP)
    assert store.load() == LAST_STAMP


def test_store_replaces_the_file_as_a_whole(store: TimestampStore) -> None:
    store.store(1, last=True)
    before = store.path.stat().st_ino
    store.store(2, last=True)
    assert store.path.stat().st_ino != before
    assert store.load() == 2
    assert os.listdir(store.path.parent) == [store.path.name]


def test_store_that_fails_leaves_the_old_time_stamp_and_nothing_else(
        store: TimestampStore, monkeypatch: pytest.MonkeyPatch) -> None:
    store.store(1, last=True)

    def fail(source: object, target: object) -> None:
        raise OSError(28, 'No space left on device')

    with monkeypatch.context() as patch:
        patch.setattr(os, 'replace', fail)
        with pytest.raises(OSError, match='No space'):
            store.store(2, last=True)
    assert store.load() == 1
    assert os.listdir(store.path.parent) == [store.path.name]


def test_each_key_and_each_component_has_its_own(tmp_path: Path) -> None:
    paths = {TimestampStore(key, name, tmp_path).path
             for key in ('a.key', 'b.key') for name in ('bridge 1/194', 'bridge 1/195')}
    assert len(paths) == 4


def test_same_key_file_by_another_way_is_the_same(tmp_path: Path) -> None:
    (tmp_path / 'link.key').symlink_to(tmp_path / 'a.key')
    one, other = (TimestampStore(str(tmp_path / name), 'x', tmp_path)
                  for name in ('a.key', 'link.key'))
    assert one.path == other.path


def test_lies_in_the_home_of_ros(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv('ROS_HOME', str(tmp_path / 'ros'))
    assert TimestampStore('a.key', 'x').path.parent == tmp_path / 'ros' / 'illuminator_ros'
    monkeypatch.delenv('ROS_HOME')
    monkeypatch.setenv('HOME', str(tmp_path))
    assert TimestampStore('a.key', 'x').path.parent == tmp_path / '.ros' / 'illuminator_ros'


def test_directory_is_made_for_the_owner_alone(store: TimestampStore) -> None:
    store.store(1)
    assert store.path.parent.stat().st_mode & 0o777 == 0o700


def test_key_is_in_neither_name_nor_content(tmp_path: Path) -> None:
    path = key_file(tmp_path, PASSPHRASE.encode())
    store = TimestampStore(path, 'x', tmp_path / 'state')
    store.store(1)
    kept = f'{store.path.name} {store.path.read_text()}'
    assert PASSPHRASE not in kept
    assert load_key(path).hex()[:8] not in kept


def test_ticks_of_the_margin_are_those_of_signing() -> None:
    assert stamp_at(NOW + 60) - stamp_at(NOW) == 60 * TICKS_PER_SECOND == NEW_STREAM_TICKS


def test_a_pipe_is_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / 'key'
    os.mkfifo(pipe, 0o600)
    with pytest.raises(KeyFileError, match='not a regular file'):
        load_key(str(pipe))
