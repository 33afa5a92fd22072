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

"""What ament_pep257 asks for."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.linter
@pytest.mark.pep257
@pytest.mark.timeout(300)
def test_pep257(monkeypatch: pytest.MonkeyPatch) -> None:
    linter = pytest.importorskip('ament_pep257.main', reason='ament_pep257 is not installed')
    monkeypatch.chdir(ROOT)

    assert linter.main(argv=[]) == 0
