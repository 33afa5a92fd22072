# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Listening to a port: the components that are heard, and at which baud rate."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
import contextlib
from dataclasses import dataclass, field
import selectors
import time

from .component_kinds import kinds
from .rate_scan import RateScan, SHARE
from ..device_kind import DeviceKind
from ..dialect import CRC_EXTRA, decode
from ..frame import Frame
from ..frame_writer import FrameWriter
from ..messages import Address, ComponentInformationBasic, Heartbeat
from ..receiver import Receiver
from ..signing import Signing
from ..statistics import MAX_SOURCES
from ..transport import Channel, open_channel
from ..transport.ports import IN_USE, OTHER_USER, users_of
from ..url import SerialUrl, UdpUrl, Url

SILENT = ('nothing is received: check the power of the device, ground, and the wire from its TX '
          'to the RX of this port, which may be swapped; PX4 on USB may send only after it has '
          'received MAVLink')
NOISE = '{} bytes, no valid frame: another baud rate, a bad wire or ground, or not MAVLink'
NOT_SENT_HERE = 'nothing is received: the device or a router must send to this port'
NOT_MAVLINK = '{} bytes, no valid frame: it is not MAVLink'
NOT_ASKED = ('nothing is received: a router or device may send only to a program that sends, '
             'unlike this one')


@dataclass
class Heard:
    """The frames of one address."""

    frames: int = 0
    signed: bool = False
    versions: set[int] = field(default_factory=set)
    messages: set[int] = field(default_factory=set)
    heartbeat: Heartbeat | None = None
    serial_number: str = ''


class Listener:
    """
    Listens to one connection URL, and sends nothing; to a serial port at one rate after another.

    It stays at the rate at which a frame is valid.

    :param label: its name for people, which is the URL where it is not a serial port.
    :param rates: of a serial port, first the rate of the URL.
    :param share: the time at each rate, s.
    :param trouble: why nothing is heard: it is not opened unless this is ''.
    :param writer: of frames that are not to be heard when they return.
    """

    def __init__(
        self, url: Url, label: str, clock: Callable[[], float], *, rates: Sequence[int] = (0,),
        share: float = SHARE, trouble: str = '', writer: FrameWriter | None = None,
    ) -> None:
        self.url = url
        self.label = label
        self.trouble = trouble
        self.components: dict[Address, Heard] = {}
        # Whether each frame came from this machine.
        self.is_loopback = True
        self.channel: Channel | None = None
        self.scan = RateScan(rates, share, clock())
        self._clock = clock
        signing = Signing()
        self._receiver = Receiver(
            signing, CRC_EXTRA, writer or FrameWriter(signing), time.time, {})

    @property
    def rate(self) -> int:
        """Return the present rate, 0 where there is none."""
        return self.scan.rate

    def kinds(self, known: Collection[DeviceKind]) -> dict[Address, list[str]]:
        """Return the kinds of each component, given the devices of payloads."""
        return {address: kinds(address, one.heartbeat, one.messages, known)
                for address, one in sorted(self.components.items())}

    @property
    def elapsed(self) -> float:
        """Return the time at the present rate, s."""
        return self._clock() - self.scan.since

    @property
    def tuned_url(self) -> Url:
        """Return the URL with the present rate."""
        return (self.url._replace(baud=self.scan.rate)
                if isinstance(self.url, SerialUrl) else self.url)

    def listen(
        self, selector: selectors.BaseSelector, opener: Callable[[Url], Channel] = open_channel,
    ) -> None:
        """Open it, unless another program reads it: each would get a part of the bytes."""
        if not self.trouble and isinstance(self.url, SerialUrl) and (users := users_of(self.url)):
            self.trouble = IN_USE.format(users)
        if self.trouble:
            return
        try:
            self.channel = opener(self.url)
        except OSError as error:
            self.trouble = error.strerror or str(error)
            if 'in use' in self.trouble and isinstance(self.url, SerialUrl | UdpUrl):
                self.trouble = IN_USE.format(users_of(self.url) or OTHER_USER)
        else:
            self._selector = selector
            self.scan.since = self._clock()
            self.channel.register(selector, self._serve)

    def release(self) -> Channel | None:
        """Listen no more, and return the channel, which stays open."""
        channel, self.channel = self.channel, None
        if channel is not None:
            for key in [*self._selector.get_map().values()]:
                if key.data == self._serve:
                    self._selector.unregister(key.fileobj)
        return channel

    def close(self, trouble: str = '') -> None:
        """Close it."""
        self.trouble = self.trouble or trouble
        if channel := self.release():
            channel.close()

    def poll(self) -> None:
        """Take the frames behind incomplete ones, and the next rate if its time has come."""
        now = self._clock()
        for _, frames in self._receiver.give_up(now):
            self._receive(frames)
        if (self.channel is not None and not self.components
                and (rate := self.scan.next_rate(now))):
            # The hardware may not have this rate.
            with contextlib.suppress(OSError):
                self.channel.change_rate(rate)

    def _serve(self, handle: object, events: int) -> None:
        assert self.channel is not None
        try:
            for peer, data in self.channel.receive(handle):
                if frames := self._receiver.feed(peer, data, self._clock()):
                    self.is_loopback &= isinstance(peer, tuple) and peer[0].startswith('127.')
                    self._receive(frames)
                elif not self.components:
                    self.scan.feed(data)
        except OSError as error:
            self.close(f'lost: {error.strerror or error}')

    def _receive(self, frames: Iterable[Frame]) -> None:
        for frame in frames:
            if frame.source not in self.components and len(self.components) >= MAX_SOURCES:
                continue
            one = self.components.setdefault(frame.source, Heard())
            one.frames += 1
            one.signed |= frame.signature is not None
            one.versions.add(frame.version)
            one.messages.add(frame.message_id)
            if frame.message_id == Heartbeat.id:
                one.heartbeat = decode(Heartbeat, frame.payload)
            elif frame.message_id == ComponentInformationBasic.id:
                one.serial_number = decode(
                    ComponentInformationBasic, frame.payload).serial_number.strip()

    def silence(self) -> str:
        """Return why no frame was heard, or the likely reason."""
        bytes_ = self._receiver.traffic.bytes_received
        if self.trouble or self.scan.found:
            return self.trouble or self.scan.found
        if isinstance(self.url, SerialUrl):
            return NOISE.format(bytes_) if bytes_ else SILENT
        if bytes_:
            return NOT_MAVLINK.format(bytes_)
        return NOT_ASKED if isinstance(self.url, UdpUrl) and self.url.remote else NOT_SENT_HERE
