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

"""What the log says while lights are found, lost and too hot."""

from collections.abc import Callable, Iterator
from typing import Any

from illuminator_ros.mavlink.messages import (
    Address,
    ComponentInformationBasic,
    heartbeat,
    MavType,
)
from illuminator_ros.ros.node import PATIENCE
from illuminator_ros.ros.process import BridgeProcess
import pytest
from support.embedded import resting_bridge
from support.fake_light import LIGHT, status_message

NOW = 1000.0
OTHER = Address(1, 244)
FLOOD = 2000


def another_identity(step: int) -> Any:
    return ComponentInformationBasic(0, 0, 0, b'maker', b'', b'', b'', b'%d' % step)


def another_life(step: int) -> Any:
    return status_message(1_000_000 * (step % 2), enable=step % 2)


def another_light_now_and_then(step: int) -> Any:
    odd = step // 20 % 2 and step % 2
    return status_message(100_000 + 100 * step, brightness=80.0 if odd else 50.0)


@pytest.fixture
def parameters() -> dict[str, Any]:
    return {}


@pytest.fixture
def process(domain: int, parameters: dict[str, Any]) -> Iterator[BridgeProcess]:
    """Return a bridge to which a test gives what it hears, and that makes no further nodes."""
    with resting_bridge(domain, lambda: NOW, **parameters) as process:
        process._ended.set()
        yield process


def hear(process: BridgeProcess, *sources: Address) -> None:
    for source in sources:
        process.component.receive(source, heartbeat(MavType.ILLUMINATOR), NOW)


def test_a_light_that_stays_away_is_missed_once(
    domain: int, capfd: pytest.CaptureFixture[str],
) -> None:
    now = [NOW]
    with resting_bridge(domain, lambda: now[0]) as process:
        process.node.poll(0.0)
        assert 'no light' not in ''.join(capfd.readouterr())

        for _ in range(10):
            now[0] += PATIENCE
            process.node.poll(0.0)

    [line] = [line for line in ''.join(capfd.readouterr()).splitlines() if 'no light' in line]
    assert line.startswith('[WARN]')
    assert line.endswith('no light connected: memory://rest is not open: not opened yet')


@pytest.mark.parametrize(('flags', 'severity', 'text'), [
    (1, 'WARN', 'thermal throttling: dimmed because it is hot'),
    (2, 'ERROR', 'over temperature shutdown: switched off because it is too hot'),
    (8, 'WARN', 'unknown flags 0x8'),
])
def test_error_flags_are_logged_until_they_are_cleared(
    process: BridgeProcess, capfd: pytest.CaptureFixture[str], flags: int, severity: str,
    text: str,
) -> None:
    process.component.receive(LIGHT, status_message(100_000, error_status=flags), NOW)
    process.component.receive(LIGHT, status_message(100_010, error_status=flags), NOW + 0.01)
    process.component.receive(LIGHT, status_message(110_000), NOW + 10.0)

    first, last = [line for line in ''.join(capfd.readouterr()).splitlines()
                   if '1/243: ' in line]
    assert first.startswith(f'[{severity}]')
    assert first.endswith(f'light 1/243: {text}')
    assert last.startswith('[INFO]')
    assert last.endswith(f'light 1/243: {text.partition(":")[0]} cleared')


def test_a_second_light_and_no_target_are_told_once(
    process: BridgeProcess, capfd: pytest.CaptureFixture[str],
) -> None:
    hear(process, LIGHT)
    assert 'besides' not in ''.join(capfd.readouterr())

    hear(process, OTHER, Address(1, 245))

    [line] = [line for line in ''.join(capfd.readouterr()).splitlines() if 'besides' in line]
    assert line.endswith(
        'light 1/244 is there besides 1/243, which /illuminator serves since it was heard first; '
        'target_system and target_component choose')


@pytest.mark.parametrize('parameters', [{'target_component': 243}])
def test_where_the_target_chooses_nothing_is_told(
    process: BridgeProcess, capfd: pytest.CaptureFixture[str],
) -> None:
    hear(process, OTHER, LIGHT)
    assert 'besides' not in ''.join(capfd.readouterr())


def test_requests_to_a_lost_light_tell_why_the_link_is_not_open(process: BridgeProcess) -> None:
    hear(process, LIGHT)
    light = process.client.lights[LIGHT]
    process.component.link_closed(NOW, 'no such file')
    assert light.unreachable(NOW) == (
        'light 1/243 is lost: the link is not open: no such file')


@pytest.mark.parametrize(('message', 'text'), [
    (another_identity, 'light 1/243 is maker'),
    (another_life, 'was on before it restarted'),
    (another_light_now_and_then, 'several lights answer as 1/243'),
])
def test_a_flood_of_frames_is_no_flood_of_lines(
    process: BridgeProcess, capfd: pytest.CaptureFixture[str], message: Callable[[int], Any],
    text: str,
) -> None:
    hear(process, LIGHT)

    for step in range(FLOOD):
        process.component.receive(LIGHT, message(step), NOW + 0.1 * step)

    # One a second at most, and this takes less than one.
    assert 1 <= ''.join(capfd.readouterr()).count(text) < 20


def test_each_new_identity_is_told(
    process: BridgeProcess, capfd: pytest.CaptureFixture[str],
) -> None:
    hear(process, LIGHT)

    for step in range(2):
        process.component.receive(LIGHT, another_identity(step), NOW)

    assert ''.join(capfd.readouterr()).count('light 1/243 is maker') == 2
