# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Registration: the parts of a payload, each imported only by the program that uses it."""

from __future__ import annotations

from importlib import import_module
from typing import Any, NamedTuple

from ..mavlink.device_kind import DeviceKind


class PayloadType(NamedTuple):
    """
    One kind of payload: a light, a winch, a camera ...

    Each part is named as ``module:ATTRIBUTE``, '' for a part that does not exist, so that the
    simulator runs without ROS and the bridge without the checks.

    :param name: its name in ``--payload`` and in the parameter ``payloads``.
    :param ros: its node, topics, services and parameters.
    :param simulated: its simulated device.
    :param checks: the requirements that ``conformance`` checks.
    :param view: how the monitor shows its devices.
    :param device: how a device is recognised, for ``discover``, ``serial://auto`` and reports of
        what is heard.
    """

    name: str
    ros: str = ''
    simulated: str = ''
    checks: str = ''
    view: str = ''
    device: DeviceKind | None = None

    def load(self, part: str) -> Any:
        """
        Import a part and return it.

        :param part: ``ros``, ``simulated``, ``checks`` or ``view``.
        :raises LookupError: if the payload does not have that part.
        """
        module, _, attribute = getattr(self, part).partition(':')
        if not module:
            raise LookupError(f'payload {self.name} has no part {part}')
        return getattr(import_module(module), attribute)
