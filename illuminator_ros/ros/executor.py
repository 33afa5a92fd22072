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
An executor that keeps its wait set, and services that answer later.

For each callback rclpy makes new lists, a wait set, a task and three coroutines, and does so
twice more afterwards. That takes 0.2 ms before and 0.2 ms after the callback of a service, which
itself takes 0.01 ms.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import contextlib
import functools
import math
import threading
import time
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription

from .answer_queue import AnswerQueue, MAX_SPREAD
from .throttled_log import NodeLog

# s between checks for calls while rclpy's own loop runs.
FALLBACK_PERIOD = 0.1
# The answer to requests that wait at the end.
ENDED = 'the bridge ended first; the device may have executed the request'

# Sends a response; callable from any thread. Untyped: messages of ROS have no types.
Respond = Callable[[Any], None]
# Takes a request and the function that sends the response.
Take = Callable[[Any, Respond], None]


class DeferredService:
    """
    The callback of a service that answers later; only a :class:`NodeExecutor` calls it.

    :param take: called with the request, and with the function that sends the response.
    :param refuse_waiting: called with the reason when the executor ends; answers what waits.
    :param spread: s within which the answers to requests that came together are sent.
    :ivar answers: paces its answers.
    """

    def __init__(
        self, take: Take, refuse_waiting: Callable[[str], None] = lambda reason: None,
        spread: float = MAX_SPREAD,
    ) -> None:
        self.take = take
        self.refuse_waiting = refuse_waiting
        self.answers = AnswerQueue(spread)

    def __call__(self, request: object, response: object) -> object:
        """Fail: another executor cannot wait for the answer."""
        raise TypeError('a deferred service needs a NodeExecutor')


class NodeExecutor(SingleThreadedExecutor):
    """
    Runs the services and subscriptions of nodes, one callback after the other.

    Where a node has timers, clients or waitables, rclpy's own loop runs instead.
    """

    def __init__(self, context: Context, log: NodeLog) -> None:
        self._wakeup = GuardCondition(None, None, context)
        super().__init__(context=context)
        self._log = log
        self._entities: _Entities | None = None
        self._calls: deque[Callable[[], None]] = deque()
        # Queues with answers that wait; only the executor's thread changes the set.
        self._queues: set[AnswerQueue] = set()
        self._stale = threading.Event()
        self._stale.set()
        self._ended = threading.Event()

    def run(self) -> None:
        """
        Run callbacks until :meth:`end` is called or the context is shut down.

        Requests that wait are then refused.
        """
        while not self._ended.is_set() and self.context.ok():
            try:
                self.spin_once()
            except ExternalShutdownException:
                break
            except Exception as error:
                self._log.error(f'internal error: {error!r}', 'executor')
        try:
            self._refuse_waiting()
        except Exception as error:
            self._log.error(f'internal error: {error!r}', 'executor')
        self._release()

    def end(self) -> None:
        """Make :meth:`run` return; callable from any thread."""
        self._ended.set()
        self.call(lambda: None)

    def call(self, function: Callable[[], None]) -> None:
        """Call a function in the executor's thread; callable from any thread."""
        self._calls.append(function)
        self._wakeup.trigger()

    def wake(self) -> None:
        """See :meth:`Executor.wake`: an entity or node was added or removed."""
        super().wake()
        if hasattr(self, '_stale'):
            self._stale.set()
            self._wakeup.trigger()

    def add_node(self, node: Node) -> bool:
        """See :meth:`Executor.add_node`."""
        added = super().add_node(node)
        self.wake()
        return added

    def remove_node(self, node: Node) -> None:
        """See :meth:`Executor.remove_node`."""
        super().remove_node(node)
        self.wake()

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait until something is ready, and run the callback of each entity that is."""
        if self._stale.is_set():
            self._stale.clear()
            self._release()
            with contextlib.suppress(InvalidHandle):
                self._entities = _Entities.of(self.get_nodes(), self._wakeup, self.context)
        if self._entities is None:
            super().spin_once(FALLBACK_PERIOD if timeout_sec is None else timeout_sec)
        else:
            services, subscriptions = self._entities.wait(self._timeout(timeout_sec))
            for service in services:
                self._serve(service)
            for subscription in subscriptions:
                self._deliver(subscription)
        self._answer(time.monotonic())
        if not self.context.ok():
            raise ExternalShutdownException()

    def _answer(self, now: float) -> None:
        while self._calls:
            self._calls.popleft()()
        for queue in tuple(self._queues):
            queue.poll(now)
            if not queue:
                self._queues.remove(queue)

    def _refuse_waiting(self) -> None:
        if not self.context.ok():
            return
        for node in self.get_nodes():
            for service in node.services:
                if isinstance(service.callback, DeferredService):
                    service.callback.refuse_waiting(ENDED)
        # No more requests are taken, so this ends; and no answer pauses any more.
        while self._calls or self._queues:
            self._answer(math.inf)

    def _release(self) -> None:
        if self._entities is not None:
            self._entities.close()
            self._entities = None

    def _take_service(self, service: Service) -> object:
        """See rclpy's Executor, whose loop calls it."""
        if not isinstance(service.callback, DeferredService):
            return super()._take_service(service)  # type: ignore[no-untyped-call]
        with service.handle:
            self._serve(service)
        return None

    def _serve(self, service: Service) -> None:
        """Take a request; the caller protects the handle of its service from destruction."""
        type_: Any = service.srv_type
        request, header = service.handle.service_take_request(type_.Request)
        if header is None:
            return
        callback: Any = service.callback
        if isinstance(callback, DeferredService):
            callback.answers.note_request()
            take = callback.take
            respond = functools.partial(self._respond, service, header, callback.answers)
        else:
            def take(request: object, respond: Callable[[object], None]) -> None:
                respond(callback(request, type_.Response()))

            respond = functools.partial(_send, service, header)
        try:
            take(request, respond)
        except Exception:
            # The client gets an answer after internal errors, too.
            respond(type_.Response())
            raise

    def _respond(
        self, service: Service, header: _rclpy.rmw_service_info_t, queue: AnswerQueue,
        response: object,
    ) -> None:
        send = functools.partial(_send, service, header, response)
        # The middleware waits up to 0.1 s before it sends an answer to a client that it has not
        # discovered yet. The executor's thread then sends the answer, so that the link does not
        # wait.
        if header.request_id.sequence_number <= 1:
            send = functools.partial(self.call, send)
        now = time.monotonic()
        if not queue.send_or_queue(send, now):
            self.call(functools.partial(self._queues.add, queue))
        queue.count_clients(functools.partial(self._count_clients, service), now)

    def _count_clients(self, service: Service) -> int | None:
        """Return how many clients a service has, None if that is unknown."""
        for node in self.get_nodes():
            with contextlib.suppress(InvalidHandle):
                return node.count_clients(service.service_name)
        return None

    def _timeout(self, timeout: float | None) -> float | None:
        """Return how long to wait for entities, s, None for ever."""
        if self._calls:
            # A call before these has failed.
            return 0.0
        due = min((queue.next_deadline() for queue in self._queues), default=math.inf)
        if due < math.inf:
            wait = max(due - time.monotonic(), 0.0)
            timeout = wait if timeout is None else min(wait, timeout)
        return timeout

    @staticmethod
    def _deliver(subscription: Subscription) -> None:
        with subscription.handle:
            taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
        if taken is not None:
            subscription.callback(taken[0])


def _send(service: Service, header: _rclpy.rmw_service_info_t, response: object) -> None:
    # The node of a forgotten device may be gone.
    with contextlib.suppress(InvalidHandle):
        service.send_response(response, header)


class _Entities:
    """A wait set and its entities, which it protects from destruction."""

    def __init__(
        self, services: list[Service], subscriptions: list[Subscription],
        guards: list[GuardCondition], context: Context,
    ) -> None:
        self._stack = contextlib.ExitStack()
        try:
            for handle in (*(one.handle for one in services),
                           *(one.handle for one in subscriptions),
                           *(one.handle for one in guards), context.handle):
                self._stack.enter_context(handle)
        except InvalidHandle:
            self.close()
            raise
        self._services = {service.handle.pointer: service for service in services}
        self._subscriptions = {one.handle.pointer: one for one in subscriptions}
        self._wait_set = wait_set = _rclpy.WaitSet(
            len(subscriptions), len(guards), 0, 0, len(services), 0, context.handle)
        # Looked up once: a method is a new object each time.
        add_service, add_subscription = wait_set.add_service, wait_set.add_subscription
        self._added = [
            *((add_service, service.handle) for service in services),
            *((add_subscription, one.handle) for one in subscriptions),
            *((wait_set.add_guard_condition, guard.handle) for guard in guards)]

    @classmethod
    def of(
        cls, nodes: list[Node], wakeup: GuardCondition, context: Context,
    ) -> _Entities | None:
        """Return the entities of nodes, None if not all are services and subscriptions."""
        if any(True for node in nodes
               for others in (node.timers, node.clients, node.waitables) for _ in others):
            return None
        return cls([one for node in nodes for one in node.services],
                   [one for node in nodes for one in node.subscriptions],
                   [wakeup, *(one for node in nodes for one in node.guards)], context)

    def wait(self, timeout: float | None) -> tuple[list[Service], list[Subscription]]:
        """Wait, and return the services and subscriptions that are ready."""
        wait_set = self._wait_set
        wait_set.clear_entities()
        for add, handle in self._added:
            add(handle)
        wait_set.wait(-1 if timeout is None else int(timeout * 1e9))
        return ([self._services[one] for one in wait_set.get_ready_entities('service')],
                [self._subscriptions[one] for one in wait_set.get_ready_entities('subscription')])

    def close(self) -> None:
        """Release the entities."""
        self._stack.close()
