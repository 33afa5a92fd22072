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

"""Each subject is a generator function of its name that yields its rows."""

# Their modules, in the order in which they are run.
SUBJECTS = {
    'enable': 'services', 'status': 'topics', 'gimbal': 'topics',
    'gimbal_manager': 'gimbal_manager', 'foreign': 'receiving', 'burst': 'receiving',
    'noise': 'receiving', 'memory': 'process', 'startup': 'services', 'overhead': 'link',
    'forward': 'forwarding',
    'lights': 'link', 'nodes': 'process', 'reconnection': 'link', 'loss': 'link',
    'parallel': 'services', 'floods': 'floods', 'rededge': 'rededge', 'limits': 'services',
    'browsers': 'browsers'}
