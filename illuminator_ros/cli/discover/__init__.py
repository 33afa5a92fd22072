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

"""The executable ``discover``: finds the port of a device. It sends nothing; no ROS."""

from __future__ import annotations

import signal

from ..entry_point import escape_output, explained


def main(args: list[str] | None = None) -> int:
    """
    Listen on all ports, print what is heard, and return the exit status.

    :param args: the command line without the program's name, by default from ``sys.argv``.
    """
    # End without a traceback until the run handles signals.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    escape_output()

    def start() -> int:
        from .run import run
        return run(args)

    return explained('discover', start)
