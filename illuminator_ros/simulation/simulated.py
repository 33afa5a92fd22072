# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Simulated components: the device's side of the protocols that all payloads share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import functools
from functools import cached_property
import math
from operator import itemgetter
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

from .faults import Behaviour, FaultInjector, FAULTS, FaultTable
from .settings import integer, one_of, Setting, settings_of, SettingValues
from ..mavlink import messages
from ..mavlink.component import Endpoint
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address, AnyCommand, Message
from ..mavlink.schedule import Schedule
from ..payload.listeners import Listeners

# s; the shortest interval of a stream, which also serves requests for shorter ones.
SHORTEST_INTERVAL = 0.01
# Addresses that are reported as peers.
MAX_PEERS = 100
# Messages and actions that a fault delays; further ones are dropped.
MAX_DELAYED = 1000
# s between reports of progress.
PROGRESS_INTERVAL = 0.5

# Changes the state of a device.
Effect = Callable[[], None]
T_contra = TypeVar('T_contra', contravariant=True)
R_co = TypeVar('R_co', covariant=True)


class CommandReply(NamedTuple):
    """A device's reply to a command: the result, and the effect of the command."""

    result: int
    effect: Effect | None = None


# None where the device does not support the command.
Reply = CommandReply | None


class Report(NamedTuple):
    """
    A message that a device sends on request, or as a stream.

    :param make: returns the message of a moment, None if the device does not have it.
    :param interval: of its stream by default, s, 0 for none; None if it cannot be streamed.
    """

    make: Callable[[float], Message | None]
    interval: float | None = None


class Snapshot(NamedTuple):
    """
    The state of a simulated device or component at a moment, for people.

    :param text: one line.
    :param state: differs between two snapshots if the second gets a line of its own.
    :param drift: a slow quantity, in steps; a change by one step gets a line, too.
    """

    text: str
    state: tuple[object, ...]
    drift: float = 0.0

    def differs(self, other: Snapshot | None) -> bool:
        """Return whether it differs enough from the last shown one for a line of its own."""
        return other is None or self.state != other.state or abs(self.drift - other.drift) >= 1


@dataclass(frozen=True)
class ConsoleCommand(Generic[T_contra, R_co]):
    """
    A command of the console, with a result for each component that it is given to.

    :param usage: the command and its arguments; those in brackets may be left out.
    :param do: called with the component or its device, the arguments and the time; ValueError
        if an argument is wrong.
    """

    usage: str
    help: str  # noqa: A003
    do: Callable[[T_contra, list[str], float], R_co]

    @property
    def name(self) -> str:
        """Return the word that a line begins with."""
        return self.usage.partition(' ')[0]

    def accepts(self, count: int) -> bool:
        """Return whether it takes so many arguments."""
        arguments = self.usage.split()[1:]
        return sum(one[0] != '[' for one in arguments) <= count <= len(arguments)


@dataclass(frozen=True)
class Properties:
    """
    The properties of a simulated component, by default those of a kind of it.

    :param behaviour: how it behaves at first, and without faults.
    :param name: its name for people, '' for none.
    :param seed: of its random faults.
    """

    address: Address
    behaviour: Behaviour = Behaviour()
    name: str = ''
    seed: int = 0


class SimulatedDevice(ABC):
    """
    The part of a simulated component that belongs to a payload: state, commands, messages.

    No I/O; ``now`` is s on the link's clock.

    :ivar records: rows of the payload's :class:`RecordType`.
    :cvar messages: the classes of the messages that it takes, besides commands.
    :cvar sends: the classes of its messages, besides :meth:`reports`.
    :cvar changes: the MAV_CMDs that change its state.
    :cvar faults: the faults that it can have.
    :cvar commands: changes by a person, on the console.
    """

    messages: ClassVar[tuple[type[Message], ...]] = ()
    sends: ClassVar[Sequence[type[Message]]] = ()
    changes: ClassVar[frozenset[int]] = frozenset()
    faults: ClassVar[FaultTable] = FAULTS
    commands: ClassVar[Sequence[ConsoleCommand[Any, Effect]]] = ()

    def __init__(self, properties: Properties) -> None:
        self.properties = properties
        self.behaviour = self.normal = properties.behaviour
        self.records: Listeners[Sequence[str]] = Listeners()
        self.restart(0.0)

    def behave(self, behaviour: Behaviour, now: float) -> None:
        """Behave differently from now on."""
        self.behaviour = behaviour

    def restart(self, now: float) -> None:  # noqa: B027 - optional
        """Return to the state after a power cycle; the constructor calls it, too."""

    def set_clock(self, unix_time: float, now: float) -> None:  # noqa: B027 - optional
        """Take the time of day (s, UTC), as from a GPS receiver of its own."""

    def reports(self) -> Mapping[type[Message], Report]:
        """Return the messages that it sends on request or as a stream."""
        return {}

    def streams(self) -> Mapping[int, float]:
        """Return the default interval (s, 0 for none) of each streamed message, by message id."""
        return {cls.id: one.interval for cls, one in self.reports().items()
                if one.interval is not None}

    def message(self, message_id: int, now: float) -> Message | None:
        """Return a message of this moment, None if the device does not have it."""
        return next((one.make(now) for cls, one in self.reports().items()
                     if cls.id == message_id), None)

    def receive(self, source: Address, message: Message, now: float) -> Iterable[Message]:
        """Take a message of one of the classes of ``messages``; return the messages to send."""
        return ()

    def source(self, message: Message, own: Address) -> Address:
        """Return the address from which it sends a message, by default its own."""
        return own

    def poll(self, now: float) -> Iterable[Message]:
        """Do what is due, besides streams; return the messages to send."""
        return ()

    @property
    def due(self) -> float:
        """Return when :meth:`poll` is due, s."""
        return math.inf

    def execute(self, source: Address, command: AnyCommand, now: float) -> Reply:
        """Return the reply to a command from an address, None if it is not supported."""
        return None

    @abstractmethod
    def snapshot(self, now: float) -> Snapshot:
        """Return the actual state, whatever the device reports."""


D = TypeVar('D', bound=SimulatedDevice, covariant=True)


@dataclass(frozen=True)
class RecordType:
    """
    Records that devices make, and that the simulator writes to a file as CSV.

    :param option: names the file, as in ``--images FILE``.
    :param columns: the names in its first line.
    """

    option: str
    help: str  # noqa: A003
    columns: Sequence[str]


P_co = TypeVar('P_co', bound=Properties, covariant=True)


@dataclass(frozen=True)
class Profile(Generic[P_co]):
    """A kind of component seen in the field."""

    description: str
    properties: P_co


@dataclass(frozen=True)
class SimulatedType(Generic[D]):
    """
    The simulated side of a payload, as the simulator offers it.

    :param noun: names one device, as in the option ``--light`` and in messages.
    :param plural: the key of the YAML file.
    :param device: the class; it is constructed from properties.
    :param properties: by default. They declare the settings, see
        :func:`~.simulated_settings.setting`.
    :param profiles: the values of the setting ``profile``; the first one is the default.
    :param examples: arguments of the simulator, for ``--help``.
    :param notes: further paragraphs of it.
    :param records: records that it makes, None for none.
    :param mavlink_version: the only version of MAVLink that it has, None for any.
    :param url: the link by default.
    """

    noun: str
    plural: str
    device: type[D]
    properties: Properties
    profiles: Mapping[str, Profile[Properties]] = field(default_factory=dict)
    examples: Sequence[str] = ()
    notes: str = ''
    records: RecordType | None = None
    mavlink_version: int | None = None
    url: str = 'udpout://127.0.0.1:14590'

    @cached_property
    def all_settings(self) -> Mapping[str, Setting]:
        """Return the settings of the payload, and those of every payload."""
        profile = {'profile': Setting(
            'NAME', f'a kind of {self.noun}, see below (default: {next(iter(self.profiles))})',
            one_of(self.profiles))} if self.profiles else {}
        return {
            **profile, **settings_of(type(self.properties)),
            'fault': Setting(f'[{self.noun.upper()}:]NAME[=VALUE]', 'a fault, see below',
                             self._read_faults, True),
            'seed': Setting('N', 'seed of the random faults (default: 0)', integer(0, 1 << 32)),
        }

    def _read_faults(self, text: str) -> tuple[str, ...]:
        names = tuple(part.strip() for part in text.split(',') if part.strip())
        for name in names:
            self.device.faults.parse(name)
        return names

    def _normal(self, settings: SettingValues) -> Properties:
        return (self.profiles[settings['profile']].properties if 'profile' in settings
                else self.properties)

    def address(self, settings: SettingValues) -> Address:
        """Return the address by default."""
        return self._normal(settings).address

    def make(self, settings: SettingValues, address: Address, name: str = '') -> D:
        """
        Return the device that settings describe.

        :raises ValueError: if the settings contradict each other.
        """
        normal = self._normal(settings)
        own = {one: settings[one] for one in (*settings_of(type(normal)), 'seed')
               if one in settings}
        device = self.device(replace(normal, address=address, name=name, **{
            one: replace(getattr(normal, one), **value) if isinstance(value, Mapping) else value
            for one, value in own.items()}))
        for fault in settings.get('fault', ()):
            device.behave(device.faults.add(device.behaviour, fault), 0.0)
        return device


class _Stream:

    def __init__(self, default: float, now: float) -> None:
        self.default = default
        self.interval = default
        self.due = now if default else math.inf

    def set(self, interval: float, now: float) -> None:  # noqa: A003
        self.interval = interval
        self.due = now + interval if interval else math.inf

    def advance(self, now: float) -> None:
        """Set the next due time; sendings that were missed are left out."""
        self.due += self.interval
        if self.due <= now:
            self.due = now + self.interval


class SimulatedComponent(Generic[D]):
    """
    One simulated component: heartbeat, commands, streams and faults. No I/O.

    :param outgoing: takes the messages that it sends, each with its address.
    :param schedule: of the link, which calls :meth:`poll`.
    """

    def __init__(
        self, device: D, now: float,
        outgoing: deque[tuple[Address, Message]] | None = None,
        schedule: Schedule | None = None,
    ) -> None:
        self.device = device
        self.address = device.properties.address
        self.name = device.properties.name
        self.outgoing = deque() if outgoing is None else outgoing
        self.schedule = Schedule() if schedule is None else schedule
        self._injector = FaultInjector(f'{device.properties.seed} {self.address}')
        self.power_on(now)

    @property
    def behaviour(self) -> Behaviour:
        """Return the behaviour of the device."""
        return self.device.behaviour

    def power_on(self, now: float) -> None:
        """Start; the faults that last for a time begin now."""
        # The time until which it neither receives nor sends, s.
        self._silent_until = now + (self.device.behaviour.silence or -math.inf)
        self.restart(now)

    def restart(self, now: float) -> None:
        """Restart, as after a power cycle."""
        self.address = self.device.properties.address
        self.device.restart(now)
        self._streams = {message_id: _Stream(interval, now)
                         for message_id, interval in self.device.streams().items()}
        self._in_progress: set[int] = set()
        self._heartbeat_due = now if self.device.behaviour.heartbeat_interval else math.inf
        # Actions that are due later.
        self._delayed: list[tuple[float, Callable[[float], None]]] = []
        self._reboot_due = now + (self.device.behaviour.reboot_interval or math.inf)
        self._set_due()

    def behave(self, behaviour: Behaviour, now: float) -> None:
        """Behave differently from now on."""
        before = self.device.behaviour
        self.device.behave(behaviour, now)
        if behaviour.silence != before.silence:
            self._silent_until = now + behaviour.silence
        if behaviour.reboot_interval != before.reboot_interval:
            self._reboot_due = now + (behaviour.reboot_interval or math.inf)
        if behaviour.heartbeat_interval != before.heartbeat_interval:
            self._heartbeat_due = now if behaviour.heartbeat_interval else math.inf
        self._set_due()

    def apply(self, effect: Effect, now: float) -> None:
        """Apply an effect, of a command or by hand, and send the streamed messages."""
        effect()
        if self.device.behaviour.status_on_change:
            for message_id, stream in self._streams.items():
                if stream.interval:
                    stream.due = now + stream.interval
                    self._send(self.device.message(message_id, now), now)
        self._set_due()

    def _is_addressed(self, message: Message) -> bool:
        """Return whether a message is for this component (MAVLink guide, "Routing")."""
        behaviour = self.device.behaviour
        system, component = messages.target_of(message)
        if behaviour.adopts_system_id:
            system = self.address.system
        if (system, component) == self.address or not behaviour.filters_target:
            return True
        return bool(behaviour.answers_broadcast and (
            system == 0 or system == self.address.system and component == 0))

    def receive(self, source: Address, message: Message, now: float) -> None:
        """Receive a command or a message for this component, or a broadcast one."""
        self._receive(source, message, now)
        self._set_due()

    def _receive(self, source: Address, message: Message, now: float) -> None:
        behaviour = self.device.behaviour
        if now < self._silent_until:
            return
        if behaviour.adopts_system_id and source.system:
            self.address = Address(source.system, self.address.component)
        if hasattr(message, 'target_system') and not self._is_addressed(message):
            return
        if isinstance(message, self.device.messages):
            for sent in self.device.receive(source, message, now):
                self._after(behaviour.slow, functools.partial(self._send, sent), now)
        if (not isinstance(message, AnyCommand) or not behaviour.answers_commands
                or isinstance(message, messages.CommandInt) and not behaviour.answers_command_int):
            return
        self._after(behaviour.slow, functools.partial(self._consider, source, message), now)

    def _after(self, delay: float, action: Callable[[float], None], now: float) -> None:
        """Call an action after a delay, s, or at once."""
        if not delay:
            action(now)
        elif len(self._delayed) < MAX_DELAYED:
            self._delayed.append((now + delay, action))

    def _consider(self, source: Address, message: AnyCommand, now: float) -> None:
        """Answer a command at once, or report its progress first."""
        behaviour = self.device.behaviour
        if message.command not in self.device.changes:
            self._finish(source, message, now)
        elif behaviour.rejections or message.command in self._in_progress:
            if behaviour.rejections:
                self.device.behave(replace(behaviour, rejections=behaviour.rejections - 1), now)
            self._acknowledge(source, message.command, mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
                              now)
        elif behaviour.refuse is not None:
            self._acknowledge(source, message.command, behaviour.refuse, now)
        elif behaviour.progress:
            self._progress(source, message, now, now)
        else:
            self._finish(source, message, now)

    def _acknowledge(
        self, source: Address, command: int, result: int, now: float, progress: int = 0,
    ) -> None:
        behaviour = self.device.behaviour
        target = source if behaviour.acks_target else Address(0, 0)
        if behaviour.acks_wrong_target:
            target = Address(source.system, source.component ^ 1)
        self._send(messages.CommandAck(command, result, progress, 0, *target), now)

    def _progress(
        self, source: Address, message: AnyCommand, begun: float, now: float,
    ) -> None:
        """Report progress until its time is over, then finish the command."""
        duration = self.device.behaviour.progress
        if now >= begun + duration:
            self._in_progress.discard(message.command)
            self._finish(source, message, now)
            return
        self._in_progress.add(message.command)
        self._acknowledge(source, message.command, mavlink.MAV_RESULT_IN_PROGRESS, now,
                          int(100 * (now - begun) / duration))
        self._delayed.append((min(now + PROGRESS_INTERVAL, begun + duration),
                              functools.partial(self._progress, source, message, begun)))

    def _finish(self, source: Address, message: AnyCommand, now: float) -> None:
        """Acknowledge a command and execute it."""
        behaviour = self.device.behaviour
        if message.command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            requested = self._requested(message.param1, now)
            result = mavlink.MAV_RESULT_ACCEPTED if requested else self._unknown(
                mavlink.MAV_RESULT_DENIED)
            self._acknowledge(source, message.command, result, now)
            if requested:
                self._send(requested, now)
            return
        if message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self._acknowledge(source, message.command, self._set_interval(message, now), now)
            return
        reply = self.device.execute(source, message, now)
        if reply is None:
            reply = CommandReply(self._unknown(mavlink.MAV_RESULT_UNSUPPORTED))
        accepted = reply.result == mavlink.MAV_RESULT_ACCEPTED
        self._acknowledge(source, message.command, reply.result, now)
        if reply.effect is None or not (
                not behaviour.ignores_changes if accepted else behaviour.applies_rejected):
            return
        self._after(behaviour.apply_after, functools.partial(self.apply, reply.effect), now)

    def _requested(self, message_id: float, now: float) -> Message | None:
        if not math.isfinite(message_id) or (
                message_id in self._streams and not self.device.behaviour.on_request):
            return None
        return self.device.message(int(message_id), now) if message_id % 1 == 0 else None

    def _unknown(self, result: int) -> int:
        return mavlink.MAV_RESULT_ACCEPTED if self.device.behaviour.accepts_unknown else result

    def _set_interval(self, message: AnyCommand, now: float) -> int:
        """Execute MAV_CMD_SET_MESSAGE_INTERVAL: param2 in µs, -1 to stop, 0 for the default."""
        behaviour, microseconds = self.device.behaviour, message.param2
        stream = next((one for id_, one in self._streams.items() if id_ == message.param1), None)
        if stream is None or not math.isfinite(microseconds):
            return mavlink.MAV_RESULT_DENIED
        default = stream.default or 1.0
        if microseconds == -1:
            stream.set(default if behaviour.endless_stream else 0.0, now)
        elif microseconds == 0 or behaviour.fixed_rate:
            stream.set(default if stream.interval or behaviour.resumes else 0.0, now)
        elif microseconds > 0:
            stream.set(max(microseconds / 1e6, SHORTEST_INTERVAL), now)
        else:
            return mavlink.MAV_RESULT_DENIED
        return mavlink.MAV_RESULT_ACCEPTED

    def _send(self, message: Message | None, now: float) -> None:
        if message is None or now < self._silent_until:
            return
        for delay, sent in self._injector.inject(message, self.device.behaviour):
            self._after(delay, functools.partial(self._transmit, sent), now)

    def _transmit(self, message: Message, now: float) -> None:
        self.outgoing.append((self.device.source(message, self.address), message))

    def snapshot(self, now: float) -> Snapshot:
        """Return the actual state of the device, with the names of component and faults."""
        name = f'{self.address} {self.device.properties.name}'.rstrip()
        faults = self.device.faults.active(self.behaviour, self.device.normal)
        device = self.device.snapshot(now)
        text = f'{name:12}  {device.text}' + (f'  [{", ".join(faults)}]' if faults else '')
        return Snapshot(text, (name, *faults, *device.state), device.drift)

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`; send a heartbeat at once for the new peer."""
        if self.device.behaviour.heartbeat_interval:
            self._send_heartbeat(now)

    def _send_heartbeat(self, now: float) -> None:
        behaviour = self.device.behaviour
        self._heartbeat_due = now + (behaviour.heartbeat_interval or math.inf)
        self._send(messages.Heartbeat(
            behaviour.heartbeat_type, behaviour.heartbeat_autopilot,
            behaviour.heartbeat_base_mode, behaviour.heartbeat_custom_mode,
            behaviour.heartbeat_state, messages.MAVLINK_VERSION), now)

    def poll(self, now: float) -> None:
        """Do what is due."""
        if now >= self._silent_until > -math.inf:
            self._silent_until = -math.inf
            self.device.behave(replace(self.device.behaviour, silence=0.0), now)
        if now >= self._reboot_due:
            self.restart(now)
        due = sorted((one for one in self._delayed if one[0] <= now), key=itemgetter(0))
        self._delayed = [one for one in self._delayed if one[0] > now]
        for _, action in due:
            action(now)
        if now >= self._heartbeat_due:
            self._send_heartbeat(now)
        for message_id, stream in self._streams.items():
            if now >= stream.due:
                stream.advance(now)
                self._send(self.device.message(message_id, now), now)
        for message in self.device.poll(now):
            self._send(message, now)
        self._set_due()

    def _set_due(self) -> None:
        end_of_silence = math.inf if self._silent_until == -math.inf else self._silent_until
        self.schedule.at(self.poll, min(
            self._heartbeat_due, self._reboot_due, end_of_silence, self.device.due,
            *(stream.due for stream in self._streams.values()),
            *(due for due, _ in self._delayed)))


class SimulatedComponents(Endpoint, Generic[D]):
    """
    One or more simulated components on one link, of one payload or of several.

    :ivar components: in the order of their devices.
    :ivar new_peers: the address of each other component, with the first message from it.
    """

    def __init__(self, devices: Iterable[D], now: float) -> None:
        super().__init__()
        self.new_peers: Listeners[Address] = Listeners()
        self._peers: set[Address] = set()
        self.components = [
            SimulatedComponent(one, now, self.outgoing, self.schedule) for one in devices]
        self.sends = tuple(dict.fromkeys(
            cls for one in self.components
            for cls in (*one.device.sends, *one.device.reports())))
        self.messages = tuple(dict.fromkeys((
            messages.Heartbeat, messages.CommandLong, messages.CommandInt,
            *(cls for one in self.components for cls in one.device.messages))))

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        for component in self.components:
            component.link_opened(now)

    def receive(self, source: Address, message: Message, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        if source not in self._peers and len(self._peers) < MAX_PEERS:
            self._peers.add(source)
            self.new_peers.emit(source)
        for component in self.components:
            component.receive(source, message, now)
