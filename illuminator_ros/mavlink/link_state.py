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

"""What others are told of a link."""

from __future__ import annotations

from dataclasses import dataclass

from .frame import DecoderCounters
from .signing import SigningCounters
from .statistics import Traffic


@dataclass(frozen=True)
class LinkEvent:
    """
    The link was opened or lost, or cannot be opened; as text it is a line for people.

    :param name: the transport, or the URL where there is none.
    :param reason: why it is not open.
    :param was_open: whether it is lost, and not just not open yet.
    """

    is_open: bool
    name: str
    reason: str = ''
    was_open: bool = False

    def __str__(self) -> str:
        if self.is_open:
            return f'link open: {self.name}'
        what = 'lost' if self.was_open else 'not open'
        return f'link {what}: {self.name}: {self.reason}; trying again'


@dataclass
class LinkState:
    """
    A link's condition, to be read from any thread.

    :param since: when it was opened or lost, on the link's clock, s.
    :param openings: how often it was opened.
    :param peers: how many have lately sent something good.
    """

    is_open: bool
    since: float
    name: str
    reason: str
    openings: int
    peers: int
    traffic: Traffic
    decoding: DecoderCounters
    signing: SigningCounters

    @property
    def failure(self) -> str:
        """Return what is not open and why, for people; '' while the link is open."""
        return '' if self.is_open else f'{self.name} is not open: {self.reason}'
