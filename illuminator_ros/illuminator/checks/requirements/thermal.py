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

"""What a light says while it gets hot."""

from __future__ import annotations

from ..bench import Bench
from ..requirement import Failed, ILLUMINATOR, requirement, Skipped
from ...error_flags import ErrorFlag, flag_names
from ...model import Status

# K that a light has to get warmer for a flag to have a reason.
STEP = 0.5
THERMAL = (ErrorFlag.THERMAL_THROTTLING, ErrorFlag.OVER_TEMPERATURE_SHUTDOWN)


@requirement('thermal-flags', 'its error flags go with its temperature', ILLUMINATOR,
             'ILLUMINATOR_ERROR_FLAGS', dazzles=True)
async def thermal(bench: Bench) -> str:
    """Switch it on at 100 % for a while, then off for as long, and compare."""
    if not bench.heat:
        raise Skipped('not asked for: --heat 0')
    await bench.baseline()
    start = await bench.status()
    if start is None or start.temperature is None:
        raise Skipped('it reports no temperature')
    if start.error_flags & ErrorFlag.THERMISTOR_FAILURE:
        raise Skipped('its temperature sensor has failed')
    await bench.configure(brightness=100.0)
    on = await bench.switch(True)
    if not on.accepted:
        raise Skipped(f'it cannot be switched on: {on.answer}')
    seen = [start, *await _sample(bench)]
    await bench.switch(False)
    seen += await _sample(bench)
    return _judge([one for one in seen if one.temperature is not None], bench.heat)


async def _sample(bench: Bench) -> list[Status]:
    samples = []
    until = bench.now + bench.heat
    while bench.now < until:
        status = await bench.status()
        if status is not None:
            samples.append(status)
        await bench.sleep(min(0.5, bench.heat / 5))
    return samples


def _judge(seen: list[Status], seconds: float) -> str:
    """
    Compare flags and temperatures, but not one sample with the next.

    Between two samples a small light may get hot and cool down again. What holds for all samples
    is that a flag is set at no temperature at which the light began without it.
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
            raise Failed(f'{name} at {min(flagged):.1f} degC; at {start:.1f} degC there was none '
                         'before')
        ranges.append(f'{name} from {min(flagged):.1f} to {max(flagged):.1f} degC')
    if not ranges:
        raise Skipped(f'{seconds:g} s at 100 % brought it from {start:.1f} to {hottest:.1f} degC '
                      'and no flag; try a longer --heat')
    return ', '.join(ranges)
