# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Address conflicts over real UDP, and our own frames that a router sends back."""

from __future__ import annotations

from illuminator_ros.mavlink.dialect import mavlink
from support.frames import heartbeat_frame
from support.live_link import BRIDGE, Bridge, Run
from support.open_channel import bound_socket
from support.waiting import eventually


def test_own_frames_that_return_are_no_address_conflict_but_those_of_another_sender_are(
        run: Run) -> None:
    with bound_socket() as router:
        bridge = run(Bridge(f'udpout://127.0.0.1:{router.getsockname()[1]}'))
        for _ in range(3):
            data, sender = router.recvfrom(2048)
            router.sendto(data, sender)
        router.recv(2048)
        assert not bridge.ask(bridge.endpoint.address_conflict)
        router.sendto(heartbeat_frame(BRIDGE, data[4] + 100 & 0xFF,
                                      mavlink.MAV_TYPE_ONBOARD_CONTROLLER),
                      sender)
        eventually(lambda: bridge.ask(bridge.endpoint.address_conflict), 'an address conflict')


def test_bridges_that_start_together_begin_at_different_sequence_numbers(run: Run) -> None:
    firsts = set()
    with bound_socket() as router:
        for _ in range(8):
            run(Bridge(f'udpout://127.0.0.1:{router.getsockname()[1]}'))
        for _ in range(8):
            firsts.add(router.recv(2048)[4])
    assert len(firsts) > 1
