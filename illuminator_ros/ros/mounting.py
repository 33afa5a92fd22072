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

"""Where each light is: parameters of the link of which a further light may have its own."""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.node import Node

from .parameters import declare_read_only, LINK_PARAMETERS, LinkParameters

NAMES = ('frame_id', 'beam_range', 'beam_angle')


def not_its_own(node: Node, first: Node) -> list[str]:
    """
    Return a warning for each parameter of the link that is given for a further light's node only.

    What is given for all nodes, or as for the first one, is no mistake.
    """
    # There is no public way to overrides that nobody declares.
    given = getattr(node, '_parameter_overrides', {})
    return [f'parameter {spec.name!r} is of the link, and ignored here: that of '
            f'{first.get_fully_qualified_name()} holds'
            for spec in LINK_PARAMETERS if spec.name in given and spec.name not in NAMES
            and given[spec.name].value != first.get_parameter(spec.name).value]


@dataclass(frozen=True)
class Mounting:
    """
    Where a light is, and how it shines from there: along +x.

    :param beam_range: the length of its beam, m; 0 if it is not to be shown.
    :param beam_angle: the full opening angle of its beam, rad.
    """

    frame_id: str
    beam_range: float
    beam_angle: float

    @classmethod
    def of_first(cls, parameters: LinkParameters) -> Mounting:
        """Return where the first light is."""
        return cls(*(getattr(parameters, name) for name in NAMES))

    def declare(self, node: Node) -> Mounting:
        """
        Declare where a further light is, read-only, and return it.

        It is here as far as nothing is given for its node.

        :raises ParameterError: if a parameter is wrong.
        """
        return Mounting(*(declare_read_only(node, spec, getattr(self, spec.name))
                          for spec in LINK_PARAMETERS if spec.name in NAMES))
