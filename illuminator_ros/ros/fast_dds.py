# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The variable of the environment that names a profile of Fast DDS."""

from pathlib import Path


def profile_variable() -> str:
    """
    Return the variable that the loaded Fast DDS reads; rclpy must have been imported.

    Fast DDS 2, of Jazzy, reads the first one only. Kilted, with Fast DDS 3, warns of that one.
    """
    fast_dds_2 = 'libfastrtps' in Path('/proc/self/maps').read_text()
    return 'FASTRTPS_DEFAULT_PROFILES_FILE' if fast_dds_2 else 'FASTDDS_DEFAULT_PROFILES_FILE'
