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

"""Reading the settings of simulated components from the command line and a YAML file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...payload.settings import Setting


class SettingError(ValueError):
    """A setting that does not exist or has a wrong value; the message names it."""


def read(settings: Mapping[str, Setting], name: str, value: Any, place: str) -> Any:
    """
    Return the value of a setting.

    :param value: text or, from a file, a number, a list or a mapping.
    :param place: where it was found, for the message.
    :raises SettingError: if it is wrong.
    """
    try:
        return settings[name].read(_as_text(value))
    except ValueError as error:
        raise SettingError(f'{place}: {error}') from error


def _as_text(value: Any) -> str:
    if isinstance(value, Mapping):
        return ','.join(str(key) if one is True or one is None else f'{key}={one}'
                        for key, one in value.items())
    if isinstance(value, list | tuple):
        return ','.join(map(_as_text, value))
    return '' if value is None else str(value)


def merged(settings: Mapping[str, Setting], *layers: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of several layers; later layers take precedence."""
    result: dict[str, Any] = {}
    for layer in layers:
        for name, value in layer.items():
            if settings[name].adds and name in result:
                before = result[name]
                value = {**before, **value} if isinstance(value, dict) else before + value
            result[name] = value
    return result
