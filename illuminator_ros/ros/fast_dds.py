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

"""The variable of the environment that names a profile of Fast DDS."""

from pathlib import Path


def profile_variable() -> str:
    """
    Return the variable that the loaded Fast DDS reads; rclpy must have been imported.

    Fast DDS 2, of Jazzy, reads the first one only. Kilted, with Fast DDS 3, warns of that one.
    """
    fast_dds_2 = 'libfastrtps' in Path('/proc/self/maps').read_text()
    return 'FASTRTPS_DEFAULT_PROFILES_FILE' if fast_dds_2 else 'FASTDDS_DEFAULT_PROFILES_FILE'
