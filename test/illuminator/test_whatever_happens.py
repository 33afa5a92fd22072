# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Random schedules of users, restarts, lost links and other senders end in the true state."""

from __future__ import annotations

import random

from illuminator_ros.illuminator.model import Mode
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.illuminator.thermal import ThermalProperties
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.command_sources import DEFAULT
import pytest
from support.back_to_back import Pair
from support.random_users import RandomUsers
from support.wire import Faults

SECONDS = 90.0
# s after the repair of the line within which all requests must be answered and all states known:
# for example, a restored configuration is sent again after 2 s.
RECOVERY = 12.0
# s; the tries of a command, its confirmation, and the requests before it in the queue.
LONGEST = 32.0
LIGHTS = [IlluminatorProperties(address=Address(1, one), thermal=ThermalProperties(rise=0.0))
          for one in (243, 244)]


@pytest.mark.parametrize('seed', range(8))
def test_random_schedules_end_with_one_answer_each_and_the_true_state(seed: int) -> None:
    draw = random.Random(seed)
    faults = Faults(**{kind: draw.choice((0.0, 0.1, 0.3)) for kind in (
        'drop', 'duplicate', 'reorder', 'delay', 'corrupt')})
    pair = Pair(LIGHTS, there=faults, seed=seed, uptime=draw.choice((0.0, 1000.0)),
                settings=LightSettings(status_interval=draw.choice((0.0, 0.2)),
                                       restore_configuration=draw.random() < 0.7))
    users = RandomUsers(pair, draw, DEFAULT)
    end = pair.now + SECONDS
    while pair.now < end:
        users.act(users.hush)
        pair.run(draw.choice((0.0, 0.01, 0.1, 0.5, 2.0)))
    pair.mend()
    users.open()
    pair.run(RECOVERY)

    assert {len(answer.results) for answer in users.answers} == {1}
    assert max(answer.seconds for answer in users.sets) <= 0.9
    assert max(answer.seconds for answer in users.answers) <= LONGEST
    for simulated in pair.devices:
        light = pair.controller.lights[simulated.address]
        assert light.connected
        followed = light.snapshot(pair.now).configuration
        assert followed is not None
        actual = simulated.device.configuration
        # Under external sync only the mode is followed.
        assert followed.mode is actual.mode
        assert followed == actual or actual.mode is Mode.EXTERNAL_SYNC
        assert light.twin.status is not None
        assert light.twin.status.enabled == simulated.device.enabled
    assert pair.controller.schedule.due > pair.now
    assert not pair.controller.sender
