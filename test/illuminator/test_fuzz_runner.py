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

from collections.abc import Callable
import importlib.util
from pathlib import Path
from typing import Any

import pytest
from support.siege import LightSiege

Call = Callable[..., tuple[int, str]]


@pytest.fixture
def fuzz(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the fuzzer's module, with rounds of a few inputs."""
    path = Path(__file__).parents[1] / 'fuzz' / 'run.py'
    spec = importlib.util.spec_from_file_location('fuzz_run', path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, 'ROUND', 20)
    return module


@pytest.fixture
def call(
    fuzz: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> Call:
    """Return a function that runs the fuzzer, and returns its exit status and output."""
    def call(*arguments: str) -> tuple[int, str]:
        monkeypatch.setattr(fuzz.sys, 'argv', ['run.py', *arguments])
        return int(fuzz.main()), capsys.readouterr().out
    return call


def test_a_run_without_findings_is_a_success(call: Call) -> None:
    status, out = call('--seconds', '0.2')
    assert status == 0
    assert '0 findings' in out


def test_the_same_round_sends_the_same_input(call: Call) -> None:
    assert len({call('--only', '5/3')[1].splitlines()[-1] for _ in range(2)}) == 1


def test_a_finding_is_a_failure_with_the_command_that_repeats_it(
    call: Call, fuzz: Any, monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Weak(LightSiege):

        def check_service(self) -> None:
            raise AssertionError('as the test says')

    monkeypatch.setattr(fuzz, 'SIEGES', {'weak': Weak})
    status, out = call('--only', '5/3')
    assert status == 1
    for text in ('as the test says', 'again: python3 test/fuzz/run.py --only 5/3',
                 'last input from'):
        assert text in out
