# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The kinds of components, for people: by HEARTBEAT, and by other messages that are heard."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from .dialect import mavlink, short_names
from .messages import Address, Heartbeat

AUTOPILOT, LIGHT, MANAGER, GIMBAL = 'autopilot', 'light', 'gimbal manager', 'gimbal'
MICASENSE = 'MicaSense camera'
# By MAV_TYPE. Each other type is an autopilot, or else is called as in the dialect.
TYPES = {
    mavlink.MAV_TYPE_ILLUMINATOR: LIGHT,
    mavlink.MAV_TYPE_GIMBAL: GIMBAL,
    mavlink.MAV_TYPE_CAMERA: 'camera',
    mavlink.MAV_TYPE_GCS: 'ground station',
    mavlink.MAV_TYPE_ONBOARD_CONTROLLER: 'onboard computer',
}
AUTOPILOTS = {mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: 'ArduPilot', mavlink.MAV_AUTOPILOT_PX4: 'PX4'}
# By message. ArduSub is a light, and an autopilot a gimbal manager, without a HEARTBEAT of it.
MESSAGES = {
    440: LIGHT,  # ILLUMINATOR_STATUS
    mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION: MANAGER,
    mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS: MANAGER,
    mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION: GIMBAL,
    mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS: GIMBAL,
}
# The most components that are named in one text.
MAX_NAMED = 8


def kinds(
    address: Address, heartbeat: Heartbeat | None, messages: Collection[int] = (),
) -> list[str]:
    """
    Return what a component is, such as ``['autopilot', 'ArduPilot', 'light']``.

    :param messages: the ids of messages that it has sent.
    """
    found = [kind for id_, kind in MESSAGES.items() if id_ in messages]
    return [*dict.fromkeys([*(_by_heartbeat(address, heartbeat) if heartbeat else ()), *found])]


def _by_heartbeat(address: Address, heartbeat: Heartbeat) -> list[str]:
    kind, autopilot = heartbeat.type, heartbeat.autopilot
    if kind in TYPES:
        return [TYPES[kind]]
    # A MicaSense camera has the type 0 and a reserved autopilot, and its component id stays.
    if kind == mavlink.MAV_TYPE_GENERIC and address.component == mavlink.MAV_COMP_ID_CAMERA:
        return [MICASENSE]
    if autopilot != mavlink.MAV_AUTOPILOT_INVALID:
        return [AUTOPILOT, *([AUTOPILOTS[autopilot]] if autopilot in AUTOPILOTS else [])]
    return [short_names('MAV_TYPE').get(kind, f'type {kind}').lower().replace('_', ' ')]


def described(
    addresses: Collection[Address], heartbeats: Mapping[Address, Heartbeat],
) -> str:
    """Return components with their kinds, the first few by name."""
    def one(address: Address) -> str:
        known = kinds(address, heartbeats.get(address))
        return f'{address} ({", ".join(known) or "no HEARTBEAT"})'

    return listed([one(address) for address in sorted(addresses)])


def listed(texts: Collection[str]) -> str:
    """Return texts as one, the first few by name."""
    *most, last = [*texts][:MAX_NAMED]
    if len(texts) > MAX_NAMED:
        most, last = [*most, last], f'{len(texts) - MAX_NAMED} more'
    return f'{", ".join(most)} and {last}' if most else last
