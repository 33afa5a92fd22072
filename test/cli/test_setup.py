# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``discover --setup``: questions, files, and the light that is tried."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import shutil
import signal
import subprocess
from typing import Any

from illuminator_ros.cli.discover.setup import set_up, try_light
from illuminator_ros.cli.entry_point import Refusal
from illuminator_ros.mavlink.messages import Address
import pytest
from support.live_link import Lights
from support.ports import free_port
from support.terminals import Terminal
from support.waiting import eventually

ANSWERS = {'device': '1', 'name': 'bow', 'max_brightness': '40', 'off_on_shutdown': 'yes',
           'off_after_silence': '60', 'try': 'no', 'boot': 'no', 'overwrite': 'no'}
FILE = """\
bow:
  ros__parameters:
    connection_url: URL
    target_system: 1
    target_component: 243
    max_brightness: 40.0
    off_on_shutdown: true
    off_after_silence: 60.0
"""


@pytest.fixture(autouse=True)
def _keep_signals() -> Any:
    before = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield
    for one, handler in before.items():
        signal.signal(one, handler)


def heard(kind: str = 'light', url: str = 'serial:///dev/x:57600') -> list[Mapping[str, Any]]:
    return [{'url': url, 'components': [
        {'address': '1/1', 'kinds': ['autopilot'], 'served': False, 'signed': False},
        {'address': '1/243', 'kinds': [kind], 'served': True, 'signed': False}]}]


def answers(folder: Path, **others: str) -> list[str]:
    return [f'{key}={value}' for key, value in {
        **ANSWERS, 'folder': str(folder), **others}.items()]


def test_the_file_has_the_answers_and_the_command_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    assert set_up(heard(), answers(tmp_path)) == 0

    assert (tmp_path / 'bow.yaml').read_text() == FILE.replace('URL', 'serial:///dev/x:57600')
    assert [*tmp_path.iterdir()] == [tmp_path / 'bow.yaml']
    assert capsys.readouterr().out.endswith(
        f'--ros-args -r __node:=bow --params-file {tmp_path}/bow.yaml\n')


@pytest.mark.parametrize('kind', ['gimbal manager', 'gimbal'])
def test_a_gimbal_has_a_file_with_its_url_only_and_the_node_for_a_managed_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str,
) -> None:
    # An autopilot is on this port.
    assert set_up(heard(kind), answers(tmp_path, name='mount')) == 0
    assert 'gimbal --ros-args' in capsys.readouterr().out

    assert (tmp_path / 'mount.yaml').read_text() == (
        'mount:\n  ros__parameters:\n    connection_url: serial:///dev/x:57600\n')


def test_an_existing_file_is_overwritten_only_after_a_yes(tmp_path: Path) -> None:
    (tmp_path / 'bow.yaml').write_text('old')

    assert set_up(heard(), answers(tmp_path)) == 1
    assert (tmp_path / 'bow.yaml').read_text() == 'old'
    assert set_up(heard(), answers(tmp_path, overwrite='yes')) == 0
    assert (tmp_path / 'bow.yaml').read_text() != 'old'


@pytest.mark.skipif(not shutil.which('systemd-analyze'), reason='systemd is not installed')
def test_the_unit_is_verified_by_systemd(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    assert set_up(heard(), answers(tmp_path, boot='yes')) == 0

    unit = tmp_path / 'illuminator-bow.service'
    verified = subprocess.run(
        ['systemd-analyze', 'verify', unit], text=True, capture_output=True, timeout=60)
    assert (verified.returncode, verified.stderr) == (0, '')
    assert 'Environment="ROS_DOMAIN_ID=7"\n' in unit.read_text()


@pytest.mark.parametrize(('given', 'reason'), [
    ({'name': '1/2'}, "--answer name: '1/2' is not a name"),
    ({'max_brightness': '140'}, '--answer max_brightness: 140 is outside 0 to 100'),
    ({'try': 'perhaps'}, "--answer try: 'perhaps' is not yes or no"),
    ({'colour': 'red'}, "--answer 'colour' is not one of boot, device, folder,")])
def test_a_wrong_answer_is_refused_with_its_key(
    tmp_path: Path, given: dict[str, str], reason: str,
) -> None:
    with pytest.raises(Refusal, match=reason):
        set_up(heard(), answers(tmp_path, **given))
    assert [*tmp_path.iterdir()] == []


def test_the_light_is_on_at_5_percent_for_a_moment_and_then_off() -> None:
    url = f'127.0.0.1:{free_port()}'
    with Lights(f'udpout://{url}') as lights:
        light = lights.endpoint.components[0].device
        outcome = try_light(f'udpin://{url}', Address(1, 243))

        assert outcome.startswith('on, confirmed by ILLUMINATOR_STATUS')
        assert outcome.endswith('; off again')
        assert (light.enabled, light.configuration.brightness) == (False, 5.0)


def test_ctrl_c_while_the_light_is_on_switches_it_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    url = f'127.0.0.1:{free_port()}'
    with Lights(f'udpout://{url}') as lights:
        light = lights.endpoint.components[0].device
        terminal = Terminal('support.quiet_discover', '--setup', '--seconds', '2',
                            f'udpin://{url}', *(text for one in answers(tmp_path, **{
                                'try': 'yes'}) for text in ('--answer', one)))
        eventually(lambda: light.enabled)
        terminal.type('\x03')

        terminal.wait()
        assert not light.enabled
