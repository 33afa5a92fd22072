# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The devices in the ROS graph, their values, and the requests to them.

Everything happens in :meth:`Graph.poll` and :meth:`Graph.poll_answers`, which never wait: the
newest message of each topic is taken when it is shown. An executor would make a wait set and run a
callback for each message: with 108 topics at 1 Hz, of twelve devices, that took 22 % of a CPU in
place of 1.6 %. rclpy's EventsExecutor would take 0.8 times this, but has an unbounded queue.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
import contextlib
import math
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import Log
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from rclpy.validate_full_topic_name import validate_full_topic_name

from ...ros import monitor_view as shared
from ...ros.graph import type_name
from ...ros.monitor_view import Device, Request, View
from ...ros.qos import STATE_QOS

# Every node can publish topics like those of a device, and more diagnostics than it has.
MAX_DEVICES, MAX_DIAGNOSES = 256, 10
# Messages of /diagnostics that one poll takes, values of a diagnosis, bytes of any message.
MAX_DIAGNOSTICS, MAX_VALUES, MAX_BYTES = 256, 200, 65536
MAX_TEXT = 1000
# Characters that a device's name must leave for those of its topics and services.
MAX_ENDPOINT = 64
# One poll of this number queries the graph, and one of this number adds to the trends.
QUERY_POLLS, TREND_POLLS = 5, 20
# s for the discovery of a service or subscriber, and for an answer: longer than a bridge takes,
# whatever its device does.
DISCOVERY_LIMIT, ANSWER_LIMIT = 2.0, 8.0
# s after an OFF in which a further OFF waits for its answer.
OFF_INTERVAL = 0.5
# s after an OFF of ALL OFF that failed until it is sent again, and until it is given up.
OFF_RETRY, OFF_LIMIT = 1.0, 60.0
# s in which a value that was requested with success counts as requested: diagnostics show it
# only once a second.
WANTED_LIFETIME = 2.0
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
            if is_usable(name) and all(
                    type_name(view.topics[topic].type) in types.get(f'{name}/{topic}', ())
                    and publishers(f'{name}/{topic}') for topic in view.signature):
                found.setdefault(name, view)
    return found


def is_usable(name: str) -> bool:
    """Return whether topics and services below a name are valid: not all of a graph are ROS's."""
    with contextlib.suppress(NameValidationException):
        return bool(name) and validate_full_topic_name(f'{name}/{"x" * MAX_ENDPOINT}')
    return False


def sane(value: Any) -> Any:
    """
    Return a value that can be shown and sent as JSON.

    Texts are short and without characters that control a terminal, a number that cannot be is
    None.
    """
    if isinstance(value, str):
        return ''.join(c if c.isprintable() else ' ' for c in value[:MAX_TEXT])
    if isinstance(value, tuple):
        return tuple(map(sane, value))
    return shared.finite(value) if isinstance(value, float) else value


class GraphDevice(Device):
    """
    A device in the ROS graph.

    Its requests have lanes, one for each topic or service and the values that it sets. A lane
    carries one request at a time. The newest of those that come meanwhile waits, so that a key
    held down does not cause a hundred commands; a failure drops it, since it would hide the
    reason. An OFF does not wait for an ON, and waits for another OFF only :data:`OFF_INTERVAL`:
    the bridge may have been restarted.
    """

    def __init__(
        self, node: Node, name: str, view: View, now: float, source: str = '', *,
        may_request: bool = True,
    ) -> None:
        super().__init__(name, view, now, source, heard_at=now)
        self._node = node
        self._may_request = may_request
        self._subscriptions = {topic: node.create_subscription(
            one.type, f'{name}/{topic}', _received_by_poll,
            STATE_QOS if one.is_state else SAMPLE_QOS) for topic, one in view.topics.items()}
        # Clients and publishers, untyped: each has a type of its own.
        self._endpoints: dict[str, Any] = {}
        self._lanes: dict[tuple[str, ...], Iterator[None]] = {}
        self._waiting: dict[tuple[str, ...], Request] = {}
        self._off_at = -math.inf
        # The OFF that is repeated until it is confirmed, when next, and until when, s.
        self._required: Request | None = None
        self._retry_at = self._required_until = math.inf
        # The text of the last message on each topic, by its name.
        self._published: dict[str, str] = {}

    def receive(self, now: float) -> None:
        """Receive the newest values."""
        self.now = now
        for topic, subscription in self._subscriptions.items():
            for message in _received(subscription):
                self.heard_at = now
                self.learn(topic, sane(self.view.topics[topic].read(message)))
        if self.view.off is not None and self._may_request:
            # The discovery of its service takes a while.
            self._endpoint(self.view.off(self))

    def learn(self, topic: str, value: Any) -> None:
        """Take the newest value of a topic."""
        known, self.values[topic] = self.values.get(topic), value
        if self.view.topics[topic].is_state and known in (None, value):
            return
        self.changed_at[topic] = self.now
        if self.view.off is not None and self.off is not None and self.off[0] in (
                shared.DONE, shared.ON_AGAIN) and (
                    topic in (wanted := self.view.off(self).values)):
            self.off = (shared.DONE if value == wanted[topic] else shared.ON_AGAIN), ''

    def diagnose(self, status: DiagnosticStatus, values: dict[str, str]) -> None:
        """Take a status of the diagnostics."""
        self.heard_at = self.now
        kind = sane(status.name.rpartition(': ')[2])
        if kind in self.diagnoses or len(self.diagnoses) < MAX_DIAGNOSES:
            self.diagnoses[kind] = shared.Diagnosis(
                min(status.level[0], 3), sane(status.message), values)

    def log(self, text: str) -> None:
        """Take a line of the node's log, which may say that a message was refused."""
        topic, separator, reason = text.partition(': ')
        if separator and (request := self._published.get(topic.removeprefix('~/'))):
            self.note(request, shared.FAILED, reason)
        self.news = text, self.now

    def require_off(self, request: Request) -> None:
        """Send an OFF, and again until it is confirmed or :data:`OFF_LIMIT` has passed."""
        self._required = request
        self._retry_at, self._required_until = math.inf, self.now + OFF_LIMIT
        self.submit(request)

    def submit(self, request: Request) -> None:
        """Send a request, or let it wait for the one before."""
        if not self._may_request:
            self.note(request.text, shared.FAILED, 'this monitor may only look')
            return
        lane = request.name, *request.values
        if self._required is not None and 'enabled' in request.values and not request.is_off:
            self._required = None
        self.wanted |= {name: (value, math.inf) for name, value in request.values.items()}
        self._waiting[lane] = request
        if lane not in self._lanes or (
                request.is_off and self.now >= self._off_at + OFF_INTERVAL):
            self._lanes[lane] = self._run(lane)
            self.poll_answers(self.now)

    def poll_answers(self, now: float) -> None:
        """Take answers, send what can be sent, and give up requests without an answer."""
        self.now = now
        if self._required is not None and now >= self._retry_at:
            self._retry_at = math.inf
            self.submit(self._required)
        for lane, steps in list(self._lanes.items()):
            # A step yields None.
            if next(steps, 'ended'):
                del self._lanes[lane]

    def destroy(self) -> None:
        """Leave the graph."""
        for one in (*self._subscriptions.values(), *self._endpoints.values()):
            one.destroy()

    def _endpoint(self, request: Request) -> Any:
        """Return the client or publisher of a request; its discovery begins with the first."""
        if request.name not in self._endpoints:
            name = f'{self.name}/{request.name}'
            self._endpoints[request.name] = (
                self._node.create_client(request.type, name) if hasattr(request.type, 'Request')
                else self._node.create_publisher(request.type, name, 10))
        return self._endpoints[request.name]

    def _run(self, lane: tuple[str, ...]) -> Iterator[None]:
        """Send the request that waits, then that which came meanwhile; a step for each poll."""
        while (request := self._waiting.pop(lane, None)) is not None:
            self._off_at = self.now if request.is_off else -math.inf
            self.note(request.text, shared.PENDING)
            is_done, answer = yield from self._exchange(request)
            outcome = shared.FAILED if not is_done else (
                shared.SENT if request.name in self._published else shared.DONE)
            self.note(request.text, outcome, sane(answer))
            if request.is_off:
                self._note_off(is_done, outcome, sane(answer))
            if lane in self._waiting and (is_done or self._waiting[lane].is_off):
                continue
            self._waiting.pop(lane, None)
            until = self.now + WANTED_LIFETIME if is_done else -math.inf
            self.wanted |= {name: (value, until) for name, value in request.values.items()}

    def _note_off(self, is_done: bool, outcome: tuple[str, str], answer: str) -> None:
        if is_done or self.now >= self._required_until:
            self._required = None
        elif self._required is not None:
            self._retry_at = self.now + OFF_RETRY
            answer += ', trying again'
        self.off = outcome, answer

    def _exchange(self, request: Request) -> Generator[None, None, tuple[bool, str]]:
        """Send a request; return whether it succeeded, and the answer."""
        endpoint, until = self._endpoint(request), self.now + DISCOVERY_LIMIT
        is_ready = getattr(endpoint, 'service_is_ready', None) or endpoint.get_subscription_count
        while not is_ready():
            if self.now >= until:
                return False, f'nothing takes {self.name}/{request.name}'
            yield
        if hasattr(endpoint, 'publish'):
            endpoint.publish(request.message)
            self._published[request.name] = request.text
            return True, ''
        future, until = endpoint.call_async(request.message), self.now + ANSWER_LIMIT
        while not future.done():
            if self.now >= until:
                return False, f'no answer for {ANSWER_LIMIT:g} s'
            yield
            _deliver_answers(endpoint)
        answer = future.result()
        if hasattr(answer, 'result'):
            return answer.result.successful, answer.result.reason
        return answer.success, answer.message


class Graph:
    """
    The devices that a node discovers.

    :param source: of commands, see :class:`Device`.
    :param may_request: whether requests are sent, or refused here.
    :param only: the one device to use, '' for all.
    :ivar clock: returns the time, s.
    :ivar views: of all payloads.
    :ivar devices: in the order of the views, then by name.
    """

    def __init__(
        self, node: Node, views: Sequence[View], source: str = '',
        clock: Callable[[], float] = time.monotonic, *, may_request: bool = True, only: str = '',
    ) -> None:
        self._node = node
        self.views = views
        self._source = source
        self.clock = clock
        self.may_request = may_request
        self._only = only
        self.devices: list[GraphDevice] = []
        self._diagnostics = node.create_subscription(
            DiagnosticArray, '/diagnostics', _received_by_poll, DIAGNOSTICS_QOS)
        self._log = node.create_subscription(Log, '/rosout', _received_by_poll, DIAGNOSTICS_QOS)
        self._polls = 0
        self._off_at = -math.inf

    def all_off(self) -> None:
        """Switch off every device that can be switched off."""
        self._off_at = self.clock()
        for device in self.devices if self.may_request else ():
            device.off = None
            if device.view.off is not None and device.is_gone:
                device.off = shared.FAILED, 'it is gone'
            elif device.view.off is not None:
                device.off = shared.PENDING, ''
                device.require_off(device.view.off(device))

    @property
    def off_answers(self) -> list[tuple[str, tuple[str, str], str]] | None:
        """Return name, outcome and answer of each device, None if ALL OFF is over."""
        answers = [(device.name, *device.off) for device in self.devices if device.off]
        is_over = self.clock() > self._off_at + (
            shared.NEWS_LIFETIME if all(outcome == shared.DONE for _, outcome, _ in answers)
            else 2 * OFF_LIMIT)
        return None if is_over else answers

    def clear_gone(self) -> None:
        """Remove the devices that are gone."""
        for device in self.devices:
            if device.is_gone:
                device.destroy()
        self.devices = [device for device in self.devices if not device.is_gone]

    def poll_answers(self) -> None:
        """Take the answers to requests."""
        for device in self.devices:
            device.poll_answers(self.clock())

    def poll(self) -> None:
        """Find new and gone devices, and take the newest values."""
        now = self.clock()
        if not self._polls % QUERY_POLLS:
            self._query(now)
        for device in self.devices:
            device.receive(now)
            if not self._polls % TREND_POLLS:
                device.trend.append(device.view.trend(device) if device.view.trend is not None
                                    and not device.is_stale else None)
        self._polls += 1
        by_name = {device.name: device for device in self.devices}
        for array in _received(self._diagnostics, MAX_DIAGNOSTICS):
            for status in array.status:
                values = {sane(one.key): sane(one.value) for one in status.values[:MAX_VALUES]}
                if known := by_name.get(values.get('node', '')):
                    known.diagnose(status, values)
        for line in _received(self._log, MAX_DIAGNOSTICS):
            # The name of a logger has dots instead of slashes.
            known = by_name.get(f'/{line.name.replace(".", "/")}')
            if known and line.level >= Log.INFO:
                known.log(sane(line.msg))

    def _query(self, now: float) -> None:
        found = devices_among(self._node.get_topic_names_and_types(), self.views,
                              self._node.count_publishers)
        nodes = Counter(f'{namespace.rstrip("/")}/{name}' for name, namespace in
                        self._node.get_node_names_and_namespaces())
        for device in self.devices:
            device.is_gone = found.pop(device.name, None) is not device.view
            device.nodes = nodes[device.name]
        names = {self._only} & {*found} if self._only else found
        for name in sorted(names)[:MAX_DEVICES - len(self.devices)]:
            self.devices.append(GraphDevice(
                self._node, name, found[name], now, self._source, may_request=self.may_request))
        self.devices.sort(key=lambda device: (self.views.index(device.view), device.name))


def _received(subscription: Subscription, limit: int = 1) -> Iterator[Any]:
    """Return messages that have come; skip large and broken ones."""
    # An executor would deserialize each one, and would wake the view for each.
    for _ in range(limit):
        if (taken := subscription.handle.take_message(subscription.msg_type, True)) is None:
            return
        if len(taken[0]) <= MAX_BYTES:
            with contextlib.suppress(Exception):
                yield deserialize_message(taken[0], subscription.msg_type)


def _deliver_answers(client: Any) -> None:
    """Give each answer that has come to its request, as an executor does."""
    while (taken := client.handle.take_response(client.srv_type.Response))[0] is not None:
        # Two nodes of the same name both answer.
        with contextlib.suppress(KeyError):
            client.get_pending_request(taken[0].request_id.sequence_number).set_result(taken[1])


def _received_by_poll(message: object) -> None:
    """Do nothing: no executor calls this."""
