# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A run of ``conformance`` against simulated or other devices, on a virtual clock."""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
from dataclasses import replace
from typing import Any

from illuminator_ros.checks.coroutines import Interrupted
from illuminator_ros.checks.requirements import (
    CheckResult,
    CheckVerdict,
    PayloadChecks,
    Requirement,
)
from illuminator_ros.checks.runner import absence, CheckRunner
from illuminator_ros.checks.session import Conditions, Session
from illuminator_ros.cli.conformance.run import LISTEN_TIME
from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandLong
from illuminator_ros.simulation.simulated import Properties, SimulatedComponents
from support.wire import Line, START

OURS = Address(255, 190)
KINDS = tuple(PAYLOADS)
# A heading of the vehicle that distinguishes the frames of yaw.
PROPERTIES: dict[str, dict[str, Any]] = {'gimbal_manager': {'heading': 40.0}}
FIND_TIMEOUT = 10.0
# s for which simulated devices have been on when a run begins.
UPTIME = 100.0
# s since 1970 at 0 on the link's clock.
UTC = 1.7e9


class ChecksRun:
    """
    A session with its checks, devices, and the line between them.

    :param only: names of requirements, all if empty.
    :param version: of MAVLink, by default the one that the device needs.
    """

    def __init__(
        self, checks: PayloadChecks[Any], devices: Endpoint, *, target: Address | None = None,
        consent: bool = True, only: Sequence[str] = (),
        requirements: Sequence[Requirement[Any]] = (), version: int = 0, **options: float,
    ) -> None:
        self.checks = checks
        self.devices: Any = devices
        defaults = {one.name: one.default for one in checks.options}
        self.session: Session = checks.session(Conditions(
            OURS, target, {**defaults, **options},
            lambda: self.link.near.decoder.counters.crc_errors, lambda: UTC + self.link.now))
        self.session.consent = consent
        self.link = Line(self.session, devices,
                         version=version or checks.mavlink_version or 2)
        self.runner = CheckRunner(
            checks, self.session, [one for one in requirements or checks.requirements
                                   if not only or one.name in only])
        self.session.runner.run(self._main())

    async def _main(self) -> None:
        missing = ''
        with contextlib.suppress(Interrupted):
            await self.session.find(FIND_TIMEOUT, LISTEN_TIME)
            if self.session.components.found is None:
                missing = absence(self.session, self.checks, FIND_TIMEOUT)
        await self.runner.run(missing)

    @property
    def component(self) -> Any:
        """Return the first simulated component."""
        return self.devices.components[0]

    @property
    def device(self) -> Any:
        """Return the state of the first simulated device."""
        return self.component.device

    def finish(self) -> ChecksRun:
        """Run the checks to their end."""
        self.link.run_until(lambda: not self.session.runner.running, within=3600.0)
        return self

    def interrupt(self) -> None:
        """Interrupt the run."""
        self.session.runner.interrupt(self.link.now)

    def fault(self, name: str) -> None:
        """Switch a fault of the first device on."""
        self.component.behave(
            self.device.faults.add(self.component.behaviour, name), self.link.now)

    def set_interval(self, seconds: float) -> None:
        """Set the interval of the status, as another sender; -1 stops the stream."""
        address: Address = self.component.address
        self.component.receive(Address(255, 1), CommandLong(
            *address, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0,
            next(iter(self.device.streams())), seconds if seconds < 0 else 1e6 * seconds,
            0, 0, 0, 0, 0), self.link.now)

    def names(self, verdict: CheckVerdict) -> set[str]:
        """Return the names of the requirements with a verdict."""
        return {one.requirement.name for one in self.runner.results if one.verdict is verdict}

    @property
    def failed(self) -> set[str]:
        """Return the names of the requirements that the device does not meet."""
        return self.names(CheckVerdict.FAIL)

    def result(self, name: str) -> CheckResult:
        """Return the result of a requirement."""
        (result,) = [one for one in self.runner.results if one.requirement.name == name]
        return result


def start(
    kind: str, *faults: str, of: Properties | None = None, others: Sequence[Properties] = (),
    **options: Any,
) -> ChecksRun:
    """
    Begin to check a simulated device.

    :param kind: the name of a payload.
    :param faults: of the device.
    :param of: its properties, by default those of its kind.
    :param others: the properties of further devices of this kind.
    :param options: see :class:`ChecksRun`; other ones replace properties of the device.
    """
    simulated = PAYLOADS[kind].load('simulated')
    properties = of or simulated.properties
    changes = PROPERTIES.get(kind, {}) | {
        name: options.pop(name) for name in list(options) if hasattr(properties, name)}
    behaviour = properties.behaviour
    for fault in faults:
        behaviour = simulated.device.faults.add(behaviour, fault)
    devices = [simulated.device(one) for one in (
        replace(properties, behaviour=behaviour, **changes), *others)]
    for device in devices:
        device.set_clock(UTC + START, START)
    return ChecksRun(PAYLOADS[kind].load('checks'),
                     SimulatedComponents(devices, START - UPTIME), **options)


def run(kind: str, *faults: str, **options: Any) -> ChecksRun:
    """Check a simulated device, see :func:`start`."""
    return start(kind, *faults, **options).finish()
