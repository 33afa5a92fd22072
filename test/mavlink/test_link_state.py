# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The states of a link, and the rate at which its events are reported; no I/O."""

from __future__ import annotations

from illuminator_ros.mavlink import link_state
import pytest


# The initials of the inputs -> the state, whether it counts as open, and the reported events.
@pytest.mark.parametrize(('inputs', 'state', 'events'), [
    ('', link_state.LinkState.OPENING, []),
    ('o', link_state.LinkState.UNPROVEN, ['open']),
    ('op', link_state.LinkState.OPEN, ['open']),
    ('opc', link_state.LinkState.LOST, ['open', 'lost']),
    ('opcop', link_state.LinkState.OPEN, ['open', 'lost', 'open']),
    ('c', link_state.LinkState.RETRYING, ['not open']),
    # A transport that closes at once each time counts as open only after a new proof.
    ('ococo', link_state.LinkState.DOUBTFUL, ['open', 'lost']),
    ('ocop', link_state.LinkState.OPEN, ['open', 'lost', 'open']),
    ('opcoco', link_state.LinkState.DOUBTFUL, ['open', 'lost', 'open', 'lost']),
    ('ops', link_state.LinkState.STOPPED, ['open'])])
def test_state_and_events_follow_from_the_inputs(
        inputs: str, state: link_state.LinkState, events: list[str]) -> None:
    status = link_state.LinkStatus('label', 0.0)
    for now, initial in enumerate(inputs):
        (input_,) = (one for one in link_state.LinkInput if one.value[0] == initial)
        status.transition(input_, float(now), 'name', 'reason')
    reported = [str(event).split(':')[0].removeprefix('link ') for event in status.events]
    assert (status.state, reported) == (state, events)
    assert state.is_open == (status.reason == '')
    assert status.openings == events.count('open')


def test_reasons_for_not_opening_are_reported_once_each_up_to_a_bound() -> None:
    status = link_state.LinkStatus('label', 0.0)
    for number in range(2 * link_state.MAX_REASONS):
        for _ in range(2):
            status.failed(f'reason {number}')
    assert [*map(str, status.events)] == [
        f'link not open: label: reason {number}; trying again'
        for number in range(link_state.MAX_REASONS)]
    assert status.reason == f'reason {2 * link_state.MAX_REASONS - 1}'
