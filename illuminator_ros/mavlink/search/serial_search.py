# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The search for the serial port of a device (``serial://auto``)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
import glob
import os
import re
import selectors
import threading
import time

from .component_kinds import listed
from .listener import Listener
from ..command_sender import request_message
from ..device_kind import DeviceKind
from ..dialect import mavlink
from ..frame_writer import FrameWriter
from ..messages import Address, heartbeat, INFORMATION_ID
from ..transport import Channel, open_channel
from ..transport.ports import serial_ports
from ..url import AutoUrl, SerialUrl, Url

# s from the first device that fits to the decision, in which a second one may be heard.
DECISION = 3.0
# s without a device until the reason is reported, before the node logs that it has no device.
PASS = 4.5
# s between looks at the ports, and between requests for the identity of a device.
TICK = 0.1
# s until a port on which only others are heard is closed, since another search may look for these,
# and until it is tried again.
OTHERS, AGAIN = 5.0, 60.0
INTERVAL = 1.0


class SerialSearch:
    """
    Listens to serial ports until one device fits, and opens its port; for one thread.

    It sends only to a component that it has heard, to ask for its serial number. Between two calls
    of :meth:`open` that fail, the ports stay open: to open a port resets some boards.

    :param writer: of the frames that it sends.
    :param address: that sends them.
    :param ports: see :func:`~.transport.ports.serial_ports`.
    """

    def __init__(
        self, url: AutoUrl, writer: FrameWriter, address: Address, *,
        ports: Callable[[], Mapping[str, bool]] = serial_ports,
        opener: Callable[[Url], Channel] = open_channel,
        clock: Callable[[], float] = time.monotonic,
        make_selector: Callable[[], selectors.BaseSelector] = selectors.DefaultSelector,
    ) -> None:
        self._url = url
        self._wanted = url.devices or tuple(frozenset({one.name}) for one in url.known)
        self._rates = [*url.rates]
        self._writer = writer
        self._address = address
        self._ports = ports
        self._opener = opener
        self._clock = clock
        self._make_selector = make_selector
        self._selector: selectors.BaseSelector | None = None
        # By path; and when ports may be opened again, s.
        self._listeners: dict[str, Listener] = {}
        self._again: dict[str, float] = {}
        # When something fitted first, and when ports and identities are due, s.
        self._first = self._due = 0.0

    def open(self, stopping: threading.Event) -> Channel:  # noqa: A003 - as a transport
        """
        Open the port.

        :param stopping: ends the search.
        :raises OSError: if no device fits for some time, or several do; it may be called again.
        """
        end = self._clock() + PASS
        self._selector = self._selector or self._make_selector()
        while not stopping.is_set():
            now = self._clock()
            if now >= self._due:
                self._due = now + INTERVAL
                self._find_ports(now)
                self._ask(now)
            fitting = [one for one in self._listeners.values() if self._fits(one)]
            if not fitting:
                self._first = now
            if fitting and (self._url.serial or now >= self._first + DECISION):
                if len(fitting) > 1:
                    self._first = now
                    raise OSError('several ports have such a device: give one of ' + ', '.join(
                        f'{one.tuned_url} ({_heard(one, self._url.known)})' for one in fitting))
                return self._claim(fitting[0])
            if not fitting and now >= end:
                raise OSError(self._reason())
            for key, events in self._selector.select(TICK):
                key.data(key.fileobj, events)
            for one in self._listeners.values():
                one.poll()
        self._close()
        raise OSError('stopped')

    def _find_ports(self, now: float) -> None:
        """Listen to new ports, and close those of others."""
        known = self._ports()
        stable = {os.path.realpath(path): path for path in known}
        paths = glob.glob(self._url.ports) if self._url.ports else known
        # The console of the system is not opened.
        wanted = sorted({name for path in paths if not known.get(
            name := stable.get(os.path.realpath(path), path))})
        for path in [*self._listeners]:
            # A port that was in use may be free now; another device may have this path.
            one = self._listeners[path]
            if path not in wanted or one.channel is None and not one.scan.found and (
                    now >= self._again.get(path, 0.0)):
                self._listeners.pop(path).close()
        for path in wanted:
            if path not in self._listeners:
                one = self._listeners[path] = Listener(
                    SerialUrl(path, self._rates[0]), path, self._clock, rates=self._rates,
                    writer=self._writer)
                assert self._selector is not None
                one.listen(self._selector, self._opener)
            elif (one := self._listeners[path]).channel and (one.scan.found or (
                    one.components and one.elapsed >= OTHERS and not self._fits(one))):
                # It is for another program.
                one.close()
                self._again[path] = now + AGAIN

    def _fits(self, one: Listener) -> bool:
        """Return whether a device that is wanted is heard, with the serial number if one is."""
        found = {kind for kinds in one.kinds(self._url.known).values() for kind in kinds}
        return (one.channel is not None
                and any(kinds <= found for kinds in self._wanted)
                and self._url.serial in (
                    '', *(heard.serial_number for heard in one.components.values())))

    def _ask(self, now: float) -> None:
        """Ask the components that are heard for their serial numbers, if one is wanted."""
        for one in self._listeners.values() if self._url.serial else ():
            frames = [self._writer.frame(
                self._address, message, now, time.time()) for message in (
                    heartbeat(mavlink.MAV_TYPE_ONBOARD_CONTROLLER), *(
                        request_message(address, INFORMATION_ID).message(0, as_int=False)
                        for address in one.components))]
            if one.channel and one.components:
                one.channel.send(frames, one.channel.peers(now))

    def _claim(self, one: Listener) -> Channel:
        # After a loss the device is likely to have the same rate.
        self._rates.sort(key=lambda rate: rate != one.scan.rate)
        channel = one.release()
        assert channel is not None
        self._close()
        return channel

    def _close(self) -> None:
        for one in self._listeners.values():
            one.close()
        self._listeners.clear()
        if self._selector is not None:
            self._selector.close()
            self._selector = None

    def _reason(self) -> str:
        """Return why no device fits, for people."""
        if not self._listeners:
            return f'no serial port{self._url.ports and " "}{self._url.ports}'
        wanted = listed([' and '.join(sorted(one)) for one in self._wanted])
        number = self._url.serial and f' with the serial number {self._url.serial!r}'
        return f'no {wanted}{number}: ' + '; '.join(
            f'{path}: {_heard(one, self._url.known)}' for path, one in self._listeners.items()
        ) + ' (discover tells more)'


def _heard(one: Listener, known: Collection[DeviceKind]) -> str:
    return ', '.join(
        f'{address} ({", ".join(kinds) or "no HEARTBEAT"}'
        + (number and f', serial number {number!r}') + ')'
        for address, kinds in one.kinds(known).items()
        for number in [one.components[address].serial_number]) or (
            one.trouble or re.sub(r'^\d+ ', '', one.silence()).partition(':')[0])
