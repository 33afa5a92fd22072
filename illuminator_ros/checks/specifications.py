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

"""The pages of the MAVLink guide that have requirements on any component."""

from __future__ import annotations

from typing import NamedTuple


class Specification(NamedTuple):
    """A page that contains requirements."""

    title: str
    url: str


_GUIDE = 'https://mavlink.io/en/'
HEARTBEAT = Specification('heartbeat protocol', _GUIDE + 'services/heartbeat.html')
COMMAND = Specification('command protocol', _GUIDE + 'services/command.html')
MESSAGES = Specification('common message set', _GUIDE + 'messages/common.html')
ROUTING = Specification('routing', _GUIDE + 'guide/routing.html')
SERIALIZATION = Specification('serialization', _GUIDE + 'guide/serialization.html')
