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
A ROS client for another machine than the bridge's.

``python3 -m support.distant_client DOMAIN`` uses the bridge, and prints what came of it as one
line of JSON.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool
from support.ros import Parameters, Ros
from support.waiting import PATIENCE

NODE = '/illuminator'


def use(ros: Ros) -> dict[str, Any]:
    """Use service, parameters and topics of the bridge."""
    parameters = Parameters(ros)
    parameters.wait(mode='internal_control')
    connected = ros.subscribe(Bool, f'{NODE}/connected')
    connected.wait(timeout=PATIENCE)
    [result] = parameters.set(brightness=60.0)
    [refusal] = parameters.set(brightness=101.0)
    enable = ros.call(SetBool, f'{NODE}/enable', SetBool.Request(data=True))
    enabled = ros.subscribe(Bool, f'{NODE}/enabled')
    enabled.wait_value(True, PATIENCE)
    brightness = ros.subscribe(Float32, f'{NODE}/brightness')
    brightness.wait_value(60.0, PATIENCE)
    return {
        'connected': connected.values[0],
        'set': [result.successful, result.reason],
        'refused': [refusal.successful, refusal.reason],
        'brightness': parameters.get('brightness')[0],
        'enable': [enable.success, enable.message],
        'enabled topic': enabled.values[-1],
        'brightness topic': brightness.values[-1],
    }


def main() -> None:
    """Use the bridge and tell."""
    ros = Ros(int(sys.argv[1]))
    try:
        print(json.dumps(use(ros)))
    finally:
        ros.close()


if __name__ == '__main__':
    main()
