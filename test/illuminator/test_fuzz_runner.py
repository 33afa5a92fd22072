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

"""The long fuzzer (``make fuzz``): what it finds it tells, with what is needed to see it again."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest
from support.siege import LightSiege


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the fuzzer's module, with rounds of a few inputs."""
    path = Path(__file__).parents[1] / 'fuzz' / 'run.py'
    spec = importlib.util.spec_from_file_location('fuzz_run', path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, 'ROUND', 20)
    return module


def call(run: Any, monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Run the fuzzer with these arguments."""
    monkeypatch.setattr(run.sys, 'argv', ['run.py', *arguments])
    return int(run.main())


def test_a_run_without_findings_is_a_success(
    run: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:
    assert call(run, monkeypatch, '--seconds', '0.2') == 0
    assert '0 findings' in capsys.readouterr().out


def test_the_same_round_sends_the_same_input(
    run: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:
    totals = []
    for _ in range(2):
        call(run, monkeypatch, '--only', '5/3')
        totals.append(capsys.readouterr().out.splitlines()[-1])
    assert totals[0] == totals[1]


def test_a_finding_is_a_failure_and_says_how_to_see_it_again(
    run: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:
    class Weak(LightSiege):

        def check_service(self) -> None:
            raise AssertionError('as the test says')

    monkeypatch.setattr(run, 'SIEGES', {'weak': Weak})
    assert call(run, monkeypatch, '--only', '5/3') == 1
    out = capsys.readouterr().out
    assert 'as the test says' in out
    assert 'again: python3 test/fuzz/run.py --only 5/3' in out
    assert 'last input from' in out
