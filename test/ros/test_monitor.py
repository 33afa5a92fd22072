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

"""What the monitor finds in a ROS graph, and what it asks of the lights there."""

from collections.abc import Iterator
import threading

from illuminator_ros.cli.monitor.actions import dim, refresh, Request, strobe, switch, switch_off
from illuminator_ros.cli.monitor.graph import lights_among, TOPICS, type_name
from illuminator_ros.cli.monitor.model import Light, Outcome, State
import pytest
from std_msgs.msg import Bool, Float32, UInt32
from std_srvs.srv import SetBool
from support.light import Address, CONFIGURE, eventually, free_port, MavResult, ServedLight
from support.monitors import Watching, watching
from support.ros import Ros, running_bridge, STATE
from support.slow import pass_time_until
from support.waiting import PATIENCE


@pytest.fixture(scope='module')
def watched(ros: Ros, shared_bridge: object) -> Iterator[Watching]:
    """Watch the module's domain."""
    with watching(ros) as made:
        yield made


@pytest.fixture
def monitor(watched: Watching, light: ServedLight) -> Watching:
    """Return the monitor, which knows a light that is off, at 50 % and steady."""
    light.behave()
    light.report(enable=0, brightness=50.0, strobe_period=0.0, strobe_duty_cycle=0.0,
                 error_status=0, temp_c=25.0)
    watched.wait(lambda light: light.value('brightness') == 50.0 and light.setpoint == 50.0
                 and light.value('enabled') is False and light.value('strobe_period') == 0.0
                 and light.value('error_flags') == 0 and not light.wanted)
    return watched


def darker(light: Light) -> Request | None:
    return dim(light, -10.0)


class TestWhatItShows:

    def test_the_light_is_found_by_its_interface(self, monitor: Watching) -> None:
        assert monitor.names == ['/illuminator']
        monitor.wait(lambda light: light.state(light.heard_at) is State.OFF)

    def test_values_are_those_of_the_light(self, light: ServedLight, monitor: Watching) -> None:
        light.report(enable=1, brightness=30.0, temp_c=61.5, error_status=1, strobe_period=0.5,
                     strobe_duty_cycle=20.0, mode=2)

        wanted = {'temperature': 61.5, 'mode': 'external_sync', 'connected': True,
                  'enabled': True, 'brightness': 30.0, 'strobe_period': 0.5,
                  'strobe_duty_cycle': 20.0}
        monitor.wait(lambda light: all(light.value(name) == wanted[name] for name in wanted)
                     and light.flags == ['thermal throttling'])
        light.report(mode=1)

    def test_link_quality_and_identity_are_those_of_the_diagnostics(
        self, monitor: Watching,
    ) -> None:
        shown = monitor.wait(lambda light: light.link and light.lamp and light.link.number(
            'round_trip_p50_ms') is not None)

        assert shown.link is not None
        assert shown.link.number('loss_percent') == 0.0
        assert shown.lamp is not None
        assert shown.lamp.values['vendor'] == 'maker'

    def test_what_is_agreed_is_known_beside_what_is_shown(
        self, light: ServedLight, monitor: Watching,
    ) -> None:
        light.report(brightness=20.0, error_status=1)

        shown = monitor.wait(lambda light: light.value('brightness') == 20.0)

        assert shown.setpoint == 50.0

    def test_a_light_that_is_lost_is_marked_and_one_that_returns_is_not(
        self, light: ServedLight, monitor: Watching,
    ) -> None:
        light.fake.silent = True
        pass_time_until(lambda: monitor.light().value('connected') is False)
        assert monitor.light().state(monitor.light().heard_at) is State.LOST

        light.behave()
        monitor.wait(lambda light: light.value('connected') is True)


class TestWhatItAsks:
    def test_a_light_is_switched_and_the_answer_is_the_bridge_s(
        self, light: ServedLight, monitor: Watching,
    ) -> None:
        monitor.ask(switch)

        assert 'confirmed by ILLUMINATOR_STATUS' in monitor.outcome('on', Outcome.DONE)
        assert light.fake.fields['enable'] == 1
        monitor.wait(lambda light: light.value('enabled') is True)

    def test_steps_add_up_however_fast_they_come(
        self, light: ServedLight, monitor: Watching,
    ) -> None:
        for _ in range(4):
            monitor.ask(darker)

        monitor.outcome('brightness 10 %', Outcome.DONE)
        assert light.fake.fields['brightness'] == 10.0
        assert len(light.commands(CONFIGURE)) <= 4

    def test_a_refused_set_shows_its_reason_and_leaves_what_is_agreed(
        self, light: ServedLight, monitor: Watching,
    ) -> None:
        light.fake.results[CONFIGURE] = MavResult.DENIED
        monitor.ask(darker)

        assert 'MAV_RESULT_DENIED' in monitor.outcome('brightness 40 %', Outcome.FAILED)
        assert monitor.light().setpoint == 50.0

    def test_a_strobe_is_period_and_duty_cycle_in_one_command(
        self, light: ServedLight, monitor: Watching,
    ) -> None:
        monitor.ask(strobe)

        monitor.outcome('strobe 1 s, 50 %', Outcome.DONE)
        assert len(light.commands(CONFIGURE)) == 1
        assert (light.fake.fields['strobe_period'], light.fake.fields['strobe_duty_cycle']) == (
            1.0, 50.0)

    def test_a_refresh_is_answered(self, monitor: Watching) -> None:
        monitor.ask(refresh)

        assert monitor.outcome('refresh', Outcome.DONE)

    def test_off_gets_through_while_a_set_is_not_answered(
        self, light: ServedLight, monitor: Watching,
    ) -> None:
        light.fake.results[CONFIGURE] = None
        monitor.ask(darker)
        monitor.outcome('brightness 40 %', Outcome.PENDING)

        monitor.ask(switch_off)

        monitor.outcome('off', Outcome.DONE)
        pass_time_until(lambda: not monitor.light().wanted, step=0.1)


class FakeBridge:
    """The interface of a light, behind which nobody answers unless told to."""

    def __init__(self, ros: Ros, name: str) -> None:
        self._node = ros.node
        self._publishers = [
            self._node.create_publisher(TOPICS[topic], f'{name}/{topic}', STATE)
            for topic in ('connected', 'enabled', 'brightness', 'error_flags')]
        for publisher, message in zip(self._publishers, (
                Bool(data=True), Bool(data=True), Float32(data=10.0), UInt32()), strict=True):
            publisher.publish(message)

    def destroy(self) -> None:
        """Leave the graph."""
        for publisher in self._publishers:
            self._node.destroy_publisher(publisher)


def test_a_service_that_does_not_answer_is_given_up(own_ros: Ros) -> None:
    release = threading.Event()
    own_ros.node.create_service(
        SetBool, '/dead/enable',
        lambda request, response: release.wait(PATIENCE) and response)
    FakeBridge(own_ros, '/dead')
    with watching(own_ros) as monitor:
        monitor.wait(lambda light: light.value('enabled'), '/dead')
        try:
            # Until the service has been found there is nobody to ask.
            def sent() -> bool:
                monitor.ask(switch_off, '/dead')
                action = monitor.light('/dead').action
                return action is not None and action.outcome is Outcome.PENDING
            eventually(sent)

            def given_up() -> bool:
                action = monitor.light('/dead').action
                return action is not None and 'no answer from /dead' in action.answer
            pass_time_until(given_up)
        finally:
            release.set()


def test_what_has_no_service_is_told_at_once(own_ros: Ros) -> None:
    FakeBridge(own_ros, '/mute')
    with watching(own_ros) as monitor:
        monitor.wait(lambda light: light.value('enabled'), '/mute')

        monitor.ask(switch_off, '/mute')

        assert monitor.outcome('off', Outcome.FAILED, '/mute') == 'nobody serves /mute/enable'


def test_a_light_that_leaves_is_marked_and_can_be_cleared_and_can_return(own_ros: Ros) -> None:
    with watching(own_ros) as monitor:
        first = FakeBridge(own_ros, '/one')
        FakeBridge(own_ros, '/two')
        monitor.wait_names('/one', '/two')

        first.destroy()
        monitor.wait(lambda light: light.gone_at is not None, '/one')
        monitor.clear_gone()
        monitor.wait_names('/two')

        FakeBridge(own_ros, '/one')
        monitor.wait(lambda light: light.value('brightness') == 10.0, '/one')


def test_two_bridges_with_nodes_of_one_name_are_told_apart(own_ros: Ros) -> None:
    ports = {'/uav1': free_port(), '/uav2': free_port()}
    with (running_bridge(own_ros.domain, ports['/uav1'], '-r', '__ns:=/uav1'),
          running_bridge(own_ros.domain, ports['/uav2'], '-r', '__ns:=/uav2'),
          ServedLight(ports['/uav1'], brightness=10.0),
          ServedLight(ports['/uav2'], Address(9, 9), brightness=20.0),
          watching(own_ros) as monitor):
        monitor.wait_names('/uav1/illuminator', '/uav2/illuminator')
        for name, address, brightness in (('/uav1/illuminator', '1/243', 10.0),
                                          ('/uav2/illuminator', '9/9', 20.0)):
            shown = monitor.wait(lambda light: light.lamp and light.setpoint is not None, name)
            assert shown.lamp is not None
            assert (shown.lamp.values['address'], shown.setpoint) == (address, brightness)


def test_two_monitors_see_and_do_the_same(ros: Ros, monitor: Watching) -> None:
    with watching(ros) as other:
        other.wait(lambda light: light.setpoint == 50.0)

        other.ask(darker)

        other.outcome('brightness 40 %', Outcome.DONE)
        monitor.wait(lambda light: light.setpoint == 40.0)


class TestWhatIsALight:
    SIGNATURE = [(f'/bow/{topic}', [type_name(TOPICS[topic])])
                 for topic in ('connected', 'enabled', 'brightness', 'error_flags')]

    def test_it_is_whoever_publishes_what_a_light_does(self) -> None:
        assert lights_among(self.SIGNATURE, lambda topic: 1) == ['/bow']

    def test_its_name_and_namespace_do_not_matter(self) -> None:
        topics = [(topic.replace('/bow', '/a/b/c'), types) for topic, types in self.SIGNATURE]

        assert lights_among(topics, lambda topic: 1) == ['/a/b/c']

    @pytest.mark.parametrize('missing', range(4))
    def test_a_part_of_it_is_none(self, missing: int) -> None:
        topics = self.SIGNATURE[:missing] + self.SIGNATURE[missing + 1:]

        assert lights_among(topics, lambda topic: 1) == []

    def test_other_types_are_none(self) -> None:
        topics = [(topic, ['std_msgs/msg/String']) for topic, _ in self.SIGNATURE]

        assert lights_among(topics, lambda topic: 1) == []

    def test_what_only_has_subscribers_is_none(self) -> None:
        assert lights_among(self.SIGNATURE, lambda topic: topic != '/bow/enabled') == []
