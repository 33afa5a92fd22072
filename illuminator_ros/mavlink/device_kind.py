# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""How a device of a payload is recognised among the components of a link; without pymavlink."""

from __future__ import annotations

from typing import NamedTuple


class DeviceKind(NamedTuple):
    """
    A kind of device, recognised by its HEARTBEAT or by a message that it sends.

    :param name: for people, such as ``gimbal manager``.
    :param mav_type: the MAV_TYPE of its HEARTBEAT; None if only messages show it.
    :param messages: the ids of messages that only such a device sends.
    :param component: the component id that the HEARTBEAT must have, too; None for any.
    :param option: its name in ``serial://auto?kind=``, by default :attr:`name` with underscores.
    """

    name: str
    mav_type: int | None = None
    messages: tuple[int, ...] = ()
    component: int | None = None
    option: str = ''
