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

"""The folder of ROS for the files of a user. No rclpy."""

from __future__ import annotations

import os
from pathlib import Path

from ..mavlink.signing_files import KeyFileError


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
