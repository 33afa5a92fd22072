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

"""Good frames found in a stream with 0 to 40 bytes of noise between them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import random

from illuminator_ros.mavlink.frame import Decoder
from pymavlink.dialects.v20 import ardupilotmega

from ..rig import Bench
from ..rows import at_most, one, Row
from ..traffic import COMMON, frames

MOST_NOISE = 40
# Bytes of one read.
PIECE = 512
# Longer than any frame, so that the parser waits for no further bytes at the end.
END = bytes(300)


def measure(bench: Bench) -> Iterator[Row]:
    """Give both parsers the same stream."""
    good = frames(COMMON, bench.amount(20_000, 200))
    draw = random.Random('noise')
    stream = b''.join(draw.randbytes(draw.randint(0, MOST_NOISE)) + frame for frame in good) + END
    pieces = [stream[at:at + PIECE] for at in range(0, len(stream), PIECE)]
    decoder = Decoder()
    ours = Counter((frame.message_id, frame.sequence, frame.payload)
                   for piece in pieces for frame in decoder.feed(piece))
    parser = ardupilotmega.MAVLink(None)
    parser.robust_parsing = True
    theirs = Counter(bytes(message.get_msgbuf()) for piece in pieces
                     for message in parser.parse_buffer(piece) or [])
    wanted = Counter((frame[7] | frame[8] << 8 | frame[9] << 16, frame[4], frame[10:-2])
                     for frame in good)
    # A frame that noise happens to form must not count as recovered.
    missing, theirs_missing = (wanted - ours).total(), (Counter(good) - theirs).total()
    yield Row('good frames recovered from noise', '%',
              one(100 * (1 - missing / len(good))),
              {"pymavlink's parser": one(100 * (1 - theirs_missing / len(good)))},
              [at_most(missing, 0, 'frames missing')],
              f'{len(good):,} frames, 0 to {MOST_NOISE} bytes between them')
