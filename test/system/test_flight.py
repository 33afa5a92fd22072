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
