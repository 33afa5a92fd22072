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

"""The faults of a simulated light: those of any component, and its own."""

from __future__ import annotations

from .model import ErrorFlag
from ..payload.faults import Fault, FaultTable
from ..payload.faults import FAULTS as COMPONENT_FAULTS
from ..payload.settings import integer

FAULTS = FaultTable({
    **COMPONENT_FAULTS,
    'thermistor': Fault('thermistor_failed', 'its temperature sensor fails: THERMISTOR_FAILURE, '
                        'and temp_c stays at 0'),
    'no-clock': Fault('has_clock', 'reports an uptime of 0', default=False),
    'no-identity': Fault('identifies', 'sends no COMPONENT_INFORMATION_BASIC', default=False),
    'no-terminator': Fault('padding', 'fills its strings with blanks, to the last byte',
                           default=' '),
    'nan': Fault('accepts_nan', 'accepts NaN'),
    'anything': Fault('accepts_out_of_range', 'accepts values out of range'),
    'toggle': Fault('toggles', 'is switched off by switching it on again'),
    'flags': Fault('false_flags', 'reports error flags without a reason',
                   'FLAGS', integer(1, 0xFFFFFFFF), int(ErrorFlag.OVER_TEMPERATURE_SHUTDOWN)),
    'cold-throttling': Fault('inverted_flags', 'reports THERMAL_THROTTLING while it is on and '
                             'cool, not while it is hot'),
})
