# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The connection state of a link, and its snapshot for other threads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

from .frame import DecoderCounters
from .signing import SigningCounters
from .statistics import TrafficSnapshot

# Different reasons for not opening that are reported before the first opening.
MAX_REASONS = 16


class LinkState(Enum):
    """
    The states of a link.

    ::

        OPENING -- opened --> UNPROVEN -- proved --> OPEN -- closed --> LOST -- opened --> UNPROVEN
                                  | closed
                                  v
                              RETRYING -- opened --> DOUBTFUL -- proved --> OPEN

    A transport is proved by a frame, or by staying open for a time. An unproven transport counts
    as open, but not if it follows another unproven one: a TCP server that closes each connection
    is not a link.
    """

    OPENING = 'opening'
    UNPROVEN = 'unproven'
    OPEN = 'open'
    LOST = 'lost'
    RETRYING = 'retrying'
    DOUBTFUL = 'doubtful'
    STOPPED = 'stopped'

    @property
    def is_open(self) -> bool:
        """Whether the link counts as open."""
        return self in (LinkState.UNPROVEN, LinkState.OPEN)


class LinkInput(Enum):
    """The inputs that change the state of a link."""

    OPENED = 'opened'
    PROVED = 'proved'
    CLOSED = 'closed'
    STOPPED = 'stopped'


# Inputs that are not here leave the state as it is.
TRANSITIONS: dict[tuple[LinkState, LinkInput], LinkState] = {
    (LinkState.OPENING, LinkInput.OPENED): LinkState.UNPROVEN,
    (LinkState.LOST, LinkInput.OPENED): LinkState.UNPROVEN,
    (LinkState.RETRYING, LinkInput.OPENED): LinkState.DOUBTFUL,
    (LinkState.UNPROVEN, LinkInput.PROVED): LinkState.OPEN,
    (LinkState.DOUBTFUL, LinkInput.PROVED): LinkState.OPEN,
    (LinkState.OPENING, LinkInput.CLOSED): LinkState.RETRYING,
    (LinkState.LOST, LinkInput.CLOSED): LinkState.RETRYING,
    (LinkState.UNPROVEN, LinkInput.CLOSED): LinkState.RETRYING,
    (LinkState.DOUBTFUL, LinkInput.CLOSED): LinkState.RETRYING,
    (LinkState.OPEN, LinkInput.CLOSED): LinkState.LOST,
    **{(state, LinkInput.STOPPED): LinkState.STOPPED for state in LinkState},
}


@dataclass(frozen=True)
class LinkEvent:
    """
    The link was opened or lost, or cannot be opened; as text it is a line for people.

    :param name: the transport, or the URL where there is none.
    :param reason: why it is not open.
    :param was_open: whether it was open before.
    :param label: the name of the line while there is no transport.
    """

    is_open: bool
    name: str
    reason: str = ''
    was_open: bool = False
    label: str = field(default='', compare=False)

    def __str__(self) -> str:
        if self.is_open:
            return f'link open: {self.name}'
        what = 'lost' if self.was_open else 'not open'
        return f'link {what}: {self.name}: {self.reason}; trying again'


class LinkSnapshot(NamedTuple):
    """
    A link at one moment; it never changes, so any thread may read it.

    :param since: when it was opened or lost, on the link's clock, s.
    :param openings: how often it was opened.
    :param peers: how many have sent an authenticated frame within 10 s.
    :param forwarded: frames of others that were sent, or wait to be sent, over this line.
    :param not_forwarded: frames of others that were then replaced or dropped, by message id.
    :param silence: why no frame comes over a serial port, for people; '' if that is unknown.
    """

    state: LinkState
    since: float
    name: str
    reason: str
    openings: int
    peers: int
    traffic: TrafficSnapshot
    decoding: DecoderCounters
    signing: SigningCounters
    forwarded: int
    not_forwarded: Mapping[int, int]
    silence: str = ''

    @property
    def is_open(self) -> bool:
        """Whether the link counts as open."""
        return self.state.is_open

    @property
    def failure(self) -> str:
        """Return why the link is not open, for people; '' while it is."""
        return '' if self.is_open else f'{self.name} is not open: {self.reason}'


class LinkStatus:
    """
    The state of a link, and the events that must be reported.

    :ivar label: the name of the link while there is no transport.
    :ivar since: when it was opened or lost, s.
    :ivar reason: why it is not open, '' where it is.
    :ivar openings: how often it was opened.
    :ivar events: openings and losses that must be reported.
    """

    def __init__(self, label: str, now: float) -> None:
        self.state = LinkState.OPENING
        self.since = now
        self.reason = 'not opened yet'
        self.openings = 0
        self.label = label
        self.events: list[LinkEvent] = []
        self._reasons: set[str] = set()

    def transition(self, input_: LinkInput, now: float, name: str = '', reason: str = '') -> None:
        """Change the state; ``reason`` says why a transport was closed."""
        was_open = self.state.is_open
        self.state = TRANSITIONS.get((self.state, input_), self.state)
        if self.state.is_open and not was_open:
            self.since, self.reason = now, ''
            self.openings += 1
            self.events.append(LinkEvent(True, name, label=self.label))
        elif self.state is LinkState.STOPPED:
            self.since, self.reason = now, 'stopped'
        elif was_open and not self.state.is_open:
            self.since, self.reason = now, reason
            self.events.append(LinkEvent(False, name, reason, True, self.label))
        elif input_ is LinkInput.CLOSED:
            self.failed(reason)

    def failed(self, reason: str) -> None:
        """Note why a transport could not be opened."""
        self.reason = reason
        # After the first opening only losses and openings are reported.
        if reason not in self._reasons and len(self._reasons) < MAX_REASONS and not self.openings:
            self._reasons.add(reason)
            self.events.append(LinkEvent(False, self.label, reason, label=self.label))
