# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0


"""A client on Cyclone DDS, another middleware: topics, services and parameters of the bridge."""

# The annotations of its sequences are callables.
# mypy: disable-error-code="type-arg, assignment, arg-type"
# Without the future import of annotations: cyclonedds evaluates the fields of its types.
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from support.light import ServedLight
from support.ros import Ros, running_bridge
from support.waiting import eventually

pytest.importorskip('cyclonedds', reason='cyclonedds is not installed')

from cyclonedds.core import Policy, Qos  # noqa: E402, I100
from cyclonedds.domain import Domain, DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct, types  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402

# Loopback without multicast, as ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST; doc/ros.md has it.
CONFIGURATION = """
<CycloneDDS><Domain>
  <General>
    <Interfaces><NetworkInterface name="lo"/></Interfaces><AllowMulticast>false</AllowMulticast>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex>
    <MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>
    <Peers><Peer address="localhost"/></Peers>
  </Discovery>
</Domain></CycloneDDS>"""
RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))
# Tries of a request, 2 s apart.
REQUESTS = 10
STATE = Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
STREAM = Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(10))


@dataclass
class Bool(IdlStruct, typename='std_msgs::msg::dds_::Bool_'):
    data: bool


@dataclass
class Float32(IdlStruct, typename='std_msgs::msg::dds_::Float32_'):
    data: types.float32


@dataclass
class SetBoolRequest(IdlStruct, typename='std_srvs::srv::dds_::SetBool_Request_'):
    data: bool


@dataclass
class SetBoolResponse(IdlStruct, typename='std_srvs::srv::dds_::SetBool_Response_'):
    success: bool
    message: str


@dataclass
class Value(IdlStruct, typename='rcl_interfaces::msg::dds_::ParameterValue_'):
    type: types.uint8 = 3  # noqa: A003
    bool_value: bool = False
    integer_value: types.int64 = 0
    double_value: types.float64 = 0.0
    string_value: str = ''
    byte_array_value: types.sequence[types.uint8] = field(default_factory=list)
    bool_array_value: types.sequence[bool] = field(default_factory=list)
    integer_array_value: types.sequence[types.int64] = field(default_factory=list)
    double_array_value: types.sequence[types.float64] = field(default_factory=list)
    string_array_value: types.sequence[str] = field(default_factory=list)


@dataclass
class Parameter(IdlStruct, typename='rcl_interfaces::msg::dds_::Parameter_'):
    name: str
    value: Value


@dataclass
class SetRequest(IdlStruct, typename='rcl_interfaces::srv::dds_::SetParameters_Request_'):
    parameters: types.sequence[Parameter]


@dataclass
class Outcome(IdlStruct, typename='rcl_interfaces::msg::dds_::SetParametersResult_'):
    successful: bool
    reason: str


@dataclass
class SetResponse(IdlStruct, typename='rcl_interfaces::srv::dds_::SetParameters_Response_'):
    results: types.sequence[Outcome]


class Client:
    """A participant of a ROS domain."""

    def __init__(self, domain: int) -> None:
        # The domain must exist as long as its participant.
        self._domain = Domain(domain, CONFIGURATION)
        self._participant = DomainParticipant(domain)

    def reader(self, name: str, type_: type[Any], qos: Qos = STATE) -> Any:
        return DataReader(self._participant, Topic(self._participant, name, type_), qos=qos)

    def writer(self, name: str, type_: type[Any]) -> Any:
        """Return a writer that has found its reader."""
        writer = DataWriter(
            self._participant, Topic(self._participant, name, type_), qos=STREAM)
        eventually(lambda: writer.get_matched_subscriptions())
        return writer

    def call(self, service: str, request: Any, response: type[Any]) -> Any:
        """Return the answer of a service."""
        answers = self.reader(f'rr{service}Reply', response, STREAM)
        requests = self.writer(f'rq{service}Request', type(request))
        eventually(lambda: answers.get_matched_publications())
        # The first answers may get lost: the bridge may discover the request's writer before the
        # answer's reader.
        for _ in range(REQUESTS):
            requests.write(request)
            for answer in answers.take_iter(timeout=duration(seconds=2)):
                return answer
        raise AssertionError(f'no answer of {service}')


@pytest.fixture
def client(own_ros: Ros) -> Iterator[Client]:
    yield Client(own_ros.domain)


def test_topics_services_and_parameters_work_for_a_client_on_cyclone_dds(
    own_ros: Ros, port: int, client: Client,
) -> None:
    with running_bridge(own_ros.domain, port), ServedLight(port, brightness=80.0) as light:
        connected = client.reader('rt/illuminator/connected', Bool)
        brightness = client.reader('rt/illuminator/brightness', Float32)
        # Latched values reach a reader that comes later.
        assert eventually(lambda: connected.take(1)) == [Bool(True)]
        assert eventually(lambda: brightness.take(1)) == [Float32(80.0)]

        switched = client.call('/illuminator/enable', SetBoolRequest(True), SetBoolResponse)
        assert switched.success, switched.message
        assert light.fake.fields['enable'] == 1

        response = client.call('/illuminator/set_parameters', SetRequest([
            Parameter('brightness', Value(double_value=30.0)),
            Parameter('brightness_', Value())]), SetResponse)
        assert [one.successful for one in response.results] == [True, False]
        assert light.fake.fields['brightness'] == 30.0

        # Last, since a late repeat of the setpoint would change what another request has set.
        setpoints = client.writer('rt/illuminator/cmd/brightness', Float32)

        def dimmed() -> bool:
            # The first message of a new writer may be lost.
            setpoints.write(Float32(42.0))
            return bool(light.fake.fields['brightness'] == 42.0)

        eventually(dimmed)
        eventually(lambda: Float32(42.0) in brightness.take(1))
