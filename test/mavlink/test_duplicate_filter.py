# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Frames that come over two paths within 5 s are copies; those of one path are not."""

from __future__ import annotations

from illuminator_ros.mavlink.forwarding.duplicate_filter import (
    DuplicateFilter,
    MEMORY,
    Path,
)
import pytest

FIRST, SECOND = Path(0, 'a'), Path(1, 'b')


def copies(filter_: DuplicateFilter, *arrivals: tuple[float, Path]) -> list[bool]:
    """Return for each arrival of the same bytes whether it is a copy."""
    found = []
    for now, path in arrivals:
        found.append(filter_.is_copy(b'frame', path, now))
        if not found[-1]:
            filter_.add(b'frame', path, now)
    return found


@pytest.mark.parametrize(('arrivals', 'expected'), [
    # A device may send each frame with the same sequence number.
    ([(0.0, FIRST), (0.0, FIRST), (1.0, FIRST)], [False] * 3),
    ([(0.0, FIRST), (0.0, SECOND)], [False, True]),
    ([(0.0, FIRST), (4.9, SECOND)], [False, True]),
    ([(0.0, FIRST), (MEMORY, SECOND)], [False, False]),
    # Two senders on one line are two paths.
    ([(0.0, FIRST), (0.1, Path(0, 'b'))], [False, True]),
    # A ring goes both ways round: the frame returns over the line of the original, too.
    ([(0.0, FIRST), (0.1, SECOND), (0.2, FIRST), (5.0, FIRST), (5.2, FIRST)],
     [False, True, True, True, False])])
def test_a_frame_is_a_copy_if_it_came_over_another_path_less_than_5_s_before(
        arrivals: list[tuple[float, Path]], expected: list[bool]) -> None:
    filter_ = DuplicateFilter()
    assert not filter_.is_copy(b'other', SECOND, arrivals[-1][0])
    assert copies(filter_, *arrivals) == expected
