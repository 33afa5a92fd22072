# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Fixtures for tests with ROS; a folder's conftest.py imports those that it needs."""

from __future__ import annotations

from collections.abc import Iterator
import logging
import os
from typing import Any

import pytest
from support.light import ServedLight
from support.ports import free_port
from support.processes import environment, Program
from support.ros import own_domain, Parameters, Ros, running_bridge


@pytest.fixture(scope='session', autouse=True)
def private_home() -> None:
    """Keep logs and time stamps of nodes in the test's own process out of the user's home."""
    os.environ |= {name: environment()[name] for name in ('HOME', 'ROS_HOME', 'ROS_LOG_DIR')}


@pytest.fixture(scope='module', autouse=True)
def log_routes() -> Iterator[None]:
    """Undo the changes that a bridge in the test's own process makes to logging."""
    logger = logging.getLogger('illuminator_ros')
    handlers, propagate = list(logger.handlers), logger.propagate
    yield
    logger.handlers[:] = handlers
    logger.propagate = propagate


@pytest.fixture(scope='module')
def domain() -> Iterator[int]:
    """Claim a ROS domain for one module."""
    with own_domain() as domain:
        yield domain


@pytest.fixture(scope='module')
def ros(domain: int) -> Iterator[Ros]:
    """Return a ROS client in the module's domain."""
    client = Ros(domain)
    yield client
    client.close()


@pytest.fixture
def own_ros() -> Iterator[Ros]:
    """Return a ROS client in a domain of the test's own, for a bridge of its own."""
    with own_domain() as domain:
        client = Ros(domain)
        yield client
        client.close()


@pytest.fixture
def port() -> int:
    """Return a free UDP port."""
    return free_port()


@pytest.fixture(scope='module')
def settings() -> dict[str, Any]:
    """Return the parameters of the module's bridge; a module may have its own."""
    return {}


@pytest.fixture(scope='module')
def shared_bridge(
    domain: int, settings: dict[str, Any],
) -> Iterator[tuple[Program, ServedLight]]:
    """Run a bridge, and a light that is connected to it."""
    port = free_port()
    with running_bridge(domain, port, **settings) as bridge, ServedLight(port) as light:
        bridge.wait_for('connected')
        yield bridge, light


@pytest.fixture
def bridge(shared_bridge: tuple[Program, ServedLight]) -> Program:
    """Return the module's bridge."""
    return shared_bridge[0]


@pytest.fixture
def light(shared_bridge: tuple[Program, ServedLight]) -> Iterator[ServedLight]:
    """Return the module's light, which obeys unless a test changes its behaviour."""
    light = shared_bridge[1]
    light.forget()
    yield light
    light.behave()


@pytest.fixture(scope='module')
def parameters(ros: Ros, shared_bridge: tuple[Program, ServedLight]) -> Parameters:
    """Return the parameters of the module's bridge, which the light has reported."""
    parameters = Parameters(ros)
    parameters.wait(mode='internal_control')
    return parameters
