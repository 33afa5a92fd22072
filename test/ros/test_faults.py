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

"""No fault of ours ends the node or leaves a caller without an answer (DESIGN.md, 3.4)."""

from collections.abc import Iterator
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.ros.publishers import LightPublishers
from illuminator_ros.ros.bridge import Bridge
from illuminator_ros.ros.diagnostics_publisher import DiagnosticsPublisher
from illuminator_ros.ros.node import PayloadNode
from illuminator_ros.ros.parameter_services import ParameterServices
import pytest
from rcl_interfaces.srv import ListParameters
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool, Trigger
from support.embedded import embedded_bridge
from support.light import eventually, ON_OFF, ServedLight
from support.ros import Parameters, Ros, STREAM

FAULT = RuntimeError('injected')


def fail(*arguments: Any, **named: Any) -> None:
    raise FAULT


@pytest.fixture
def bridge(own_ros: Ros, port: int) -> Iterator[Bridge]:
    """Return a bridge with a light that has reported its configuration."""
    with embedded_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        Parameters(own_ros).wait(mode='internal_control')
        bridge.test_light = light  # type: ignore[attr-defined]
        yield bridge


def works(ros: Ros) -> bool:
    """Return whether services, parameters and the link still do what they should."""
    enabled = ros.call(SetBool, '/illuminator/enable', SetBool.Request(data=True))
    [result] = Parameters(ros).set(brightness=55.0)
    return bool(enabled.success and result.successful)


@pytest.mark.parametrize(('owner', 'method', 'service', 'type_'), [
    (Light, 'enable', 'enable', SetBool),
    (Light, 'refresh', 'refresh', Trigger),
])
def test_a_service_says_that_it_failed(
    own_ros: Ros, bridge: Bridge, monkeypatch: pytest.MonkeyPatch, owner: type,
    method: str, service: str, type_: Any,
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(owner, method, fail)
        response = own_ros.call(type_, f'/illuminator/{service}', type_.Request())

    assert not response.success
    assert response.message == "internal error: RuntimeError('injected')"
    assert works(own_ros)


@pytest.mark.parametrize(('owner', 'method'), [
    (Light, 'configure'), (ParameterServices, '_check')])
@pytest.mark.parametrize('atomically', [False, True])
def test_a_set_says_that_it_failed(
    own_ros: Ros, bridge: Bridge, monkeypatch: pytest.MonkeyPatch, owner: type,
    method: str, atomically: bool,
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(owner, method, fail)
        response = Parameters(own_ros).start_set(atomically=atomically, brightness=9.0).result()

    [result] = [response.result] if atomically else response.results
    assert not result.successful
    assert result.reason == "internal error: RuntimeError('injected')"
    assert works(own_ros)


def test_other_parameter_services_answer(
    own_ros: Ros, bridge: Bridge, monkeypatch: pytest.MonkeyPatch,
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(PayloadNode, 'list_parameters', fail)
        response = Parameters(own_ros).start(ListParameters, 'list_parameters').result()

    assert response.result.names == []
    assert works(own_ros)


@pytest.mark.parametrize(('owner', 'method'), [
    (LightPublishers, 'take'), (DiagnosticsPublisher, 'poll'),
    (DiagnosticsPublisher, 'look'),
])
def test_what_goes_wrong_in_publishing_is_over_when_it_is_over(
    own_ros: Ros, bridge: Bridge, monkeypatch: pytest.MonkeyPatch, owner: type,
    method: str,
) -> None:
    calls = []

    def failing(*arguments: Any, **named: Any) -> None:
        calls.append(arguments)
        fail()

    with monkeypatch.context() as patch:
        patch.setattr(owner, method, failing)
        bridge.test_light.report(brightness=12.0, error_status=4)  # type: ignore[attr-defined]
        eventually(lambda: calls)
    bridge.test_light.report(error_status=0)  # type: ignore[attr-defined]

    assert works(own_ros)
    own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM).wait()


@pytest.mark.parametrize(('topic', 'type_', 'value', 'owner', 'method'), [
    ('enable', Bool, True, Light, 'enable'),
    ('brightness', Float32, 20.0, Light, 'set_brightness'),
])
def test_a_command_topic_goes_on(
    own_ros: Ros, bridge: Bridge, monkeypatch: pytest.MonkeyPatch, topic: str,
    type_: Any, value: object, owner: type, method: str,
) -> None:
    calls = []

    def failing(*arguments: Any, **named: Any) -> None:
        calls.append(arguments)
        fail()

    with monkeypatch.context() as patch:
        patch.setattr(owner, method, failing)
        own_ros.publish(type_, f'/illuminator/cmd/{topic}', value)
        eventually(lambda: calls)

    own_ros.publish(Bool, '/illuminator/cmd/enable', True)
    bridge.test_light.wait_for(ON_OFF)  # type: ignore[attr-defined]
    assert works(own_ros)
