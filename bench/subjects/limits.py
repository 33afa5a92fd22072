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

"""The documented time limits of answers and of the end of the programs, and the idle load."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import signal
import time

from illuminator_ros.mavlink.dialect import mavlink
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from ..light import serving
from ..rig import Bench, bridge, Client, cpu, free_port, peer, Program, simulator
from ..rows import at_most, one, quantile, Row

ANSWER, REFUSAL, END, PAUSE = 900.0, 300.0, 1000.0, 10.0
SIGNALS = (signal.SIGINT, signal.SIGTERM)


def limited(text: str, took: list[float], limit: float) -> Row:
    """Return a row of times, s, the longest of which has a limit, ms."""
    took = [seconds * 1e3 for seconds in took]
    return Row(text, 'ms', {'p50': quantile(took, 0.5), 'max': max(took)},
               targets=[at_most(max(took), limit, 'ms')], note=f'{len(took)} tries')


def set_brightness(client: Client, value: float) -> float:
    """Return the time until a set of the parameter is answered, s."""
    return client.request(SetParameters, '/illuminator/set_parameters', SetParameters.Request(
        parameters=[Parameter('brightness', value=value).to_parameter_msg()]))[0]


def ended(program: Program, number: int) -> float:
    """Return the time from a signal to the end of a program, s."""
    began = time.monotonic()
    if program.end(number):
        raise RuntimeError(program.log)
    return time.monotonic() - began


def measure(bench: Bench) -> Iterator[Row]:
    """Measure each limit several times."""
    tries = range(bench.amount(5, 1))
    port = free_port()
    with (bridge(f'udpin://127.0.0.1:{port}') as program, Client(bench.domain) as client):
        client.meet('/illuminator/enable', success=False)
        yield limited('~/enable without a light fails',
                      [client.call('/illuminator/enable', True)[0] for _ in tries], REFUSAL)
        yield limited('a set of parameters without a light fails',
                      [set_brightness(client, 50.0) for _ in tries], REFUSAL)
        with serving(port) as light:
            client.meet('/illuminator/enable')
            seconds = bench.amount(3.0, 0.2)
            before = cpu(program.pid)
            time.sleep(seconds)
            yield Row('CPU of the bridge with one light at 1 Hz', '%',
                      one(100 * (cpu(program.pid) - before) / seconds))
            light.silent = {mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE}
            yield limited('a set of parameters is answered beside a silent light',
                          [set_brightness(client, float(10 + number)) for number in tries],
                          ANSWER)
    for name, off in (('the bridge ends', False),
                      ('the bridge switches the light off and ends', True)):
        took = []
        for number in tries:
            port = free_port()
            with contextlib.ExitStack() as stack:
                stack.enter_context(simulator(f'udpout://127.0.0.1:{port}'))
                program = stack.enter_context(
                    bridge(f'udpin://127.0.0.1:{port}', off_on_shutdown=off))
                client = stack.enter_context(Client(bench.domain))
                client.meet('/illuminator/enable')
                client.call('/illuminator/enable', True)
                took.append(ended(program, SIGNALS[number % 2]))
        yield limited(name, took, END)
    yield limited('a collection of all garbage stops the bridge', collections(len(tries)), PAUSE)


def collections(count: int) -> list[float]:
    """Return for how long garbage collections stop a bridge that serves a light, s."""
    port = free_port()
    with (serving(port), peer('collecting_bridge', str(count), '--ros-args', '-p',
                              f'connection_url:=udpin://127.0.0.1:{port}') as program):
        program.wait_for('collected in', count=count)
        return [float(line.split()[2]) / 1e3 for line in program.lines if 'collected in' in line]
