# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The receiving side of the MAVLink command protocol; no I/O, and time is passed in.

https://mavlink.io/en/services/command.html: each received COMMAND_LONG and COMMAND_INT is
acknowledged once. A COMMAND_LONG that its sender repeats, with ``confirmation`` counted up, is
acknowledged again but not executed again. COMMAND_INT has no such field.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import NamedTuple

from . import messages as mav
from .dialect import encode, mavlink, replaced

# Commands whose result is remembered, one of each kind from each sender.
MAX_RESULTS = 256
# s since the last frame of a command in which a frame with a confirmation above 0 repeats it.
REPEAT_TIME = 5.0

# Executes a command; None if it is not supported.
Execute = Callable[[mav.Address, mav.AnyCommand, float], int | None]


class _Executed(NamedTuple):
    payload: bytes
    result: int
    at: float


class CommandReceiver:
    """
    Decides which received commands are executed, and how they are acknowledged.

    :param address: our own address.
    """

    def __init__(self, address: mav.Address) -> None:
        self._address = address
        self._executed: dict[tuple[mav.Address, int], _Executed] = {}

    def receive(
        self, source: mav.Address, command: mav.AnyCommand, now: float, execute: Execute,
    ) -> mav.CommandAck | None:
        """
        Take a command and return its acknowledgement.

        :return: None for a command to another component, and for an unsupported one to all
            components.
        """
        target = mav.target_of(command)
        if not target.includes(self._address):
            return None
        result = self._result(source, command, now, execute)
        if result is None:
            if target != self._address:
                return None
            result = mavlink.MAV_RESULT_UNSUPPORTED
        return mav.CommandAck(command.command, result, 0, 0, *source)

    def _result(
        self, source: mav.Address, command: mav.AnyCommand, now: float, execute: Execute,
    ) -> int | None:
        if isinstance(command, mav.CommandInt):
            return execute(source, command, now)
        key = source, command.command
        payload = encode(replaced(command, confirmation=0))
        last = self._executed.pop(key, _Executed(b'', mavlink.MAV_RESULT_FAILED, -math.inf))
        if command.confirmation and last.payload == payload and now < last.at + REPEAT_TIME:
            result: int | None = last.result
        else:
            result = execute(source, command, now)
        # A repeat of a temporarily rejected command must be executed.
        if result not in (None, mavlink.MAV_RESULT_TEMPORARILY_REJECTED):
            self._executed[key] = _Executed(payload, result, now)
            if len(self._executed) > MAX_RESULTS:
                del self._executed[next(iter(self._executed))]
        return result
