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

from dataclasses import dataclass
from typing import ClassVar

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point, Pose, Vector3
from std_msgs.msg import ColorRGBA, Header

@dataclass(kw_only=True)
class Marker:
    ARROW: ClassVar[int]
    CYLINDER: ClassVar[int]
    LINE_LIST: ClassVar[int]
    TRIANGLE_LIST: ClassVar[int]
    ADD: ClassVar[int]
    MODIFY: ClassVar[int]
    DELETE: ClassVar[int]
    DELETEALL: ClassVar[int]
    header: Header = ...
    ns: str = ...
    id: int = ...  # noqa: A003
    type: int = ...  # noqa: A003
    action: int = ...
    pose: Pose = ...
    scale: Vector3 = ...
    color: ColorRGBA = ...
    lifetime: Duration = ...
    frame_locked: bool = ...
    points: list[Point] = ...
    colors: list[ColorRGBA] = ...
    text: str = ...
