# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Run simulated devices and their nodes, use them from ordinary ROS clients, and show each step.

A light with the bridge comes first, then a camera on a flight, and the light on a gimbal.

The exit status is 0 if each step succeeded, otherwise 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import contextlib
import math
import os
from pathlib import Path
import random
import shutil
import subprocess
import sys
import tempfile
import textwrap
import time
from typing import NamedTuple

from illuminator_ros.mavlink.messages import Address

from .ground_station import ADDRESS, GroundStation
from .programs import free_port, ROOT, running
from .ros_client import Failed, RosClient

LIGHT = Address(1, 243)
# Of the light and the gimbal.
PLACE = f'127.0.0.1:{free_port()}'
# Degrees of the last step.
DOWN, LEFT = 45.0, 30.0
# s from the topic to the parameter.
PARAMETER_TIMEOUT = 5.0


# The steps, in order; each returns what the client saw, or raises.

def discover(ros: RosClient) -> str:
    """Wait for the light."""
    ros.wait('light', lambda: ros.topic('connected'), 20.0)
    lamp = ros.wait('status of the lamp in /diagnostics', ros.lamp)
    return f'found light {LIGHT} (system/component), serial number {lamp.hardware_id}'


def switch_on(ros: RosClient) -> str:
    """Switch the light on."""
    return switch(ros, True)


def switch_off(ros: RosClient) -> str:
    """Switch the light off."""
    return switch(ros, False)


def switch(ros: RosClient, on: bool) -> str:
    """Switch the light, and wait until the topic shows it."""
    answer = ros.enable(on)
    ros.wait(f'/illuminator/enabled {on}', lambda: ros.topic('enabled') is on)
    return answer


def dim(ros: RosClient) -> str:
    """Set one parameter, with an integer for a double."""
    ros.set(brightness=60)
    ros.wait('/illuminator/brightness 60', lambda: ros.topic('brightness') == 60)
    return 'accepted; the topic /illuminator/brightness shows 60 %'


def strobe(ros: RosClient) -> str:
    """Set two parameters with one command."""
    ros.set(strobe_period=0.5, strobe_duty_cycle=25.0)
    ros.wait('strobe', lambda: ros.topic('strobe_period') == 0.5)
    return 'accepted; the light flashes twice a second'


def refuse(ros: RosClient) -> str:
    """Request a period that the light does not support."""
    try:
        ros.set(strobe_period=60.0)
    except Failed as refusal:
        if ros.get('strobe_period') == 0.5:
            return f'refused, and the parameter keeps its value: {refusal}'
    raise Failed('the parameter strobe_period took 60 s, which the light cannot do')


def follow(ros: RosClient) -> str:
    """Let a ground station change the light; the parameter follows."""
    with contextlib.closing(GroundStation(f'udpout://{PLACE}')) as ground_station:
        result = ground_station.configure(LIGHT, 1, 35.0, 0.5, 25.0)
    if not result.accepted:
        raise Failed(f'the light refused the ground station: {result}')
    ros.wait('/illuminator/brightness 35', lambda: ros.topic('brightness') == 35)
    # The topic is published before the parameter changes.
    until = time.monotonic() + PARAMETER_TIMEOUT
    while (brightness := ros.get('brightness')) != 35.0:
        if time.monotonic() > until:
            raise Failed(f'the parameter brightness is {brightness:g}')
    return 'the parameter brightness now is 35, too'


def overheat(ros: RosClient) -> str:
    """Let the light get hot: diagnostics warn, and the parameter stays."""
    ros.set(brightness=100.0, strobe_period=0.0)

    def warning() -> dict[str, str] | None:
        lamp = ros.lamp()
        return ({'message': lamp.message, **{pair.key: pair.value for pair in lamp.values}}
                if lamp and lamp.level == b'\1' else None)

    seen = ros.wait('warning in /diagnostics', warning, 20.0)
    if ros.get('brightness') != 100.0:
        raise Failed('the parameter brightness changed')
    return (f'/diagnostics: WARN, {seen["message"]}; {float(seen["temperature_c"]):.0f} degC '
            f'leave {seen["brightness_percent"]} %, and the parameter stays at 100')


def take_control(ros: RosClient) -> str:
    """Take control of the gimbal."""
    ros.wait('attitude of the gimbal', ros.angles, 20.0)
    return ros.take_control()


def turn(ros: RosClient) -> str:
    """Turn the gimbal, and wait until its attitude confirms it."""
    def turned() -> tuple[float, float] | None:
        angles = ros.angles()
        return angles if angles and math.dist(angles, (DOWN, LEFT)) < 0.5 else None

    ros.turn(DOWN, LEFT)
    down, left = ros.wait('such attitude in /gimbal/angles', turned)
    if not ros.topic('enabled'):
        raise Failed('the searchlight is off')
    return f'/gimbal/angles: {down:.1f} degrees down, {left:.1f} to the left; the light is on'


class Step(NamedTuple):
    """
    One step of the demonstration.

    :param command: the ros2 command with the same effect, '' if there is none.
    """

    title: str
    run: Callable[[RosClient], str]
    command: str = ''


ENABLE = 'ros2 service call /illuminator/enable std_srvs/srv/SetBool'
STEPS = (
    Step('The bridge finds the light by its MAVLink heartbeat', discover,
         'ros2 topic echo --once /illuminator/connected'),
    Step('Switch the light on; success means that the light confirmed it', switch_on,
         f'{ENABLE} "{{data: true}}"'),
    Step('Dim the light to 60 %', dim, 'ros2 param set /illuminator brightness 60'),
    Step('Make it flash: a period of 0.5 s, on for 25 % of it, set in one call', strobe),
    Step('Ask for a period of 60 s, which this light does not support', refuse,
         'ros2 param set /illuminator strobe_period 60'),
    Step(f'A ground station (MAVLink address {ADDRESS}) dims the light to 35 %', follow),
    Step('Full brightness in 45 degC until the light dims itself (60 times faster than real)',
         overheat, 'ros2 topic echo /diagnostics'),
    Step('Switch the light off', switch_off, f'{ENABLE} "{{data: false}}"'),
)
SEARCHLIGHT = (
    Step('The searchlight is on a gimbal. Switch it on', switch_on,
         f'{ENABLE} "{{data: true}}"'),
    Step('Take control of the gimbal; success means that its manager shows it', take_control,
         'ros2 service call /gimbal/take_control std_srvs/srv/Trigger'),
    Step(f'Turn it {DOWN:g} degrees down and {LEFT:g} to the left', turn,
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
Go on with these, each in a terminal of its own, in this folder:
  {python} -m illuminator_ros.simulator   # a light on the screen; type "help"
  {python} -m illuminator_ros.bridge      # finds that light
  {python} -m illuminator_ros.monitor     # all devices, operated with keys
  {python} -m illuminator_ros.discover    # finds the port of a device of yours
"""


def show(ros: RosClient, steps: Sequence[Step]) -> bool:
    """Run and print some steps; return whether all succeeded."""
    start = time.monotonic()
    for step in steps:
        print(f'\n{step.title}')
        if step.command:
            print(f'     $ {step.command}')
        try:
            success, seen = True, step.run(ros)
        except Failed as error:
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
        [sys.executable, '-m', 'tools.demo.flight', '--seconds', '36'], cwd=ROOT,
        check=False).returncode


def main() -> int:
    """Run the demonstration."""
    # A ROS graph of its own, on this machine only.
    os.environ['ROS_DOMAIN_ID'] = str(random.randrange(1, 101))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    print(INTRODUCTION.strip(), (WITH_ROS2 if shutil.which('ros2') else WITHOUT_ROS2).strip(),
          sep='\n')
    commands = {
        'simulator': ['-m', 'illuminator_ros.simulator', f'udpin://{PLACE}', '--payload',
                      'illuminator,gimbal_manager', '--ambient', '45', '--time-scale', '60'],
        'bridge': ['-m', 'illuminator_ros.bridge', '--ros-args', '-p',
                   f'connection_url:=udpout://{PLACE}', '-p',
                   'payloads:=[illuminator, gimbal]'],
    }
    with tempfile.TemporaryDirectory() as name:
        logs = Path(name)
        with contextlib.ExitStack() as stack:
            processes = {one: stack.enter_context(running(logs / one, *command))
                         for one, command in commands.items()}
            ros = stack.enter_context(contextlib.closing(RosClient()))
            success = show(ros, STEPS) and fly() and show(ros, SEARCHLIGHT)
        for one, process in processes.items():
            if process.returncode or not success:
                success = False
                print(f'\nThe {one} ended with status {process.returncode}; its log:')
                print((logs / one).read_text())
    print('\nEach step succeeded.' if success else '\nThe demonstration failed.')
    if success:
        python = Path(sys.executable)
        print(NEXT.format(python=python.relative_to(Path.cwd())
                          if python.is_relative_to(Path.cwd()) else python).rstrip())
    return 0 if success else 1


if __name__ == '__main__':
    sys.exit(main())
