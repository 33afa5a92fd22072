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

"""What ament_copyright asks for."""

from pathlib import Path

import pytest
from support.linters import lint, ROOT


@pytest.mark.copyright
@pytest.mark.linter
def test_copyright() -> None:
    status, text = lint('copyright', ROOT)

    assert status == 0, text


def test_a_file_without_a_header_is_found(tmp_path: Path) -> None:
    (tmp_path / 'planted.py').write_text('import os\n')

    status, text = lint('copyright', tmp_path)

    assert (status, 'planted.py: could not find copyright notice' in text) == (1, True), text
