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

For each callback rclpy makes new lists, a wait set, a task and coroutines, and does so again
afterwards: with rclpy's executor ``~/enable`` takes a third longer, and with 100 nodes five times
as long (doc/performance.md). The EventsExecutor of rclpy 7.1.6 spins and answers no service; one
that answers would replace this one.
"""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import functools
import heapq
import itertools
import math
import threading
import time
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.guard_condition import GuardCondition
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.service import Service
from rclpy.subscription import Subscription

from .answer_spacing import AnswerSpacing, MAX_SPREAD
from .rclpy_private import rclpy_implementation as _rclpy
from .throttled_log import NodeLog

# Answers that wait for their time; more would fill the memory and come too late.
MAX_WAITING = 250
# The answer to requests that wait at the end.
ENDED = 'the bridge ended first; the device may have executed the request'

# Sends a response; callable from any thread. Untyped: messages of ROS have no types.
Respond = Callable[[Any], None]
# Takes a request and the function that sends the response.
Take = Callable[[Any, Respond], None]


class DeferredService:
    """
    A service that answers later; a node with one needs a :class:`NodeExecutor`.

    :param take: called with the request, and with the function that sends the response.
    :param refuse_waiting: called with the reason when the executor ends; answers what waits.
    :param spread: s within which the answers to requests that came together are sent.
    """

    def __init__(
        self, node: Node, type_: type[Any], name: str, take: Take,
        refuse_waiting: Callable[[str], None], qos: QoSProfile, spread: float = MAX_SPREAD,
    ) -> None:
        self.take = take
        self.refuse_waiting = refuse_waiting
        self.spacing = AnswerSpacing(spread)
        node.create_service(type_, name, self, qos_profile=qos)

    def __call__(self, request: Any, response: Any) -> Any:
        """Refuse to answer in another executor."""
        raise NotImplementedError


class NodeExecutor(SingleThreadedExecutor):
    """
    Runs the services, subscriptions and guard conditions of nodes, one callback after the other.

    It does not run timers, clients and waitables.
    """

    def __init__(self, context: Context, log: NodeLog) -> None:
        self._wakeup = GuardCondition(None, None, context)
        self._stale = threading.Event()
        super().__init__(context=context)
        self._log = log
        self._wait_set: _WaitSet | None = None
        # A heap: the time from which on each is due (s, monotonic), its number, the function.
        self._calls: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = itertools.count()
        self._calls_lock = threading.Lock()
        self._ended = threading.Event()

    def run(self) -> None:
        """
        Run callbacks until :meth:`end` is called or the context is shut down.

        Requests that wait are then refused.
        """
        while not self._ended.is_set() and self.context.ok():
            self._call(self.spin_once)
        self._call(self._refuse_waiting)
        self._release()

    def _call(self, function: Callable[[], None]) -> None:
        try:
            function()
        except Exception as error:
            self._log.error(f'internal error: {error!r}', 'executor')

    def end(self) -> None:
        """Make :meth:`run` return; callable from any thread."""
        self._ended.set()
        self.call(lambda: None)

    def call(self, function: Callable[[], None], due: float = -math.inf) -> None:
        """
        Call a function in the executor's thread; callable from any thread.

        :param due: s, monotonic; not before this time.
        """
        with self._calls_lock:
            heapq.heappush(self._calls, (due, next(self._numbers), function))
        self._wakeup.trigger()

    def wake(self) -> None:
        """See :meth:`Executor.wake`: an entity or node was added or removed."""
        super().wake()
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
        if self._wait_set is None:
            # An entity may be destroyed meanwhile; the next call then tries again.
            with contextlib.suppress(InvalidHandle):
                self._wait_set = _WaitSet(self.get_nodes(), self._wakeup, self.context)
        else:
            timeout = math.inf if timeout_sec is None else timeout_sec
            if self._calls:
                timeout = min(self._calls[0][0] - time.monotonic(), timeout)
            guards, services, subscriptions = self._wait_set.wait(max(timeout, 0.0))
            # First, so that a request finds what was called before it was sent.
            for guard in guards:
                if guard.callback is not None:
                    guard.callback()
            for service in services:
                self._serve(service)
            for subscription in subscriptions:
                self._deliver(subscription)
        self._run_calls(time.monotonic())

    def _run_calls(self, now: float) -> None:
        while self._calls and self._calls[0][0] <= now:
            with self._calls_lock:
                _, _, function = heapq.heappop(self._calls)
            function()

    def _refuse_waiting(self) -> None:
        if not self.context.ok():
            return
        for node in self.get_nodes():
            for service in node.services:
                if isinstance(service.callback, DeferredService):
                    service.callback.refuse_waiting(ENDED)
        # No more requests are taken, so this ends; and no answer waits for its time any more.
        self._run_calls(math.inf)

    def _release(self) -> None:
        if self._wait_set is not None:
            self._wait_set.close()
            self._wait_set = None

    def _serve(self, service: Service) -> None:
        """Take a request; the wait set protects the handle of its service from destruction."""
        # Untyped: rclpy does not say that the class of a service has these classes.
        type_: Any = service.srv_type
        callback: Any = service.callback
        request, header = service.handle.service_take_request(type_.Request)
        if header is None:
            return
        if isinstance(callback, DeferredService):
            callback.spacing.note_request()
            take = callback.take
            respond = functools.partial(self._respond, service, header, callback.spacing)
        else:
            def take(request: Any, respond: Respond) -> None:
                respond(callback(request, type_.Response()))

            respond = functools.partial(_send, service, header)
        try:
            take(request, respond)
        except Exception:
            # The client gets an answer after internal errors, too.
            respond(type_.Response())
            raise

    def _respond(
        self, service: Service, header: _rclpy.rmw_service_info_t, spacing: AnswerSpacing,
        response: Any,
    ) -> None:
        now = time.monotonic()
        due = spacing.time_of_answer(now)
        if len(self._calls) >= MAX_WAITING:
            due = now
        # The middleware waits up to 0.1 s before it sends an answer to a client that it has not
        # discovered yet. The executor's thread then sends the answer, so that the link does not
        # wait.
        if due > now or header.request_id.sequence_number <= 1:
            self.call(functools.partial(_send, service, header, response), due)
        else:
            _send(service, header, response)
        for node in self.get_nodes()[:1]:
            with contextlib.suppress(InvalidHandle):
                spacing.clients = node.count_clients(service.service_name)

    @staticmethod
    def _deliver(subscription: Subscription) -> None:
        with subscription.handle:
            taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
        if taken is not None:
            subscription.callback(taken[0])


def _send(service: Service, header: _rclpy.rmw_service_info_t, response: Any) -> None:
    # The node of a forgotten device may be gone.
    with contextlib.suppress(InvalidHandle):
        service.send_response(response, header)


class _WaitSet:
    """A wait set and its entities, which it protects from destruction."""

    def __init__(self, nodes: list[Node], wakeup: GuardCondition, context: Context) -> None:
        services = [one for node in nodes for one in node.services]
        subscriptions = [one for node in nodes for one in node.subscriptions]
        guards = [wakeup, *(one for node in nodes for one in node.guards)]
        with contextlib.ExitStack() as stack:
            # Untyped: they have no common class.
            entities: tuple[Any, ...] = (*services, *subscriptions, *guards, context)
            for one in entities:
                stack.enter_context(one.handle)
            self._services = {service.handle.pointer: service for service in services}
            self._subscriptions = {one.handle.pointer: one for one in subscriptions}
            self._guards = {one.handle.pointer: one for one in guards}
            self._wait_set = _rclpy.WaitSet(
                len(subscriptions), len(guards), 0, 0, len(services), 0, context.handle)
            self._stack = stack.pop_all()

    def wait(
        self, timeout: float,
    ) -> tuple[list[GuardCondition], list[Service], list[Subscription]]:
        """Wait, and return the guard conditions, services and subscriptions that are ready."""
        wait_set = self._wait_set
        wait_set.clear_entities()
        for service in self._services.values():
            wait_set.add_service(service.handle)
        for subscription in self._subscriptions.values():
            wait_set.add_subscription(subscription.handle)
        for guard in self._guards.values():
            wait_set.add_guard_condition(guard.handle)
        wait_set.wait(-1 if timeout == math.inf else int(timeout * 1e9))
        return ([self._guards[one] for one in wait_set.get_ready_entities('guard_condition')],
                [self._services[one] for one in wait_set.get_ready_entities('service')],
                [self._subscriptions[one] for one in wait_set.get_ready_entities('subscription')])

    def close(self) -> None:
        """Release the entities."""
        self._stack.close()
