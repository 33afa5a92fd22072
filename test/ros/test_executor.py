# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The requirements of the bridge on the executor of rclpy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import functools
import threading
from typing import TypeVar

from illuminator_ros.ros.deferred_service import DeferredService, Respond
from illuminator_ros.ros.node import SERVICE_QOS
from illuminator_ros.ros.throttled_log import NodeLog
import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Int32
from std_srvs.srv import Trigger
from support.recording import Call
from support.ros import Ros
from support.waiting import eventually, Log, PATIENCE

T = TypeVar('T')
NODES, CLIENTS, ROUNDS, MESSAGES = 30, 50, 10, 20_000


class Spun:
    """
    A node in the bridge's executor, which a thread spins as the bridge does.

    :ivar errors: of callbacks.
    :ivar spins: calls of ``spin_once`` that have returned.
    """

    def __init__(self, ros: Ros, **parameters: bool) -> None:
        self.node = Node('spun', context=ros.context, parameter_overrides=[
            Parameter(name, value=value) for name, value in parameters.items()])
        self.log = NodeLog(self.node.get_logger())
        self.executor = SingleThreadedExecutor(context=ros.context)
        self.executor.add_node(self.node)
        self.errors: Log[str] = Log()
        self.spins = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _spin(self) -> None:
        while not self._ended.is_set():
            try:
                self.executor.spin_once()
            except Exception as error:
                self.errors.append(repr(error))
            self.spins += 1

    def do(self, function: Callable[[], T]) -> T:
        """Call a function in the executor's thread, and return its result."""
        done: Log[T] = Log()
        self.executor.create_task(lambda: done.append(function()))
        return done.wait_for(lambda result: True)

    def make(self, name: str, take: Callable[[Respond], None]) -> Node:
        """Make a further node with a service ``~/serve``."""
        return self.do(functools.partial(self._make, name, take))

    def _make(self, name: str, take: Callable[[Respond], None]) -> Node:
        node = Node(name, context=self.node.context)
        self.executor.add_node(node)
        DeferredService(node, Trigger, '~/serve', lambda request, respond: take(respond),
                        SERVICE_QOS, self.log)
        node.create_timer(0.001, lambda: None)
        node.create_subscription(Int32, '/numbers', lambda message: None, 10)
        return node

    def remove(self, node: Node) -> None:
        """Remove a further node; for the executor's thread."""
        self.executor.remove_node(node)
        node.destroy_node()

    def close(self) -> None:
        """End the thread, and leave the graph."""
        self._ended.set()
        self.executor.create_task(lambda: None)
        self._thread.join(PATIENCE)
        assert not self._thread.is_alive()
        self.executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def spun(ros: Ros) -> Iterator[Spun]:
    spun = Spun(ros)
    yield spun
    spun.close()


def accept(respond: Respond) -> None:
    respond(Trigger.Response(success=True))


def call(ros: Ros, service: str) -> Call:
    return ros.start(Trigger, service, Trigger.Request())


def test_requests_are_answered_while_nodes_are_made_and_removed(ros: Ros, spun: Spun) -> None:
    spun.make('staying', accept)
    numbers = ros.node.create_publisher(Int32, '/numbers', 10)
    call(ros, '/staying/serve').result()

    for number in range(NODES):
        asked = call(ros, '/staying/serve')
        node = spun.make(f'passing_{number}', accept)
        numbers.publish(Int32(data=number))
        spun.do(functools.partial(spun.remove, node))
        assert asked.result().success

    assert not spun.errors


def test_node_may_leave_while_its_requests_wait_for_their_answers_and_for_the_executor(
    ros: Ros, spun: Spun,
) -> None:
    waiting: Log[Respond] = Log()
    held, released = threading.Event(), threading.Event()
    node = spun.make('leaving', waiting.append)
    spun.make('staying', accept)
    call(ros, '/leaving/serve')
    call(ros, '/staying/serve').result()
    waiting.wait_for(lambda respond: True)

    def leave() -> None:
        held.set()
        released.wait(PATIENCE)
        spun.remove(node)

    spun.executor.create_task(leave)
    held.wait(PATIENCE)
    # The executor takes these requests after the node has left.
    for _ in range(3):
        call(ros, '/leaving/serve')
    later = call(ros, '/staying/serve')
    released.set()
    assert later.result().success
    for respond in [*waiting]:
        accept(respond)

    assert call(ros, '/staying/serve').result().success
    assert not spun.errors


def test_executor_goes_on_after_an_exception_in_a_callback(ros: Ros, spun: Spun) -> None:
    taken: Log[int] = Log()

    def take(message: Int32) -> None:
        taken.append(message.data)
        if message.data == 1:
            raise ValueError('one')

    spun.do(lambda: spun.node.create_subscription(Int32, '/data', take, 10))
    publisher = ros.node.create_publisher(Int32, '/data', 10)
    eventually(publisher.get_subscription_count)
    ros.meet('/spun')

    for number in (1, 2, 3):
        publisher.publish(Int32(data=number))

    taken.wait_for(lambda number: number == 3)
    assert [*taken] == [1, 2, 3]
    assert [*spun.errors] == ["ValueError('one')"]


def test_timer_by_the_clock_of_ros_follows_simulated_time(ros: Ros) -> None:
    spun = Spun(ros, use_sim_time=True)
    try:
        times: Log[int] = Log()
        spun.do(lambda: spun.node.create_timer(
            10.0, lambda: times.append(spun.node.get_clock().now().nanoseconds)))
        publisher = ros.node.create_publisher(Clock, '/clock', 10)
        eventually(publisher.get_subscription_count)

        ros.meet('/spun')

        def reach(seconds: int) -> None:
            message = Clock()
            message.clock.sec = seconds
            publisher.publish(message)
            eventually(lambda: spun.node.get_clock().now().nanoseconds == seconds * 10**9)

        reach(100)
        spun.do(times.clear)
        reach(105)
        spun.do(lambda: None)
        assert not times
        reach(110)
        times.wait_for(lambda time: time == 110 * 10**9)
    finally:
        spun.close()


def test_calls_of_many_clients_at_the_same_moment_are_all_answered(ros: Ros, spun: Spun) -> None:
    spun.make('asked', accept)
    # Each client receives the answers to all; rclpy's default queue of 10 would lose some of them.
    clients = [ros.node.create_client(
        Trigger, '/asked/serve', qos_profile=QoSProfile(depth=2 * CLIENTS))
        for _ in range(CLIENTS)]
    eventually(lambda: all(client.service_is_ready() for client in clients))
    ros.meet('/spun')

    for _ in range(ROUNDS):
        calls = [Call(client.call_async(Trigger.Request())) for client in clients]
        assert all(one.result().success for one in calls)


def test_request_waits_for_the_kept_messages_of_a_flood_only(ros: Ros, spun: Spun) -> None:
    spun.make('asked', accept)
    publisher = ros.node.create_publisher(Int32, '/numbers', 10)
    eventually(publisher.get_subscription_count)
    call(ros, '/asked/serve').result()
    held, released = threading.Event(), threading.Event()

    def hold() -> None:
        held.set()
        released.wait(PATIENCE)

    spun.executor.create_task(hold)
    assert held.wait(PATIENCE)
    for number in range(MESSAGES):
        publisher.publish(Int32(data=number))
    asked, before = call(ros, '/asked/serve'), spun.spins
    released.set()

    assert asked.result().success
    assert spun.spins - before < MESSAGES / 10
