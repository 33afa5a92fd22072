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

"""The linters of ROS that are programs of the system, from ROS or from Debian."""

from pathlib import Path
import shutil
import subprocess

import pytest

ROOT = Path(__file__).parents[2]


def lint(name: str, folder: Path) -> tuple[int, str]:
    """Return exit status and output of a linter; skip the test if it is not installed."""
    program = shutil.which(f'ament_{name}')
    if program is None:
        pytest.skip(f'ament_{name} is not installed')
    outcome = subprocess.run([program], cwd=folder, text=True, timeout=100,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return outcome.returncode, outcome.stdout
