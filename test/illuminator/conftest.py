# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Fixtures of the tests of the illuminator protocol."""

import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight


@pytest.fixture
def pair() -> Pair:
    """Return a controller and a simulated light that have discovered each other."""
    return Pair().settle()


@pytest.fixture
def fake() -> FakeLight:
    """Return a light whose behaviour the test sets; ``faked`` connects it to a controller."""
    return FakeLight()


@pytest.fixture
def faked(fake: FakeLight) -> Pair:
    """Return a controller and the light ``fake`` that have discovered each other."""
    return Pair(fake).settle()
