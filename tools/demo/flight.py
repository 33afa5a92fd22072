# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Fly a simulated survey, and compare what a camera writes into its images with the truth.

A robot publishes its position, velocity, attitude and the angles of a gimbal as ROS topics; the
node ``rededge`` feeds a simulated camera over a pseudo-terminal. For some time there is no fix,
and the link is pulled once. The flight is played faster than real time: all times of the node and
of the camera are shortened by the same factor, and all clocks are real ones.

The exit status is 0 if the images agree with the truth, otherwise 1.
"""

from __future__ import annotations

import argparse
import csv
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time

from illuminator_ros.cli.simulator.components import SettingError
from illuminator_ros.cli.simulator.csv_file import CsvFile
from illuminator_ros.geometry.rotation import enu_flu, flip, Quaternion
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.url import parse_url
from illuminator_ros.payload.messages import GeoPoint
from illuminator_ros.rededge.simulated import COLUMNS, RedEdgeProperties, SimulatedRedEdge
from illuminator_ros.simulation.simulated import SimulatedComponents

from .flight_model import (
    ATTITUDE_RATE,
    compare,
    Comparison,
    FIX_RATE,
    Flight,
    GEOID,
    Image,
    IMAGE_INTERVAL,
    LATITUDE,
    LENS,
    LONGITUDE,
    VALIDITY,
)
from .programs import END_TIMEOUT, running

# s to start a program, and s from its start to the take-off, real time.
START_TIMEOUT, LEAD_TIME = 20.0, 0.5
# s of flight time after which the node refuses a fix or an attitude.
POSITION_TIMEOUT, ATTITUDE_TIMEOUT = 1.0, 0.5
# s that a message may take from the node to the camera, real time; and the share of images in
# undisturbed flight whose fix is not older than one interval. Both depend on the computer's load.
MAX_DELIVERY, LEAST_FRESH = 1.0, 0.25
# Degrees; a node that has missed attitudes interpolates between two that are 0.5 s apart.
MAX_ANGLE_ERROR = 1.5


def publish(flight: Flight) -> None:
    """Publish the flight as ROS topics; print the time of the take-off (UTC, s) before it."""
    # The middleware writes its errors into standard output.
    output = os.fdopen(os.dup(1), 'w')
    os.dup2(2, 1)
    from geometry_msgs.msg import Quaternion as QuaternionMessage
    from geometry_msgs.msg import QuaternionStamped, TwistStamped
    import rclpy
    from rclpy.qos import qos_profile_sensor_data
    from rclpy.signals import SignalHandlerOptions
    from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus
    from std_msgs.msg import Header

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node('robot')
    publishers = [
        node.create_publisher(kind, f'/rededge/{topic}', qos_profile_sensor_data)
        for kind, topic in ((NavSatFix, 'fix'), (TwistStamped, 'velocity'), (Imu, 'imu'),
                            (QuaternionStamped, 'mount'))]
    fix, velocity, imu, mount = publishers
    deadline = time.monotonic() + START_TIMEOUT
    while not all(one.get_subscription_count() for one in publishers):
        if time.monotonic() > deadline:
            raise TimeoutError('the node rededge does not subscribe to the topics')
        time.sleep(0.05)
    begin = time.time() + LEAD_TIME
    print(f'{begin:.6f}', file=output, flush=True)

    def rotation(one: Quaternion) -> QuaternionMessage:
        return QuaternionMessage(w=one.w, x=one.x, y=one.y, z=one.z)

    # The next fix and the next attitude, flight time; the vehicle stands before the take-off.
    fix_due = attitude_due = -LEAD_TIME * flight.speed
    while min(fix_due, attitude_due) < flight.seconds:
        due = min(fix_due, attitude_due)
        time.sleep(max(begin + due / flight.speed - time.time(), 0.0))
        stamp = time.time()
        now = (stamp - begin) * flight.speed
        truth = flight.truth(now)
        header = Header()
        header.stamp.sec, header.stamp.nanosec = divmod(round(stamp * 1e9), 1_000_000_000)
        if due == fix_due:
            fix_due += 1 / FIX_RATE
            twist = TwistStamped(header=header)
            twist.twist.linear.x, twist.twist.linear.y, twist.twist.linear.z = truth.velocity
            velocity.publish(twist)
            if now not in flight.outage:
                fix.publish(NavSatFix(
                    header=header, status=NavSatStatus(status=NavSatStatus.STATUS_FIX),
                    latitude=truth.latitude, longitude=truth.longitude,
                    altitude=truth.altitude + GEOID))
        else:
            attitude_due += 1 / ATTITUDE_RATE
            imu.publish(Imu(header=header, orientation=rotation(enu_flu(truth.vehicle))))
            # The orientation of the camera in base_link, as a gimbal publishes it.
            mount.publish(QuaternionStamped(header=header, quaternion=rotation(
                flip(truth.vehicle.inverse() * truth.camera * LENS))))
    rclpy.try_shutdown()


class SimulatedCamera:
    """
    A simulated camera on a pseudo-terminal, whose cable can be pulled.

    :param path: of the link to the terminal's device.
    :param images: file for the metadata of the images.
    """

    def __init__(self, path: Path, images: Path, speed: float) -> None:
        self._url = f'pty://{path}'
        self._device = SimulatedRedEdge(RedEdgeProperties(
            validity=VALIDITY / speed, own_gps=GeoPoint(LATITUDE, LONGITUDE, 0.0)))
        self._device.records.subscribe(CsvFile(str(images), tuple(COLUMNS)).append)
        self._device.set_clock(time.time(), time.monotonic())
        self._endpoint = SimulatedComponents(
            [self._device], time.monotonic())
        self.heard = threading.Event()
        self._endpoint.new_peers.subscribe(lambda peer: self.heard.set())

    def plug_in(self) -> Link:
        """Return the open link; stopping it pulls the cable."""
        link = Link(parse_url(self._url), self._endpoint, label=self._url, mavlink_version=1)
        link.start()
        return link

    def take_images(self, link: Link, interval: float, begin: float) -> None:
        """Take an image at each interval, s, from a moment (UTC, s) on."""
        link.call(lambda now: self._device.set_interval(interval, now + begin - time.time()))
        # The interval begins with the next poll.
        link.call(lambda now: None)


def wait_until(begin: float, seconds: float) -> None:
    """Wait until so long after a moment (UTC), s."""
    time.sleep(max(begin + seconds - time.time(), 0.0))


def fly(flight: Flight, images: Path, directory: Path) -> Comparison:
    """
    Fly, and return how the images compare with the truth.

    :param directory: for the link to the serial device, and the logs of the programs.
    :raises TimeoutError: if a program does not start.
    """
    speed, port = flight.speed, directory / 'ttyREDEDGE'
    camera = SimulatedCamera(port, images, speed)
    link = camera.plug_in()
    parameters = {
        'connection_url': f'serial://{port}:57600', 'geoid_separation': GEOID,
        'position_timeout': POSITION_TIMEOUT / speed,
        'attitude_timeout': ATTITUDE_TIMEOUT / speed,
        'attitude_rate': ATTITUDE_RATE * speed}
    node = ('-m', 'illuminator_ros.rededge', '--ros-args', *(
        text for name, value in parameters.items() for text in ('-p', f'{name}:={value}')))
    robot = ('-m', 'tools.demo.flight', '--publish', '--seconds', str(flight.seconds),
             '--speed', str(speed))
    try:
        with running(directory / 'node.log', *node):
            if not camera.heard.wait(START_TIMEOUT):
                raise TimeoutError('the camera does not receive from the node rededge')
            with running(directory / 'robot.log', *robot, is_read=True) as process:
                assert process.stdout is not None
                if not (line := process.stdout.readline()):
                    raise TimeoutError('the robot has not started')
                begin = float(line)
                camera.take_images(link, IMAGE_INTERVAL / speed, begin)
                wait_until(begin, flight.pull.begin / speed)
                link.stop()
                wait_until(begin, flight.pull.end / speed)
                link = camera.plug_in()
                process.wait(flight.seconds / speed + END_TIMEOUT)
    finally:
        link.stop()
    with images.open(newline='') as file:
        rows = list(csv.DictReader(file))
    return compare((Image.read(row, begin, speed) for row in rows), flight,
                   max_delay=POSITION_TIMEOUT + MAX_DELIVERY * speed, least_fresh=LEAST_FRESH,
                   max_angle_error=MAX_ANGLE_ERROR)


def report(result: Comparison, speed: float) -> str:
    """Return a comparison as text."""
    lines = (
        f'this machine was late by at most {result.delay / speed * 1e3:.0f} ms, which is '
        f'{result.delay:.2f} s of flight; the comparison allows for that',
        f'{result.images} images; {result.fresh} in undisturbed flight have a fix that is not '
        f'older than {1 / FIX_RATE + result.delay:.2f} s',
        f'position  at most {result.position_error:.2f} m from the truth at the time of the '
        f'image, {result.fix_error:.2f} m at the time of the fix',
        f'attitude  at most {result.angle_error:.3f} degrees from the truth, for vehicle and '
        'camera',
        f'no image has data older than {result.oldest:.1f} s; without a fix the camera used its '
        f'own GPS for {result.own} images',
        f'after the link was pulled, {result.returned} images have a new fix',
        *(f'FAILED: {text}' for text in result.failures))
    return '\n'.join(lines)


def main() -> int:
    """Run the flight."""
    parser = argparse.ArgumentParser(
        description='Fly a simulated survey, and compare the images with the truth.')
    parser.add_argument('--seconds', type=float, default=60.0,
                        help='duration, flight time (default: %(default)g)')
    parser.add_argument('--speed', type=float, default=10.0,
                        help='how much faster than real it is played (default: %(default)g)')
    parser.add_argument('--images', type=Path, metavar='FILE',
                        help='keep the metadata of the images in FILE, as CSV')
    parser.add_argument('--publish', action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args()
    if not 36.0 <= options.seconds <= 600.0 or not 0.1 <= options.speed <= 10.0:
        parser.error('a flight takes 36 to 600 s, and is played at 0.1 to 10 times its speed')
    flight = Flight(options.seconds, options.speed)
    # A ROS graph of its own, on this machine only.
    os.environ.setdefault('ROS_DOMAIN_ID', str(random.randrange(1, 101)))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    if options.publish:
        publish(flight)
        return 0
    print(f'{options.seconds:g} s of flight at {options.speed:g} times its speed, with turns of '
          f'40 degrees of bank; no fix\nfrom {flight.outage.begin:g} to {flight.outage.end:g} s, '
          f'link pulled from {flight.pull.begin:g} to {flight.pull.end:g} s')
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        try:
            result = fly(flight, options.images or directory / 'images.csv', directory)
            failed = bool(result.failures)
            print(report(result, options.speed))
        except (OSError, SettingError, subprocess.TimeoutExpired) as error:
            failed = True
            print(f'FAILED: {error}')
        if failed:
            for log in directory.glob('*.log'):
                print(f'{log.name}:\n{log.read_text()}')
    return 1 if failed else 0


if __name__ == '__main__':
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(1)
