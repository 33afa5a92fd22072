# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Record a run with a light, a gimbal and a camera, all simulated, as an MCAP file.

Foxglove and PlotJuggler open the file without ROS. This program needs mcap, which
``make environment`` installs.
"""

from __future__ import annotations

import argparse
import contextlib
from importlib import import_module
import os
from pathlib import Path
import sys
import tempfile
import threading
import time

from ament_index_python import get_package_share_directory
from mcap.writer import Writer
from programs import free_port, running
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from ros_client import Failed, RosClient
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

# The wheels of ROS, which stand in for an installation, have the definitions here.
os.environ.setdefault('AMENT_PREFIX_PATH', sys.prefix)
# s between two searches for new topics.
SEARCH_INTERVAL = 0.2


def definition(type_: str) -> str:
    """Return the definition of a message with those that it contains, as MCAP wants it."""
    texts: list[str] = []
    waiting, known = [type_], {type_}
    while waiting:
        package, _, name = waiting.pop(0).split('/')
        text = Path(get_package_share_directory(package), 'msg', f'{name}.msg').read_text()
        texts.append(text if not texts else f'{"=" * 80}\nMSG: {package}/{name}\n{text}')
        fields = getattr(import_module(f'{package}.msg'), name).get_fields_and_field_types()
        for field in fields.values():
            element = field.removeprefix('sequence<').partition('>')[0].partition('[')[0]
            if '/' in element:
                package_of, name_of = element.partition(',')[0].split('/')
                contained = f'{package_of}/msg/{name_of}'
                if contained not in known:
                    known.add(contained)
                    waiting.append(contained)
    return '\n'.join(texts)


class Recorder:
    """
    Writes each message of each topic, as the middleware delivers it.

    :ivar topics: the names of the recorded topics.
    """

    def __init__(self, path: str) -> None:
        self._writer = Writer(path)
        self._writer.start(profile='ros2')
        self._schemas: dict[str, int] = {}
        self.topics: set[str] = set()
        # The newest message of each topic, serialized.
        self._newest: dict[str, bytes] = {}
        self._lock = threading.Lock()
        self._node = Node('recorder')
        self._node.create_timer(SEARCH_INTERVAL, self._search)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin)
        self._thread.start()

    def _search(self) -> None:
        for topic, types in self._node.get_topic_names_and_types():
            publishers = self._node.get_publishers_info_by_topic(topic)
            if topic in self.topics or not publishers:
                continue
            # The strictest QoS that each of the publishers offers.
            qos = QoSProfile(depth=100)
            profiles = [one.qos_profile for one in publishers]
            if any(one.reliability is ReliabilityPolicy.BEST_EFFORT for one in profiles):
                qos.reliability = ReliabilityPolicy.BEST_EFFORT
            if all(one.durability is DurabilityPolicy.TRANSIENT_LOCAL for one in profiles):
                qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
            self._record(topic, types[0], qos)
            self.topics.add(topic)

    def _record(self, topic: str, type_: str, qos: QoSProfile) -> None:
        if type_ not in self._schemas:
            self._schemas[type_] = self._writer.register_schema(
                type_, 'ros2msg', definition(type_).encode())
        channel = self._writer.register_channel(topic, 'cdr', self._schemas[type_])

        def write(data: bytes) -> None:
            now = time.time_ns()
            with self._lock:
                self._writer.add_message(channel, now, data, now)
                self._newest[topic] = data

        package, _, name = type_.split('/')
        self._node.create_subscription(
            getattr(import_module(f'{package}.msg'), name), topic, write, qos, raw=True)

    def shows(self, topic: str, value: bool) -> bool:
        """Return whether the newest recorded message of a topic of std_msgs/Bool has a value."""
        with self._lock:
            data = self._newest.get(topic)
        return data is not None and deserialize_message(data, Bool).data is value

    def close(self) -> None:
        """Finish the file."""
        self._executor.shutdown()
        self._thread.join()
        self._writer.finish()


def operate(ros: RosClient, recorder: Recorder, seconds: float) -> None:
    """
    Use the devices, so that their topics have something to show.

    :raises Failed: if one does not do what it should.
    """
    ros.wait('light', lambda: ros.topic('connected'), 20.0)
    ros.wait('attitude of the gimbal', ros.angles, 20.0)
    ros.enable(True)
    ros.set(strobe_period=1.0, strobe_duty_cycle=50.0)
    ros.take_control()
    start = time.monotonic()
    while (passed := time.monotonic() - start) < seconds:
        ros.turn(30.0 + 15.0 * passed / seconds, 40.0 * passed / seconds - 20.0)
        ros.set(brightness=round(100.0 - 60.0 * passed / seconds))
        ros.call(Trigger, '/rededge/capture', Trigger.Request())
        time.sleep(0.2)
    ros.enable(False)
    ros.wait('recording of /illuminator/enabled False',
             lambda: recorder.shows('/illuminator/enabled', False))


def main() -> int:
    """Record a run."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').strip().partition('\n')[0])
    parser.add_argument('file', help='such as run.mcap')
    parser.add_argument('--seconds', type=float, default=10.0, help='of operation; default 10')
    arguments = parser.parse_args()
    light, camera = (f'127.0.0.1:{free_port()}' for _ in range(2))
    commands = (
        ['simulator', f'udpin://{light}', '--payload', 'illuminator,gimbal_manager'],
        ['simulator', f'udpin://{camera}', '--payload', 'rededge'],
        ['bridge', '--ros-args', '-p', f'connection_url:=udpout://{light}',
         '-p', 'payloads:=[illuminator, gimbal]', '-p', 'beam_range:=20.0',
         '-p', 'mounted_on:=1', '-p', 'frame_id:=base_link'],
        ['rededge', f'udpout://{camera}'])
    failure = ''
    with tempfile.TemporaryDirectory() as logs, contextlib.ExitStack() as stack:
        # The nodes end first, since they give the gimbal back.
        processes = [stack.enter_context(running(
            Path(logs, str(number)), '-m', f'illuminator_ros.{name}', *rest))
            for number, (name, *rest) in enumerate(commands)]
        ros = stack.enter_context(contextlib.closing(RosClient()))
        recorder = stack.enter_context(contextlib.closing(Recorder(arguments.file)))
        try:
            operate(ros, recorder, arguments.seconds)
        except Failed as error:
            failure = str(error)
    failure = failure or ('' if recorder.topics else 'no topic was found')
    print(failure or f'{arguments.file}: {os.path.getsize(arguments.file) / 1000:.0f} kB')
    return 1 if failure or any(one.returncode for one in processes) else 0


if __name__ == '__main__':
    sys.exit(main())
