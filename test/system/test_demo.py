# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The demonstration, on a computer without the command ros2."""

import shlex
import sys

from support.processes import Program
from support.ros import own_domain
from support.waiting import PATIENCE

# The demonstration without the flight, which has a test of its own.
DEMO = """
import os, random, sys
# A domain that no other test uses.
domain = int(os.environ['ROS_DOMAIN_ID'])
random.randrange = lambda *bounds: domain
from tools.demo import __main__ as run
run.fly = lambda: True
sys.exit(run.main())
"""


def test_demo_says_that_ros2_is_missing_and_ends_with_four_commands_that_run() -> None:
    with own_domain() as domain:
        demo = Program(sys.executable, '-c', DEMO,
                       env={'PATH': '/usr/bin:/bin', 'ROS_DOMAIN_ID': str(domain)})
        try:
            # The demonstration waits for more than one event.
            assert demo.wait(3 * PATIENCE) == 0, demo.log
        finally:
            demo.kill()

    told, command = (demo.log.find(text) for text in ('ros2 is not installed here', '$ ros2 '))
    assert 0 < told < command
    assert demo.lines[-5].endswith('in this folder:\n')
    for line in demo.lines[-4:]:
        assert Program(*shlex.split(line, comments=True), '--help').wait() == 0, line
