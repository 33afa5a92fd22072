# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The conformance checks of a winch, beside a light on the same link."""

import signal
from typing import Any

from illuminator_ros.cli import conformance
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.simulation.simulated import SimulatedComponents
from payloads.winch import CHECKS, SIMULATED, SimulatedWinch, WINCH
import pytest
from support.checks_run import ChecksRun
from support.wire import START

DECK = Address(1, 169)


@pytest.mark.parametrize(('fault', 'failed'), [('', set()), ('lie', {'release'})])
def test_a_winch_is_checked_and_restored_by_its_own_requirements_and_those_of_every_component(
        fault: str, failed: set[str]) -> None:
    winch, checks = SimulatedWinch(SIMULATED.properties), WINCH.load('checks')
    devices: SimulatedComponents[Any] = SimulatedComponents(
        [SimulatedIlluminator(IlluminatorProperties()), winch], START)
    component = devices.components[1]
    if fault:
        component.behave(winch.faults.add(component.behaviour, fault), START)
    done = ChecksRun(checks, devices).finish()

    assert done.session.components.found == DECK
    assert done.failed == failed
    assert len(done.runner.results) == len(CHECKS.requirements)
    assert done.runner.restored == 'the winch is as it was'
    assert winch.line_length == 0.0


def test_conformance_takes_a_payload_that_the_package_does_not_have(
    capsys: pytest.CaptureFixture[str],
) -> None:
    handler = signal.getsignal(signal.SIGINT)
    try:
        assert conformance.main(['--payload', 'winch', '--list'], {'winch': WINCH}) == 0
    finally:
        signal.signal(signal.SIGINT, handler)

    assert 'release ' in capsys.readouterr().out
