# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Both sides of a link under attack, and the conditions that must hold meanwhile."""

from __future__ import annotations

from collections.abc import Callable
import math
import random
from typing import Any, cast

from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import FAULTS, IlluminatorProperties
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandLong
from illuminator_ros.mavlink.signing import Signing, SigningMode
from illuminator_ros.payload.requests import Result
from illuminator_ros.simulation.simulated import SimulatedComponent, SimulatedComponents
from support.attacker import Attacker
from support.client import Client
from support.entries import stores
from support.frames import Codec
from support.simulated_link import SimulatedLink

BRIDGE = Address(1, 193)
GENUINE = Address(1, 243)
GENUINE_PEER = ('127.0.0.1', 20_000)
# s after which every request has been answered.
ANSWERED_WITHIN = 120.0
KEY = bytes(range(32))
# Entries in the tables of a link and its endpoint, of which time stamps are 4,096.
MAX_ENTRIES = 8_000


class AttackedLink:
    """
    A link and its attacker.

    :ivar inputs: datagrams so far.
    :ivar frames: of them, frames that were taken for good.
    """

    def __init__(self, seed: object, mode: SigningMode) -> None:
        self.mode = mode
        self.inputs = 0
        self.last: list[tuple[bytes, Any]] = []
        self._random = random.Random(repr(('siege', seed)))
        self.link = SimulatedLink(
            self.make_endpoint(), self.take, signing=self._signing())
        self.attacker = Attacker(seed, KEY, [GENUINE, BRIDGE, Address(1, 244), Address(1, 1)])
        self.get_ready()

    def _signing(self, link_id: int = 0) -> Signing:
        return Signing(self.mode, KEY, link_id)

    def make_endpoint(self) -> Any:
        """Return the endpoint that is attacked."""
        raise NotImplementedError

    def take(self, data: bytes, peer: Any) -> None:
        """Take what the link sends."""
        raise NotImplementedError

    def get_ready(self) -> None:
        """Prepare the attack."""

    def busy(self) -> None:
        """Send honest requests during the attack."""
        raise NotImplementedError

    def entries(self) -> int:
        """Return the number of entries in the tables of the link and its endpoint."""
        return sum(stores(self.link, self).values())

    def check_state(self) -> None:
        """Check that nothing waits to be sent."""
        assert not self.link.endpoint.outgoing

    def check_bounds(self) -> None:
        """Check the state, and that the tables have a bounded size, which takes 0.1 s."""
        self.check_state()
        assert self.entries() < MAX_ENTRIES

    def attack(self) -> None:
        """Send the next datagrams, and sometimes honest requests."""
        self.last = self.attacker.datagrams(self.link.now)
        self.link.receive(*self.last)
        self.inputs += len(self.last)
        if self._random.random() < 0.2:
            self.link.run(self._random.choice((0.001, 0.01, 0.1)))
        if self._random.random() < 0.02:
            self.busy()
            self.check_state()

    def check_service(self) -> None:
        """Check that the service is as before after the attack."""
        raise NotImplementedError

    def close(self) -> None:
        """End the link."""
        self.link.stop()


class AttackedBridge(AttackedLink):
    """The bridge's side, with a genuine light that it must serve at any time."""

    def make_endpoint(self) -> Any:
        self.results: list[list[Result]] = []
        return Client(BRIDGE, LightSettings(status_interval=1.0))

    @property
    def controller(self) -> Client:
        """Return the client that is attacked."""
        return cast(Client, self.link.endpoint)

    def get_ready(self) -> None:
        self._light = SimulatedComponent(
            SimulatedIlluminator(IlluminatorProperties(address=GENUINE)), self.link.now)
        self._party = Codec(self._signing(7))
        self.genuine(3.0)
        self._check_command()

    def take(self, data: bytes, peer: Any) -> None:
        if peer == GENUINE_PEER:
            for source, message in self._party.messages(data):
                self._light.receive(source, message, self.link.now)
                self._flush()

    def disturb(self, fault: str) -> None:
        """Give the genuine light a fault of the simulator."""
        self._light.behave(FAULTS.add(self._light.behaviour, fault), self.link.now)

    def _flush(self) -> None:
        while self._light.outgoing:
            frame = self._party.frame(*self._light.outgoing.popleft(), self.link.now)
            self.link.socket.inbox.append((frame, GENUINE_PEER))

    def genuine(self, seconds: float) -> None:
        """Let time pass with the genuine light and the other frames in the inbox."""
        until = self.link.now + seconds
        while self.link.now < until:
            self._light.schedule.run(self.link.now)
            self._flush()
            self.link.run(min(self._light.schedule.due, until) - self.link.now + 0.001)

    def busy(self) -> None:
        self._light.schedule.run(self.link.now)
        self._flush()
        self.link.receive()
        light = self._random.choice(list(self.controller.lights.values()))
        brightness = self._random.uniform(0, 100)
        results: list[Result] = []

        def done(result: Result, now: float) -> None:
            results.append(result)

        asked = self._random.randrange(4)
        if asked < 3:
            self.results.append(results)
        self.link.ask((
            lambda now: light.enable(brightness > 50, now, done),
            lambda now: light.configure({'brightness': brightness}, now, done),
            lambda now: light.refresh(now, done),
            lambda now: light.set_brightness(brightness, now))[asked])

    def check_service(self) -> None:
        self.genuine(ANSWERED_WITHIN)
        assert all(len(results) == 1 for results in self.results), (
            f'{sum(not results for results in self.results)} requests without an answer, '
            f'{sum(len(results) > 1 for results in self.results)} with more than one')
        self._check_command()

    def _check_command(self) -> None:
        """Check that the genuine light can be commanded, and is distinguished from its copies."""
        light = self.controller.lights[GENUINE]
        assert light.connected
        for on, brightness in ((True, 40.0), (False, 70.0)):
            results: list[Result] = []

            def ask(now: float, on: bool = on, brightness: float = brightness,
                    to: list[Result] = results) -> None:
                def done(outcome: Result, now: float) -> None:
                    to.append(outcome)

                light.enable(on, now, done)
                light.configure({'brightness': brightness}, now, done)

            self.link.ask(ask)
            self.genuine(2.0)
            assert [result.success for result in results] == [True, True], results
            lamp = self._light.device
            assert (lamp.enabled, lamp.configuration.brightness) == (on, brightness)


class AttackedLights(AttackedLink):
    """Simulated lights, with a genuine client that they must obey at any time."""

    def make_endpoint(self) -> Any:
        return SimulatedComponents([
            SimulatedIlluminator(IlluminatorProperties(address=Address(1, 243 + i)))
            for i in range(3)], 1000.0)

    def get_ready(self) -> None:
        self.lights = cast(SimulatedComponents[Any], self.link.endpoint).components
        self._party = Codec(self._signing(7))
        self._acks: list[Any] = []
        self.busy()

    def take(self, data: bytes, peer: Any) -> None:
        if peer == GENUINE_PEER:
            self._acks += [message for _, message in self._party.messages(data)
                           if hasattr(message, 'result')]
            del self._acks[:-100]

    def busy(self) -> None:
        self._command(405, self._random.randrange(2))

    def _command(self, command: int, *params: float) -> None:
        message = CommandLong(*GENUINE, command, 0, *[*params, 0, 0, 0, 0, 0, 0, 0][:7])
        self.link.receive((self._party.frame(BRIDGE, message, self.link.now), GENUINE_PEER))

    def check_state(self) -> None:
        super().check_state()
        for light in self.lights:
            assert math.isfinite(light.device.thermal.temperature)
            configuration = light.device.configuration
            assert 0 <= configuration.brightness <= 100, configuration
            assert 0 <= configuration.strobe_period <= 10, configuration
            assert 0 <= configuration.strobe_duty_cycle <= 100, configuration

    def check_service(self) -> None:
        # Peers and time stamps of the attack expire.
        self.link.run(70.0)
        for on in (1, 0):
            self._acks.clear()
            self._command(405, on)
            assert [ack.result for ack in self._acks] == [mavlink.MAV_RESULT_ACCEPTED]
            assert self.lights[0].device.enabled is bool(on)


ATTACKED: dict[str, Callable[[object, SigningMode], AttackedLink]] = {
    'bridge': AttackedBridge, 'light': AttackedLights}
