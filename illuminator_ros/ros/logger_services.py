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

"""The logger services of a process, with bounded requests."""

from __future__ import annotations

from rcl_interfaces.msg import LoggerLevel, SetLoggerLevelsResult
from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from rclpy.logging import get_logger_level, LoggingSeverity, set_logger_level
from rclpy.node import Node

from .parameter_services import MAX_NAMES
from .throttled_log import LogForwarder

# rcl never forgets a logger whose level was set.
MAX_LOGGERS = 200


class LoggerServices:
    """``~/get_logger_levels`` and ``~/set_logger_levels``, for all loggers of the process."""

    def __init__(self, node: Node, frame_log: LogForwarder) -> None:
        self._frame_log = frame_log
        self._names: set[str] = set()
        node.create_service(GetLoggerLevels, '~/get_logger_levels', self._get)
        node.create_service(SetLoggerLevels, '~/set_logger_levels', self._set)

    def _get(
        self, request: GetLoggerLevels.Request, response: GetLoggerLevels.Response,
    ) -> GetLoggerLevels.Response:
        if len(request.names) <= MAX_NAMES:
            response.levels = [
                LoggerLevel(name=name, level=_level(name)) for name in request.names]
        return response

    def _set(
        self, request: SetLoggerLevels.Request, response: SetLoggerLevels.Response,
    ) -> SetLoggerLevels.Response:
        if len(request.levels) <= MAX_NAMES:
            reasons = [self._set_one(level.name, level.level) for level in request.levels]
            response.results = [SetLoggerLevelsResult(successful=not reason, reason=reason)
                                for reason in reasons]
            self._frame_log.adjust()
        return response

    def _set_one(self, name: str, level: int) -> str:
        if name not in self._names and len(self._names) >= MAX_LOGGERS:
            return f'the levels of {MAX_LOGGERS} loggers were set already'
        try:
            set_logger_level(name, LoggingSeverity(level))
        except ValueError:
            return f'{level} is not a logger level'
        except RuntimeError as error:
            return str(error)
        self._names.add(name)
        return ''


def _level(name: str) -> int:
    try:
        return int(get_logger_level(name))
    except RuntimeError:
        return int(LoggingSeverity.UNSET)
