# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The payloads that the executables know, by the name that ``--payload`` takes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property

from ..mavlink.device_kind import DeviceKind
from ..payload.payload_type import PayloadType

# The payload of the executables without ``--payload``, and of ``bridge``.
DEFAULT_PAYLOAD = 'illuminator'
# The entry points by which other packages add payloads.
GROUP = 'illuminator_ros.payloads'
OWN_PAYLOADS: Mapping[str, PayloadType] = {one.name: one for one in (
    PayloadType(
        'illuminator', ros='illuminator_ros.illuminator.ros.lights:ILLUMINATOR',
        simulated='illuminator_ros.illuminator.simulated:SIMULATED',
        checks='illuminator_ros.illuminator.checks.requirements:CHECKS',
        view='illuminator_ros.illuminator.ros.monitor_view:VIEW',
        # ILLUMINATOR_STATUS
        device=DeviceKind('light', 44, (440,))),
    PayloadType('rededge', ros='illuminator_ros.rededge.ros.camera_node:REDEDGE',
                simulated='illuminator_ros.rededge.simulated:SIMULATED',
                checks='illuminator_ros.rededge.checks:CHECKS',
                view='illuminator_ros.rededge.ros.monitor_view:VIEW',
                # MAV_TYPE_GENERIC with a reserved autopilot; MAV_COMP_ID_CAMERA stays.
                device=DeviceKind('MicaSense camera', 0, component=100, option='camera')),
    PayloadType(
        'gimbal', ros='illuminator_ros.gimbal.ros.gimbals:GIMBAL',
        simulated='illuminator_ros.gimbal.simulated_device:SIMULATED',
        checks='illuminator_ros.gimbal.checks.device:CHECKS',
        view='illuminator_ros.gimbal.ros.monitor_view:VIEW',
        # GIMBAL_MANAGER_INFORMATION, GIMBAL_MANAGER_STATUS
        device=DeviceKind('gimbal manager', messages=(280, 281))),
    PayloadType(
        'gimbal_manager', ros='illuminator_ros.gimbal.ros.manager_node:GIMBAL_MANAGER',
        simulated='illuminator_ros.gimbal.simulated_manager:SIMULATED',
        checks='illuminator_ros.gimbal.checks.manager:CHECKS',
        # MAV_TYPE_GIMBAL; GIMBAL_DEVICE_INFORMATION, GIMBAL_DEVICE_ATTITUDE_STATUS
        device=DeviceKind('gimbal', 26, (283, 285))),
)}


def _of_other_packages() -> Iterator[PayloadType]:
    """Import the payloads of other packages; one that cannot be imported is a warning."""
    # Slow to import: signals are handled before.
    from importlib.metadata import entry_points
    import logging
    for entry in entry_points(group=GROUP):
        try:
            payload = entry.load()
        except Exception as error:  # noqa: B902
            # The import of another package may fail in any way.
            reason = f'{type(error).__name__}: {error}'
        else:
            if isinstance(payload, PayloadType) and payload.name not in OWN_PAYLOADS:
                yield payload
                continue
            reason = 'it is not a PayloadType with a name of its own'
        logging.getLogger(__name__).warning(
            'payload %s (%s) is ignored: %s', entry.name, entry.value, reason)


class _Payloads(Mapping[str, PayloadType]):
    """All payloads, those of other packages too; these are looked for when they are needed."""

    @cached_property
    def _all(self) -> Mapping[str, PayloadType]:
        return {**OWN_PAYLOADS, **{one.name: one for one in _of_other_packages()}}

    def __getitem__(self, name: str) -> PayloadType:
        return self._all[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)


PAYLOADS: Mapping[str, PayloadType] = _Payloads()


def devices(types: Mapping[str, PayloadType]) -> tuple[DeviceKind, ...]:
    """Return how the devices of payloads are recognised."""
    return tuple(one.device for one in types.values() if one.device)
