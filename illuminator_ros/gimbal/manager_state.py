# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The state of a gimbal manager, which depends on its device and on other managers of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
import math

from .messages import NON_MAVLINK_IDS
from ..mavlink.messages import Address

# s without a message after which a device, or another manager, is lost.
DEVICE_TIMEOUT = 3.0
MANAGER_TIMEOUT = 3.0
# s for which a manager listens for other managers: the least time, and the most random time that
# is added. So of two managers that start together, one announces the device first, even if their
# addresses are equal.
LISTENING_TIME, RANDOM_TIME = 2.0, 2.0
# The most other gimbal devices that are named while the manager's own is not heard.
MAX_OTHER_DEVICES = 8


class ManagerState(Enum):
    """
    The states of a gimbal manager.

    Only an ACTIVE manager announces the device and gives it setpoints. A LISTENING manager waits
    for other managers of the device; an INACTIVE manager has heard one.
    """

    NO_DEVICE = 'no device'
    LISTENING = 'listening'
    ACTIVE = 'active'
    INACTIVE = 'inactive'


class ManagerInput(Enum):
    """The inputs that change the state of a gimbal manager."""

    DEVICE_HEARD = 'device heard'
    DEVICE_LOST = 'device lost'
    TIME_OVER = 'time over'
    MANAGER_HEARD = 'manager heard'
    MANAGER_LOST = 'manager lost'


# Inputs that are not listed do not change the state.
TRANSITIONS: dict[tuple[ManagerState, ManagerInput], ManagerState] = {
    (ManagerState.NO_DEVICE, ManagerInput.DEVICE_HEARD): ManagerState.LISTENING,
    (ManagerState.LISTENING, ManagerInput.TIME_OVER): ManagerState.ACTIVE,
    (ManagerState.LISTENING, ManagerInput.MANAGER_HEARD): ManagerState.INACTIVE,
    (ManagerState.LISTENING, ManagerInput.DEVICE_LOST): ManagerState.NO_DEVICE,
    (ManagerState.ACTIVE, ManagerInput.MANAGER_HEARD): ManagerState.INACTIVE,
    (ManagerState.ACTIVE, ManagerInput.DEVICE_LOST): ManagerState.NO_DEVICE,
    (ManagerState.INACTIVE, ManagerInput.MANAGER_LOST): ManagerState.LISTENING,
    (ManagerState.INACTIVE, ManagerInput.DEVICE_LOST): ManagerState.NO_DEVICE,
}


@dataclass(frozen=True)
class StateChanged:
    """
    The state of a manager has changed.

    :param device: the address of its device, None for one without MAVLink.
    :param other: the other manager that was heard, None if there is none.
    """

    before: ManagerState
    after: ManagerState
    device_id: int
    device: Address | None
    other: Address | None


class StateTracker:
    """
    Tracks the device of a manager, and other managers of this device. No I/O; times are s.

    :param address: of the manager.
    :param device_id: of the device; 1..6 for one without MAVLink, 0 for the first that is heard.
    :param changed: takes each change of the state.
    :param draw: returns a random number, 0..1.
    :ivar device: the address of the device, None while none is known.
    :ivar has_mavlink: whether the device is a MAVLink component.
    :ivar other: the other manager, None if none is heard.
    """

    def __init__(
        self, address: Address, device_id: int,
        changed: Callable[[StateChanged, float], None], draw: Callable[[], float],
    ) -> None:
        self.state = ManagerState.NO_DEVICE
        self.device: Address | None = None
        self.has_mavlink = device_id not in NON_MAVLINK_IDS
        self.other: Address | None = None
        self._address = address
        self._wanted = device_id
        self._other_devices: set[Address] = set()
        self._changed = changed
        self._draw = draw
        self._device_heard = self._other_heard = -math.inf
        self._listening_until = math.inf

    @property
    def device_id(self) -> int:
        """Return the id of the device, 0 while none is known."""
        return self.device.component if self.device else self._wanted

    @property
    def inactive_reason(self) -> str:
        """Return why the device is not managed, for people; '' if it is."""
        if self.state is ManagerState.INACTIVE:
            return f'{self.other} manages gimbal {self.device or self.device_id} too'
        if self.state is ManagerState.LISTENING:
            return 'the manager listens for other managers'
        if self.state is ManagerState.ACTIVE:
            return ''
        device = f'gimbal device {self._wanted}' if self._wanted else 'a gimbal device'
        others = ', '.join(map(str, sorted(self._other_devices)))
        return f'{device} has not been heard' + (f'; heard: {others}' if others else '')

    def link_opened(self, now: float) -> None:
        """Record that the link is open."""
        if not self.has_mavlink:
            self._advance(ManagerInput.DEVICE_HEARD, now)

    def link_closed(self, now: float) -> None:
        """Record that the link is closed."""
        self.other = None
        self._advance(ManagerInput.DEVICE_LOST, now)

    def hear_device(self, source: Address, now: float) -> bool:
        """Receive a message of a gimbal device; return whether it is the manager's."""
        if (not self.has_mavlink or source.system != self._address.system
                or self._wanted not in (0, source.component)
                or self.device not in (None, source)):
            if len(self._other_devices) < MAX_OTHER_DEVICES:
                self._other_devices.add(source)
            return False
        self.device, self._device_heard = source, now
        self._advance(ManagerInput.DEVICE_HEARD, now)
        return True

    def hear_manager(self, source: Address, device_id: int, now: float) -> None:
        """Receive the announcement of a device by a manager."""
        if source != self.device and (
                source.system != self._address.system or device_id != self.device_id):
            return
        self.other, self._other_heard = source, now
        self._advance(ManagerInput.MANAGER_HEARD, now)

    def poll(self, now: float) -> None:
        """Act on each time-out that is over."""
        if self.device and now >= self._device_heard + DEVICE_TIMEOUT:
            self._advance(ManagerInput.DEVICE_LOST, now)
            # If no id is configured, the next device may be another one.
            self.device = None
        if self.other and now >= self._other_heard + MANAGER_TIMEOUT:
            self.other = None
            self._advance(ManagerInput.MANAGER_LOST, now)
        if now >= self._listening_until:
            self._advance(ManagerInput.TIME_OVER, now)

    @property
    def due(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        return min(
            self._listening_until,
            self._device_heard + DEVICE_TIMEOUT if self.device else math.inf,
            self._other_heard + MANAGER_TIMEOUT if self.other else math.inf)

    def _advance(self, input_: ManagerInput, now: float) -> None:
        before = self.state
        self.state = TRANSITIONS.get((before, input_), before)
        if self.state is before:
            return
        self._listening_until = math.inf
        if self.state is ManagerState.LISTENING:
            self._listening_until = now + LISTENING_TIME + RANDOM_TIME * self._draw()
        self._changed(
            StateChanged(before, self.state, self.device_id, self.device, self.other), now)
