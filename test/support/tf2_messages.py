# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
``tf2_msgs`` for machines without ROS, since there are no wheels of it.

Transforms are sent as markers there: header, name and rotation.
"""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
import sys
from typing import Any

from geometry_msgs.msg import Transform, TransformStamped

# The type support looks at the name of the class and of its module.
STAND_IN = """
from geometry_msgs.msg import Pose
from visualization_msgs.msg import Marker, MarkerArray as Markers


class MarkerArray(Markers):

    __module__ = Markers.__module__

    def __init__(self, transforms=(), **fields):
        fields = fields or {'markers': [
            Marker(header=one.header, ns=one.child_frame_id,
                   pose=Pose(orientation=one.transform.rotation)) for one in transforms]}
        super().__init__(**fields)


TFMessage = MarkerArray
"""


def tf2_path(folder: Path) -> str:
    """Return the PYTHONPATH with which other processes and this one find ``tf2_msgs``."""
    path = os.environ.get('PYTHONPATH', '')
    if importlib.util.find_spec('tf2_msgs') is None:
        (folder / 'tf2_msgs').mkdir()
        (folder / 'tf2_msgs' / '__init__.py').touch()
        (folder / 'tf2_msgs' / 'msg.py').write_text(STAND_IN)
        sys.path.append(str(folder))
        path = os.pathsep.join(filter(None, (str(folder), path)))
    return path


def transforms(message: Any) -> list[TransformStamped]:
    """Return the transforms of a received message."""
    if hasattr(message, 'transforms'):
        return list(message.transforms)
    return [TransformStamped(header=one.header, child_frame_id=one.ns,
                             transform=Transform(rotation=one.pose.orientation))
            for one in message.markers]
