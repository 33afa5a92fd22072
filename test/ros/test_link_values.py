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

"""The values of ``illuminator: link``: each key tells what it says and nothing else."""

from __future__ import annotations

from illuminator_ros.illuminator.light import Settings
from illuminator_ros.mavlink.command import CommandCounters
from illuminator_ros.mavlink.frame import DecoderCounters
from illuminator_ros.mavlink.link_state import LinkState
from illuminator_ros.mavlink.messages import heartbeat, MavType
from illuminator_ros.mavlink.signing import SigningCounters
from illuminator_ros.mavlink.statistics import SequenceCounter, Traffic
from illuminator_ros.ros.diagnostics import link_status
import pytest
from support.client import Client
from support.fake_light import LIGHT
from support.live_link import BRIDGE

STARTED, SINCE, NOW = 100.0, 150.0, 200.0
# s before NOW from which on the rates count.
BEFORE = 10.0


@pytest.fixture(scope='module')
def values() -> dict[str, str]:
    """Return what is told of a link on which no two things are alike."""
    controller = Client(BRIDGE, Settings())
    controller.receive(LIGHT, heartbeat(MavType.ILLUMINATOR), NOW)
    controller.sender.counters = CommandCounters(sent=41, resent=42, unanswered=43)
    for hundredths in range(100):
        controller.sender.round_trip(LIGHT).add(hundredths / 100)
    traffic = Traffic(bytes_received=100, bytes_sent=200, sources={
        LIGHT: SequenceCounter(received=11, lost=12, duplicate=13, reordered=14)})
    state = LinkState(
        True, SINCE, 'udp x', '', 5, 6, traffic,
        DecoderCounters(frames=21, crc_errors=22, unknown_ids=23, skipped_bytes=24),
        SigningCounters(good=31, bad=32, replayed=33, unsigned=34, unchecked=35))

    def read(now: float) -> dict[str, str]:
        status = link_status('node', 'url', state, controller, controller.client,
                             controller.lights[LIGHT],
                             now=now, started=STARTED)
        return {value.key: value.value for value in status.values}

    read(NOW - BEFORE)
    traffic.bytes_received += 1000
    traffic.bytes_sent += 2000
    traffic.frames_sent, traffic.frames_dropped = 15, 16
    return read(NOW)


@pytest.mark.parametrize(('key', 'value'), {
    'url': 'url', 'open': 'true', 'since_s': '50', 'openings': '5', 'peers': '6', 'lights': '1',
    'frames_received': '11', 'frames_sent': '15', 'frames_dropped': '16',
    'bytes_received': '1100', 'bytes_sent': '2200',
    'bytes_received_per_s': '100', 'bytes_sent_per_s': '200',
    'crc_errors': '22',
    'frames_lost': '12', 'frames_duplicate': '13', 'frames_reordered': '14',
    # Of the last 64: 0.36 s to 0.99 s.
    'round_trip_p50_ms': '680', 'round_trip_p95_ms': '960',
    'commands_sent': '41', 'commands_resent': '42', 'commands_unanswered': '43',
    'signatures_good': '31', 'signatures_bad': '32', 'signatures_replayed': '33',
    'unsigned_frames': '34', 'signatures_unchecked': '35',
}.items())
def test_it_tells(values: dict[str, str], key: str, value: str) -> None:
    assert values[key] == value
