# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A flight from ROS topics through the node and a serial line to the images of a camera."""

from pathlib import Path
import sys

import pytest
from support.processes import Program

# Runs at the start of each program. Fast DDS prints so where other programs lock shared memory.
PRINTING = """
import builtins, os
real = builtins.__import__

def load(name, *rest, **options):
    if name == 'rclpy':
        builtins.__import__ = real
        os.write(1, b'[RTPS_TRANSPORT_SHM Error] Failed to create segment\\n')
    return real(name, *rest, **options)

builtins.__import__ = load
"""


def test_images_of_a_flight_agree_with_the_truth_although_the_middleware_prints(
    domain: int, tmp_path: Path,
) -> None:
    (tmp_path / 'sitecustomize.py').write_text(PRINTING)
    pytest.importorskip('serial', reason='pyserial is not installed')
    flight = Program(sys.executable, '-m', 'tools.demo.flight', '--seconds', '36', '--speed', '3',
                     env={'ROS_DOMAIN_ID': str(domain), 'PYTHONPATH': str(tmp_path)})
    try:
        # The flight ends by itself in less time if a program does not start.
        assert flight.wait(90.0) == 0, flight.log
        assert 'after the link was pulled' in flight.log
    finally:
        flight.kill()
