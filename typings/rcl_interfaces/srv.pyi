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

from rcl_interfaces.msg import (
    ListParametersResult,
    LoggerLevel,
    Parameter,
    ParameterDescriptor,
    ParameterValue,
    SetLoggerLevelsResult,
    SetParametersResult,
)
from rclpy.type_support import ServiceType

@dataclass(kw_only=True)
class DescribeParameters_Request:
    names: list[str] = ...

@dataclass(kw_only=True)
class DescribeParameters_Response:
    descriptors: list[ParameterDescriptor] = ...

class DescribeParameters(ServiceType[DescribeParameters_Request, DescribeParameters_Response]):
    Request: TypeAlias = DescribeParameters_Request
    Response: TypeAlias = DescribeParameters_Response

@dataclass(kw_only=True)
class GetParameters_Request:
    names: list[str] = ...

@dataclass(kw_only=True)
class GetParameters_Response:
    values: list[ParameterValue] = ...

class GetParameters(ServiceType[GetParameters_Request, GetParameters_Response]):
    Request: TypeAlias = GetParameters_Request
    Response: TypeAlias = GetParameters_Response

@dataclass(kw_only=True)
class GetParameterTypes_Request:
    names: list[str] = ...

@dataclass(kw_only=True)
class GetParameterTypes_Response:
    types: list[int] = ...

class GetParameterTypes(ServiceType[GetParameterTypes_Request, GetParameterTypes_Response]):
    Request: TypeAlias = GetParameterTypes_Request
    Response: TypeAlias = GetParameterTypes_Response

@dataclass(kw_only=True)
class ListParameters_Request:
    prefixes: list[str] = ...
    depth: int = ...

@dataclass(kw_only=True)
class ListParameters_Response:
    result: ListParametersResult = ...

class ListParameters(ServiceType[ListParameters_Request, ListParameters_Response]):
    Request: TypeAlias = ListParameters_Request
    Response: TypeAlias = ListParameters_Response

@dataclass(kw_only=True)
class SetParameters_Request:
    parameters: list[Parameter] = ...

@dataclass(kw_only=True)
class SetParameters_Response:
    results: list[SetParametersResult] = ...

class SetParameters(ServiceType[SetParameters_Request, SetParameters_Response]):
    Request: TypeAlias = SetParameters_Request
    Response: TypeAlias = SetParameters_Response

@dataclass(kw_only=True)
class SetParametersAtomically_Request:
    parameters: list[Parameter] = ...

@dataclass(kw_only=True)
class SetParametersAtomically_Response:
    result: SetParametersResult = ...

class SetParametersAtomically(
        ServiceType[SetParametersAtomically_Request, SetParametersAtomically_Response]):
    Request: TypeAlias = SetParametersAtomically_Request
    Response: TypeAlias = SetParametersAtomically_Response

@dataclass(kw_only=True)
class GetLoggerLevels_Request:
    names: list[str] = ...

@dataclass(kw_only=True)
class GetLoggerLevels_Response:
    levels: list[LoggerLevel] = ...

class GetLoggerLevels(ServiceType[GetLoggerLevels_Request, GetLoggerLevels_Response]):
    Request: TypeAlias = GetLoggerLevels_Request
    Response: TypeAlias = GetLoggerLevels_Response

@dataclass(kw_only=True)
class SetLoggerLevels_Request:
    levels: list[LoggerLevel] = ...

@dataclass(kw_only=True)
class SetLoggerLevels_Response:
    results: list[SetLoggerLevelsResult] = ...

class SetLoggerLevels(ServiceType[SetLoggerLevels_Request, SetLoggerLevels_Response]):
    Request: TypeAlias = SetLoggerLevels_Request
    Response: TypeAlias = SetLoggerLevels_Response
