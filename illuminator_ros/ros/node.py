# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A node of a payload: topics, services and commands from tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import contextlib
from dataclasses import dataclass
import functools
import math
import threading
from typing import Any, Generic, NamedTuple, TypeVar

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from .deferred_service import DeferredService, Handler, Respond
from .link_call import LinkCalls, MAX_PENDING
from .qos import STATE_QOS
from .throttled_log import NodeLog
from ..mavlink.link import Link

T = TypeVar('T')
# Takes success and a message.
Answer = Callable[[bool, str], None]

# Matches reliable and best-effort publishers. Messages may be lost, especially the first ones of a
# publisher; the next one of a stream replaces them.
COMMAND_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
# For commands that are not repeated, and each of which is taken in its place among all requests.
# Matches reliable publishers only.
SWITCH_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
# Requests that the middleware queues while others are taken, so that each gets an answer.
SERVICE_QOS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)


class Entity(NamedTuple):
    """
    A topic or service ``~/name``; the tables of the pages are written from it.

    :param type: the class of its messages, or the service's class.
    :param meaning: what its values mean, with their unit, or what it does.
    :param qos: of a topic; where it is None, :data:`STATE_QOS` of one that the node publishes, and
        :data:`COMMAND_QOS` of others. :data:`SWITCH_QOS` is for single messages.
    """

    name: str
    # Untyped: messages of ROS have no types.
    type: type[Any]  # noqa: A003
    meaning: str
    qos: QoSProfile | None = None

    def of(self, prefix: str) -> Entity:
        """Return the same topic or service of a source, with the prefix of its names."""
        return self._replace(name=f'{prefix}{self.name}')


@dataclass(frozen=True)
class RequestService:
    """
    A service, whose response has ``success`` and ``message``.

    :param start: called in the link's thread with the request, the time (s), and the function
        that it must call once with success and message, then or later.
    :param limit: requests with equal ``data`` that may wait for their answers; one more is
        answered at once.
    """

    entity: Entity
    start: Callable[[Any, float, Answer], None]
    limit: int = MAX_PENDING


def finite_data(message: Any) -> Any:
    """
    Return ``data`` of a message of std_msgs.

    :raises ValueError: if it is NaN or infinite.
    """
    value = message.data
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f'{value} is not a finite number')
    return value


@dataclass(frozen=True)
class CommandTopic(Generic[T]):
    """
    A topic that the node subscribes to.

    :param receive: called in the link's thread with a value and the time (s); of the values of a
        stream that come faster than the link handles them only the newest.
    :param read: returns the value of a message, in any thread; a ValueError is logged.
    """

    entity: Entity
    receive: Callable[[T, float], None]
    # Untyped: of the class that the entity names.
    read: Callable[[Any], T] = finite_data


# Of any type of value.
AnyCommandTopic = CommandTopic[Any]


class NodeEntities:
    """The topics and services of one node, as tables give them."""

    def __init__(
        self, node: Node, link: Link, log: NodeLog, *,
        publications: Iterable[Entity] = (), services: Iterable[RequestService] = (),
        commands: Iterable[AnyCommandTopic] = (),
    ) -> None:
        self._publishers = {
            one.name: node.create_publisher(one.type, f'~/{one.name}', one.qos or STATE_QOS)
            for one in publications}
        self._types = {one.name: one.type for one in publications}
        for service in services:
            calls, entity = LinkCalls(link, log, service.limit), service.entity
            DeferredService(node, entity.type, f'~/{entity.name}', _handler(service, calls),
                            SERVICE_QOS, log)
        for command in commands:
            entity = command.entity
            node.create_subscription(
                entity.type, f'~/{entity.name}', _TopicCalls(link, log, command).offer,
                entity.qos or COMMAND_QOS)

    def publish(self, name: str, value: object) -> None:
        """See :meth:`publish_all`."""
        self.publish_all({name: value})

    def publish_all(self, values: Mapping[str, object]) -> None:
        """
        Publish values by topic; callable from any thread, but only from one at a time.

        :param values: each the message, or ``data`` of a message of std_msgs.
        """
        # On a busy machine the nodes leave before the link's thread has ended.
        with contextlib.suppress(InvalidHandle):
            for name, value in values.items():
                type_ = self._types[name]
                self._publishers[name].publish(
                    value if isinstance(value, type_) else type_(data=value))

    def publish_to_subscribers(self, name: str, make: Callable[[], object]) -> None:
        """
        Publish on a topic that does not keep its last message, if it has a subscriber.

        :param make: returns the value, see :meth:`publish`.
        """
        if self._publishers[name].get_subscription_count():
            self.publish(name, make())


def _handler(service: RequestService, calls: LinkCalls) -> Handler:
    response = service.entity.type.Response

    def handle(request: Any, respond: Respond) -> None:
        def start(now: float, answer: Respond) -> None:
            service.start(request, now, lambda success, message: answer(
                response(success=success, message=message)))

        calls.ask(start, respond, lambda reason: response(success=False, message=reason),
                  kind=getattr(request, 'data', None))

    return handle


class _TopicCalls(Generic[T]):
    """Hands the values of a topic to the link: of a stream only the newest."""

    def __init__(self, link: Link, log: NodeLog, command: CommandTopic[T]) -> None:
        self._link = link
        self._log = log
        self._command = command
        self._waiting: list[T] = []
        self._lock = threading.Lock()

    def offer(self, message: Any) -> None:
        entity = self._command.entity
        try:
            value = self._command.read(message)
        except ValueError as error:
            self._log.stream_failed(f'~/{entity.name}: ignored: {error}', entity.name)
            return
        if entity.qos is SWITCH_QOS:
            self._link.call(functools.partial(self._command.receive, value))
            return
        with self._lock:
            called = bool(self._waiting)
            self._waiting[:] = [value]
        if not called:
            self._link.call(self._deliver)

    def _deliver(self, now: float) -> None:
        with self._lock:
            value = self._waiting.pop()
        self._command.receive(value, now)
