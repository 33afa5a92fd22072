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

"""
The devices in the ROS graph, their values, and the requests to them.

Everything happens in :meth:`Graph.poll` and :meth:`Graph.poll_answers`, which never wait: the
newest message of each topic is taken when it is shown. An executor would run a callback for each
message, 9,000 a second of 100 lights.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import contextlib
import math
import time
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from ...ros import monitor_view as shared
from ...ros.graph import type_name
from ...ros.monitor_view import Device, Request, View
from ...ros.qos import STATE_QOS

T = TypeVar('T')
# Every node can publish topics like those of a device, and more diagnostics than it has.
MAX_DEVICES, MAX_DIAGNOSES = 256, 10
# Messages of /diagnostics that one poll takes, values of a diagnosis, bytes of any message.
MAX_DIAGNOSTICS, MAX_VALUES, MAX_BYTES = 256, 200, 65536
# One poll of this number queries the graph.
QUERY_POLLS = 2
# s for the discovery of a service or subscriber, and for an answer: longer than a bridge takes,
# whatever its device does.
DISCOVERY_LIMIT, ANSWER_LIMIT = 2.0, 8.0
# s after an unanswered OFF in which a further OFF waits for its answer.
OFF_INTERVAL = 0.5
# s in which a value that was requested with success counts as requested: diagnostics show it
# only once a second.
WANTED_LIFETIME = 2.0
MAX_TEXT = 1000
SAMPLE_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
DIAGNOSTICS_QOS = QoSProfile(depth=MAX_DIAGNOSTICS, reliability=ReliabilityPolicy.RELIABLE)


def devices_among(
    topics: Iterable[tuple[str, list[str]]], views: Sequence[View],
    publishers: Callable[[str], int],
) -> dict[str, View]:
    """
    Return the views of the devices among the topics of a graph, by name.

    :param publishers: returns the number of publishers of a topic; the monitor's own subscriptions
        make topics, too.
    """
    types = dict(topics)
    found: dict[str, View] = {}
    for view in views:
        last = f'/{view.signature[0]}'
        for name in (topic.removesuffix(last) for topic in types if topic.endswith(last)):
            if name and all(type_name(view.topics[topic].type) in types.get(f'{name}/{topic}', ())
                            and publishers(f'{name}/{topic}') for topic in view.signature):
                found.setdefault(name, view)
    return found


def printable(value: Any) -> Any:
    """Return a value whose texts are short, without characters that control a terminal."""
    if isinstance(value, str):
        return ''.join(c if c.isprintable() else ' ' for c in value[:MAX_TEXT])
    return tuple(map(printable, value)) if isinstance(value, tuple) else value


class _Pending:
    """A request, its number once it is sent, and when its next step must have happened."""

    def __init__(self, request: Request, now: float) -> None:
        self.request = request
        self.sequence: int | None = None
        self.sent_at = now
        self.deadline = now + DISCOVERY_LIMIT


class Requests:
    """
    The requests to one device.

    For each topic, and for the same values of a service, there is one request at a time. The
    newest of those that come meanwhile waits, so that a key held down does not cause a hundred
    commands; a failure drops it, since it would hide the reason. An OFF does not wait for an ON,
    and waits for another OFF only :data:`OFF_INTERVAL`: the bridge may have been restarted.
    """

    def __init__(self, node: Node, device: Device, clock: Callable[[], float]) -> None:
        self._node = node
        self._device = device
        self._clock = clock
        # Clients and publishers, untyped: each has a type of its own.
        self._endpoints: dict[str, Any] = {}
        self._pending: dict[tuple[str, ...], _Pending] = {}
        self._waiting: dict[tuple[str, ...], Request] = {}

    def prepare(self, request: Request) -> Any:
        """Return the client or publisher of a request; its discovery begins with the first."""
        if request.name not in self._endpoints:
            name = f'{self._device.name}/{request.name}'
            self._endpoints[request.name] = (
                self._node.create_client(request.type, name) if hasattr(request.type, 'Request')
                else self._node.create_publisher(request.type, name, 10))
        return self._endpoints[request.name]

    def submit(self, request: Request) -> None:
        """Send a request, or let it wait for the pending one."""
        is_service = hasattr(request.type, 'Request')
        lane, now = (request.name, *(request.values if is_service else ())), self._clock()
        self._device.wanted |= {
            name: (value, math.inf) for name, value in request.values.items()}
        one = self._pending.get(lane)
        if one is None or request.is_off and (
                not one.request.is_off or now >= one.sent_at + OFF_INTERVAL):
            self._waiting.pop(lane, None)
            self._pending[lane] = _Pending(request, now)
            self.note(request.text, shared.PENDING, '')
            self.poll()
        else:
            self._waiting[lane] = request

    def poll(self) -> None:
        """Take answers, send what can be sent, and give up requests without an answer."""
        for lane, one in list(self._pending.items()):
            request, endpoint = one.request, self.prepare(one.request)
            if self._pending.get(lane) is not one:
                # The end of another one has sent it.
                continue
            if one.sequence is not None:
                while self._pending.get(lane) is one and (
                        taken := endpoint.handle.take_response(request.type.Response))[0]:
                    header, answer = taken
                    if header.request_id.sequence_number == one.sequence:
                        self._end(lane, *(
                            (answer.result.successful, answer.result.reason)
                            if hasattr(answer, 'result') else (answer.success, answer.message)))
            elif not hasattr(endpoint, 'publish'):
                if endpoint.service_is_ready():
                    one.sequence = endpoint.handle.send_request(request.message)
                    one.deadline = self._clock() + ANSWER_LIMIT
            elif endpoint.get_subscription_count():
                endpoint.publish(request.message)
                self._end(lane, True, 'sent, which has no answer')
            if self._pending.get(lane) is one and self._clock() >= one.deadline:
                self._end(lane, False, f'nothing takes {self._device.name}/{request.name}'
                          if one.sequence is None else f'no answer for {ANSWER_LIMIT:g} s')

    def note(self, text: str, outcome: tuple[str, str], answer: str) -> None:
        """Note the outcome of a request."""
        self._device.action = text, outcome, printable(answer), self._clock()

    def destroy(self) -> None:
        """Drop all requests."""
        for endpoint in self._endpoints.values():
            endpoint.destroy()

    def _end(self, lane: tuple[str, ...], success: bool, answer: str) -> None:
        request = self._pending.pop(lane).request
        self.note(request.text, shared.DONE if success else shared.FAILED, answer)
        waiting = self._waiting.pop(lane, None)
        if waiting is not None and (success or waiting.is_off):
            self.submit(waiting)
            return
        until = self._clock() + WANTED_LIFETIME if success else -math.inf
        self._device.wanted |= {name: (value, until) for name, value in request.values.items()}


class Graph:
    """
    The devices that a node discovers.

    :param source: of commands, see :class:`Device`.
    :ivar clock: returns the time, s.
    :ivar devices: in the order of the views, then by name.
    """

    def __init__(
        self, node: Node, views: Sequence[View], source: str = '',
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._node = node
        self._views = views
        self.clock = clock
        self._source = source
        self.devices: list[Device] = []
        self._topics: dict[str, dict[str, Subscription]] = {}
        self._requests: dict[str, Requests] = {}
        # The last message of each state, to leave out what has not changed.
        self._last: dict[Subscription, bytes] = {}
        self._diagnostics = node.create_subscription(
            DiagnosticArray, '/diagnostics', _taken_by_poll, DIAGNOSTICS_QOS)
        self._polls = 0
        self._trend_at = clock()

    def submit(self, device: Device, request: Request) -> None:
        """Send a request to a device."""
        self._requests[device.name].submit(request)

    def refuse(self, device: Device, text: str, reason: str) -> None:
        """Note why a request to a device is not sent."""
        self._requests[device.name].note(text, shared.FAILED, reason)

    def all_off(self) -> None:
        """Switch off every device that can be switched off, unless it is gone."""
        for device in self.devices:
            if device.view.off is not None and device.gone_at is None:
                self.submit(device, device.view.off(device))

    def clear_gone(self) -> None:
        """Remove the devices that are gone."""
        for name in [device.name for device in self.devices if device.gone_at is not None]:
            self._requests.pop(name).destroy()
            for subscription in self._topics.pop(name).values():
                self._last.pop(subscription, None)
                self._node.destroy_subscription(subscription)
        self.devices = [device for device in self.devices if device.name in self._requests]

    def poll_answers(self) -> None:
        """Take the answers to requests."""
        for requests in self._requests.values():
            requests.poll()

    def poll(self) -> None:
        """Find new and gone devices, and take the newest values."""
        now = self.clock()
        if not self._polls % QUERY_POLLS:
            self._query(now)
        self._polls += 1
        self.poll_answers()
        samples, self._trend_at = ((True, now + shared.TREND_STEP) if now >= self._trend_at
                                   else (False, self._trend_at))
        for device in self.devices:
            device.now = now
            for topic, subscription in self._topics[device.name].items():
                self._take(device, topic, subscription)
            if samples:
                value = device.values.get(device.view.trend)
                device.trend.append(value if device.state in device.view.states else None)
        by_name = {one.name: one for one in self.devices}
        for _ in range(MAX_DIAGNOSTICS):
            if (data := _newest(self._diagnostics)) is None:
                break
            for status in getattr(_decoded(data, DiagnosticArray), 'status', ()):
                values = {printable(pair.key): printable(pair.value)
                          for pair in status.values[:MAX_VALUES]}
                # The name of the status has the node's name without its namespace.
                if known := by_name.get(values.get('node', '')):
                    known.heard_at = now
                    kind = printable(status.name.rpartition(': ')[2])
                    if kind in known.diagnoses or len(known.diagnoses) < MAX_DIAGNOSES:
                        known.diagnoses[kind] = shared.Diagnosis(
                            min(status.level[0], 3), printable(status.message), values)

    def _query(self, now: float) -> None:
        found = devices_among(self._node.get_topic_names_and_types(), self._views,
                              self._node.count_publishers)
        for device in self.devices:
            is_present = found.pop(device.name, None) is device.view
            device.gone_at = None if is_present else device.gone_at or now
        for name in sorted(found)[:MAX_DEVICES - len(self.devices)]:
            # The graph also has names that other middleware has made.
            with contextlib.suppress(NameValidationException):
                self._topics[name] = {
                    topic: self._node.create_subscription(
                        one.type, f'{name}/{topic}', _taken_by_poll,
                        STATE_QOS if one.is_state else SAMPLE_QOS)
                    for topic, one in found[name].topics.items()}
                device = Device(name, found[name], now, self._source, now)
                self._requests[name] = Requests(self._node, device, self.clock)
                self.devices.append(device)
        self.devices.sort(key=lambda device: (self._views.index(device.view), device.name))
        for device in self.devices:
            if device.view.off is not None:
                self._requests[device.name].prepare(device.view.off(device))

    def _take(self, device: Device, topic: str, subscription: Subscription) -> None:
        data, spec = _newest(subscription), device.view.topics[topic]
        if not data:
            return
        device.heard_at = device.now
        if spec.is_state:
            if self._last.get(subscription) == data:
                return
            self._last[subscription] = data
        if (message := _decoded(data, spec.type)) is not None:
            if not spec.is_state or topic in device.values:
                device.changed_at[topic] = device.now
            device.values[topic] = printable(spec.read(message))


def _newest(subscription: Subscription) -> bytes | None:
    """Return a message, None if there is none, b'' if it is too large."""
    taken = subscription.handle.take_message(subscription.msg_type, True)
    if taken is None:
        return None
    assert isinstance(taken[0], bytes)
    return taken[0] if len(taken[0]) <= MAX_BYTES else b''


def _decoded(data: bytes, type_: type[T]) -> T | None:
    """Return a message, None if it is broken."""
    with contextlib.suppress(Exception):
        message: T = deserialize_message(data, type_)
        return message
    return None


def _taken_by_poll(message: object) -> None:
    """Do nothing: no executor calls this."""
