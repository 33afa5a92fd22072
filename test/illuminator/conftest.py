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
