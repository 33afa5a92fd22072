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

from builtin_interfaces.msg import Time

@dataclass(kw_only=True)
class Bool:
    data: bool = ...

@dataclass(kw_only=True)
class ColorRGBA:
    r: float = ...
    g: float = ...
    b: float = ...
    a: float = ...

@dataclass(kw_only=True)
class Float32:
    data: float = ...

@dataclass(kw_only=True)
class Float64:
    data: float = ...

@dataclass(kw_only=True)
class Header:
    stamp: Time = ...
    frame_id: str = ...

@dataclass(kw_only=True)
class String:
    data: str = ...

@dataclass(kw_only=True)
class UInt32:
    data: int = ...
