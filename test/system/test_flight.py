# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A flight from ROS topics through the node and a serial line to the images of a camera."""

import sys

import pytest
from support.processes import Program


def test_images_of_a_flight_agree_with_the_truth(domain: int) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    flight = Program(sys.executable, 'demo/flight.py', '--seconds', '36', '--speed', '3',
                     env={'ROS_DOMAIN_ID': str(domain)})
    try:
        # The flight ends by itself in less time if a program does not start.
        assert flight.wait(90.0) == 0, flight.log
        assert 'after the link was pulled' in flight.log
    finally:
        flight.kill()
