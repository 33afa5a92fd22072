# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""One port: what is heard on it, at which baud rate, and the commands for it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import contextlib
from dataclasses import dataclass, field
import selectors
import shlex
import time
from typing import Any

from .ports import users_of
from ..arguments import invocation
from ...mavlink.dialect import CRC_EXTRA, decode
from ...mavlink.frame import Frame
from ...mavlink.frame_writer import FrameWriter
from ...mavlink.messages import Address, Heartbeat
from ...mavlink.receiver import Receiver
from ...mavlink.signing import Signing
from ...mavlink.statistics import MAX_SOURCES
from ...mavlink.transport import Channel, open_channel
from ...mavlink.url import SerialUrl, UdpUrl, Url
from ...payload.component_kinds import AUTOPILOT, GIMBAL, kinds, LIGHT, MANAGER, MICASENSE

RATES = 57600, 115200, 921600, 38400
SERVED = {LIGHT, MANAGER, GIMBAL, MICASENSE}
IN_USE = 'in use by {}: end it, or share its link (doc/routers.md)'
OTHER_USER = 'a program of another user, which root can see'
SILENT = ('nothing is received: check the power of the device, ground, and the wire from its TX '
          'to the RX of this port, which may be swapped; PX4 on USB may send only after it has '
          'received MAVLink')
NOISE = ('{} bytes, no valid frame: another baud rate (give one, as in "{} {},9600"), a bad wire '
         'or ground, or not MAVLink')
NOT_SENT_HERE = 'nothing is received: the device or a router must send to this port'
NOT_MAVLINK = '{} bytes, no valid frame: it is not MAVLink'
NOT_ASKED = ('nothing is received: a router or device may send only to a program that sends, '
             'unlike this one')
NOT_SERVED = ('none of these is a light, a gimbal or a MicaSense camera; an autopilot or router '
              'may forward their frames only to a program that sends, unlike this one')


@dataclass
class Heard:
    """The frames of one address."""

    frames: int = 0
    signed: bool = False
    versions: set[int] = field(default_factory=set)
    messages: set[int] = field(default_factory=set)
    heartbeat: Heartbeat | None = None


class Port:
    """
    Listens to one connection URL; to a serial port at one rate after the other.

    It stays at the rate at which a frame is valid.

    :param url: of a serial port with the first rate.
    :param label: its name for people, which is the URL where it is not a serial port.
    :param duration: how long it listens, s; each rate has an equal share.
    :param trouble: why nothing is heard: it is not opened unless this is ''.
    """

    def __init__(
        self, url: Url, label: str, duration: float, clock: Callable[[], float],
        trouble: str = '',
    ) -> None:
        self.url = url
        self.label = label
        self.trouble = trouble
        self.components: dict[Address, Heard] = {}
        self._rates = [*dict.fromkeys((url.baud, *RATES))] if isinstance(url, SerialUrl) else [0]
        self._share = duration / len(self._rates)
        self._clock = clock
        # When the listening at the present rate began, s.
        self._since = clock()
        # Whether each frame came from this machine.
        self._is_loopback = True
        self._channel: Channel | None = None
        signing = Signing()
        self._receiver = Receiver(signing, CRC_EXTRA, FrameWriter(signing), time.time, {})

    @property
    def rate(self) -> int:
        """Return the present rate, 0 where there is none."""
        return self._rates[0]

    def listen(
        self, selector: selectors.BaseSelector, opener: Callable[[Url], Channel] = open_channel,
    ) -> None:
        """Open it, unless another program reads it: each would get a part of the bytes."""
        if not self.trouble and isinstance(self.url, SerialUrl) and (users := users_of(self.url)):
            self.trouble = IN_USE.format(users)
        if self.trouble:
            return
        try:
            self._channel = opener(self.url)
        except OSError as error:
            self.trouble = error.strerror or str(error)
            if 'in use' in self.trouble and isinstance(self.url, SerialUrl | UdpUrl):
                self.trouble = IN_USE.format(users_of(self.url) or OTHER_USER)
        else:
            self._selector = selector
            self._since = self._clock()
            self._channel.register(selector, self._serve)

    def close(self, trouble: str = '') -> None:
        """Close it."""
        self.trouble = self.trouble or trouble
        channel, self._channel = self._channel, None
        if channel is not None:
            for key in [*self._selector.get_map().values()]:
                if key.data == self._serve:
                    self._selector.unregister(key.fileobj)
            channel.close()

    def poll(self) -> None:
        """Take the frames behind incomplete ones, and the next rate if its time has come."""
        now = self._clock()
        for _, frames in self._receiver.give_up(now):
            self._take(frames)
        if (self._channel is not None and not self.components and len(self._rates) > 1
                and now >= self._since + self._share):
            del self._rates[0]
            self._since = now
            # The hardware may not have this rate.
            with contextlib.suppress(OSError):
                self._channel.change_rate(self.rate)

    def _serve(self, handle: object, events: int) -> None:
        assert self._channel is not None
        try:
            for peer, data in self._channel.receive(handle):
                if frames := self._receiver.take(peer, data, self._clock()):
                    self._is_loopback &= isinstance(peer, tuple) and peer[0].startswith('127.')
                    self._take(frames)
        except OSError as error:
            self.close(f'lost: {error.strerror or error}')

    def _take(self, frames: Iterable[Frame]) -> None:
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

    # The report

    def report(self) -> dict[str, Any]:
        """Return what was heard, and the commands, for ``--json``."""
        known = {address: kinds(address, one.heartbeat, one.messages)
                 for address, one in sorted(self.components.items())}
        elapsed = max(self._clock() - self._since, 1e-3)
        components = [
            {'address': str(address), 'kinds': known[address],
             'mavlink_versions': sorted(one.versions), 'signed': one.signed,
             'frames_per_s': round(one.frames / elapsed, 1),
             'served': not SERVED.isdisjoint(known[address])}
            for address, one in sorted(self.components.items())]
        payloads = _payloads({kind for one in known.values() for kind in one})
        signed = any(one['served'] and one['signed'] for one in components)
        trouble = self.trouble or (
            self._silence() if not components else '' if payloads else NOT_SERVED)
        return {
            'port': self.label,
            'url': self._url() if components else '',
            'trouble': trouble,
            'components': components,
            'run': [self._command(names, signed) for names in payloads],
            'try': [self._command(['illuminator', 'gimbal'], False)]
            if trouble in (NOT_SERVED, NOT_ASKED) else [],
        }

    def _silence(self) -> str:
        """Return the likely reason why no frame was heard."""
        bytes_ = self._receiver.traffic.bytes_received
        if isinstance(self.url, SerialUrl):
            return NOISE.format(
                bytes_, invocation('discover'), self.url.device) if bytes_ else SILENT
        if bytes_:
            return NOT_MAVLINK.format(bytes_)
        return NOT_ASKED if isinstance(self.url, UdpUrl) and self.url.remote else NOT_SENT_HERE

    def _url(self) -> str:
        if isinstance(self.url, SerialUrl):
            scheme = 'serial-hwfc' if self.url.hardware_flow_control else 'serial'
            return f'{scheme}://{self.url.device}:{self.rate}'
        if self._is_loopback:
            # As the default URL of the bridge, it hears this machine only.
            return self.label.replace('udpin://0.0.0.0:', 'udpin://127.0.0.1:')
        return self.label

    def _command(self, payloads: list[str], signed: bool) -> str:
        """Return the command that serves payloads, in the form in which this program was run."""
        name = 'bridge' if payloads[0] == 'illuminator' else payloads[0]
        parameters = [f'payloads:="[{", ".join(payloads)}]"'] if payloads[1:] else []
        if signed:
            parameters += ['signing_mode:=sign', 'signing_key_file:=KEY_FILE']
        return ' '.join([
            invocation('discover').removesuffix('discover') + name, shlex.quote(self._url()),
            *(['--ros-args'] if parameters else []), *(f'-p {one}' for one in parameters)])


def _payloads(found: set[str]) -> list[list[str]]:
    """Return the payloads that serve kinds, by process: only a camera needs MAVLink 1."""
    managed = MANAGER in found or {GIMBAL, AUTOPILOT} <= found
    shared = [*(['illuminator'] if LIGHT in found else []),
              *(['gimbal'] if managed else ['gimbal_manager'] if GIMBAL in found else [])]
    return [*([shared] if shared else []), *([['rededge']] if MICASENSE in found else [])]
