# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The kinds of components, for people: by HEARTBEAT, and by other messages that are heard."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from ..device_kind import DeviceKind
from ..dialect import mavlink, short_names
from ..messages import Address, Heartbeat

AUTOPILOT = 'autopilot'
# By MAV_TYPE. Each other type is a device of a payload, an autopilot, or called as in the dialect.
TYPES = {
    mavlink.MAV_TYPE_CAMERA: 'camera',
    mavlink.MAV_TYPE_GCS: 'ground station',
    mavlink.MAV_TYPE_ONBOARD_CONTROLLER: 'onboard computer',
}
AUTOPILOTS = {mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: 'ArduPilot', mavlink.MAV_AUTOPILOT_PX4: 'PX4'}
# The most components that are named in one text.
MAX_NAMED = 8


def kinds(
    address: Address, heartbeat: Heartbeat | None, messages: Collection[int] = (),
    known: Collection[DeviceKind] = (),
) -> list[str]:
    """
    Return what a component is, such as ``['autopilot', 'ArduPilot', 'light']``.

    :param messages: the ids of messages that it has sent.
    :param known: the devices of payloads.
    """
    # ArduSub is a light, and an autopilot a gimbal manager, without a HEARTBEAT of it.
    found = [kind.name for kind in known if not {*kind.messages}.isdisjoint(messages)]
    return [*dict.fromkeys([
        *(_by_heartbeat(address, heartbeat, known) if heartbeat else ()), *found])]


def _by_heartbeat(
    address: Address, heartbeat: Heartbeat, known: Collection[DeviceKind],
) -> list[str]:
    kind, autopilot = heartbeat.type, heartbeat.autopilot
    devices = [one.name for one in known
               if one.mav_type == kind and one.component in (None, address.component)]
    if devices or kind in TYPES:
        return devices or [TYPES[kind]]
    if autopilot != mavlink.MAV_AUTOPILOT_INVALID:
        return [AUTOPILOT, *([AUTOPILOTS[autopilot]] if autopilot in AUTOPILOTS else [])]
    return [short_names('MAV_TYPE').get(kind, f'type {kind}').lower().replace('_', ' ')]


def described(
    addresses: Collection[Address], heartbeats: Mapping[Address, Heartbeat],
    known: Collection[DeviceKind],
) -> str:
    """
    Return components with their kinds, the first few by name.

    :param known: the devices of payloads.
    """
    def one(address: Address) -> str:
        found = kinds(address, heartbeats.get(address), known=known)
        return f'{address} ({", ".join(found) or "no HEARTBEAT"})'

    return listed([one(address) for address in sorted(addresses)])


def listed(texts: Collection[str]) -> str:
    """Return texts as one, the first few by name."""
    *most, last = [*texts][:MAX_NAMED]
    if len(texts) > MAX_NAMED:
        most, last = [*most, last], f'{len(texts) - MAX_NAMED} more'
    return f'{", ".join(most)} and {last}' if most else last
