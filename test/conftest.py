# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Settings of all tests."""

from __future__ import annotations

import gc

from hypothesis import HealthCheck, settings
import pytest

# The time of an example depends on the machine and on its other load.
settings.register_profile(
    'steady', deadline=None, derandomize=True, max_examples=40,
    suppress_health_check=[HealthCheck.too_slow])
settings.load_profile('steady')
# Collection makes thousands of objects that stay.
gc.disable()
# Files that take longer than 10 s, the longest first; they begin before all others.
LONG = [f'test_{name}.py' for name in (
    'app', 'examples', 'findings', 'gimbal_node', 'rededge', 'conformance', 'monitor',
    'monitor_web', 'soak', 'mavsdk', 'packaging', 'manager_node', 'demo',
    'command_line')]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with long files: at the end, one would run alone; then mix those of all folders."""
    items.sort(key=lambda item: (
        item.path.parent.name != 'lint',
        LONG.index(item.path.name) if item.path.name in LONG else len(LONG), item.path.name))


def pytest_collection_finish() -> None:
    """Keep the garbage collector from looking through thousands of tests again and again."""
    gc.freeze()
    gc.enable()
