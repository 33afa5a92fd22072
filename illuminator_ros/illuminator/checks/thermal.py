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

"""The requirement on the error flags of a hot light."""

from __future__ import annotations

from .specification import ILLUMINATOR
from .tester import LightTester
from ..model import ErrorFlag, flag_names, Status
from ...payload.checks.requirement import Failed, requirement, Skipped

# Smallest rise of temperature that explains a flag, K.
STEP = 0.5
THERMAL = (ErrorFlag.THERMAL_THROTTLING, ErrorFlag.OVER_TEMPERATURE_SHUTDOWN)


@requirement('thermal-flags', 'sets thermal error flags according to its temperature', ILLUMINATOR,
             'ILLUMINATOR_ERROR_FLAGS', needs_consent=True)
async def thermal(tester: LightTester) -> str:
    """Keep it at 100 % for some time, then off for as long, and compare."""
    heat = tester.conditions.options['heat']
    if not heat:
        raise Skipped('disabled by --heat 0')
    await tester.baseline()
    start = await tester.status()
    if start is None or start.temperature is None:
        raise Skipped('it reports no temperature')
    if start.error_flags & ErrorFlag.THERMISTOR_FAILURE:
        raise Skipped('its temperature sensor has failed')
    await tester.configure(brightness=100.0)
    on = (await tester.switch(True)).transaction
    if not on.accepted:
        raise Skipped(f'it cannot be switched on: {on.answer}')
    seen = [start, *await _sample(tester, heat)]
    await tester.switch(False)
    seen += await _sample(tester, heat)
    return _judge([one for one in seen if one.temperature is not None], heat)


async def _sample(tester: LightTester, heat: float) -> list[Status]:
    samples, until = [], tester.session.now + heat
    while tester.session.now < until:
        samples.append(await tester.status())
        await tester.session.runner.sleep(min(0.5, heat / 5))
    return [one for one in samples if one is not None]


def _judge(seen: list[Status], seconds: float) -> str:
    """
    Return the temperatures at which flags were set.

    A flag must not be set at a temperature at which it was not set at first. Consecutive samples
    are not compared: between them a small light may heat up and cool down.

    :raises Failed: if a flag was.
    """
    start, hottest = seen[0].temperature or 0.0, max(one.temperature or 0.0 for one in seen)
    if not any(one.temperature for one in seen):
        raise Skipped('it reports no temperature')
    ranges = []
    for flag in THERMAL:
        flagged = [one.temperature or 0.0 for one in seen if one.error_flags & flag]
        if not flagged or seen[0].error_flags & flag:
            continue
        name = flag_names(flag)[0]
        if min(flagged) < start + STEP:
            raise Failed(f'{name} at {min(flagged):.1f} degC; it was not set at '
                         f'{start:.1f} degC before')
        ranges.append(f'{name} from {min(flagged):.1f} to {max(flagged):.1f} degC')
    if not ranges:
        raise Skipped(f'{seconds:g} s at 100 % heated it from {start:.1f} to {hottest:.1f} degC '
                      'and set no flag; try a longer --heat')
    return ', '.join(ranges)
