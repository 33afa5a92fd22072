# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Files with the records of simulated devices, as CSV; each record is written at once."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
import csv
import logging

from .components import SettingError, Types
from ...simulation.simulated import SimulatedDevice

_log = logging.getLogger(__name__)


class CsvFile:
    """
    A file with records; an existing one is overwritten.

    :raises SettingError: if it cannot be written.
    """

    def __init__(self, path: str, columns: Sequence[str]) -> None:
        self._path = path
        self._failed = False
        try:
            self._write('w', columns)
        except OSError as error:
            raise SettingError(f'{path}: {error.strerror}') from error

    def append(self, record: Sequence[str]) -> None:
        """Append a record; a file that could not be written once gets no further records."""
        if self._failed:
            return
        try:
            self._write('a', record)
        except OSError as error:
            self._failed = True
            _log.error('%s: %s: no more records are written', self._path, error.strerror)

    def _write(self, mode: str, record: Sequence[str]) -> None:
        with open(self._path, mode, encoding='utf-8', newline='') as file:
            csv.writer(file, lineterminator='\n').writerow(record)


def write_records(
    options: argparse.Namespace, types: Types, devices: Iterable[SimulatedDevice],
) -> None:
    """
    Write the records of devices to the files that the options name.

    :raises SettingError: if a file cannot be written.
    """
    for one in types:
        if one.records and (path := getattr(options, one.records.option)):
            file = CsvFile(path, one.records.columns)
            for device in devices:
                if isinstance(device, one.device):
                    device.records.subscribe(file.append)
