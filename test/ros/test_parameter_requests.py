# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A request to the parameter services is few calls of the link; the executor does the rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any
from unittest.mock import Mock

from illuminator_ros.ros.deferred_service import DeferredService
from illuminator_ros.ros.parameter_services import MAX_NAMES, ParameterServices
from illuminator_ros.ros.parameters import (
    ChangeableParameters,
    declare_given,
    DeviceParameters,
    ParameterSpec,
    Values,
)
from illuminator_ros.ros.payload_node import PayloadNode
import pytest
from rcl_interfaces import srv
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from support.ros import Ros

OWN = (ParameterSpec('limit', 100.0, '', low=0.0, high=100.0, changeable=True),
       ParameterSpec('silence', 0.0, '', low=0.0, high=10.0, changeable=True))
OF_DEVICE = (ParameterSpec('brightness', 0.0, '', low=0.0, high=100.0),)


class Served:
    """
    A node with parameters of its own and of a device, without its executor's thread.

    :ivar calls: of the link, which wait.
    :ivar changes: of the node, as the link has got them.
    :ivar commands: to the device.
    """

    def __init__(self, ros: Ros) -> None:
        self.node = PayloadNode('served', context=ros.context)
        self.calls: list[Any] = []
        self.changes: list[Values] = []
        self.commands: list[Values] = []
        self.answers: list[Any] = []
        self.refusal = ''
        self.device = DeviceParameters(self.node, OF_DEVICE, Mock())
        # Any: a link that notes its calls.
        link: Any = Mock(call=self.calls.append)
        ParameterServices(
            self.node, link, Mock(), self.device, configure=self._configure,
            changeable=ChangeableParameters(
                self.node, OWN, declare_given(self.node, OWN), check=lambda values: None,
                change=lambda values, now: self.changes.append(values)))
        self.executor = SingleThreadedExecutor(context=ros.context)
        self.executor.add_node(self.node)

    def _configure(self, values: Values, now: float, answer: Any) -> None:
        self.commands.append(values)
        answer(self.refusal)

    def request(self, name: str, request: Any) -> None:
        """Take a request, as the executor does."""
        [service] = [one for one in self.node.services
                     if one.service_name == f'/served/{name}']
        assert isinstance(service.callback, DeferredService)
        service.callback.handle(request, self.answers.append)

    def set_parameters(self, *values: tuple[str, object], atomically: bool = False) -> None:
        """Request a set."""
        kind, name = ((srv.SetParametersAtomically, 'set_parameters_atomically') if atomically
                      else (srv.SetParameters, 'set_parameters'))
        self.request(name, kind.Request(parameters=[
            Parameter(one, value=value).to_parameter_msg() for one, value in values]))

    def run_link(self) -> int:
        """Make the calls of the link; return how many there were."""
        calls, self.calls[:] = self.calls[:], []
        for call in calls:
            call(0.0)
        return len(calls)

    def values(self, *names: str) -> Sequence[object]:
        """Return the values of parameters."""
        return [self.node.get_parameter_or(name).value for name in names]


@pytest.fixture
def served(ros: Ros) -> Iterator[Served]:
    """Yield a node with parameters."""
    made = Served(ros)
    yield made
    made.executor.remove_node(made.node)
    made.node.destroy_node()


def test_all_values_of_a_request_are_one_change_and_one_command(served: Served) -> None:
    repeated = [(name, float(number)) for number in range(MAX_NAMES // 4) for name in (
        'limit', 'brightness')]
    served.set_parameters(
        *repeated, ('limit', 60.0), ('silence', 5.0), ('brightness', 50.0))

    assert served.run_link() == 2
    assert served.changes == [{'limit': 60.0, 'silence': 5.0}]
    assert served.commands == [{'brightness': 50.0}]
    [answer] = served.answers
    assert [result.reason for result in answer.results] == [
        f'{name} has another value later in the request' for name, _ in repeated] + [''] * 3


def test_parameters_of_node_and_device_are_not_set_atomically_in_one_request(
    served: Served,
) -> None:
    served.set_parameters(('limit', 60.0), ('brightness', 50.0), atomically=True)

    [answer] = served.answers
    assert answer.result.reason == 'set brightness of the device in a request without others'
    assert (served.run_link(), served.values('limit')) == (0, [100.0])

    served.set_parameters(('limit', 60.0), ('silence', 5.0), atomically=True)
    served.set_parameters(('brightness', 50.0), atomically=True)
    served.run_link()
    assert served.changes == [{'limit': 60.0, 'silence': 5.0}]
    assert served.commands == [{'brightness': 50.0}]


@pytest.mark.parametrize('values', [
    [('limit', 101.0)], [('limits', 1.0)], [('limit', 1.0)] * (MAX_NAMES + 1)])
@pytest.mark.parametrize('atomically', [False, True])
def test_request_that_is_too_long_or_wrong_is_answered_without_the_link(
    served: Served, values: list[tuple[str, object]], atomically: bool,
) -> None:
    served.set_parameters(*values, atomically=atomically)

    assert served.run_link() == 0
    [answer] = served.answers
    result = answer.result if atomically else answer.results[0]
    assert not result.successful
    assert served.values('limit') == [100.0]


def test_parameters_of_the_device_are_set_by_the_executor_before_the_next_request(
    served: Served,
) -> None:
    served.device.show({'brightness': 40.0})
    served.device.show({'brightness': 70.0})
    assert served.values('brightness') == [None]

    served.executor.spin_once()

    assert served.values('brightness') == [70.0]


@pytest.mark.parametrize('names', [['limit'] * (MAX_NAMES + 1), ['limit', 'banana']],
                         ids=['too many', 'unknown'])
@pytest.mark.parametrize(('name', 'type_', 'field'), [
    ('get_parameters', srv.GetParameters, 'values'),
    ('get_parameter_types', srv.GetParameterTypes, 'types'),
    ('describe_parameters', srv.DescribeParameters, 'descriptors')])
def test_list_of_names_that_is_long_or_has_an_unknown_one_is_answered_with_an_empty_one(
    served: Served, names: list[str], name: str, type_: Any, field: str,
) -> None:
    served.request(name, type_.Request(names=names))

    assert list(getattr(served.answers[0], field)) == []
