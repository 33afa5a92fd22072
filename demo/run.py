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
The main job, shown: a simulated light and the bridge as processes, and an ordinary ROS client.

Exit status 0 if all of it happened, 1 if not, and then what did not.
"""

from __future__ import annotations

import os
from pathlib import Path
import random
import socket
import subprocess
import sys
import tempfile
import time

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
# Before rclpy is imported: a ROS graph of its own, on this machine only.
os.environ['ROS_DOMAIN_ID'] = str(random.randrange(1, 101))
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'

from ground_station import GroundStation  # noqa: E402
from illuminator_ros.mavlink.messages import Address  # noqa: E402
from ros_client import RosClient, TimedOut  # noqa: E402

LIGHT = Address(1, 243)
# s for simulator and bridge to end after SIGINT.
END_TIMEOUT = 5.0


class Failed(Exception):
    """A step did not do what it should; the text says what happened instead."""


def free_port() -> int:
    """Return a UDP port that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])


class Demo:
    """The steps, in order; each returns what it saw, or raises."""

    def __init__(self, ros: RosClient, ground_station: GroundStation) -> None:
        self.ros = ros
        self.ground_station = ground_station

    def discovered(self) -> str:
        """Wait for the light."""
        self.ros.wait('connecting', lambda: self.ros.topic('connected'), 20.0)
        lamp = self.ros.wait('the lamp in /diagnostics', self.ros.lamp)
        return f'light {LIGHT}, hardware id {lamp.hardware_id}'

    def switched_on(self) -> str:
        """Switch the light on."""
        answer = self.ros.enable(True)
        if not answer.success:
            raise Failed(answer.message)
        self.ros.wait('~/enabled true', lambda: self.ros.topic('enabled'))
        return str(answer.message)

    def brightness_set(self) -> str:
        """Set one parameter, with an integer for a double."""
        (result,) = self.ros.set(brightness=60)
        if not result.successful:
            raise Failed(result.reason)
        self.ros.wait('~/brightness 60', lambda: self.ros.topic('brightness') == 60.0)
        return f'accepted; ~/brightness shows {self.ros.topic("brightness"):g} %'

    def strobe_set(self) -> str:
        """Set two parameters with one command."""
        result = self.ros.set_atomically(strobe_period=0.5, strobe_duty_cycle=25.0)
        if not result.successful:
            raise Failed(result.reason)
        self.ros.wait('~/strobe_period 0.5', lambda: self.ros.topic('strobe_period') == 0.5)
        return 'accepted, as one command'

    def refused(self) -> str:
        """Ask for what the light cannot do; the parameter keeps its value."""
        (result,) = self.ros.set(strobe_period=60.0)
        if result.successful:
            raise Failed('a strobe period of 60 s was accepted')
        if self.ros.get('strobe_period') != 0.5:
            raise Failed('the parameter did not keep its value')
        return f'refused: {result.reason}'

    def changed_outside(self) -> str:
        """Have somebody else change the light; the parameter follows."""
        outcome = self.ground_station.configure(LIGHT, 1, 35.0, 0.5, 25.0)
        if not outcome.accepted:
            raise Failed(f'the light refused the ground station: {outcome}')
        self.ros.wait('~/brightness 35', lambda: self.ros.topic('brightness') == 35.0)
        if self.ros.get('brightness') != 35.0:
            raise Failed(f'the parameter is {self.ros.get("brightness"):g}')
        return f'the parameter follows: brightness is {self.ros.get("brightness"):g}'

    def overheating(self) -> str:
        """Let the light get hot; diagnostics say so, the parameter stays."""
        result = self.ros.set_atomically(brightness=100.0, strobe_period=0.0)
        if not result.successful:
            raise Failed(result.reason)
        lamp = self.ros.wait('a warning in /diagnostics', lambda: (
            self.ros.lamp() if self.ros.lamp().level == b'\1' else None), 20.0)
        values = {pair.key: pair.value for pair in lamp.values}
        if self.ros.get('brightness') != 100.0:
            raise Failed('dimming by heat has moved the parameter')
        return (f'WARN {lamp.message}, {float(values["temperature_c"]):.0f} degC, gives '
                f'{values["brightness_percent"]} %; the parameter stays 100')

    def switched_off(self) -> str:
        """Switch the light off."""
        answer = self.ros.enable(False)
        if not answer.success:
            raise Failed(answer.message)
        self.ros.wait('~/enabled false', lambda: self.ros.topic('enabled') is False)
        return str(answer.message)


SET_BOOL = '$ ros2 service call /illuminator/enable std_srvs/srv/SetBool'
STEPS = (
    ('discovered', '(a heartbeat of type MAV_TYPE_ILLUMINATOR is enough)',
     Demo.discovered),
    ('switched on', f'{SET_BOOL} "{{data: true}}"',
     Demo.switched_on),
    ('brightness set', '$ ros2 param set /illuminator brightness 60',
     Demo.brightness_set),
    ('strobe set', '(both in one call of set_parameters_atomically)',
     Demo.strobe_set),
    ('refused', '$ ros2 param set /illuminator strobe_period 60',
     Demo.refused),
    ('changed outside', '(a ground station, 255/190, sets 35 % over MAVLink)',
     Demo.changed_outside),
    ('overheating', '(full brightness in 45 degC; the heat runs 60 times faster here)',
     Demo.overheating),
    ('switched off', f'{SET_BOOL} "{{data: false}}"',
     Demo.switched_off),
)


def show(demo: Demo) -> bool:
    """Run the steps and print the timeline; return whether all went well."""
    start = time.monotonic()
    for name, caption, step in STEPS:
        print(f'{"":10}  {caption}')
        try:
            result, seen = '', step(demo)
        except (Failed, TimedOut) as error:
            result, seen = 'FAILED: ', str(error)
        print(f'{time.monotonic() - start:8.2f} s  {name:15}  {result}{seen}')
        if result:
            return False
    return True


def main() -> int:
    """Run the demonstration."""
    url = f'127.0.0.1:{free_port()}'
    commands = {
        'simulator': ['-m', 'illuminator_ros.simulator', f'udpin://{url}', '--ambient', '45',
                      '--time-scale', '60'],
        'bridge': ['-m', 'illuminator_ros.bridge', '--ros-args', '-p',
                   f'connection_url:=udpout://{url}'],
    }
    with tempfile.TemporaryDirectory() as logs:
        processes = []
        for name, command in commands.items():
            with open(f'{logs}/{name}', 'wb') as log:
                processes.append(subprocess.Popen(
                    [sys.executable, *command], cwd=ROOT, stdout=log, stderr=log))
        ground_station = GroundStation(f'udpout://{url}')
        ros = RosClient()
        try:
            happened = show(Demo(ros, ground_station))
        finally:
            ros.close()
            ground_station.close()
            statuses = end(processes)
        for name, status in zip(commands, statuses, strict=True):
            if status or not happened:
                happened = False
                print(f'\n{name} ended with status {status}; its log:')
                print(Path(logs, name).read_text())
    print('\nAll of it happened.' if happened else '\nNot all of it happened.')
    return 0 if happened else 1


def end(processes: list[subprocess.Popen[bytes]]) -> list[int]:
    """End the processes as Ctrl-C would and return their exit statuses."""
    for process in processes:
        process.send_signal(2)
    statuses = []
    for process in processes:
        try:
            statuses.append(process.wait(END_TIMEOUT))
        except subprocess.TimeoutExpired:
            process.kill()
            statuses.append(process.wait())
    return statuses


if __name__ == '__main__':
    sys.exit(main())
