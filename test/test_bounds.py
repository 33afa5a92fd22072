# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Each store that grows with what others send has a bound: one table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
import functools
import itertools
from types import SimpleNamespace
from typing import Any, NamedTuple
from unittest.mock import Mock, patch

from illuminator_ros.gimbal.client import MAX_COMPONENTS, MAX_GIMBALS
from illuminator_ros.gimbal.manager_state import MAX_OTHER_DEVICES
from illuminator_ros.illuminator.mount_orientation import MAX_MOUNTS, MountOrientations
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import (
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink import frame_writer
from illuminator_ros.mavlink.command_receiver import MAX_RESULTS
from illuminator_ros.mavlink.command_sender import CommandSender, MAX_TARGETS
from illuminator_ros.mavlink.component import Component, Endpoint
from illuminator_ros.mavlink.forwarding import duplicate_filter
from illuminator_ros.mavlink.forwarding.forward_queue import ForwardQueue, MAX_QUEUED
from illuminator_ros.mavlink.forwarding.forwarded_commands import MAX_COMMANDS
from illuminator_ros.mavlink.forwarding.routing_table import MAX_ROUTES
from illuminator_ros.mavlink.messages import Address, CommandLong, heartbeat, Message
from illuminator_ros.mavlink.receiver import MAX_DECODERS
from illuminator_ros.mavlink.search.listener import Listener
from illuminator_ros.mavlink.signing import MAX_STREAMS, ticks
from illuminator_ros.mavlink.statistics import MAX_SOURCES
from illuminator_ros.mavlink.transport.udp import MAX_PEERS
from illuminator_ros.mavlink.url import MemoryUrl
from illuminator_ros.payload.discovery import MAX_CANDIDATES, MAX_DEVICES, MAX_IGNORED
from illuminator_ros.payload.messages import Attitude, GimbalDeviceAttitudeStatus
from illuminator_ros.payload.requests import MAX_CALLS
from illuminator_ros.rededge.client import RedEdgeClient
from illuminator_ros.rededge.input_states import CameraSettings
from illuminator_ros.rededge.messages import CameraFeedback
from illuminator_ros.simulation import simulated
from illuminator_ros.simulation.simulated import SimulatedComponents
import pytest
from support.client import Client
from support.entries import stores
from support.fake_light import status_message
from support.frames import frame_of, LIGHT, only
from support.gimbal_manager import ManagerRig
from support.gimbals import FakeManager, Rig
from support.network import FakeSelector, Leaf, Network, Router
from support.signers import checker, signed_frame
from support.simulated_link import SimulatedLink

OURS = Address(1, 193)
# More than any bound but those of MANY.
COUNT = 300
MANY = 1500
# Smaller stores belong to one device, or hold tables of the program.
SMALL = 40
COMMAND = CommandLong(*OURS, 1000, 0, 0, 0, 0, 0, 0, 0, 0)
FEEDBACK = CameraFeedback(0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 3)
MANAGER = FakeManager(device_id=1)
ATTITUDE = GimbalDeviceAttitudeStatus(0, 0, 0, 0, (1, 0, 0, 0), 0, 0, 0, 0, 0, 0, 0)


def senders(count: int = COUNT) -> Iterator[Address]:
    """Return addresses, each of another component."""
    return (Address(2 + number // 250, 1 + number % 250) for number in range(count))


def linked(
    endpoint: Endpoint, *frames: bytes, pause: float = 0.003, **options: Any,
) -> SimulatedLink:
    """Return a link that has received frames, each from a peer of its own, with pauses (s)."""
    link = SimulatedLink(endpoint, lambda data, peer: None, **options)
    for number, frame in enumerate(frames):
        link.receive((frame, ('127.0.0.2', 1 + number)))
        link.run(pause)
    return link


def bridge(
    message: Message, *, count: int = COUNT, pause: float = 0.003, **options: Any,
) -> object:
    return linked(Client(OURS, LightSettings(), **options),
                  *(frame_of(message, 0, one) for one in senders(count)), pause=pause)


def beginnings_of_frames() -> object:
    return linked(Client(OURS, LightSettings()), *[frame_of()[:9]] * COUNT)


def signed_streams() -> object:
    frames = (signed_frame(ticks(1.7e9 + 1000.0), link_id=number % 256, source=source)
              for number, source in enumerate(senders(MANY)))
    return linked(Client(OURS, LightSettings()), *frames, signing=checker())


def own_frames() -> object:
    link = linked(Client(OURS, LightSettings()), signing=checker())
    for _ in range(3 * frame_writer.MAX_STAMPS):
        link.endpoint.outgoing.append((OURS, heartbeat(18)))
    link.run(0.1)
    return link


def requests() -> object:
    client = Client(OURS, LightSettings())
    link = linked(client, frame_of(status_message(100)))
    light = client.lights[LIGHT]
    link.ask(lambda now: [light.enable(True, now, lambda result, now: None)
                          for _ in range(COUNT)])
    return link


@patch.object(duplicate_filter, 'MAX_FRAMES', COUNT)
def forwarded(message: Message) -> object:
    """Frames between two lines of a router."""
    network = Network()
    ports = [network.port(name, has_clients=True) for name in ('first', 'second')]
    router = Router(network, ports, OURS)
    router.endpoint.receive = Mock()  # type: ignore[method-assign]
    for port in ports:
        port.wires['peer'] = lambda data: None
        port.take('peer', frame_of(heartbeat(6), 0, LIGHT))
    network.settle()
    for number, source in zip(range(2 * COUNT), itertools.cycle(senders()), strict=False):
        ports[0].take('peer', frame_of(message, number // COUNT, source))
        network._carried.clear()
    return router.lines


def waiting_frames() -> object:
    queue = ForwardQueue(Counter())
    for source in senders(MANY):
        queue.put(only(frame_of(heartbeat(6), 0, source)), 0.0)
    return queue


def commanded() -> object:
    network = Network()
    ports = [network.port(name) for name in ('first', 'second')]
    router, light = Router(network, ports, OURS), Leaf(network, ports[0], LIGHT)
    ground = Leaf(network, ports[1], Address(255, 190))
    light.send(heartbeat(44))
    for number in range(COUNT):
        ground.send(CommandLong(*LIGHT, number, 0, 0, 0, 0, 0, 0, 0, 0))
    light.received.clear()
    return router.lines


def players(message: Message) -> object:
    rig = ManagerRig()
    for source in senders():
        rig.give(source, message)
    rig.sent.clear()
    rig.events.clear()
    return rig.component


def mounts(message: Message) -> object:
    one = MountOrientations()
    for system in range(256):
        one.receive(Address(system, 1), message, 0.0)
    return one


def camera(message: Message) -> object:
    commands = CommandSender(OURS)
    return linked(Component(commands, [RedEdgeClient(commands, CameraSettings())]),
                  *(frame_of(message, 0, source) for source in senders()), mavlink_version=1)


def gimbals(*messages: Message) -> object:
    rig = Rig()
    for source in senders():
        for message in messages:
            rig.receive(source, message)
    rig.sent.clear()
    rig.events.clear()
    return rig.component


def simulator(message: Message, count: int = COUNT) -> object:
    delayed = IlluminatorBehaviour(slow=30.0)
    lights = [SimulatedIlluminator(IlluminatorProperties(behaviour=delayed))]
    return linked(SimulatedComponents(lights, 1000.0),
                  *(frame_of(message, 0, source) for source in senders(count)))


def discovered() -> object:
    channel = Network().port('port')
    port = Listener(MemoryUrl('port'), 'port', lambda: 0.0)
    port.listen(FakeSelector(), lambda url: channel)
    for source in senders():
        channel.take(('127.0.0.1', 14550), frame_of(heartbeat(6), 0, source))
    return port


def ros_requests(limit: int) -> object:
    pytest.importorskip('rclpy')
    from illuminator_ros.ros.link_call import LinkCalls

    class BusyLink(list[object]):
        call = list.append
        is_running = Mock()

    link: Any = BusyLink()
    calls = LinkCalls(link, Mock(), limit)
    for _ in range(COUNT):
        calls.ask(lambda now, answer: None, Mock(), str)
    return SimpleNamespace(link=list(link))


def monitored() -> object:
    pytest.importorskip('rclpy')
    from illuminator_ros.cli.monitor.ros_graph import Graph
    from illuminator_ros.illuminator.ros.monitor_view import VIEW
    from illuminator_ros.ros.graph import type_name
    node = Mock()
    node.get_topic_names_and_types.return_value = [
        (f'/light_{number}/{name}', [type_name(topic.type)])
        for number in range(COUNT) for name, topic in VIEW.topics.items()]
    node.get_node_names_and_namespaces.return_value = []
    node.create_subscription.return_value.handle.take_message.return_value = None
    graph = Graph(node, [VIEW], clock=lambda: 0.0)
    graph.poll()
    return graph


def log_lines() -> object:
    pytest.importorskip('rclpy')
    from illuminator_ros.ros.throttled_log import NodeLog
    lines = NodeLog(Mock(), lambda: 0.0)
    for number in range(COUNT):
        lines.info('text', f'kind {number}')
    return lines


class Row(NamedTuple):
    """
    A way to fill stores, and their bounds by their class and attribute.

    :param full: the stores that it fills up to the bound.
    :param others: stores that it fills, too.
    """

    fill: Callable[[], object]
    full: Mapping[str, int]
    others: Mapping[str, int] = {}


# Tables of the program.
NO_STORES = {'Receiver.foreign'}
FOUND = MAX_DEVICES + MAX_CANDIDATES
LINK = {
    'UdpChannel.peers': MAX_PEERS, 'RoutingTable.routes': MAX_ROUTES,
    'Receiver.streams': MAX_DECODERS, 'Traffic.sources': MAX_SOURCES}
SENT = {
    'LoopbackFilter.sent': frame_writer.MAX_FRAMES, 'CommandSender.round_trips': MAX_TARGETS,
    'CommandSender.unanswering': MAX_TARGETS, 'CommandSender.pending': FOUND,
    'CommandSender.answers': MAX_TARGETS}
STAMPS = {'LoopbackFilter.stamps': frame_writer.MAX_STAMPS}
HEARTBEATS = {'Client.heartbeats': MAX_SOURCES}
OTHERS = {'Component.heartbeats': MAX_SOURCES}
LIGHTS = {'IlluminatorClient.lights': MAX_DEVICES}
ROWS = {
    'heartbeats of lights': Row(
        functools.partial(bridge, heartbeat(44), pause=0.1),
        {'Discovery.candidates': MAX_CANDIDATES, 'Discovery.found_at': MAX_CANDIDATES},
        {**LINK, **SENT, **HEARTBEATS}),
    'heartbeats of other components': Row(
        functools.partial(bridge, heartbeat(2)), {**LINK, **HEARTBEATS}, SENT),
    'statuses': Row(
        functools.partial(bridge, status_message(100), count=MANY), {**LINK, **LIGHTS}, SENT),
    'lights that are not the target': Row(
        functools.partial(bridge, status_message(100), wanted=lambda one: False),
        {**LINK, 'Discovery.ignored': MAX_IGNORED}, SENT),
    'beginnings of frames': Row(beginnings_of_frames, {
        'Receiver.streams': MAX_DECODERS, 'Receiver.waits': MAX_DECODERS}),
    'signed streams': Row(
        signed_streams, {**LINK, 'Signing.streams': MAX_STREAMS}, {**SENT, **STAMPS, **LIGHTS}),
    'own frames': Row(own_frames, {'LoopbackFilter.sent': frame_writer.MAX_FRAMES, **STAMPS}),
    'requests to a light': Row(requests, {
        'Requests.standing': MAX_CALLS}),
    'forwarded frames': Row(
        functools.partial(forwarded, heartbeat(44)),
        {'DuplicateFilter.arrivals': COUNT, 'RoutingTable.routes': MAX_ROUTES,
         'Traffic.sources': MAX_SOURCES}),
    'forwarded commands': Row(
        commanded, {'ForwardedCommands.sent': MAX_COMMANDS},
        {'DuplicateFilter.arrivals': 2 * COUNT}),
    'frames for a slow line': Row(
        waiting_frames, {'ForwardQueue.held[]': MAX_QUEUED // len(frame_of(heartbeat(6)))}),
    'commands of players': Row(
        functools.partial(players, COMMAND), {'CommandReceiver.executed': MAX_RESULTS}),
    'heartbeats of players': Row(functools.partial(players, heartbeat(6)), OTHERS),
    'gimbal devices': Row(
        functools.partial(players, ATTITUDE), {'StateTracker.other_devices': MAX_OTHER_DEVICES}),
    'gimbals of managers': Row(
        functools.partial(gimbals, heartbeat(26), MANAGER.status(), MANAGER.information()),
        {'GimbalClient.gimbals': MAX_GIMBALS, 'GimbalClient.components': MAX_COMPONENTS},
        {**OTHERS, **SENT}),
    'mounts': Row(
        functools.partial(mounts, ATTITUDE), {'MountOrientations.mounts': MAX_MOUNTS}),
    'vehicles with mounts': Row(
        functools.partial(mounts, Attitude(*[0] * 7)), {'MountOrientations.vehicles': MAX_MOUNTS}),
    'heartbeats of cameras': Row(
        functools.partial(camera, heartbeat(30)), {**LINK, **OTHERS}, SENT),
    'feedback of cameras': Row(
        functools.partial(camera, FEEDBACK), LINK, SENT),
    'peers of the simulator': Row(
        functools.partial(simulator, heartbeat(18)),
        {**LINK, 'SimulatedComponents.peers': simulated.MAX_PEERS}, SENT),
    'delayed answers of the simulator': Row(
        functools.partial(simulator, CommandLong(*LIGHT, 405, 0, 1, 0, 0, 0, 0, 0, 0), MANY),
        {**LINK, 'SimulatedComponents.peers': simulated.MAX_PEERS,
         'SimulatedComponent.delayed': simulated.MAX_DELAYED}, SENT),
    'components of discover': Row(
        discovered, {'Listener.components': MAX_SOURCES, 'Traffic.sources': MAX_SOURCES},
        {'RoutingTable.routes': MAX_ROUTES}),
    'requests of ROS': Row(functools.partial(ros_requests, 64), {'SimpleNamespace.link': 64}),
    'devices of the monitor': Row(monitored, {'Graph.devices': 256}),
    'kinds of log lines': Row(log_lines, {'NodeLog.kinds': 256}),
}


@pytest.mark.parametrize('row', ROWS.values(), ids=ROWS)
def test_a_store_that_senders_fill_has_a_bound(row: Row) -> None:
    sizes = {name: size for name, size in stores(row.fill(), Mock).items()
             if name not in NO_STORES and not name.startswith('Mock')}
    bounds = {**row.others, **row.full}
    assert {name: sizes.get(name, 0) for name in row.full} == row.full
    assert {name: size for name, size in sizes.items()
            if size > bounds.get(name, SMALL)} == {}
