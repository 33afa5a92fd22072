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

"""In what a light differs from what it was told, unless there is a good reason."""

from __future__ import annotations

from .error_flags import DIMMING_FLAGS
from .model import Configuration, Mode


def unexplained(
    agreed: Configuration, reported: Configuration, flags: int, *, step: bool,
    external: bool = True,
) -> list[str]:
    """
    Return the fields in which a light differs from its agreed configuration without reason.

    There are two good reasons: it dims itself because it is hot, and under external sync its
    output follows another signal.

    :param external: whether external sync is to count as a reason.
    :param step: whether the light's own rounding is passed over.
    """
    names = agreed.differences(reported, step=step)
    # A light that does not say which mode it is in does not contradict.
    if reported.mode is Mode.UNKNOWN or step and agreed.mode is Mode.UNKNOWN:
        names = [name for name in names if name != 'mode']
    if flags & DIMMING_FLAGS and reported.brightness < agreed.brightness:
        names = [name for name in names if name != 'brightness']
    if external and agreed.mode is reported.mode is Mode.EXTERNAL_SYNC:
        names = []
    return names
