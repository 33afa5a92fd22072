# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Users of lights, other senders, restarts and lost links, at random."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import random

from illuminator_ros.illuminator.client import enable_all
from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.model import Mode
from support.back_to_back import Pair
from support.records import Answer


class RandomUsers:
    """
    Does everything that may change a light.

    :param sources: the names of the sources of requests.
    :param others_switch_on: whether other senders switch on, too.
    :ivar answers: to all requests; ``sets`` has those to parameter sets.
    """

    def __init__(self, pair: Pair, draw: random.Random, *sources: str,
                 others_switch_on: bool = True) -> None:
        self.pair = pair
        self.draw = draw
        self.answers: list[Answer] = []
        self.sets: list[Answer] = []
        self._sources = sources
        self._others_switch_on = others_switch_on
        self._is_open = True

    def act(self, *further: Callable[[], None]) -> None:
        """Take one random action, of ``further`` ones too."""
        self.draw.choice([*(self.enable, self.configure, self.dim) * 4, self.enable_all,
                          self.refresh, self.desire, self.release, self.restart, self.change,
                          self.cut, self.open, self.open, *further])()
        self.pair.turn()

    def light(self) -> Light | None:
        """Return one of the lights, None if none is found yet."""
        lights: list[Light | None] = [*self.pair.controller.lights.values()]
        return self.draw.choice(lights or [None])

    def source(self) -> str:
        return self.draw.choice(self._sources)

    def answer(self) -> Answer:
        """Return a new answer."""
        self.answers.append(answer := Answer(self.pair.now))
        return answer

    def enable(self) -> None:
        if light := self.light():
            light.enable(self.draw.random() < 0.7, self.pair.now, self.answer(),
                         source=self.source(), is_call=self.draw.random() >= 0.5)

    def enable_all(self) -> None:
        if lights := [*self.pair.controller.lights.values()]:
            enable_all(lights, True, self.pair.now, self.answer(), name=str)

    def configure(self) -> None:
        if light := self.light():
            self.sets.append(self.answer())
            values = {'brightness': float(self.draw.randrange(81)),
                      'strobe_period': self.draw.choice((0.0, 1.0))}
            light.configure(values, self.pair.now, self.sets[-1])

    def dim(self) -> None:
        if light := self.light():
            for _ in range(self.draw.randint(1, 5)):
                light.set_brightness(
                    float(self.draw.randrange(101)), self.pair.now, source=self.source())

    def refresh(self) -> None:
        if light := self.light():
            light.refresh(self.pair.now, self.answer())

    def desire(self) -> None:
        if light := self.light():
            light.require({'strobe_duty_cycle': 30.0}, self.pair.now)

    def release(self) -> None:
        if light := self.light():
            light.release(self.source(), self.pair.now)

    def restart(self) -> None:
        self.draw.choice(self.pair.devices).restart(self.pair.now)

    def change(self) -> None:
        """Let another sender change a light, which the bridge may undo."""
        lamp = self.draw.choice(self.pair.devices).device
        lamp.enabled = self._others_switch_on and self.draw.random() < 0.5
        lamp.configuration = replace(
            lamp.configuration, mode=self.draw.choice(list(Mode)[1:]),
            brightness=float(self.draw.randrange(101)))

    def cut(self) -> None:
        if self.draw.random() < 0.2:
            self.pair.close()
            self._is_open = False

    def open(self) -> None:  # noqa: A003
        if not self._is_open:
            self.pair.open()
            self._is_open = True

    def hush(self) -> None:
        """Lose all frames of the lights for 1 to 6 s; after 3 s a light is lost."""
        faults = self.pair.far.wire.faults
        self.pair.far.wire.faults = replace(faults, drop=1.0)
        self.pair.run(self.draw.uniform(1.0, 6.0))
        self.pair.far.wire.faults = faults
