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
Run simulated devices and their nodes, use them from ordinary ROS clients, and show each step.

A light with the bridge comes first, then a camera on a flight, and the light on a gimbal.

The exit status is 0 if each step succeeded, otherwise 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import math
import os
from pathlib import Path
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import textwrap
import time
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
# Before rclpy is imported: a ROS graph of its own, on this machine only.
os.environ['ROS_DOMAIN_ID'] = str(random.randrange(1, 101))
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'

from ground_station import ADDRESS, GroundStation  # noqa: E402
from illuminator_ros.mavlink.messages import Address  # noqa: E402
from ros_client import RosClient, TimedOut  # noqa: E402

LIGHT = Address(1, 243)
# Degrees of the last step.
DOWN, LEFT = 45.0, 30.0
# s for simulator and bridge to end after SIGINT.
END_TIMEOUT = 5.0
# s from the topic to the parameter.
PARAMETER_TIMEOUT = 5.0


class Failed(Exception):
    """A step had an unexpected result, which the text names."""


def free_port() -> int:
    """Return an unused UDP port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])


class Demo:
    """The steps, in order; each returns what the client saw, or raises."""

    def __init__(self, ros: RosClient, ground_station: GroundStation) -> None:
        self.ros = ros
        self.ground_station = ground_station

    def _switch(self, on: bool) -> str:
        answer = self.ros.enable(on)
        if not answer.success:
            raise Failed(answer.message)
        self.ros.wait(f'/illuminator/enabled {on}', lambda: self.ros.topic('enabled') is on)
        return str(answer.message)

    def discover(self) -> str:
        """Wait for the light."""
        self.ros.wait('light', lambda: self.ros.topic('connected'), 20.0)
        lamp = self.ros.wait('status of the lamp in /diagnostics', self.ros.lamp)
        return f'found light {LIGHT} (system/component), serial number {lamp.hardware_id}'

    def switch_on(self) -> str:
        """Switch the light on."""
        return self._switch(True)

    def dim(self) -> str:
        """Set one parameter, with an integer for a double."""
        result = self.ros.set('brightness', 60)
        if not result.successful:
            raise Failed(result.reason)
        self.ros.wait('/illuminator/brightness 60', lambda: self.ros.topic('brightness') == 60)
        return 'accepted; the topic /illuminator/brightness shows 60 %'

    def strobe(self) -> str:
        """Set two parameters with one command."""
        result = self.ros.set_atomically(strobe_period=0.5, strobe_duty_cycle=25.0)
        if not result.successful:
            raise Failed(result.reason)
        self.ros.wait('strobe', lambda: self.ros.topic('strobe_period') == 0.5)
        return 'accepted; the light flashes twice a second'

    def refuse(self) -> str:
        """Request a period that the light does not support."""
        result = self.ros.set('strobe_period', 60.0)
        if result.successful or self.ros.get('strobe_period') != 0.5:
            raise Failed('the parameter strobe_period took 60 s, which the light cannot do')
        return f'refused, and the parameter keeps its value: {result.reason}'

    def follow(self) -> str:
        """Let a ground station change the light; the parameter follows."""
        result = self.ground_station.configure(LIGHT, 1, 35.0, 0.5, 25.0)
        if not result.accepted:
            raise Failed(f'the light refused the ground station: {result}')
        self.ros.wait('/illuminator/brightness 35', lambda: self.ros.topic('brightness') == 35)
        # The topic is published before the parameter changes.
        until = time.monotonic() + PARAMETER_TIMEOUT
        while (brightness := self.ros.get('brightness')) != 35.0:
            if time.monotonic() > until:
                raise Failed(f'the parameter brightness is {brightness:g}')
        return 'the parameter brightness now is 35, too'

    def overheat(self) -> str:
        """Let the light get hot: diagnostics warn, and the parameter stays."""
        result = self.ros.set_atomically(brightness=100.0, strobe_period=0.0)
        if not result.successful:
            raise Failed(result.reason)

        def warning() -> dict[str, str] | None:
            lamp = self.ros.lamp()
            return ({'message': lamp.message, **{pair.key: pair.value for pair in lamp.values}}
                    if lamp and lamp.level == b'\1' else None)

        seen = self.ros.wait('warning in /diagnostics', warning, 20.0)
        if self.ros.get('brightness') != 100.0:
            raise Failed('the parameter brightness changed')
        return (f'/diagnostics: WARN, {seen["message"]}; {float(seen["temperature_c"]):.0f} degC '
                f'leave {seen["brightness_percent"]} %, and the parameter stays at 100')

    def switch_off(self) -> str:
        """Switch the light off."""
        return self._switch(False)

    def take_control(self) -> str:
        """Take control of the gimbal."""
        self.ros.wait('attitude of the gimbal', self.ros.angles, 20.0)
        answer = self.ros.take_control()
        if not answer.success:
            raise Failed(answer.message)
        return str(answer.message)

    def turn(self) -> str:
        """Turn the gimbal, and wait until its attitude confirms it."""
        def turned() -> tuple[float, float] | None:
            angles = self.ros.angles()
            return angles if angles and math.dist(angles, (DOWN, LEFT)) < 0.5 else None

        self.ros.turn(DOWN, LEFT)
        down, left = self.ros.wait('such attitude in /gimbal/angles', turned)
        if not self.ros.topic('enabled'):
            raise Failed('the searchlight is off')
        return f'/gimbal/angles: {down:.1f} degrees down, {left:.1f} to the left; the light is on'


class Step(NamedTuple):
    """
    One step of the demonstration.

    :param command: the ros2 command with the same effect, '' if there is none.
    """

    title: str
    run: Callable[[Demo], str]
    command: str = ''


ENABLE = 'ros2 service call /illuminator/enable std_srvs/srv/SetBool'
STEPS = (
    Step('The bridge finds the light by its MAVLink heartbeat', Demo.discover,
         'ros2 topic echo --once /illuminator/connected'),
    Step('Switch the light on; success means that the light confirmed it', Demo.switch_on,
         f'{ENABLE} "{{data: true}}"'),
    Step('Dim the light to 60 %', Demo.dim, 'ros2 param set /illuminator brightness 60'),
    Step('Make it flash: a period of 0.5 s, on for 25 % of it, set in one call', Demo.strobe),
    Step('Ask for a period of 60 s, which this light does not support', Demo.refuse,
         'ros2 param set /illuminator strobe_period 60'),
    Step(f'A ground station (MAVLink address {ADDRESS}) dims the light to 35 %', Demo.follow),
    Step('Full brightness in 45 degC until the light dims itself (60 times faster than real)',
         Demo.overheat, 'ros2 topic echo /diagnostics'),
    Step('Switch the light off', Demo.switch_off, f'{ENABLE} "{{data: false}}"'),
)
SEARCHLIGHT = (
    Step('The searchlight is on a gimbal. Switch it on', Demo.switch_on,
         f'{ENABLE} "{{data: true}}"'),
    Step('Take control of the gimbal; success means that its manager shows it', Demo.take_control,
         'ros2 service call /gimbal/take_control std_srvs/srv/Trigger'),
    Step(f'Turn it {DOWN:g} degrees down and {LEFT:g} to the left', Demo.turn,
         'ros2 topic pub -1 /gimbal/cmd/angles geometry_msgs/msg/Vector3Stamped "{header: '
         '{frame_id: base_link_stabilized}, vector: {y: 0.785, z: 0.524}}"'),
)
INTRODUCTION = """
This demonstration starts two programs: a simulated searchlight on a gimbal, both of which speak
MAVLink, as on a drone; and the bridge, which makes the ROS 2 nodes /illuminator and /gimbal of
them. A ROS client then uses the nodes as a program of yours would.
"""
WITH_ROS2 = 'Under each step stands the ros2 command that has the same effect.'
WITHOUT_ROS2 = """
The command ros2 is not installed here, so the client makes the calls itself. Under each step
stands the command that has the same effect on a computer with ROS 2.
"""
FLIGHT = """
A robot flies a survey. The node /rededge gives its position, attitude and gimbal angles, which
are ROS topics, to a simulated camera on a serial line. What the camera writes into its images is
compared with the truth:"""
NEXT = """
Go on with these three, each in a terminal of its own:
  {python} -m illuminator_ros.simulator   # a light on the screen; type "help"
  {python} -m illuminator_ros.bridge      # finds that light
  {python} -m illuminator_ros.monitor     # all devices, operated with keys
"""


def show(demo: Demo, steps: Sequence[Step]) -> bool:
    """Run and print some steps; return whether all succeeded."""
    start = time.monotonic()
    for step in steps:
        print(f'\n{step.title}')
        if step.command:
            print(f'     $ {step.command}')
        try:
            success, seen = True, step.run(demo)
        except (Failed, TimedOut) as error:
            success, seen = False, f'FAILED: {error}'
        print(textwrap.fill(seen, 95, initial_indent=f'{time.monotonic() - start:6.2f} s  ',
                            subsequent_indent=' ' * 10))
        if not success:
            return False
    return True


def fly() -> bool:
    """Run the flight of the camera; return whether it succeeded."""
    print(FLIGHT, flush=True)
    return not subprocess.run(
        [sys.executable, Path(__file__).with_name('flight.py'), '--seconds', '36'],
        check=False).returncode


def main() -> int:
    """Run the demonstration."""
    print(INTRODUCTION.strip(), (WITH_ROS2 if shutil.which('ros2') else WITHOUT_ROS2).strip(),
          sep='\n')
    url = f'127.0.0.1:{free_port()}'
    commands = {
        'simulator': ['-m', 'illuminator_ros.simulator', f'udpin://{url}', '--payload',
                      'illuminator,gimbal_manager', '--ambient', '45', '--time-scale', '60'],
        'bridge': ['-m', 'illuminator_ros.bridge', '--ros-args', '-p',
                   f'connection_url:=udpout://{url}', '-p',
                   'payloads:=[illuminator, gimbal]'],
    }
    with tempfile.TemporaryDirectory() as logs:
        processes = []
        for name, command in commands.items():
            with open(f'{logs}/{name}', 'wb') as log:
                processes.append(subprocess.Popen(
                    [sys.executable, *command], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=log,
                    stderr=log))
        ground_station = GroundStation(f'udpout://{url}')
        ros = RosClient()
        try:
            demo = Demo(ros, ground_station)
            success = show(demo, STEPS) and fly() and show(demo, SEARCHLIGHT)
        finally:
            ros.close()
            ground_station.close()
            statuses = end(processes)
        for name, status in zip(commands, statuses, strict=True):
            if status or not success:
                success = False
                print(f'\nThe {name} ended with status {status}; its log:')
                print(Path(logs, name).read_text())
    print('\nEach step succeeded.' if success else '\nThe demonstration failed.')
    if success:
        python = Path(sys.executable)
        print(NEXT.format(python=python.relative_to(Path.cwd())
                          if python.is_relative_to(Path.cwd()) else python).rstrip())
    return 0 if success else 1


def end(processes: list[subprocess.Popen[bytes]]) -> list[int]:
    """End the processes as Ctrl-C would and return their exit statuses."""
    for process in processes:
        process.send_signal(signal.SIGINT)
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
