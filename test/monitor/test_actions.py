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

"""What keys ask of a light, given what is known of it."""

from illuminator_ros.cli.monitor.actions import (
    dim,
    refresh,
    Request,
    Service,
    strobe,
    switch,
    switch_off,
)
from illuminator_ros.cli.monitor.model import Light
import pytest


def light(setpoint: float | None = None, wanted: dict[str, object] | None = None,
          **values: object) -> Light:
    """Return a light that has published these values."""
    return Light('/bow', 0.0, setpoint=setpoint, wanted=wanted or {}, values=values)


@pytest.mark.parametrize(('enabled', 'on'), [(True, False), (False, True), (None, True)])
def test_switching_is_to_the_other_state(enabled: bool | None, on: bool) -> None:
    assert switch(light(enabled=enabled)) == Request(
        Service.ENABLE, 'on' if on else 'off', on)


def test_switching_twice_is_back_before_the_light_has_answered() -> None:
    assert switch(light(enabled=False, wanted={'enabled': True})).value is False


@pytest.mark.parametrize('enabled', [True, False, None])
def test_switching_off_is_off_whatever_the_light_shows(enabled: bool | None) -> None:
    assert switch_off(light(enabled=enabled)).value is False


class TestDim:

    def dimmed(self, one: Light, step: float) -> float:
        request = dim(one, step)
        assert request is not None
        assert request.service is Service.SET
        [(name, value)] = request.value.items()
        assert name == 'brightness'
        return float(value)

    @pytest.mark.parametrize(('start', 'step', 'target'), [
        (50.0, 10.0, 60.0), (50.0, -1.0, 49.0), (95.0, 10.0, 100.0), (5.0, -10.0, 0.0),
        (100.0, 10.0, 100.0), (0.0, -1.0, 0.0), (33.3, 1.0, 34.3)])
    def test_it_goes_by_a_step_and_stays_within_the_range(
        self, start: float, step: float, target: float,
    ) -> None:
        assert self.dimmed(light(setpoint=start), step) == target

    def test_it_starts_from_what_is_agreed_though_a_hot_light_shines_less(self) -> None:
        assert self.dimmed(light(setpoint=80.0, brightness=40.0), 10.0) == 90.0

    def test_it_starts_from_what_was_asked_for_last(self) -> None:
        one = light(setpoint=80.0, wanted={'brightness': 60.0}, brightness=80.0)

        assert self.dimmed(one, -10.0) == 50.0

    def test_it_starts_from_what_is_shown_if_that_is_all_that_is_known(self) -> None:
        assert self.dimmed(light(brightness=40.0), 10.0) == 50.0

    def test_without_any_brightness_there_is_nothing_to_ask(self) -> None:
        assert dim(light(), 10.0) is None


class TestStrobe:

    def test_a_steady_light_is_to_strobe_once_a_second(self) -> None:
        assert strobe(light(strobe_period=0.0, strobe_duty_cycle=0.0)).value == {
            'strobe_period': 1.0, 'strobe_duty_cycle': 50.0}

    def test_it_keeps_the_duty_cycle_that_it_has(self) -> None:
        assert strobe(light(strobe_period=0.0, strobe_duty_cycle=20.0)).value == {
            'strobe_period': 1.0, 'strobe_duty_cycle': 20.0}

    def test_a_strobe_is_ended(self) -> None:
        assert strobe(light(strobe_period=0.5)).value == {'strobe_period': 0.0}

    def test_so_is_one_that_has_only_been_asked_for(self) -> None:
        one = light(strobe_period=0.0, wanted={'strobe_period': 1.0})

        assert strobe(one).value == {'strobe_period': 0.0}


def test_refresh_is_a_service_of_its_own() -> None:
    assert refresh(light()).service is Service.REFRESH
