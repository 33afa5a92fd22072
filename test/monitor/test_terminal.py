# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The terminal of the monitor: errors of the middleware."""

import os

from illuminator_ros.cli.monitor.terminal import quiet_errors
import pytest


def test_errors_on_the_screen_are_written_afterwards(capfd: pytest.CaptureFixture[str]) -> None:
    with quiet_errors():
        os.write(2, b'error\n')
        assert capfd.readouterr().err == ''

    assert capfd.readouterr().err == 'error\n'
