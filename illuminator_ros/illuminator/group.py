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

"""Several lights switched at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import functools

from .light import Light
from ..payload.request import Done, Result


def enable_all(
    lights: Sequence[Light], on: bool, now: float, done: Done, *,
    name: Callable[[Light], str], detail: str = '',
) -> None:
    """
    Switch all connected lights on or off, in parallel.

    :param done: called once, when the last light has answered. It is a success if all connected
        lights succeeded, of which there must be one; the message has the outcome of each.
    :param name: returns the name of a light, for people.
    :param detail: as for :meth:`Light.enable`.
    """
    connected = [light for light in lights if light.connected]
    outcomes: dict[Light, Result] = {}

    def outcome(light: Light, result: Result, now: float) -> None:
        outcomes[light] = result
        if len(outcomes) == len(connected):
            done(_summary(on, [
                (name(one), outcomes.get(one) or Result(False, one.unreachable(now)))
                for one in lights], [outcomes[one].success for one in connected]), now)

    for light in connected:
        light.enable(on, now, functools.partial(outcome, light), detail=detail)
    if not connected:
        lost = '; '.join(f'{name(light)}: {light.unreachable(now)}' for light in lights)
        done(Result(False, lost or 'no light has been heard yet'), now)


def _summary(
    on: bool, outcomes: list[tuple[str, Result]], successes: list[bool],
) -> Result:
    done = f'{sum(successes)} of {len(successes)} {"on" if on else "off"}'
    return Result(all(successes), '; '.join(
        [done, *(f'{name}: {result.message}' for name, result in outcomes)]))
