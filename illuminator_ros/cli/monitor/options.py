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

"""The command line of the monitor."""

from __future__ import annotations

import argparse

from ..options import number, Parser
from ... import __version__

DESCRIPTION = """\
Shows the lights in a ROS graph: state, brightness, strobe, temperature, link and errors of each
light of every bridge, whatever it is called. Keys switch and dim the selected one; ? lists them.
Where standard input or output is no terminal, it prints one table and ends.
"""
EPILOG = """\
examples:
  ros2 run illuminator_ros monitor
  ros2 run illuminator_ros monitor --once | grep LOST
  NO_COLOR=1 ros2 run illuminator_ros monitor

exit status: 0 after q or a signal, or with a table printed; 1 if no light was found for that
table, or a package is missing; 2 if an argument is wrong.
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = Parser(
        prog='monitor', description=DESCRIPTION, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument('--once', action='store_true', help='print one table and end')
    made.add_argument('--wait', type=number(0.1, 3600), default=6.0, metavar='S',
                      help='s for which lights are looked for at most before that table is '
                           'printed (default: 6)')
    made.add_argument('--ascii', action='store_true',
                      help='draw with ASCII characters only')
    made.add_argument('--version', action='version', version=__version__)
    return made
