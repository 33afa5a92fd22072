# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A line: one connection URL with its transport, its state, and the frames that it carries."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
import contextlib
import copy
import functools
import logging
import math
import selectors
import threading
from typing import Protocol

from .connector import Connector
from .frame import Frame
from .link_state import LinkInput, LinkSnapshot, LinkState, LinkStatus
from .link_thread import FaultLog
from .messages import Address
from .receiver import Receiver
from .retries import RESOURCE
from .schedule import Schedule
from .search.silent_port import SilentPort
from .transport import Channel, Peer
from .url import Url

# s; a channel that stays open for this time is proved without a frame.
PROOF_TIME = 1.0
# s without a frame from any peer until the endpoint announces itself again, longer than the
# interval of heartbeats; and s between these announcements. A router that has restarted forwards
# nothing to us until it has heard us.
SILENCE = 1.5
ANNOUNCE_INTERVAL = 0.25

# Each frame in a line, at DEBUG, with the ``address`` of the other component.
_frame_log = logging.getLogger('illuminator_ros')


class LineUser(Protocol):
    """The user of a line, which the line calls in the thread that waits with the selector."""

    @property
    def is_behind(self) -> bool:
        """Whether it has not taken all received frames yet: no more must be read."""

    def opened(self, now: float) -> None:
        """Note that a line can carry messages, or that a new peer may receive them."""

    def lost(self, heard: Sequence[Address], reason: str, now: float) -> None:
        """
        Note that a line is closed; it opens again by itself.

        :param heard: the components that were heard over it.
        """

    def silent(self, line: Line, now: float) -> None:
        """Note that no peer is heard over an open line; repeated."""

    def behind(self, line: Line, peer: Peer, now: float) -> None:
        """Note that the signing clock of a sender that is not a peer is behind."""

    def receive(
        self, line: Line, peer: Peer, frames: Sequence[Frame], now: float,
    ) -> None:
        """Take accepted frames of a peer, of which all may be of messages that only count."""


class Line:
    """
    Opens a connection URL again and again, and carries frames.

    All methods but :meth:`stop` are for the thread that waits with the selector.

    :param label: its name while there is no transport.
    :param call: calls a function in that thread, given the time, s; callable from any thread.
    :param opener: see :class:`~.connector.Connector`.
    """

    def __init__(
        self, url: Url, user: LineUser, schedule: Schedule, receiver: Receiver, *,
        label: str, faults: FaultLog,
        selector: selectors.BaseSelector, call: Callable[[Callable[[float], None]], None],
        clock: Callable[[], float], opener: Callable[[threading.Event], Channel] | None = None,
    ) -> None:
        self.status = LinkStatus(label, clock())
        self.receiver = receiver
        self._forwarded = 0
        # Frames of others that were replaced or dropped on channels that are closed.
        self._not_forwarded: Counter[int] = Counter()
        self._user = user
        self._faults = faults
        self._selector = selector
        self._clock = clock
        self._connector = Connector(
            url, lambda outcome: call(functools.partial(self._connector_reports, outcome)),
            opener=opener)
        self._schedule = schedule
        self._channel: Channel | None = None
        self._watch = functools.partial(SilentPort, call=call)
        self._silent: SilentPort | None = None
        schedule.at(self._connect, -math.inf)

    @property
    def is_open(self) -> bool:
        """Return whether there is a channel."""
        return self._channel is not None

    @property
    def name(self) -> str:
        """Return the name of the channel, of the line while there is none."""
        return self._channel.name if self._channel else self.status.label

    @property
    def silence(self) -> str:
        """Return why no frame comes over an open serial port, '' if that is unknown."""
        return self._silent.reason if self._silent else ''

    def stop(self) -> None:
        """Open nothing any more; callable from any thread."""
        self._connector.stop()

    def snapshot(self, now: float) -> LinkSnapshot:
        """Return the line at this moment; the counters of signing are of all lines."""
        status, receiver, channel = self.status, self.receiver, self._channel
        return LinkSnapshot(
            status.state, status.since, self.name,
            status.reason, status.openings, receiver.routes.peer_count(now),
            receiver.traffic.snapshot(now), copy.copy(receiver.counters),
            copy.copy(receiver.signing.counters),
            self._forwarded,
            self._not_forwarded + channel.not_forwarded if channel else self._not_forwarded,
            self.silence)

    def opened(self, channel: Channel, now: float) -> None:
        """Use a channel from now on."""
        self._channel = channel
        self.receiver.leads_to = channel.leads_to
        self._silent = self._watch(channel.serial, channel) if channel.serial else None
        self._schedule.at(self._prove, now + PROOF_TIME)
        self._schedule.at(self._announce, now + ANNOUNCE_INTERVAL)
        try:
            channel.register(self._selector, self._serve)
        except (OSError, ValueError) as error:
            self._lost(OSError(f'cannot wait for {channel.name}: {error}'))
            return
        self._user.opened(now)
        # Sending the first heartbeat may already have failed.
        if self._channel is channel:
            self.status.transition(LinkInput.OPENED, now, channel.name)

    def peers(self, now: float) -> Sequence[Peer]:
        """Return all peers, none without a channel."""
        return self._channel.peers(now) if self._channel else ()

    def others(self, peer: Peer, now: float) -> Sequence[Peer]:
        """Return the peers that do not hear a peer."""
        channel = self._channel
        if channel is None or not channel.has_clients:
            return ()
        return [one for one in channel.peers(now) if one != peer]

    def write(self, frames: Sequence[bytes], peers: Sequence[Peer], now: float) -> None:
        """Send our frames to some of the peers, ahead of forwarded frames."""
        channel, traffic = self._channel, self.receiver.traffic
        if channel is None or not frames:
            return
        dropped, size = channel.dropped, sum(map(len, frames))
        try:
            channel.send(frames, peers)
        except OSError as error:
            self._lost(error)
            return
        channel.free_at = max(now, channel.free_at) + size / channel.rate
        traffic.frames_dropped += channel.dropped - dropped
        traffic.frames_sent += len(frames) * len(peers)
        traffic.bytes_sent += size * len(peers)

    def forward(self, frames: Sequence[Frame], peers: Sequence[Peer], now: float) -> None:
        """Send frames of others to some of the peers, when the line has room."""
        if self._channel is None:
            return
        try:
            self._channel.forward(frames, peers, now)
        except OSError as error:
            self._lost(error)
            return
        self._forwarded += len(frames) * len(peers)
        self._schedule.at(self._forward_more, self._channel.forward_due)

    @property
    def free_at(self) -> float:
        """Return when our next frames can be sent without waiting, infinity if that is unknown."""
        channel = self._channel
        return math.inf if channel is None or channel.is_waiting else channel.free_at

    def pause(self, now: float) -> float:
        """Return for how long to let foreign frames collect before the next read, s."""
        if self._channel is None or self._channel.more:
            return 0.0
        return self.receiver.pause(now)

    def close(self) -> None:
        """Close the channel."""
        channel, self._channel, self._silent = self._channel, None, None
        if channel is None:
            return
        for key in list(self._selector.get_map().values()):
            if key.data == self._serve:
                self._selector.unregister(key.fileobj)
        with contextlib.suppress(OSError):
            channel.close()
        self._not_forwarded += channel.not_forwarded
        for call in self._prove, self._announce, self._give_up, self._forward_more:
            self._schedule.at(call, math.inf)
        self.receiver.clear()

    # Calls of the schedule

    def _connect(self, now: float) -> None:
        try:
            self._connector.start()
        except RuntimeError as error:
            self.status.failed(str(error))
            self._schedule.at(self._connect, now + RESOURCE.first)

    def _prove(self, now: float) -> None:
        """Note that the channel has lasted, so the next try after its loss is immediate."""
        self._connector.backoff.succeeded()
        self.status.transition(LinkInput.PROVED, now, self.name)

    def _announce(self, now: float) -> None:
        """Have the user announce itself to a peer that is not heard."""
        self._schedule.at(self._announce, now + ANNOUNCE_INTERVAL)
        self._user.silent(self, now)
        if self._silent:
            self._silent.poll(self.receiver.traffic.frames_received, now)

    def _give_up(self, now: float) -> None:
        """Take the frames behind beginnings of frames that have waited too long."""
        for peer, frames in self.receiver.give_up(now):
            if self._channel is not None:
                self._handle(self._channel, peer, frames, now)
        self._schedule.at(self._give_up, self.receiver.due)

    def _forward_more(self, now: float) -> None:
        """Send frames of others that have waited."""
        if self._channel is None:
            return
        try:
            self._channel.forward_more(now)
        except OSError as error:
            self._lost(error)
        else:
            self._schedule.at(self._forward_more, self._channel.forward_due)

    def _connector_reports(self, outcome: Channel | str | None, now: float) -> None:
        if isinstance(outcome, str):
            self.status.failed(outcome)
        elif outcome is None:
            self._schedule.at(self._connect, now + RESOURCE.first)
        else:
            self.opened(outcome, now)

    def _lost(self, error: OSError) -> None:
        """Close the channel; it is opened again in this turn of the thread."""
        if self._channel is None:
            return
        name, reason, now = self._channel.name, error.strerror or str(error), self._clock()
        heard = self.receiver.routes.sources()
        self.close()
        self._schedule.at(self._connect, -math.inf)
        self.status.transition(LinkInput.CLOSED, now, name, reason)
        self._user.lost(heard, reason, now)

    def _serve(self, handle: object, events: int) -> None:
        """Send or receive on a handle that is ready."""
        channel = self._channel
        # Another handle of the channel may just have shown its loss.
        if channel is None:
            return
        try:
            if events & selectors.EVENT_WRITE:
                channel.writable(handle)
                self._schedule.at(self._forward_more, channel.forward_due)
            if events & selectors.EVENT_READ and not self._user.is_behind:
                for peer, data in channel.receive(handle):
                    # An answer to the datagram before may have shown the loss.
                    if self._channel is not channel:
                        return
                    if self._silent and self._silent.is_away:
                        self._silent.feed(data)
                        continue
                    now = self._clock()
                    frames = self.receiver.feed(peer, data, now)
                    # Most lines wait for none.
                    if self.receiver.waits:
                        self._schedule.by(self._give_up, self.receiver.due)
                    if frames is not None:
                        self._handle(channel, peer, frames, now)
                    elif self._silent:
                        self._silent.feed(data)
                    if (self.receiver.is_behind and channel.has_clients
                            and peer not in channel.peers(now)):
                        self._user.behind(self, peer, now)
        except OSError as error:
            self._lost(error)

    def _handle(
        self, channel: Channel, peer: Peer, frames: list[Frame], now: float,
    ) -> None:
        """Take accepted frames of a peer, of which all may be of messages that are not handled."""
        if self.status.state is not LinkState.OPEN:
            self._connector.backoff.answered()
            self.status.transition(LinkInput.PROVED, now, channel.name)
        self._schedule.at(self._announce, now + SILENCE)
        if channel.heard(peer, now):
            if _frame_log.isEnabledFor(logging.DEBUG):
                _frame_log.debug('new peer %s on %s', peer, channel.name)
            self._user.opened(now)
        self._user.receive(self, peer, frames, now)
