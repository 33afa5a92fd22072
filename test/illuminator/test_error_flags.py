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

"""ILLUMINATOR_ERROR_FLAGS in words."""

from illuminator_ros.illuminator.model import flag_names
import pytest


@pytest.mark.parametrize(('flags', 'names'), [
    (0, []),
    (1, ['thermal throttling']),
    (2, ['over temperature shutdown']),
    (4, ['thermistor failure']),
    (5, ['thermal throttling', 'thermistor failure']),
    (8, ['unknown flags 0x8']),
    (0x80000001, ['thermal throttling', 'unknown flags 0x80000000']),
])
def test_error_flags_have_readable_names(flags, names):
    assert flag_names(flags) == names
