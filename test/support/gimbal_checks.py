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

"""Runs of the checks of gimbals against simulated ones, on a virtual clock."""

from __future__ import annotations

from typing import Any

from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.checks.requirement import (
    Conditions,
    PayloadChecks,
    Result,
    Verdict,
)
from illuminator_ros.payload.checks.runner import absence, CheckRunner
from illuminator_ros.payload.simulated import Description, SimulatedComponents, SimulatedType
from support.virtual_link import START, VirtualLink

TESTER = Address(255, 190)


class GimbalRun:
    """
    A session, its checks and a simulated gimbal.

    :param faults: of the gimbal.
    :param settings: of the simulator.
    """

    def __init__(
        self, checks: PayloadChecks[Any], kind: SimulatedType[Any], *faults: str,
        consent: bool = True, only: tuple[str, ...] = (), **settings: object,
    ) -> None:
        address = kind.address(settings)
        device = kind.make(settings, address, False)
        for fault in faults:
            device.behave(device.faults.add(device.behaviour, fault), START - 100.0)
        self.endpoint = SimulatedComponents([Description(address, device)], START - 100.0)
        self.component = self.endpoint.components[0]
        self.device = device
        self.checks = checks
        self.session = checks.session(TESTER)
        self.link = VirtualLink(self.session, self.endpoint)
        options = {one.name: one.default for one in checks.options}
        self.runner: CheckRunner[Any] = CheckRunner(
            checks, self.session, Conditions(
                consent, lambda: self.link.decoders[0].counters.crc_errors, options),
            [one for one in checks.requirements if not only or one.name in only])
        self.session.runner.run(self._main())

    async def _main(self) -> None:
        await self.session.find(10.0, 4.5)
        await self.runner.run('' if self.session.found else absence(
            self.session, self.checks, 10.0))

    def finish(self) -> GimbalRun:
        """Let the run end."""
        self.link.run_until(lambda: not self.session.runner.running, within=3600.0)
        return self

    def names(self, verdict: Verdict) -> set[str]:
        """Return the names of the requirements with a verdict."""
        return {one.requirement.name for one in self.runner.results if one.verdict is verdict}

    @property
    def failed(self) -> set[str]:
        """Return the names of the requirements that the gimbal does not meet."""
        return self.names(Verdict.FAIL)

    def result(self, name: str) -> Result:
        """Return the result of a requirement."""
        (result,) = [one for one in self.runner.results if one.requirement.name == name]
        return result
