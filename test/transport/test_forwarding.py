# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Frames between the lines of one process, and through networks of several."""

from __future__ import annotations

from collections.abc import Callable
import itertools
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.mavlink.dialect import CRC_EXTRA, mavlink
from illuminator_ros.mavlink.errors import ChannelLost
from illuminator_ros.mavlink.forwarding.duplicate_filter import MEMORY
from illuminator_ros.mavlink.forwarding.routing_table import EXPIRY
from illuminator_ros.mavlink.line import ANNOUNCE_INTERVAL, SILENCE
from illuminator_ros.mavlink.messages import Address, CommandLong, heartbeat, Message
from illuminator_ros.mavlink.signing import Signing, SigningMode
from illuminator_ros.mavlink.url import parse_url
import pytest
from support.frames import Codec, frame_of, only, raw_v2, spoilt
from support.live_link import LiveLink, Run
from support.network import Leaf, Network, Router
from support.open_channel import bound_socket, has_nothing
from support.ports import free_port

OWN, LIGHT, GROUND = Address(1, 193), Address(1, 243), Address(255, 190)
ALIVE = heartbeat(18)


def to(target: Address) -> CommandLong:
    return CommandLong(target.system, target.component, 512, 0, 0, 0, 0, 0, 0, 0, 0)


def frame_source(data: bytes) -> Address:
    return only(data).source


class Pair:
    """A bridge with a light on its first line and a ground station on its second one."""

    def __init__(self, **options: Any) -> None:
        self.network = Network()
        self.ports = [self.network.port(name) for name in ('first', 'second')]
        self.router = Router(self.network, self.ports, OWN, **options)
        self.light = Leaf(self.network, self.ports[0], LIGHT)
        self.ground = Leaf(self.network, self.ports[1], GROUND)

    def meet(self) -> None:
        """Let both be heard, and forget what they have received."""
        for leaf in (self.light, self.ground):
            leaf.send(ALIVE)
        self.light.received.clear()
        self.ground.received.clear()


# Networks: for each router, the router before it that it is connected with; whether lines of
# routers have a server; the router and the server or line of each leaf.
routers = st.integers(0, 3).flatmap(
    lambda count: st.tuples(*(st.integers(0, before) for before in range(count))))
leaves = st.lists(st.tuples(st.integers(0, 3), st.booleans(), st.integers(1, 2)),
                  min_size=2, max_size=6)


class Mesh:
    """
    A network of routers, each with a server line and a line for each neighbour and each leaf.

    :param links: pairs of connected routers.
    :param places: of each leaf: its router, whether it is a client of the server, its system.
    """

    def __init__(
        self, count: int, links: list[tuple[int, int]], places: list[tuple[int, bool, int]],
    ) -> None:
        self.network = Network()
        servers = [self.network.port(f'server {index}', has_clients=True)
                   for index in range(count)]
        ports = [[server] for server in servers]
        for one, other in links:
            ends = [self.network.port(f'{one}-{other}') for _ in range(2)]
            self.network.connect(*ends)
            ports[one].append(ends[0])
            ports[other].append(ends[1])
        self.leaves = []
        for number, (at, is_client, system) in enumerate(places):
            port = servers[at % count]
            if not is_client:
                port = self.network.port(f'leaf {number}')
                ports[at % count].append(port)
            self.leaves.append(Leaf(self.network, port, Address(system, 10 + number)))
        # One line alone would not forward.
        for index, some in enumerate(ports):
            some.append(self.network.port(f'unused {index}'))
        self.routers = [Router(self.network, some, Address(100 + index, 193))
                        for index, some in enumerate(ports)]

    def receivers(self, frame: bytes) -> list[int]:
        """Return how often each leaf has received a frame."""
        return [leaf.received.count(frame) for leaf in self.leaves]

    def check(self, draw: Callable[[int], int]) -> None:
        """Each frame reaches each component that it is for once, and no other one."""
        for sender in self.leaves:
            frame = sender.send(ALIVE)
            assert self.receivers(frame) == [int(leaf is not sender) for leaf in self.leaves]
            assert all(len([one for one in router.endpoint.heard if one[0] == sender.address]) == 1
                       for router in self.routers)
        for sender in self.leaves:
            target = self.leaves[draw(len(self.leaves))]
            frame = sender.send(to(target.address))
            assert self.receivers(frame) == [
                int(leaf is target and leaf is not sender) for leaf in self.leaves]
            frame = sender.send(to(Address(target.address.system, 0)))
            assert self.receivers(frame) == [
                int(leaf.address.system == target.address.system and leaf is not sender)
                for leaf in self.leaves]
        for index, router in enumerate(self.routers):
            router.send(to(self.leaves[0].address))
            self.network.settle()
            received = [leaf.codec.decoder.feed(b''.join(leaf.received)) for leaf in self.leaves]
            own = Address(100 + index, 193)
            assert [sum(frame.source == own for frame in some) for some in received] == [
                int(leaf is self.leaves[0]) for leaf in self.leaves]


@given(routers, leaves, st.randoms(use_true_random=False))
def test_each_frame_reaches_each_component_that_it_is_for_exactly_once(
        before: tuple[int, ...], places: list[tuple[int, bool, int]], random: Any) -> None:
    mesh = Mesh(len(before) + 1, [(one, index + 1) for index, one in enumerate(before)], places)
    mesh.check(random.randrange)


@given(routers, leaves, st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), min_size=1,
                                 max_size=3), st.randoms(use_true_random=False))
def test_so_it_does_in_networks_with_loops_where_each_link_carries_a_bounded_number_of_copies(
        before: tuple[int, ...], places: list[tuple[int, bool, int]],
        loops: list[tuple[int, int]], random: Any) -> None:
    count = len(before) + 1
    links = [(one, index + 1) for index, one in enumerate(before)]
    links += [(one % count, other % count) for one, other in loops]
    mesh = Mesh(count, links, places)
    mesh.check(random.randrange)

    mesh.leaves[0].send(ALIVE)
    # Each end of a link carries a frame once, and each leaf gets one.
    assert mesh.network.hops <= 2 * len(links) + len(places)


def test_a_frame_is_forwarded_byte_for_byte_and_our_own_component_hears_it() -> None:
    pair = Pair()
    signer = Signing(SigningMode.SIGN, bytes(32))
    frames = [frame_of(ALIVE, 7, LIGHT), frame_of(ALIVE, 8, LIGHT, version=1),
              signer.sign(frame_of(ALIVE, 9, LIGHT, signed=True), 1.7e9),
              raw_v2(0, bytes(9) + b'\1' * 20, compat=0x5A, source=LIGHT)]
    pair.light.send_bytes(b''.join(frames))
    assert pair.ground.received == frames
    assert [source for source, _ in pair.router.endpoint.heard] == [LIGHT] * 4
    assert pair.light.received == []


@given(st.lists(st.one_of(
    st.binary(max_size=60), st.just(frame_of(ALIVE, 1, LIGHT)),
    st.builds(lambda at: spoilt(frame_of(to(GROUND), 2, LIGHT), at), st.integers(1, 40)),
    st.builds(lambda id_, payload: raw_v2(id_, payload, crc_extra=0, source=LIGHT),
              st.integers(0, 70000).filter(lambda id_: CRC_EXTRA.get(id_) != 0),
              st.binary(max_size=255))), max_size=12))
def test_bytes_cross_only_in_frames_with_a_right_checksum(pieces: list[bytes]) -> None:
    pair = Pair()
    pair.light.send_bytes(b''.join(pieces))
    decoder = Codec().decoder
    for data in pair.ground.received:
        assert [frame.data for frame in decoder.feed(data)] == [data]


KEY, OTHER_KEY = bytes(32), bytes(31) + b'\1'
UNSIGNED, RIGHT, WRONG, REPLAYED = 'unsigned', 'right', 'wrong', 'replayed'


def frames_of(kind: str) -> list[bytes]:
    """Return a frame of a kind, after those that make it one."""
    if kind == UNSIGNED:
        return [frame_of(ALIVE, 0, LIGHT)]
    signer = Signing(SigningMode.SIGN, OTHER_KEY if kind == WRONG else KEY)
    frames = [signer.sign(frame_of(ALIVE, number, LIGHT, signed=True), 1.7e9)
              for number in range(2)]
    return [frames[1], frames[0]] if kind == REPLAYED else frames[:1]


@pytest.mark.parametrize(('kind', 'modes'), [
    (UNSIGNED, {'off', 'sign'}), (RIGHT, {'off', 'sign', 'require'}), (WRONG, {'off'}),
    (REPLAYED, {'off'})])
@pytest.mark.parametrize('mode', SigningMode)
def test_a_frame_is_forwarded_if_its_signature_is_accepted(
        mode: SigningMode, kind: str, modes: set[str]) -> None:
    pair = Pair(signing=Signing(mode, KEY))
    *before, frame = frames_of(kind)
    for one in (*before, frame):
        pair.light.send_bytes(one)
    assert pair.ground.received == [*before, *([frame] if mode.value in modes else [])]
    pair.router.send(ALIVE)
    pair.network.settle()
    own = [leaf.codec.decoder.feed(leaf.received[-1])[0] for leaf in (pair.light, pair.ground)]
    assert own[0] == own[1]
    assert (own[0].signature is not None) == (mode is not SigningMode.OFF)


@pytest.mark.parametrize('signing', [None, Signing(SigningMode.REQUIRE, KEY)])
def test_a_copy_over_another_line_is_neither_forwarded_nor_handled_nor_a_replay(
        signing: Signing | None) -> None:
    pair = Pair(signing=signing)
    frame = frames_of(RIGHT)[0]
    pair.light.send_bytes(frame)
    pair.ground.send_bytes(frame)
    assert (pair.ground.received, pair.light.received) == ([frame], [])
    assert len(pair.router.endpoint.heard) == 1
    assert pair.router.lines.copies(pair.network.now) == {(0, 1): 1}
    if signing:
        assert (signing.counters.good, signing.counters.replayed) == (1, 0)
    # The copy shows that the light can be reached over the second line, too.
    pair.router.ports[0].send = _broken  # type: ignore[method-assign]
    pair.router.send(ALIVE)
    assert pair.router.endpoint.lost == [[]]


def _broken(frames: object, peers: object) -> None:
    raise ChannelLost('unplugged')


def test_a_frame_of_mavlink_2_is_not_sent_on_lines_of_mavlink_1() -> None:
    pair = Pair(version=1)
    pair.light.send_bytes(frame_of(ALIVE, 0, LIGHT))
    pair.light.send_bytes(frame := frame_of(ALIVE, 1, LIGHT, version=1))
    assert pair.ground.received == [frame]
    assert len(pair.router.endpoint.heard) == 2


@pytest.mark.parametrize('message', [
    to(OWN), mavlink.MAVLink_setup_signing_message(1, 243, [7] * 32, 0)])
def test_a_frame_for_us_and_a_signing_key_are_not_forwarded(message: Message) -> None:
    pair = Pair()
    pair.router.send(ALIVE)
    pair.meet()
    pair.ground.send(message)
    assert pair.light.received == []


def test_frames_of_another_sender_with_our_address_are_forwarded_and_ours_are_not() -> None:
    pair = Pair()
    for _ in range(10):
        pair.router.send(ALIVE)
    pair.network.settle()
    ours = pair.light.received[-1]
    pair.meet()
    other = pair.ground.send(to(LIGHT), source=OWN)
    assert pair.light.received == [other]
    # A slow ring returns ours.
    for after in (0.0, 2.0, 2.9):
        pair.network.now += after
        pair.ground.send_bytes(ours)
    assert pair.light.received == [other]
    assert pair.router.lines.copies(pair.network.now) == {(-1, 1): 2}


@pytest.mark.parametrize('same_line', [False, True])
@pytest.mark.parametrize('delay', [0.01, 0.6, 2.4, 4.9])
def test_a_frame_passes_once_through_a_ring_that_is_slower_than_its_traffic(
        delay: float, same_line: bool) -> None:
    network = Network()
    ports = [network.port(name, has_clients=True) for name in ('first', 'second')]
    router, heard = Router(network, ports, OWN), []
    # The rest of the ring repeats each frame at its other end; one server has both ends, or not.
    carried: list[tuple[float, bytes, str]] = []
    ends = {'left': ports[0], 'right': ports[0 if same_line else 1]}
    for end, port in ends.items():
        def carry(frame: bytes, end: str = end) -> None:
            carried.append((network.now, frame, end))

        port.wires[end] = carry
    for number in range(3):
        frame = frame_of(ALIVE, number, LIGHT)
        carried += [(network.now, frame, 'left'), (network.now, frame, 'right')]
    while carried and network.now < 1060.0:
        at, frame, end = carried.pop(0)
        network.now = at + delay
        other = 'right' if end == 'left' else 'left'
        heard.append(frame)
        ends[other].take(other, frame)
        network.settle()
    assert len(heard) == 9
    lines = {(0, 0)} if same_line else {(1, 0), (0, 1)}
    assert set(router.lines.copies(network.now)) <= lines
    assert len(router.endpoint.heard) == 3


def test_equal_frames_of_one_sender_are_each_forwarded() -> None:
    pair = Pair()
    frame = frame_of(ALIVE, 0, LIGHT)
    for _ in range(3):
        pair.light.send_bytes(frame)
    assert pair.ground.received == [frame] * 3
    assert len(pair.router.endpoint.heard) == 3
    assert pair.router.lines.copies(pair.network.now) == {}


def test_a_lost_line_takes_only_the_components_that_are_heard_on_no_other_one() -> None:
    pair = Pair()
    both = Address(1, 1)
    pair.meet()
    pair.light.send(ALIVE, source=both)
    pair.network.now += MEMORY
    pair.ground.send(ALIVE, source=both)
    pair.ports[0].send = _broken  # type: ignore[method-assign]
    pair.router.send(ALIVE)
    assert pair.router.endpoint.lost == [[LIGHT]]
    assert [line.status.state.is_open for line in pair.router.lines] == [False, True]
    pair.network.settle()
    assert frame_source(pair.ground.received[-1]) == OWN

    pair.ports[1].send = _broken  # type: ignore[method-assign]
    pair.router.send(ALIVE)
    assert pair.router.endpoint.lost == [[LIGHT], None]


def test_a_component_that_moves_to_another_line_is_followed() -> None:
    pair = Pair()
    pair.meet()
    pair.network.now += 1
    moved = Leaf(pair.network, pair.ports[1], LIGHT, pair.light.codec)
    pair.ports[1].has_clients = True
    moved.send(ALIVE)
    pair.light.received.clear()
    moved.received.clear()
    for after, old in ((1.0, 1), (EXPIRY - 1, 0)):
        pair.network.now += after
        pair.router.send(to(LIGHT))
        pair.network.settle()
        assert (len(pair.light.received), len(moved.received)) == (old, 1)
        moved.received.clear()
        pair.light.received.clear()


def test_a_command_reaches_a_light_that_sends_from_another_port_than_it_listens_on(
        run: Run) -> None:
    light_port, near, far = free_port(), free_port(), free_port()
    with bound_socket() as sender, bound_socket(port=light_port) as light, (
            bound_socket()) as ground:
        link = run(LiveLink(f'udp://127.0.0.1:{near}@127.0.0.1:{light_port}', further={
            'far': parse_url(f'udpin://127.0.0.1:{far}')}))
        link.wait_open(2)
        sender.sendto(frame_of(ALIVE, 0, LIGHT), ('127.0.0.1', near))
        ground.sendto(frame_of(ALIVE, 0, GROUND), ('127.0.0.1', far))
        link.endpoint.wait_heard(2)
        command = frame_of(to(LIGHT), 1, GROUND)
        ground.sendto(command, ('127.0.0.1', far))
        while command not in light.recv(65536):
            pass
        assert has_nothing(sender)


def test_a_silent_line_beside_a_live_one_gets_our_last_heartbeat_again() -> None:
    pair = Pair()
    pair.router.send(ALIVE)
    pair.meet()
    pair.router.line(1)
    pair.network.now += SILENCE
    pair.light.send(ALIVE)
    pair.ground.received.clear()
    for after, count in ((0.0, 1), (ANNOUNCE_INTERVAL - 0.01, 1), (0.01, 2)):
        pair.network.now += after
        pair.router.endpoint.schedule.run(pair.network.now)
        pair.network.settle()
        assert [frame_source(frame) for frame in pair.ground.received] == [OWN] * count
    assert pair.light.received == []


def test_silent_lines_together_announce_us_as_often_as_one() -> None:
    pair = Pair()
    announced: list[float] = []
    pair.router.endpoint.link_opened = announced.append  # type: ignore[assignment, method-assign]
    pair.network.now += ANNOUNCE_INTERVAL / 3
    # From now on both lines are silent, at other times.
    pair.light.send(ALIVE)
    announced.clear()
    for _ in range(200):
        pair.network.now += ANNOUNCE_INTERVAL / 10
        pair.router.endpoint.schedule.run(pair.network.now)
    assert len(announced) > 10
    assert min(after - before for before, after in itertools.pairwise(announced)) >= (
        ANNOUNCE_INTERVAL)
