# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""A run of ``conformance`` against devices, without links and clocks."""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
from typing import Any, TypeVar

from illuminator_ros.cli.conformance.run import LISTEN_TIME
from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.checks import requirement
from illuminator_ros.payload.checks.coroutines import Interrupted
from illuminator_ros.payload.checks.runner import absence, CheckRunner
from illuminator_ros.payload.checks.session import Conditions
from illuminator_ros.payload.simulated import SimulatedComponents
from support.virtual_link import VirtualLink

TESTER = Address(255, 190)
FIND_TIMEOUT = 10.0

R = TypeVar('R', bound='ChecksRun')


class ChecksRun:
    """
    A session with its checks, devices, and the line between them.

    :param devices: simulated or other devices.
    :param only: names of requirements, all if empty.
    :param version: of MAVLink.
    :param utc: the time at 0 of the link's clock, s since 1970.
    """

    def __init__(
        self, checks: requirement.PayloadChecks[Any], devices: Endpoint, *,
        target: Address | None = None, consent: bool = True, only: tuple[str, ...] = (),
        requirements: Sequence[requirement.Requirement[Any]] = (), version: int = 2,
        utc: float = 0.0, **options: float,
    ) -> None:
        self.checks = checks
        if isinstance(devices, SimulatedComponents):
            self.component = devices.components[0]
            self.device: Any = self.component.device
        defaults = {one.name: one.default for one in checks.options}
        self.session = checks.session(Conditions(
            TESTER, target, {**defaults, **options},
            lambda: self.link.decoders[0].counters.crc_errors, lambda: utc + self.link.now))
        self.session.consent = consent
        self.link = VirtualLink(self.session, devices, version)
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

    def finish(self: R) -> R:
        """Run the checks to their end."""
        self.link.run_until(lambda: not self.session.runner.running, within=3600.0)
        return self

    def names(self, verdict: requirement.Verdict) -> set[str]:
        """Return the names of the requirements with a verdict."""
        return {one.requirement.name for one in self.runner.results if one.verdict is verdict}

    @property
    def failed(self) -> set[str]:
        """Return the names of the requirements that the device does not meet."""
        return self.names(requirement.Verdict.FAIL)

    def result(self, name: str) -> requirement.Result:
        """Return the result of a requirement."""
        (result,) = [one for one in self.runner.results if one.requirement.name == name]
        return result
