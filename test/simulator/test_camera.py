# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The simulator with a camera: MAVLink 1 frames on a pseudo-terminal, and a file of images."""

from __future__ import annotations

import csv
import os
from pathlib import Path
import select
import signal

from illuminator_ros.cli.simulator.components import SettingError
from illuminator_ros.cli.simulator.csv_file import CsvFile
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.rededge.messages import DigicamControl, Ping
from illuminator_ros.rededge.simulated import COLUMNS
import pytest
from support.frames import frame_of
from support.processes import ended, python
from support.strict_mavlink_1 import strict_frames
from support.waiting import PATIENCE

HOST = Address(1, 191)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_camera_answers_in_mavlink_1_only_and_writes_each_image_at_once_re_1_re_2(
        tmp_path: Path, number: int) -> None:
    port, images = tmp_path / 'ttyREDEDGE', tmp_path / 'images.csv'
    with ended(python('illuminator_ros.simulator', '--payload', 'rededge', f'pty://{port}',
                      '--images', str(images))) as simulator:
        simulator.wait_for(f'serial://{port}')
        device = os.open(port, os.O_RDWR | os.O_NOCTTY)
        os.write(device, frame_of(Ping(0, 1, 0, 0), source=HOST, version=1))
        os.write(device, frame_of(DigicamControl(1, 100, 1, 1, 0, 0, 1, 0, 0, 0.0), source=HOST))
        data = b''
        while 180 not in (ids := [one.message_id for one in strict_frames(data)[0]]):
            assert select.select([device], [], [], PATIENCE)[0], ids
            data += os.read(device, 4096)
        os.close(device)
        with images.open(newline='') as file:
            [row] = csv.DictReader(file)
        assert simulator.end(number) == 0

    assert [one for one in ids if one] == [4, 179, 180]
    assert list(row) == list(COLUMNS)
    assert (row['camera'], row['trigger'], row['position_source']) == ('100', 'mavlink', 'own')
    assert not port.is_symlink()


def test_file_that_cannot_be_written_is_named_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=f'{tmp_path}/no/file: No such file or directory'):
        CsvFile(f'{tmp_path}/no/file', ['a'])


def test_full_disk_is_said_once_and_ends_the_records(
        tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / 'records'
    file = CsvFile(str(path), ['a', 'b'])
    file.append(['1', 'x,y'])
    assert path.read_text() == 'a,b\n1,"x,y"\n'
    path.unlink()
    path.symlink_to('/dev/full')
    for _ in range(3):
        file.append(['2', ''])
    assert [one.getMessage() for one in caplog.records] == [
        f'{path}: No space left on device: no more records are written']
