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

"""The modules that the process of a bridge imports late or not at all."""

from __future__ import annotations

import importlib
from pathlib import Path
import sys
from types import ModuleType

from illuminator_ros.cli import postponed_imports as tested
from illuminator_ros.mavlink.link import Link
import pytest
from support.light import ServedLight
from support.processes import ended, Program, start_interpreter
from support.ros import bridge_arguments, Parameters, Ros
from support.waiting import eventually

# Their libraries, and a library of the parser of the message generator.
UNUSED = ('/numpy/', '/_hashlib.', '/_lzma.')
SIGNING = """
import sys
from illuminator_ros.cli.postponed_imports import postponed_imports

with postponed_imports():
    from illuminator_ros.mavlink.signing import Signing, SigningMode
for arguments in (), (SigningMode.SIGN, bytes(32)):
    Signing(*arguments)
    print(sorted({'hashlib', 'hmac'} & set(sys.modules)))
"""


@pytest.fixture
def value(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a module ``value`` that is postponed, and one ``generator`` that is left out."""
    for name in ('value', 'generator'):
        (tmp_path / f'{name}.py').write_text('one = object()\n')
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(tested, 'POSTPONED', ('value',))
    monkeypatch.setattr(tested, 'LEFT_OUT', ('generator',))
    return tmp_path


def test_postponed_module_is_imported_when_it_is_used(value: Path) -> None:
    with tested.postponed_imports():
        early, again = importlib.import_module('value'), importlib.import_module('value')
        with pytest.raises(ImportError):
            importlib.import_module('generator')
    assert {'value', 'generator'} & set(sys.modules) == set()

    used = early.one

    assert used is again.one is importlib.import_module('value').one
    assert importlib.import_module('generator').one
    with pytest.raises(AttributeError):
        early.two  # noqa: B018 - reading it is the test.


def test_module_that_is_used_at_once_or_was_imported_before_is_the_real_one(value: Path) -> None:
    with tested.postponed_imports():
        used = importlib.import_module('value').one
    real = importlib.import_module('value')
    with tested.postponed_imports():
        assert importlib.import_module('value') is real

    assert type(real) is ModuleType and real.one is used


def test_modules_of_signing_are_imported_with_the_key_and_not_for_the_first_frame() -> None:
    program = Program(sys.executable, '-c', SIGNING)

    assert program.wait() == 0
    assert program.lines == ['[]\n', "['hashlib', 'hmac']\n"]


def test_bridge_that_serves_a_light_loads_no_library_that_it_does_not_use(
    own_ros: Ros, port: int,
) -> None:
    with (ended(start_interpreter('illuminator_ros.bridge', *bridge_arguments(port),
                                  env={'ROS_DOMAIN_ID': str(own_ros.domain)})) as bridge,
          ServedLight(port, enable=1, link=Link)):
        parameters = Parameters(own_ros)
        parameters.wait(brightness=100.0)
        # Retry: the clock of the machine may pause for longer than a confirmation takes.
        eventually(lambda: parameters.set(brightness=50.0)[0].successful)
        loaded = Path(f'/proc/{bridge.pid}/maps').read_text()

    assert 'sensor_msgs' in loaded
    assert [name for name in UNUSED if name in loaded] == []
