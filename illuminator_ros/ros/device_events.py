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

"""The events that devices of each kind have, as log lines and topics."""

from __future__ import annotations

from typing import Any

from .node import NodeInterface
from .throttled_log import NodeLog
from ..payload.command_sources import describe
from ..payload.device_events import DeviceConnected, DeviceDisconnected, DeviceEvent, DeviceHeld


def publish_event(
    event: DeviceEvent[Any], kind: str, log: NodeLog, interface: NodeInterface,
) -> None:
    """
    Write the log line of an event, and publish ``~/connected`` or ``~/source``; ignore others.

    :param kind: a noun for the device, such as ``light``.
    """
    match event:
        case DeviceConnected(note=note):
            log.info(f'{kind} {event.key} connected{note and ", "}{note}', 'connection')
            interface.publish('connected', True)
        case DeviceDisconnected(reason=reason):
            log.warning(f'{kind} {event.key} lost: {reason}', 'connection')
            interface.publish('connected', False)
        case DeviceHeld(change=change):
            log.info(f'{kind} {event.key} {describe(change)}', 'holder')
            interface.publish('source', change.after or '')
