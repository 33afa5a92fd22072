# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A flight of a minute in simulated time: client, MAVLink 1 bytes, camera, and the truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import heapq

from illuminator_ros.geometry.rotation import enu_flu, flip, Quaternion
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.messages import GeoPoint
from illuminator_ros.rededge.client import RedEdgeClient
from illuminator_ros.rededge.conversions import Position
from illuminator_ros.rededge.input_states import (
    CameraSettings,
    Input,
    PositionSource,
    Stamp,
    UNKNOWN,
)
from illuminator_ros.rededge.simulated import COLUMNS, RedEdgeProperties, SimulatedRedEdge
from illuminator_ros.simulation.simulated import SimulatedComponents
import pytest
from support.wire import Line, START
from tools.demo.flight_model import (
    ATTITUDE_RATE,
    compare,
    Comparison,
    FIX_RATE,
    Flight,
    GEOID,
    Image,
    IMAGE_INTERVAL,
    LENS,
    Pair,
)

UTC = 1.7e9


class Rig:
    """The client of a camera, and the camera, during a flight at its real speed."""

    def __init__(self, flight: Flight, settings: CameraSettings) -> None:
        self.flight = flight
        commands = CommandSender(Address(1, 191))
        self.client = RedEdgeClient(commands, settings)
        self.camera = SimulatedRedEdge(RedEdgeProperties(
            interval=IMAGE_INTERVAL, own_gps=GeoPoint(0.0, 0.0, 0.0)))
        cameras = SimulatedComponents([self.camera], START)
        self.camera.set_clock(UTC, START)
        self.link = Line(Component(commands, [self.client]), cameras, version=1)
        self.rows: list[dict[str, str]] = []
        self.camera.records.subscribe(
            lambda row: self.rows.append(dict(zip(COLUMNS, row, strict=True))))

    def stamp(self, time: float) -> Stamp:
        return Stamp(round((UTC + time) * 1e9), 0.0)

    def fix(self, time: float) -> None:
        truth, feeder, now = self.flight.truth(time), self.client.feeder, self.link.now
        feeder.receive_velocity(Input.VELOCITY, truth.velocity, self.stamp(time), now)
        if time not in self.flight.outage:
            feeder.receive_fix(
                Position(0, truth.latitude, truth.longitude, truth.altitude + GEOID),
                self.stamp(time), now)

    def attitude(self, time: float) -> None:
        truth, feeder, now = self.flight.truth(time), self.client.feeder, self.link.now
        feeder.orientation.receive_attitude(
            Input.IMU, enu_flu(truth.vehicle), UNKNOWN, self.stamp(time), now)
        feeder.orientation.receive_mount(
            flip(truth.vehicle.inverse() * truth.camera * LENS), 'base_link',
            self.stamp(time), now)

    def events(self) -> Iterator[tuple[float, int]]:
        count = int(self.flight.seconds * FIX_RATE)
        return heapq.merge(((number / FIX_RATE, 0) for number in range(count)),
                           ((number / ATTITUDE_RATE, 1) for number in range(
                               int(self.flight.seconds * ATTITUDE_RATE))))

    def fly(self) -> Comparison:
        """Fly, and compare the images with the truth."""
        for time, kind in self.events():
            self.link.run(START + time - self.link.now)
            if (time in self.flight.pull) is self.link.near.wire.is_open:
                (self.link.close if self.link.near.wire.is_open else self.link.open)()
            (self.attitude if kind else self.fix)(time)
            self.link.turn()
        self.link.run(START + self.flight.seconds - self.link.now)
        return compare((Image.read(row, UTC, 1.0) for row in self.rows), self.flight,
                       max_delay=0.001, least_fresh=1.0)


@pytest.mark.parametrize('source', PositionSource)
def test_images_of_a_flight_have_the_true_position_and_attitude(source: PositionSource) -> None:
    flight = Flight(60.0, 1.0)
    result = Rig(flight, CameraSettings(source, GEOID, attitude_rate=ATTITUDE_RATE)).fly()

    assert result.failures == []
    assert max(abs(flight.truth(time / 10).vehicle.euler()[0]) for time in range(600)) > 0.69


def test_comparison_finds_wrong_positions_wrong_angles_and_old_data() -> None:
    flight = Flight(36.0, 1.0)
    rig = Rig(flight, CameraSettings(geoid_separation=GEOID))
    assert rig.fly().failures == []
    images = [Image.read(row, UTC, 1.0) for row in rig.rows]
    turned = Quaternion.from_euler(0.0, 0.002, 0.0)

    def failures(changed: list[Image], max_delay: float = 0.001) -> str:
        return '; '.join(compare(
            changed, flight, max_delay=max_delay, least_fresh=1.0).failures)

    wrong_mounts = [replace(one, pair=one.pair and one.pair._replace(
        mount=one.pair.mount * turned)) for one in images]
    assert 'an attitude is wrong by 0.1' in failures(wrong_mounts[20:26])
    assert 'an attitude is wrong by 0.' in failures(wrong_mounts[20:26], max_delay=11.0)
    assert 'data that is 6.00 s old' in failures(
        [*images[1:], replace(images[0], position_age=6.0)])
    assert 'instead of 72' in failures(images[5:])
    assert 'did not fall back' in failures(
        [replace(one, position_age=1.0) if one.position_age is None else one for one in images])
    wrong = Rig(flight, CameraSettings(geoid_separation=GEOID - 0.6)).fly()
    assert wrong.failures[0].startswith('a position is wrong by 0.')


def test_a_delay_of_the_machine_explains_an_attitude_that_was_true() -> None:
    flight = Flight(60.0, 10.0)
    for number in range(0, 50, 4):
        # In all parts of the flight, and with a clock of the camera that is late, too.
        time, delay = 3.0 + 1.08 * number, 2.9 * (number % 11 - 5) / 5
        truth = flight.truth(time)
        fit = flight.explain(Pair(
            time + delay, truth.vehicle, time + delay, truth.vehicle.inverse() * truth.camera),
            11.0)
        assert fit.error < 0.05
        assert abs(fit.delay) < abs(delay) + 0.05
