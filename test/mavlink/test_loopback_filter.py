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

"""Our own frames that return are distinguished from frames of another sender with our address."""

from illuminator_ros.mavlink.frame import Frame
from illuminator_ros.mavlink.frame_writer import FrameWriter, LoopbackFilter, MAX_FRAMES, MEMORY
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.signing import Signing, SigningMode
import pytest
from support.frames import LIGHT, only
from support.messages import STATUS

OURS = Address(1, 194)
SENT = {'source': OURS, 'sequence': 7, 'message_id': 0, 'payload': b'\x01\x02\0\0'}


@pytest.fixture
def echoes() -> LoopbackFilter:
    """Return echoes that know of one frame, sent at 100 s."""
    echoes = LoopbackFilter()
    echoes.sent(**SENT, now=100.0)
    return echoes


def frame(**changes):
    """Return the frame that was sent, as it comes in; or a slightly different one."""
    fields = {**SENT, 'payload': b'\x01\x02', **changes}
    return Frame(2, fields['sequence'], fields['source'], fields['message_id'], fields['payload'])


@pytest.mark.parametrize('after', [0.0, 0.001, MEMORY])
@pytest.mark.parametrize('payload', [b'\x01\x02', b'\x01\x02\0\0'], ids=['cut', 'whole'])
def test_what_was_sent_lately_is_an_echo(echoes, after, payload):
    assert echoes.has(frame(payload=payload), 100.0 + after)


def test_it_is_one_however_often_it_comes(echoes):
    assert echoes.has(frame(), 100.1)
    assert echoes.has(frame(), 100.2)


@pytest.mark.parametrize('changes', [
    {'sequence': 8}, {'payload': b'\x01\x03'}, {'message_id': 76}, {'source': Address(1, 195)}])
def test_what_differs_in_anything_is_of_somebody_else(echoes, changes):
    assert not echoes.has(frame(**changes), 100.1)


def test_what_comes_long_after_it_was_sent_is_of_somebody_else(echoes):
    assert not echoes.has(frame(), 100.1 + MEMORY)


def test_memory_is_bounded(echoes):
    for number in range(MAX_FRAMES):
        echoes.sent(OURS, number, 76, b'\x01', 100.0)
    assert not echoes.has(frame(), 100.1)


def test_signed_frame_that_comes_back_late_is_recognised() -> None:
    writer = FrameWriter(Signing(SigningMode.REQUIRE, bytes(range(32))))
    frame = only(writer.frame(LIGHT, STATUS, 0.0, 1.7e9))

    assert writer.is_loopback(frame, 3600.0)
