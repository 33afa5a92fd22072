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

"""What checks do to a light: switch and configure it, and see whether it shows that."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .comparison import differences, same
from .describe import status_text
from .exchange import Exchange, SHOW_TIMEOUT
from .transaction import Finding, Transaction
from ..model import Configuration, Mode, Status
from ...mavlink.messages import Address, INFORMATION_ID, MavCmd, MavResult, STATUS_ID

# The brightness at which a light may be switched on without asking, %.
LOW = 10.0
# The brightness that is not exceeded without asking, %.
DIM = 20.0


class Bench(Exchange):
    """
    The tester's side.

    :param target: the light; None takes the first that is heard.
    :param consent: whether the light may strobe and shine at 100 %.
    :param heat: s at 100 % in which it may get hot.
    :param checksum_errors: returns how many frames had a wrong checksum.
    :param link_fault: returns why the link is not open, '' if it is.
    :ivar rest: the statuses that came before anything was asked for.
    :ivar disagreements: accepted changes that the status did not show.
    :ivar disobediences: refused changes after which the status was another.
    """

    def __init__(
        self, identity: Address, *, target: Address | None = None, consent: bool = True,
        heat: float = 5.0, checksum_errors: Callable[[], int] = lambda: 0,
        link_fault: Callable[[], str] = lambda: '',
    ) -> None:
        super().__init__(identity, target)
        self.consent = consent
        self.heat = heat
        self.checksum_errors = checksum_errors
        self.link_fault = link_fault
        self.rest: list[tuple[float, Status]] = []
        self.disagreements: list[Finding] = []
        self.disobediences: list[Finding] = []

    async def status(self) -> Status | None:
        """Return what the light reports now, None if it does not."""
        came = await self.request(STATUS_ID, self.statuses)
        if came is None:
            # It may stream what it does not send on request.
            before = len(self.statuses)
            if await self.more(self.statuses, before, 2.5):
                came = self.statuses[-1]
        return came[1] if came else None

    async def information(self) -> Any:
        """Return the COMPONENT_INFORMATION_BASIC, None if there is none."""
        return await self.request(INFORMATION_ID, self.informations)

    async def switch(self, on: bool, *, as_int: bool = False, confirmation: int = 0
                     ) -> Transaction:
        """Switch the light and note whether it shows what it accepted."""
        one = await self.command(
            MavCmd.ILLUMINATOR_ON_OFF, float(on), as_int=as_int, confirmation=confirmation)
        await self._agree(one, lambda status: [] if status.enabled == on else ['enable'])
        return one

    async def configure(
        self, mode: int = Mode.INTERNAL_CONTROL, brightness: float = LOW, period: float = 0.0,
        duty: float = 0.0,
    ) -> Transaction:
        """Configure the light and note whether it shows what it accepted."""
        asked = Configuration(Mode(mode), brightness, period, duty)
        one = await self.command(MavCmd.DO_ILLUMINATOR_CONFIGURE, mode, brightness, period, duty)
        await self._agree(one, lambda status: differences(asked, status))
        return one

    async def _agree(self, one: Transaction, differ: Callable[[Status], list[str]]) -> None:
        if not one.accepted:
            return
        begun, since = len(self.log), self.now
        while True:
            status = await self.status()
            if status is None or not differ(status):
                return
            if self.now - since >= SHOW_TIMEOUT:
                break
            await self.sleep(0.1)
        one.not_shown = differ(status)
        one.disagreement = (
            f'{one.text}: {one.answer}, but then the status differs in '
            f'{" and ".join(one.not_shown)}: {status_text(status)}',
            one.lines + self.log[begun:][-2:])
        self.disagreements.append(one.disagreement)

    async def refused(self, command: int, params: tuple[float, ...]) -> Finding | None:
        """Send what has to be denied; return what is wrong with the answer, None if nothing."""
        before = await self.status()
        one = await self.command(command, *params)
        after = await self.status()
        restarted = before and after and after.uptime_ms < before.uptime_ms
        if before and after and not (one.accepted or restarted or same(before, after)):
            self.disobediences.append((
                f'{one.text}: {one.answer}, and then {status_text(after)}', one.lines))
        if one.result == MavResult.DENIED:
            return None
        if one.accepted:
            await self.baseline()
        return one.finding()

    async def baseline(self) -> None:
        """Bring the light to where checks begin: off, at low brightness, without strobe."""
        status = await self.status()
        low = Configuration(Mode.INTERNAL_CONTROL, LOW, 0.0, 0.0)
        if status is None or status.enabled is not False:
            await self.command(MavCmd.ILLUMINATOR_ON_OFF, 0.0)
            status = await self.status()
        if status is None or differences(low, status):
            await self.command(MavCmd.DO_ILLUMINATOR_CONFIGURE, *low.params())
            status = await self.status()
        if status is not None and status.enabled:
            # Where brightness and switch are one.
            await self.command(MavCmd.ILLUMINATOR_ON_OFF, 0.0)

    async def watch(self, seconds: float) -> list[tuple[float, Status]]:
        """Return the statuses that come in a time."""
        before = len(self.statuses)
        await self.sleep(seconds)
        return self.statuses[before:]
