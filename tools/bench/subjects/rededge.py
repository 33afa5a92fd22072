# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The input of a camera over a line of 57,600 baud, compared with a script that a user would write.

The line is a pseudo-terminal, and each byte takes the time of the line, from its arrival or from
the end of the byte before.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import math
import os
import select
import threading
import time
import tty

from geometry_msgs.msg import Quaternion
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus
from std_msgs.msg import Header
from support.processes import start_interpreter
from support.strict_mavlink_1 import OVERHEAD, strict_frames
from support.waiting import eventually

from ..rig import Bench, Client, cpu, peer, ready
from ..rows import at_most, quantiles, Row, times

# bytes/s
LINE_RATE = 57600 / 10
FIX_RATE = 10.0
GPS_RAW_INT = 24


class Line:
    """
    The far end of a serial line, read in a thread; it notes when each frame was sent.

    :ivar device: the path of the near end.
    :ivar sent: when the last byte of each fix was sent, s, by its latitude.
    """

    def __init__(self) -> None:
        self._far, self._near = os.openpty()
        tty.setraw(self._near)
        self.device = os.ttyname(self._near)
        self.sent: dict[int, float] = {}
        self._rest, self._free_at = b'', 0.0
        self._stopping, self._stop = os.pipe()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Line:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        os.write(self._stop, b'\0')
        self._thread.join()
        for descriptor in (self._far, self._near, self._stopping, self._stop):
            os.close(descriptor)

    def _run(self) -> None:
        while self._stopping not in select.select([self._far, self._stopping], [], [])[0]:
            data = os.read(self._far, 65536)
            self._free_at = max(self._free_at, time.perf_counter()) + len(data) / LINE_RATE
            found, self._rest = strict_frames(self._rest + data)
            end = self._free_at - len(self._rest) / LINE_RATE
            for frame in reversed(found):
                if frame.message_id == GPS_RAW_INT:
                    self.sent[int.from_bytes(frame.payload[8:12], 'little')] = end
                end -= (len(frame.payload) + OVERHEAD) / LINE_RATE


def rededge(bench: Bench) -> Iterator[Row]:
    """Feed both at once, at a rate that the line can carry and at a rate that it cannot."""
    for rate in (50.0, 200.0):
        yield from fed(bench, rate)


def fed(bench: Bench, rate: float) -> Iterator[Row]:
    """Yield the rows at a rate of attitudes, Hz."""
    with contextlib.ExitStack() as stack:
        ours, theirs = stack.enter_context(Line()), stack.enter_context(Line())
        node = stack.enter_context(ready(start_interpreter(
            'illuminator_ros.rededge', f'serial://{ours.device}:57600', '--ros-args', '-r',
            '~/fix:=/fix', '-r', '~/imu:=/imu', '-p', f'attitude_rate:={rate}'), 'link open'))
        script = stack.enter_context(peer('straightforward_feeder', theirs.device))
        client = stack.enter_context(Client(bench))
        began, used, seconds = publish(client, rate, bench.amount(20.0, 1.5), node.pid, script.pid)
        time.sleep(bench.amount(0.5, 0.2))
        overloaded = time.perf_counter()
        late = {name: [1e3 * (line.sent.get(number, overloaded) - at)
                       for number, at in began.items()]
                for name, line in (('ours', ours), ('theirs', theirs))}
    found = {name: quantiles(values) for name, values in late.items()}
    name = 'straightforward script'
    yield Row(f'fix on a topic to its last byte on the line, beside {rate:g} Hz attitudes', 'ms',
              found['ours'], {name: found['theirs']},
              [at_most(found['ours']['p99'], 25, 'ms p99')])
    share = [{'': 100 * value / seconds} for value in used]
    yield Row(f'CPU for {rate:g} Hz attitudes and {FIX_RATE:g} Hz fixes', '%', share[0],
              {name: share[1]}, [times(share[0], share[1], 1.25)] if rate < 100 else [])


def publish(
    client: Client, rate: float, seconds: float, *pids: int,
) -> tuple[dict[int, float], list[float], float]:
    """
    Publish for a time.

    Return when each fix was published, the CPU time of the processes, and the elapsed time.
    """
    node = client.node
    fixes = node.create_publisher(NavSatFix, '/fix', 10)
    imus = node.create_publisher(Imu, '/imu', 10)
    eventually(lambda: min(fixes.get_subscription_count(), imus.get_subscription_count())
               >= len(pids), 'the topics have subscribers')
    # A node sends no attitude for 2 s after its start.
    time.sleep(2.0)
    began: dict[int, float] = {}
    start, before = time.perf_counter(), [cpu(pid) for pid in pids]
    every = round(rate / FIX_RATE)
    for number in range(round(seconds * rate)):
        time.sleep(max(start + number / rate - time.perf_counter(), 0.0))
        header = Header(stamp=node.get_clock().now().to_msg())
        angle = number / rate
        imus.publish(Imu(header=header, orientation=Quaternion(
            w=math.cos(angle), x=0.0, y=0.0, z=math.sin(angle))))
        if number % every == 0:
            began[number + 1] = time.perf_counter()
            fixes.publish(NavSatFix(
                header=header, status=NavSatStatus(status=0), latitude=(number + 1) * 1e-7,
                longitude=8.0, altitude=500.0))
    return (began, [cpu(pid) - first for pid, first in zip(pids, before, strict=True)],
            time.perf_counter() - start)
