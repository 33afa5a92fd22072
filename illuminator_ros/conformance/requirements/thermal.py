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

from ...illuminator.model import ErrorFlag, flag_names, Status
from ..bench import Bench
from ..requirement import Failed, ILLUMINATOR, requirement, Skipped

# K that a light has to get warmer, or cooler, for a flag to have a reason.
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
    temperatures = [one.temperature or 0.0 for one in seen]
    if not any(temperatures):
        raise Skipped('it reports no temperature')
    changes = []
    for flag in THERMAL:
        # The temperature at which the flag last changed, or was first seen as it is.
        since = temperatures[0]
        for before, after, temperature in zip(seen, seen[1:], temperatures[1:], strict=False):
            if not (before.error_flags ^ after.error_flags) & flag:
                continue
            name = flag_names(flag)[0]
            if after.error_flags & flag:
                if temperature < since + STEP:
                    raise Failed(f'{name} began at {temperature:.1f} degC; at {since:.1f} degC '
                                 'there was none')
                changes.append(f'{name} from {temperature:.1f} degC')
            else:
                if temperature > since - STEP:
                    raise Failed(f'{name} ended at {temperature:.1f} degC, having begun at '
                                 f'{since:.1f} degC')
                changes.append(f'to {temperature:.1f} degC')
            since = temperature
    if not changes:
        raise Skipped(f'{seconds:g} s at 100 % brought it from {temperatures[0]:.1f} to '
                      f'{max(temperatures):.1f} degC and no flag; try a longer --heat')
    return ', '.join(changes)
