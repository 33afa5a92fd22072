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

"""The SROS2 policy allows what the node does, and nothing else."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
import xml.etree.ElementTree as ET

import pytest
from support.graph import Interface, interface
from support.processes import Program
from support.ros import Ros

ROOT = Path(__file__).parents[2]
POLICY = ET.parse(ROOT / 'config' / 'sros2' / 'illuminator.policy.xml').getroot()
# Kind of rule, and what in the graph has names of this kind.
KINDS = {('topic', 'publish'): 'publishers', ('topic', 'subscribe'): 'subscriptions',
         ('service', 'reply'): 'services', ('service', 'request'): 'clients'}


@pytest.fixture(scope='module')
def settings() -> dict[str, Any]:
    """With everything that makes the node do more."""
    return {'use_sim_time': True, 'beam_range': 5.0}


@pytest.fixture(scope='module')
def offered(ros: Ros, shared_bridge: tuple[Program, Any]) -> Interface:
    """Return what the first node of the bridge has."""
    return interface(ros)


def profile(node: str) -> ET.Element:
    """Return the profile of a node in the root namespace."""
    [found] = [profile for profile in POLICY.iter('profile') if profile.attrib['node'] == node]
    assert found.attrib['ns'] == '/'
    return found


def allowed(node: str, element: str, action: str) -> list[str]:
    """Return the names in full of what a node may do."""
    rules = [rule for rule in profile(node) if action in rule.attrib]
    assert all(rule.attrib == {action: 'ALLOW'} for rule in rules)
    names = [str(name.text) for rule in rules for name in rule.iter(element)]
    return [f'/{node}{name[1:]}' if name.startswith('~') else name for name in names]


def test_the_policy_is_of_the_form_that_sros2_reads() -> None:
    """The schema, sros2/policy/schemas/policy.xsd, in short."""
    def children(element: ET.Element) -> Iterator[str]:
        return (child.tag for child in element)

    assert (POLICY.tag, POLICY.attrib) == ('policy', {'version': '0.2.0'})
    assert list(children(POLICY)) == ['enclaves']
    for enclave in POLICY.iter('enclave'):
        assert enclave.attrib['path'].startswith('/')
        assert list(children(enclave)) == ['profiles']
    for found in POLICY.iter('profile'):
        assert found.attrib.keys() == {'ns', 'node'}
        for rule in found:
            [action] = rule.attrib
            assert (rule.tag[:-1], action) in KINDS
            assert set(children(rule)) == {rule.tag[:-1]}


@pytest.mark.parametrize(('kind', 'part'), KINDS.items(), ids=KINDS.values())
def test_the_bridge_may_do_what_it_does_and_nothing_else(
    offered: Interface, kind: tuple[str, str], part: str,
) -> None:
    names = allowed('illuminator', *kind)
    assert sorted(names) == sorted(getattr(offered, part))


def test_the_operator_may_use_all_that_the_bridge_offers_but_its_logging(
    offered: Interface,
) -> None:
    own = {'/clock', '/diagnostics', '/parameter_events', '/rosout'}
    heard = set(allowed('operator', 'topic', 'subscribe'))
    sent = set(allowed('operator', 'topic', 'publish'))
    asked = set(allowed('operator', 'service', 'request'))
    internal = {'/illuminator/get_logger_levels', '/illuminator/set_logger_levels',
                '/illuminator/get_type_description'}

    assert heard - own == set(offered.publishers) - own
    assert sent - own == set(offered.subscriptions) - own
    assert asked == set(offered.services) - internal


def test_the_operator_s_own_services_are_those_of_any_node(ros: Ros) -> None:
    mine = interface(ros, 'tester', ['/tester/get_type_description'])

    replies = allowed('operator', 'service', 'reply')

    assert sorted(replies) == sorted(
        name.replace('/tester/', '/operator/') for name in mine.services)
    for topic in mine.publishers:
        assert topic in allowed('operator', 'topic', 'publish')
