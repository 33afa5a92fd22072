# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The folder of ROS for the files of a user. No rclpy."""

from __future__ import annotations

import os
from pathlib import Path

from ..mavlink.errors import KeyFileError


def state_folder() -> Path:
    """
    Return the folder of the files that the package keeps between runs.

    :raises KeyFileError: if there is no home directory.
    """
    try:
        home = Path(os.environ.get('ROS_HOME') or Path.home() / '.ros')
    except RuntimeError:
        raise KeyFileError('signing keeps its time stamps in the home directory, and there is '
                           'none: set HOME or ROS_HOME') from None
    return home / 'illuminator_ros'
