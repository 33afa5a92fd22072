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

"""Several simulated lights on one link."""

from illuminator_ros.illuminator.simulated import simulated_lights
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import Address, CommandLong

LIGHTS = [IlluminatorProperties(address=Address(1, one)) for one in (243, 244)]
GROUND = Address(255, 190)


def test_lights_on_one_link_answer_for_themselves_only():
    lights = simulated_lights(LIGHTS, 0.0)
    lights.receive(GROUND, CommandLong(1, 244, 405, 0, 1, 0, 0, 0, 0, 0, 0), 0.0)
    assert [light.device.lamp.enabled for light in lights.components] == [False, True]
    assert {source for source, _ in lights.outgoing} == {Address(1, 244)}


def test_all_lights_on_a_link_answer_a_broadcast():
    lights = simulated_lights(LIGHTS, 0.0)
    lights.receive(GROUND, CommandLong(0, 0, 405, 0, 1, 0, 0, 0, 0, 0, 0), 0.0)
    assert [light.device.lamp.enabled for light in lights.components] == [True, True]
