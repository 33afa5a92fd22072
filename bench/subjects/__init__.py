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

# In the order in which they are run.
SUBJECTS = {
    'enable': 'the time that ~/enable takes, and 50 clients at the same moment',
    'status': 'the time from a status on the wire to a subscriber',
    'gimbal': 'the time from a rate of a gimbal to the datagram',
    'foreign': 'CPU for the frames of others on the link',
    'burst': 'frames lost of a burst',
    'noise': 'frames recovered from noise',
    'memory': 'memory of the bridge above an empty node, and its growth',
    'startup': 'the time from the start of the process to service',
    'overhead': 'the bytes that the bridge adds to a link',
    'lights': 'CPU for a status with many lights on one link',
    'nodes': 'many nodes in one process',
    'reconnection': 'the time until the link is up again',
    'loss': 'commands through loss',
    'parallel': 'the delay that a silent light causes to others',
    'gimbal_manager': 'the way of a setpoint, and control that players compete for',
    'rededge': 'the way of a fix to a camera, and CPU',
    'limits': 'the documented time limits',
}
