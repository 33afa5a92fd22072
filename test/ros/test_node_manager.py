# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Nodes of further devices: a failure is tried again, and a node goes with its device."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import cast

from illuminator_ros.mavlink.retries import RESOURCE
from illuminator_ros.payload.device_events import DeviceForgotten
from illuminator_ros.ros import node_manager, throttled_log
from illuminator_ros.ros.device_nodes import DeviceNodes
from illuminator_ros.ros.diagnostics_publisher import DiagnosticsSource
from illuminator_ros.ros.node_manager import NodeManager, NodeRequest
from illuminator_ros.ros.parameters import ParameterError
from illuminator_ros.ros.payload import BridgeContext
from illuminator_ros.ros.payload_node import PayloadNode
from illuminator_ros.ros.throttled_log import NodeLog
import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from support.ros import Ros
from support.waiting import eventually


@pytest.fixture
def first(own_ros: Ros) -> Iterator[PayloadNode]:
    node = PayloadNode('first', context=own_ros.context)
    yield node
    node.destroy_node()


@pytest.fixture
def pool(first: PayloadNode) -> Iterator[NodeManager]:
    executor = SingleThreadedExecutor(context=first.context)
    pool = NodeManager(first, [], NodeLog(first.get_logger()), executor, lambda: None)
    yield pool
    for node in pool.nodes:
        node.destroy_node()


def request(serve: Callable[[Node, NodeLog], None] = lambda node, log: None) -> NodeRequest:
    return NodeRequest('light 1/244', 'further', serve)


def names(ros: Ros) -> list[str]:
    return ros.node.get_node_names()


def test_node_that_cannot_be_made_is_tried_again_and_logged_and_removed_with_its_device(
    own_ros: Ros, pool: NodeManager, capfd: pytest.CaptureFixture[str],
) -> None:
    failures = [OSError('too many threads')]

    def serve(node: Node, log: NodeLog) -> None:
        if failures:
            raise failures.pop()

    wanted = request(serve)
    pool.make(wanted)

    pool.work()
    assert 'light 1/244 gets no node yet: too many threads' in ''.join(capfd.readouterr())
    eventually(lambda: pool.work() or 'further' in names(own_ros))

    pool.remove(wanted)
    pool.work()
    eventually(lambda: 'further' not in names(own_ros))
    assert pool.nodes == []


def test_device_that_goes_before_its_node_is_made_gets_none(pool: NodeManager) -> None:
    wanted = request()
    pool.make(wanted)
    pool.remove(wanted)

    assert not pool.work()
    assert pool.nodes == []


def test_device_whose_node_has_a_wrong_parameter_gets_none_and_one_line(
    pool: NodeManager, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(node_manager, 'RESOURCE', RESOURCE._replace(first=0.0))

    def serve(node: Node, log: NodeLog) -> None:
        raise ParameterError('brightness: wrong')

    pool.make(request(serve))
    for _ in range(2):
        pool.work()

    assert ''.join(capfd.readouterr()).count('light 1/244 gets no node: brightness: wrong') == 1
    assert pool.nodes == []


def test_last_line_that_the_log_of_a_further_node_left_out_is_written_after_its_period(
    pool: NodeManager, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
) -> None:
    def serve(node: Node, log: NodeLog) -> None:
        for number in range(throttled_log.BURST + 2):
            log.warning(f'line {number}', 'kind')

    pool.make(request(serve))
    pool.work()
    assert 'left out' not in ''.join(capfd.readouterr())

    monkeypatch.setattr(throttled_log, 'PERIOD', 0.0)
    pool.work()

    assert '[further]: line 11 (1 similar lines left out)' in ''.join(capfd.readouterr())


class Served:
    """The node of a device, in name only."""

    def __init__(self, node: Node) -> None:
        self.source = DiagnosticsSource(
            node.get_fully_qualified_name(), lambda now: lambda link: ())

    def handle(self, event: object) -> None:
        """Publish nothing."""

    def release(self) -> None:
        """Serve no device."""

    def absence(self, now: float) -> str:
        """Return why there is no device."""
        return ''


def test_device_found_again_while_its_node_is_made_has_one_node_and_one_diagnostics_source(
    first: PayloadNode, pool: NodeManager,
) -> None:
    turns: list[Callable[[float], None]] = []
    sources: set[DiagnosticsSource] = set()
    made: list[Served] = []

    def make(node: Node, log: NodeLog) -> Served:
        made.append(Served(node))
        if len(made) == 1:
            nodes.handle(DeviceForgotten(7))
            nodes.serve(7, 'further')
        return made[-1]

    nodes = DeviceNodes[int, Served](
        cast(BridgeContext, SimpleNamespace(
            node=first, nodes=pool, log=NodeLog(first.get_logger()),
            link=SimpleNamespace(clock=lambda: 0.0, call=turns.append),
            diagnostics=SimpleNamespace(add=sources.add, remove=sources.discard))),
        'light', Served(first), make, lambda node, key, now: None)
    nodes.serve(7, 'further')
    while pool.work():
        pass
    pool.work()
    for turn in turns:
        turn(0.0)

    assert len(pool.nodes) == 1
    assert nodes.get(7) is made[1]
    assert sources == {nodes.first.source, made[1].source}
