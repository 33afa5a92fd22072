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
from typing import TypeAlias

from rclpy.type_support import ServiceType

@dataclass(kw_only=True)
class SetBool_Request:
    data: bool = ...

@dataclass(kw_only=True)
class SetBool_Response:
    success: bool = ...
    message: str = ...

class SetBool(ServiceType[SetBool_Request, SetBool_Response]):
    Request: TypeAlias = SetBool_Request
    Response: TypeAlias = SetBool_Response

@dataclass(kw_only=True)
class Trigger_Request: ...

@dataclass(kw_only=True)
class Trigger_Response:
    success: bool = ...
    message: str = ...

class Trigger(ServiceType[Trigger_Request, Trigger_Response]):
    Request: TypeAlias = Trigger_Request
    Response: TypeAlias = Trigger_Response
