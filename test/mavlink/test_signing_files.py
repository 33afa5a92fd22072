# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Key files, and the time stamp that is stored between runs."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
import subprocess
import sys

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink.errors import KeyFileError
from illuminator_ros.mavlink.signing import NEW_STREAM_TICKS, SigningMode
from illuminator_ros.mavlink.signing_files import (
    load_key,
    load_signing,
    MAX_KEY_FILE,
    TimestampStore,
)
from illuminator_ros.ros.ros_home import state_folder
import pytest
from support.frames import frame_of, only
from support.signers import checker, LAST_STAMP, NOW, SECOND, signed, STAMP

RAW = bytes(range(100, 132))
HEX = RAW.hex().encode()
PASSPHRASE = b'correct horse battery staple'


def key_file(directory: Path, content: bytes, mode: int = 0o600) -> str:
    """Write a key file."""
    path = directory / 'signing.key'
    path.write_bytes(content)
    path.chmod(mode)
    return str(path)


@pytest.mark.parametrize(('content', 'key'), [
    (RAW, RAW), (bytes(32), bytes(32)), (RAW[:31] + b'\n', RAW[:31] + b'\n'),
    *((digits + end, RAW) for digits in (HEX, HEX.upper())
      for end in (b'', b'\n', b'\r\n', b' ', b' \r\n', b'\t')),
    # A passphrase, as MAVProxy and Mission Planner have it: its SHA-256.
    *((text + end, hashlib.sha256(text).digest()) for end in (b'', b'\n') for text in (
        PASSPHRASE, b'12345678', b'x' * 31, b'x' * 32, 'ä'.encode() * 16, b'g' + HEX[1:])),
    (b'x' * MAX_KEY_FILE, hashlib.sha256(b'x' * MAX_KEY_FILE).digest())])
def test_key_file_holds_raw_bytes_digits_or_a_passphrase(
        tmp_path: Path, content: bytes, key: bytes) -> None:
    for mode in (0o600, 0o400, 0o700):
        assert load_key(key_file(tmp_path, content, mode)) == key
        (tmp_path / 'signing.key').unlink()


@pytest.mark.parametrize(('content', 'mode', 'reason'), [
    *((content, 0o600, f'holds {len(content)} bytes') for content in (
        b'', b'\n', b'1234567', b'1234567\n', RAW[:31], RAW + b'\0', RAW * 2,
        b'two lines\nof text', PASSPHRASE.decode().encode('utf-16'))),
    *((RAW, mode, f'{mode:04o}.*chmod 600') for mode in (
        0o640, 0o604, 0o660, 0o644, 0o610, 0o602, 0o777)),
    *((b'x' * size, 0o600, f'longer than {MAX_KEY_FILE} bytes') for size in (
        MAX_KEY_FILE + 1, 3_000_000))])
def test_unusable_or_open_key_file_is_refused_with_path_and_reason(
        tmp_path: Path, content: bytes, mode: int, reason: str) -> None:
    path = key_file(tmp_path, content, mode)
    with pytest.raises(KeyFileError, match=reason) as caught:
        load_key(path)
    assert path in str(caught.value)


def test_path_without_regular_file_is_refused_with_the_reason(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / 'pipe', 0o600)
    for path, reason in ((tmp_path / 'none', 'No such file'), (tmp_path, 'Is a directory'),
                         (tmp_path / 'pipe', 'not a regular file'), ('', 'no key file is given'),
                         ('key\0file', 'null (byte|character)')):
        with pytest.raises(KeyFileError, match=reason) as caught:
            load_key(str(path))
        assert repr(str(path)) in str(caught.value) or not path


@given(st.binary(max_size=80) | st.text(max_size=80).map(str.encode)
       | st.binary(min_size=32, max_size=32))
@settings(max_examples=20)
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


# The time stamp that is stored between runs

@pytest.fixture
def store(tmp_path: Path) -> TimestampStore:
    return TimestampStore('signing.key', 'bridge 1/193', tmp_path / 'state')


def run(store: TimestampStore, unix_time: float) -> int:
    """Return the first time stamp of a run, whose clock may be wrong."""
    signing = checker(timestamp=store.begin(unix_time))
    signing.sign(frame_of(signed=True), unix_time)
    return signing.timestamp


@pytest.mark.parametrize(('clock', 'last', 'least', 'most'), [
    # After an orderly end: just after the last stamp, or by the clock.
    (-NOW, True, 1, 2), (1.0, True, SECOND, SECOND + 1),
    (3600.0, True, 3600 * SECOND, 3600 * SECOND + 1),
    # After a crash: beyond every stamp that was used, and within the minute that peers accept.
    (-NOW, False, 44 * SECOND, NEW_STREAM_TICKS), (1.0, False, 44 * SECOND, NEW_STREAM_TICKS)])
def test_next_run_repeats_no_time_stamp_and_stays_near_the_clock(
        store: TimestampStore, clock: float, last: bool, least: int, most: int) -> None:
    store.store(run(store, NOW), NOW, last=last)
    assert least <= run(store, NOW + clock) - STAMP <= most


def test_clock_that_was_ahead_for_a_moment_locks_no_light_out(store: TimestampStore) -> None:
    store.store(run(store, NOW + 7200), NOW + 7200)
    assert checker(timestamp=store.load()).accepts(signed(STAMP), NOW)


SIGN_UNTIL_KILLED = """
from pathlib import Path
import sys
from illuminator_ros.mavlink.signing import SigningMode
from illuminator_ros.mavlink.signing_files import load_signing
now = float(sys.argv[2])
signing, store = load_signing(SigningMode.SIGN, sys.argv[1], 'bridge', now,
                              lambda: Path(sys.argv[3]))
store.store(signing.timestamp, now)
while True:
    signing.sign(b'', now)
    sys.stdout.buffer.write(signing.timestamp.to_bytes(8, 'big'))
"""


def test_kill_9_again_and_again_repeats_no_time_stamp_and_locks_no_light_out(
        tmp_path: Path) -> None:
    key, newest = key_file(tmp_path, PASSPHRASE), 0
    for _ in range(3):
        with subprocess.Popen(
                [sys.executable, '-c', SIGN_UNTIL_KILLED, key, str(NOW), str(tmp_path)],
                stdout=subprocess.PIPE) as program:
            assert program.stdout is not None
            data = program.stdout.read(80_000)
            program.kill()
            data += program.stdout.read()
        used = [int.from_bytes(data[at:at + 8], 'big') for at in range(0, len(data) - 7, 8)]
        assert newest < used[0] < used[-1]
        newest = used[-1]
    ours, light = (load_signing(SigningMode.REQUIRE, key, name, NOW, lambda: tmp_path)[0]
                   for name in ('bridge', 'light'))
    for sender, receiver in ((ours, light), (light, ours)):
        frame = only(sender.sign(frame_of(signed=True), NOW))
        assert receiver.accepts(frame, NOW)


def test_failed_write_is_logged_once_tried_again_and_leaves_the_old_time_stamp(
        store: TimestampStore, caplog: pytest.LogCaptureFixture,
        monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(source: object, target: object) -> None:
        raise OSError(28, 'No space left on device')

    store.store(1, 0.0, last=True)
    with monkeypatch.context() as patch:
        patch.setattr(os, 'replace', fail)
        store.store(5, NOW)
        store.store(5, NOW)
    assert [record.getMessage() for record in caplog.records] == [
        'cannot store the signing time stamp, trying again: a restart may repeat some: '
        '[Errno 28] No space left on device']
    assert (store.load(), os.listdir(store.path.parent)) == (1, [store.path.name])
    store.store(5, NOW)
    assert store.load() > STAMP


@pytest.mark.parametrize('content', [
    b'', b'nonsense', b'-5', b'\xff\xfe', b'9' * 5000, str(LAST_STAMP + 1).encode()])
def test_state_file_without_time_stamp_counts_as_none(
        store: TimestampStore, content: bytes) -> None:
    store.store(LAST_STAMP, 0.0)
    assert store.load() == LAST_STAMP
    store.path.write_bytes(content)
    assert store.load() == 0
    store.path.unlink()
    assert store.load() == 0
    os.mkfifo(store.path)
    assert store.load() == 0


def test_each_key_file_and_component_has_one_state_file_in_the_ros_home(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('HOME', str(tmp_path))
    monkeypatch.delenv('ROS_HOME', raising=False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'link').symlink_to(tmp_path / 'key')
    names = ('key', './key', '~/key', str(tmp_path / 'key'), 'link')
    (one,) = {TimestampStore(name, 'bridge 1/193', state_folder()).path for name in names}
    assert one.parent == tmp_path / '.ros' / 'illuminator_ros'
    monkeypatch.setenv('ROS_HOME', str(tmp_path / 'ros'))
    assert state_folder() == tmp_path / 'ros' / 'illuminator_ros'
    assert len({TimestampStore(key, name, tmp_path).path for key in ('key', 'other')
                for name in ('bridge 1/193', 'bridge 1/195')}) == 4


def test_missing_home_directory_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home() -> Path:
        raise RuntimeError('Could not determine home directory.')

    monkeypatch.delenv('ROS_HOME', raising=False)
    monkeypatch.setattr(Path, 'home', no_home)
    with pytest.raises(KeyFileError, match='set HOME or ROS_HOME'):
        state_folder()
