# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The drone's side of the illuminator protocol: finds lights and keeps each of them up to date."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
import functools
import itertools

from .commands import OFF
from .events import LightEvent
from .light import Light
from .messages import IlluminatorStatus
from .model import Status
from .mount_orientation import MountOrientations
from .settings import LightSettings
from ..mavlink.command_sender import Command, CommandSender, CommandStatus
from ..mavlink.component import Payload
from ..mavlink.dialect import mavlink
from ..mavlink.messages import (
    Address,
    CommandAck,
    ComponentInformationBasic,
    Heartbeat,
    Message,
)
from ..payload.discovery import Discovery
from ..payload.identity import Identity
from ..payload.listeners import Listeners
from ..payload.requests import Done, Result

# How many lost lights are asked for a status when the link opens: more would fill a slow line.
MAX_ASKED = 8


class IlluminatorClient(Payload):
    """
    Finds illuminators on a link by their messages, never by their ids.

    A component is an illuminator if its HEARTBEAT has MAV_TYPE_ILLUMINATOR or if it sends
    ILLUMINATOR_STATUS; ArduSub's lights have no heartbeat of their own. It is announced once it
    has sent a status or an answer, and forgotten a minute after its loss if no user has ever
    commanded it.

    :param commands: the command sender of the component that carries this payload.
    :param wanted: returns whether a light at an address is of interest; others are ignored.
    :param needs_mounts: whether the messages for :attr:`mounts` are received.
    :ivar events: the events of all lights.
    :ivar discovery: finds the lights.
    :ivar lights: the announced lights by address, in the order of their announcement.
    :ivar mounts: the directions of gimbals.
    :ivar mount_moved: the system id of each mount that sends its attitude.
    """

    def __init__(
        self, commands: CommandSender, settings: LightSettings, *,
        wanted: Callable[[Address], bool] = lambda address: True, needs_mounts: bool = False,
    ) -> None:
        self.mounts = MountOrientations()
        self.mount_moved: Listeners[int] = Listeners()
        self._commands = commands
        self.settings = settings
        self.events: Listeners[LightEvent] = Listeners()
        # Takes the results of the OFF at the end of the process.
        self._report_off: Callable[[Light, Result, float], None] | None = None
        self.discovery = Discovery[Address, Light](
            commands.schedule, self.events.emit, found=self._found, wanted=wanted,
            dropped=lambda one, now: commands.end_all(now, CommandStatus.CANCELLED, one))
        self.lights: Mapping[Address, Light] = self.discovery.devices
        self.messages = (Heartbeat, IlluminatorStatus, ComponentInformationBasic, CommandAck,
                         *(self.mounts.messages if needs_mounts else ()))

    @property
    def lights_by_address(self) -> list[Light]:
        """Return the announced lights in the order of their addresses."""
        return [self.lights[address] for address in sorted(self.lights)]

    def change_settings(self, settings: LightSettings, now: float) -> None:
        """Take other settings, see :meth:`.light.Light.change_settings`."""
        self.settings = settings
        for light in self.discovery:
            light.change_settings(settings, now)

    def _make(self, address: Address) -> Light:
        def emit(event: LightEvent) -> None:
            if address in self.discovery.devices:
                self.events.emit(event)

        return Light(address, self._commands, self.settings, emit)

    def _found(self, light: Light, now: float) -> None:
        for event in light.snapshot(now).events():
            self.events.emit(event)
        light.announce(now)
        self._switch_off_finally(light, now)

    def link_opened(self, now: float) -> None:
        """See :meth:`Payload.link_opened`."""
        for light in self.discovery:
            light.link_opened(now)
        # A light that is heard again answers immediately; its next heartbeat may take a second.
        lost = (light for light in self.lights.values() if not light.connected)
        for light in itertools.islice(lost, MAX_ASKED):
            light.request_status(now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""
        for light in self.discovery:
            light.link_closed(now, reason)

    def components_lost(self, lost: Collection[Address], now: float, reason: str) -> None:
        """See :meth:`Payload.components_lost`."""
        for light in self.discovery:
            if light.address in lost:
                light.lose('the link was lost', now)

    def receive(self, source: Address, message: Message, now: float) -> None:
        """See :meth:`Payload.receive`."""
        if isinstance(message, IlluminatorStatus):
            if light := self.discovery.hear(source, now, self._make, proved=True):
                light.receive_status(Status.from_message(message), now)
        elif isinstance(message, Heartbeat) and message.type == mavlink.MAV_TYPE_ILLUMINATOR:
            if light := self.discovery.hear(source, now, self._make, proved=False):
                light.heard(now)
        elif isinstance(message, self.mounts.messages):
            if self.mounts.receive(source, message, now):
                self.mount_moved.emit(source.system)
        elif light := self.discovery.get(source):
            if isinstance(message, Heartbeat):
                light.heard(now)
            elif isinstance(message, CommandAck):
                # An answer announces it: a heartbeat alone proves nothing.
                self.discovery.prove(source, now)
            elif isinstance(message, ComponentInformationBasic):
                self.discovery.prove(source, now)
                light.receive_identity(Identity.from_message(message), now)

    def may_send_at_end(self, sent: Command | Message) -> bool:
        """See :meth:`Payload.may_send_at_end`."""
        return (isinstance(sent, Command) and sent.command == mavlink.MAV_CMD_ILLUMINATOR_ON_OFF
                and sent.params == OFF.params)

    def close(self, now: float) -> None:
        """See :meth:`Payload.close`."""
        for light in self.discovery:
            light.close(now)

    def switch_off_finally(
        self, now: float, report: Callable[[Light, Result, float], None],
    ) -> None:
        """
        Switch off all lights, and those found later.

        See :meth:`.light.Light.switch_off_finally`.
        """
        self._report_off = report
        for light in self.lights_by_address:
            self._switch_off_finally(light, now)

    def _switch_off_finally(self, light: Light, now: float) -> None:
        if self._report_off is not None:
            light.switch_off_finally(now, functools.partial(self._report_off, light))


def enable_all(
    lights: Sequence[Light], on: bool, now: float, done: Done, *,
    name: Callable[[Light], str], detail: str = '', is_call: bool = True,
) -> None:
    """
    Switch all connected lights on or off, in parallel.

    :param lights: at least one.
    :param done: called once, when the last light has answered. The result is a success if at least
        one light is connected and all connected lights succeeded; the message has the outcome of
        each light.
    :param name: returns the name of a light, for people.
    :param detail: as for :meth:`.light.Light.enable`, and ``is_call``.
    """
    connected = [light for light in lights if light.connected]
    outcomes: dict[Light, Result] = {}

    def outcome(light: Light, result: Result, now: float) -> None:
        outcomes[light] = result
        if len(outcomes) == len(lights):
            done(_summary(on, {name(one): outcomes[one] for one in lights},
                          [outcomes[one] for one in connected]), now)

    # A lost light fails at once, but an OFF replaces a remembered ON.
    for light in lights:
        light.enable(on, now, functools.partial(outcome, light), detail=detail,
                     is_call=is_call)


def _summary(
    on: bool, outcomes: Mapping[str, Result], connected: list[Result],
) -> Result:
    failures = [result for result in connected if not result.success]
    texts = [f'{name}: {result.message}' for name, result in outcomes.items()]
    if connected:
        succeeded = len(connected) - len(failures)
        texts.insert(0, f'{succeeded} of {len(connected)} {"on" if on else "off"}')
    return Result(bool(connected) and not failures, '; '.join(texts),
                  superseded=bool(failures) and all(one.superseded for one in failures))
