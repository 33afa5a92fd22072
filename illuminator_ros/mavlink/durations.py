# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Durations for people."""


def format_seconds(seconds: float) -> str:
    """Return a duration for people: ms below a second, else s."""
    return f'{seconds * 1000:.0f} ms' if seconds < 0.9995 else f'{seconds:.2f} s'


def timing(tries: int, seconds: float) -> str:
    """Return the number of tries and the time taken, for people."""
    return f'{tries} {"try" if tries == 1 else "tries"}, {format_seconds(seconds)}'
