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

"""One file for each subject, with a function ``measure`` that yields its rows."""

from __future__ import annotations

from pathlib import Path

# In the order of the runs.
SUBJECTS = {
    'enable': 'time of a call of ~/enable',
    'status': 'time from a status to a subscriber',
    'foreign': 'CPU for frames of others on the link',
    'busy': '~/enable beside frames of others',
    'burst': 'frames lost from a burst',
    'noise': 'frames recovered from noise',
    'memory': 'memory above that of an empty node',
    'soak': 'whether memory stays flat',
    'startup': 'time from the start of the process to an answer',
    'overhead': 'bytes that the bridge adds to a link',
    'lights': 'CPU for a status with many lights on one link',
    'nodes': 'many nodes in one process',
    'rates': 'CPU with a status at 1, 10 and 50 Hz',
    'serial_line': 'a slow and a fast serial line, used by others too',
    'reconnection': 'time until a link is open again',
    'loss': 'commands through loss',
    'parallel': 'effect of a silent light on others',
}
# Without promises.py its subject is left out.
if Path(__file__).parents[1].joinpath('promises.py').exists():
    SUBJECTS['promises'] = 'documented time limits'
