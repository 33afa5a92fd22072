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

"""
The executable ``monitor``: the lights in a ROS graph, as ``top`` shows processes.

``model`` holds the lights, ``key_bindings`` the meaning of keys, ``view`` the screen: without ROS
and without a clock. ``ros_graph`` fills the model from the ROS graph and calls services,
``terminal`` is the terminal, ``run`` the command line.
"""

from __future__ import annotations

import signal

from ..entry_point import run_program
from ..termination import Termination


def main(args: list[str] | None = None) -> int:
    """
    Show the lights until ``q`` or a signal; see :mod:`~.run`.

    :param args: the command line without the program's name.
    """
    def start(termination: Termination) -> int:
        from .run import run
        return run(args, termination)

    # Ctrl-\ too: it would leave the terminal without echo.
    return run_program('monitor', start, more=[signal.SIGQUIT])
