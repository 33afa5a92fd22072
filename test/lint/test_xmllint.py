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

"""What ament_xmllint asks for; without a copy of its schemas it loads them from the network."""

from pathlib import Path

import pytest
from support.linters import lint, ROOT


@pytest.mark.linter
@pytest.mark.xmllint
def test_xmllint() -> None:
    status, text = lint('xmllint', ROOT)

    assert status == 0, text


def test_a_manifest_that_is_against_the_schema_is_found(tmp_path: Path) -> None:
    manifest = (ROOT / 'package.xml').read_text()
    (tmp_path / 'package.xml').write_text(manifest.replace('exec_depend>', 'depends>'))

    status, text = lint('xmllint', tmp_path)

    assert (status, 'depends' in text) == (1, True), text
