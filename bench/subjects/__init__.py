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

# In the order in which they are run.
SUBJECTS = {
    'enable': 'how long ~/enable takes',
    'status': 'how long a status takes to a subscriber',
    'foreign': 'CPU for the frames of others on the link',
    'busy': '~/enable beside the frames of others',
    'burst': 'frames lost of a burst',
    'noise': 'frames recovered from noise',
    'memory': 'what the bridge takes above an empty node',
    'soak': 'whether memory stays flat',
    'startup': 'how long it takes from the start of the process to service',
    'overhead': 'the bytes that the bridge adds to a link',
    'lights': 'CPU for a status with many lights on one link',
    'nodes': 'many nodes in one process',
    'rates': 'CPU with a status at 1, 10 and 50 Hz',
    'serial_line': 'a slow and a fast serial line, used by others too',
    'reconnection': 'how soon the link is up again',
    'loss': 'commands through loss',
    'parallel': 'what a silent light costs the others',
}
# What is not there is left out.
if Path(__file__).parents[1].joinpath('promises.py').exists():
    SUBJECTS['promises'] = 'whether what is promised in time is done in time'
