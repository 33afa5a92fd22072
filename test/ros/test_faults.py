# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""An exception in the bridge neither ends the node nor leaves a caller without an answer."""

from collections.abc import Iterator
import threading
from typing import Any
from unittest import mock

from diagnostic_msgs.msg import DiagnosticArray
from illuminator_ros.illuminator.client import IlluminatorClient
from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.ros.event_publisher import EventPublisher
from illuminator_ros.ros.bridge import Bridge
from illuminator_ros.ros.diagnostics_publisher import DiagnosticsPublisher
from illuminator_ros.ros.parameter_services import ParameterServices
from illuminator_ros.ros.payload_node import PayloadNode
import pytest
from rcl_interfaces.srv import ListParameters
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool, Trigger
from support.embedded import embedded_bridge
from support.light import ServedLight
from support.ports import free_port
from support.recording import Call
from support.ros import Parameters, Ros, STREAM
from support.slow import CLOCK
from support.waiting import eventually, PATIENCE


@pytest.fixture(scope='module')
def served(domain: int, ros: Ros) -> Iterator[tuple[Bridge, ServedLight]]:
    """Return a bridge in this process, and a light that has reported its configuration to it."""
    light = ServedLight(port := free_port())
    with embedded_bridge(domain, port, beam_range=5.0) as bridge, light:
        Parameters(ros).wait(mode='internal_control')
        yield bridge, light


@pytest.fixture
def light(served: tuple[Bridge, ServedLight]) -> ServedLight:
    return served[1]


def fault(owner: type, method: str) -> Any:
    """Make a method raise, and count how often."""
    return mock.patch.object(owner, method, side_effect=RuntimeError('injected'))


def assert_works(ros: Ros) -> None:
    """Check that services, parameters and the link still work."""
    assert ros.enable().success
    assert Parameters(ros).set(brightness=55.0)[0].successful


def test_the_light_goes_off_although_a_payload_fails_at_the_end(
    own_ros: Ros, port: int, capfd: pytest.CaptureFixture[str],
) -> None:
    with (ServedLight(port, enable=1) as light,
          embedded_bridge(own_ros.domain, port, off_on_shutdown=True) as bridge,
          fault(IlluminatorClient, 'close')):
        Parameters(own_ros).wait(brightness=100.0)

        bridge.end()

        eventually(lambda: not light.fake.fields['enable'])
    assert "internal error: RuntimeError('injected')" in capfd.readouterr().err


def test_a_link_that_hangs_delays_the_end_for_a_limited_time_and_is_named(
    own_ros: Ros, port: int, capfd: pytest.CaptureFixture[str],
) -> None:
    hanging, released = threading.Event(), threading.Event()

    def hang(now: float) -> None:
        hanging.set()
        released.wait(PATIENCE)

    with embedded_bridge(own_ros.domain, port) as bridge:
        bridge.link.call(hang)
        assert hanging.wait(PATIENCE)
        end = threading.Thread(target=bridge.end)
        end.start()
        # Its limits are 0.75 s together; the rest is for a busy machine.
        end.join(1.5)
        has_ended = not end.is_alive()
        released.set()
    assert has_ended
    assert 'the link does not answer: devices may still be on' in capfd.readouterr().err


def start_set(ros: Ros, atomically: bool) -> Call:
    return Parameters(ros).start_set(atomically=atomically, brightness=9.0)


@pytest.mark.parametrize(('owner', 'method', 'service'), [
    (Light, 'enable', 'enable'), (Light, 'refresh', 'refresh'),
    (Light, 'configure', 'set_parameters'),
    (Light, 'configure', 'set_parameters_atomically')])
def test_service_that_fails_inside_answers_with_the_exception(
    ros: Ros, light: ServedLight, owner: type, method: str, service: str,
) -> None:
    with fault(owner, method):
        if service.startswith('set'):
            response: Any = start_set(ros, service.endswith('atomically')).result()
            result = response.result if service.endswith('atomically') else response.results[0]
            success, text = result.successful, result.reason
        else:
            type_ = SetBool if service == 'enable' else Trigger
            response = ros.call(type_, f'/illuminator/{service}', type_.Request())
            success, text = response.success, response.message

    assert (success, text) == (False, "internal error: RuntimeError('injected')")
    assert_works(ros)


def test_parameter_service_that_fails_inside_answers_empty(ros: Ros, light: ServedLight) -> None:
    with fault(PayloadNode, 'list_parameters'):
        response = Parameters(ros).start(ListParameters, 'list_parameters').result()
    with fault(ParameterServices, '_check'):
        listed, atomic = (start_set(ros, atomically).result() for atomically in (False, True))

    assert (response.result.names, listed.results, atomic.result.successful) == ([], [], False)
    assert_works(ros)


@pytest.mark.parametrize(('owner', 'method'), [
    (EventPublisher, 'handle'), (DiagnosticsPublisher, 'poll'),
    (DiagnosticsPublisher, 'snapshot')])
def test_publishing_goes_on_after_it_has_failed(
    ros: Ros, light: ServedLight, owner: type, method: str,
) -> None:
    with fault(owner, method) as failing:
        light.report(brightness=12.0, error_status=4)
        CLOCK.forward(1.0)
        eventually(lambda: failing.called)
    light.report(error_status=0)

    assert_works(ros)
    recorder = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
    CLOCK.forward(1.0)
    recorder.wait()


@pytest.mark.parametrize(('topic', 'type_', 'value', 'method'), [
    ('enable', Bool, True, 'enable'), ('brightness', Float32, 20.0, 'set_brightness')])
def test_command_topic_goes_on_after_it_has_failed(
    ros: Ros, light: ServedLight, topic: str, type_: Any, value: object, method: str,
) -> None:
    light.report(enable=0)
    with fault(Light, method) as failing:
        ros.publish(type_, f'/illuminator/cmd/{topic}', value)
        eventually(lambda: failing.called)

    ros.publish(Bool, '/illuminator/cmd/enable', True)
    eventually(lambda: light.fake.fields['enable'])
    assert_works(ros)
