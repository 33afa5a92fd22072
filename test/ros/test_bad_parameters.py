# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Invalid parameters are refused with the reason, and unknown ones are warned about."""

from collections.abc import Callable, Iterator
import contextlib
import math
from pathlib import Path
import re
from typing import Any

from illuminator_ros.ros.ignored_parameters import ignored_parameters
from illuminator_ros.ros.parameters import ParameterError
import pytest
from rclpy.node import Node
from support.embedded import refusal
from support.ports import free_port
from support.ros import Ros, running_bridge

NUMBER, INTEGER, STRING, BOOLEAN = (
    rf'is (no|not an?) {kind}' for kind in ('number', 'integer', 'string', 'boolean'))


@pytest.mark.parametrize(('given', 'reason'), [
    ({'strobe_period': math.inf}, 'strobe_period inf is not a finite number'),
    ({'brightness': 101}, 'brightness 101 % is out of range: 0 to 100 %'),
    ({'brightness': 'bright'}, f"brightness 'bright' {NUMBER}"),
    ({'mode': 1}, 'mode 1 is not one of internal_control, external_sync'),
    ({'frame_id': 7}, f'frame_id: 7 {STRING}'),
    ({'beam_range': -1.0}, 'beam_range: -1.0 m is out of range: 0 to 10000 m'),
    ({'system_id': 'one'}, f"system_id: 'one' {INTEGER}"),
    ({'off_on_shutdown': 1}, f'off_on_shutdown: 1 {BOOLEAN}'),
    ({'component_id': 0}, 'component_id: 0 is out of range: 1 to 255'),
    ({'heartbeat_timeout': 1.0}, 'heartbeat_timeout: 1.0 s is out of range: 1.1 to 3600 s'),
    ({'command_timeout': math.nan}, 'command_timeout: nan s is out of range: 0.05 to 60 s'),
    ({'connection_url': 'udpin://127.0.0.1:99999'}, 'port 99999 is outside 1..65535'),
    *(({'forward_urls': urls}, reason) for urls, reason in [
        ('udpin://127.0.0.1:14551', 'forward_urls: .* is not a list of strings'),
        (['udpin://127.0.0.1:99999'], 'forward_urls: .* port 99999 is outside 1..65535'),
        (['/dev/ttyACM0:57600', '/dev/ttyACM0,115200'],
         "forward_urls: '/dev/ttyACM0,115200' and '/dev/ttyACM0:57600' are the same link"),
        (['udpin:127.0.0.1:14551', 'udp://127.0.0.1:14551@'],
         "forward_urls: 'udp://127.0.0.1:14551@' and 'udpin:127.0.0.1:14551' are the same link"),
        ([f'udpin://127.0.0.1:{20000 + number}' for number in range(8)],
         'forward_urls: 8 URLs, but 7 are possible')]),
    ({'connection_url': 'tcp:127.0.0.1:5760', 'forward_urls': ['tcpout://127.0.0.1:5760']},
     "forward_urls: 'tcpout://127.0.0.1:5760' and 'tcp:127.0.0.1:5760' are the same link"),
    ({'names': ['belly']}, "names: 'belly' is not of the form 1/244=belly"),
    ({'names': ['1/244=2 fast']}, "names: '2 fast' is not a valid node name"),
    ({'names': ['1/244=belly', '1/245=belly']}, "'1/245=belly' repeats an address or a name"),
    ({'names': ['1/244=belly', '1/244=nose']}, "'1/244=nose' repeats an address or a name"),
    ({'names': ['1/244=illuminator_1_250']},
     "'1/244=illuminator_1_250' is the name of light 1/250"),
    ({'signing_mode': 'require'}, 'signing_key_file: no key file is given'),
    ({'sources': ['default', 'safety', 'default']}, "sources: 'default' is given twice"),
    *(({'sources': [name]}, f"sources: '{name}' is not a valid name of a source")
      for name in ('1st', 'a__b', 'cmd')),
    ({'source_timeout': 1.0}, 'source_timeout: is given, but sources is empty'),
    ({'on_release': 'off'}, 'on_release: is given, but sources is empty'),
    ({'on_release': 'dim'}, "on_release: 'dim' is not one of keep, off"),
    ({'max_brightness': 60, 'brightness': 80}, 'brightness 80 % is above max_brightness 60 %'),
    *(({wrong: 1}, f"{wrong} is unknown; did you mean '{right}'\\?") for wrong, right in [
        ('max_brightnes', 'max_brightness'), ('min_strobe_peroid', 'min_strobe_period'),
        ('of_after_silence', 'off_after_silence'), ('off_on_shut_down', 'off_on_shutdown'),
        ('signing-mode', 'signing_mode'), ('conection_url', 'connection_url')]),
])
def test_invalid_parameter_is_refused_with_its_name_value_and_range(
    ros: Ros, given: dict[str, Any], reason: str,
) -> None:
    assert re.search(reason, refusal(ros.context, **given))


@pytest.fixture
def node(ros: Ros) -> Iterator[Callable[..., Node]]:
    """Return a function that makes a node, given its name and the names of its parameters."""
    with contextlib.ExitStack() as stack:
        def make(name: str, *parameters: str, namespace: str = '') -> Node:
            made = Node(name, context=ros.context, namespace=namespace)
            stack.callback(made.destroy_node)
            for parameter in parameters:
                made.declare_parameter(parameter, 1.0)
            return made

        yield make


def write(folder: Path, contents: str, encoding: str = 'utf-8') -> list[str]:
    """Write a parameter file, and return the arguments that give it to a node."""
    file = folder / 'boat.yaml'
    file.write_text(contents, encoding=encoding)
    return ['--ros-args', '--params-file', str(file)]


def test_parameter_file_that_cannot_be_read_is_named(
    node: Callable[..., Node], tmp_path: Path,
) -> None:
    arguments = write(tmp_path, 'illuminator: caf\xe9', 'latin-1')

    with pytest.raises(ParameterError, match=f'^file {re.escape(arguments[-1])}: '):
        ignored_parameters(arguments, [node('illuminator')], set())


@pytest.mark.parametrize(('section', 'is_ignored'), [
    ('illuminator', False), ('/illuminator', False), ('/**', False), ('/*', False),
    ('/**/illuminator', False), ('illuminator_1_244', False), ('belly', False),
    ('illuminatr', True), ('/boat/illuminator', True), ('/boat/**', True), ('/*/*', True)])
def test_section_of_a_parameter_file_that_matches_no_node_ends_the_start_if_it_restricts(
    node: Callable[..., Node], tmp_path: Path, section: str, is_ignored: bool,
) -> None:
    # rcl reads UTF-16, too.
    arguments = write(tmp_path, f'{section}: {{ros__parameters: {{limit: 40.0}}}}', 'utf-16')
    made = node('illuminator', 'limit')
    pattern, further = section.strip('/'), dict.fromkeys(
        ('illuminator_1_244', 'belly'), {'limit'}).get

    assert ignored_parameters(arguments, [made], set(), further) == [
        f'{arguments[-1]}: the section {pattern} matches no node and is ignored; the name here is '
        '/illuminator'] * is_ignored
    with pytest.raises(ParameterError, match=re.escape(
            f'the section {pattern} matches no node; the name here is /illuminator, where limit '
            'would have no effect')) if is_ignored else contextlib.nullcontext():
        assert ignored_parameters(arguments, [made], {'limit'}, further) == []


@pytest.mark.parametrize(('ours', 'other', 'outcome'), [
    ('port: {rate: 1}', 'rate: 2', ''),
    ('port_1_244: {rate: 1}', 'rate: 2', ''),
    ('/**: {rate: 1}', 'rate: 2', ''),
    # Both names are in the warning, since the other may be misspelt.
    ('port: {rate: 1}', 'limit: 2', 'the section starboard matches no node and is ignored, with '
     'its limit; the name here is /port'),
    ('port: {limit: 1}', 'limit: 2', 'with its limit; the name here is /port'),
    # These match each node, and are for none of ours.
    ('/**: {use_sim_time: false}', 'rate: 2', 'is ignored; the name here is /port'),
    ('/**: {use_sim_time: false}', 'limit: 2', 'end'),
    ('stern: {rate: 1}', 'limit: 2', 'end')])
def test_section_of_another_node_in_a_file_that_is_ours_is_named_only_if_it_restricts(
    node: Callable[..., Node], tmp_path: Path, ours: str, other: str, outcome: str,
) -> None:
    name, _, parameters = ours.partition(': ')
    arguments = write(tmp_path, f'{name}: {{ros__parameters: {parameters}}}\n'
                                f'starboard: {{ros__parameters: {{{other}}}}}')

    with pytest.raises(ParameterError, match='section starboard matches no node; the name here is '
                       '/port, where limit would have no effect') if outcome == 'end' else (
            contextlib.nullcontext()):
        warnings = [text for text in ignored_parameters(
            arguments, [node('port', 'limit', 'rate')], {'limit'}, {'port_1_244': {'rate'}}.get)
            if 'starboard' in text]
        assert len(warnings) == bool(outcome)
        assert outcome in ''.join(warnings)


@pytest.mark.parametrize(('section', 'name', 'outcome'), [
    ('illuminator', 'connection_url', ''),
    ('illuminator', 'conection_url', 'end'), ('/**', 'conection_url', 'end'),
    ('gimbal', 'connection_url', 'end'), ('camera', 'conection_url', 'warning'),
    ('camera', 'connection_url', 'warning')])
def test_url_ends_the_start_if_it_is_misspelt_or_for_a_wrong_node_of_this_process_only(
    node: Callable[..., Node], tmp_path: Path, section: str, name: str, outcome: str,
) -> None:
    arguments = write(tmp_path, f'{section}: {{ros__parameters: {{{name}: "udpin://:14551"}}}}')
    nodes = [node('illuminator', 'connection_url'), node('gimbal', 'rate')]

    with pytest.raises(ParameterError, match=name) if outcome == 'end' else (
            contextlib.nullcontext()):
        assert bool(ignored_parameters(arguments, nodes, set())) is (outcome == 'warning')


# The reason for which a limit ends the start, which is '' where it has an effect.
@pytest.mark.parametrize(('given', 'namespace', 'reason'), [
    ('illuminator:limit', '', ''), ('limit', '', ''),
    ('spot:limit', '', '-p spot:limit:=1: the name spot matches no node; the name here is '
                       '/illuminator, /gimbal'),
    ('illuminator:limit', '/boat', 'matches no node; the name here is /boat/illuminator'),
    ('gimbal:limit', '', 'limit is given for gimbal, but is a parameter of /illuminator'),
    ('illuminator_1_244:limit', '', 'limit is given for illuminator_1_244, but'),
    ('illuminator_1_244:limits', '', "limits is unknown; did you mean 'limit'?"),
    ('illuminator.limit', '', "illuminator.limit is unknown; did you mean 'limit'?"),
    ('gimbal:gimbal.limit', '', "gimbal.limit is unknown; did you mean 'limit'?")])
def test_limit_that_has_no_effect_where_it_is_given_ends_the_start(
    node: Callable[..., Node], given: str, namespace: str, reason: str,
) -> None:
    nodes = [node('illuminator', 'limit', namespace=namespace), node('gimbal', 'rate',
                                                                     namespace=namespace)]

    with pytest.raises(ParameterError, match=re.escape(reason)) if reason else (
            contextlib.nullcontext()):
        assert ignored_parameters(
            ['-p', f'{given}:=1'], nodes, {'limit'}, {'illuminator_1_244': set[str]()}.get) == []


@pytest.mark.parametrize(('name', 'ends'), [
    ('max_brightnes', True), ('max_brightness_level', False),
    ('illuminator.max_brightness', True), ('illuminator_1_244.max_brightness', True),
    ('lamp.max_brightness', False)])
def test_misspelt_restriction_in_a_section_for_other_nodes_ends_the_start_if_it_is_clear(
    node: Callable[..., Node], tmp_path: Path, name: str, ends: bool,
) -> None:
    arguments = write(tmp_path, f'/**: {{ros__parameters: {{use_sim_time: false, {name}: 40.0}}}}')

    with pytest.raises(ParameterError) if ends else contextlib.nullcontext():
        assert ignored_parameters(
            arguments, [node('illuminator', 'max_brightness')], {'max_brightness'},
            {'illuminator_1_244': set[str]()}.get) == []


def test_parameter_is_warned_about_only_where_it_is_given_for_a_node_without_it(
    node: Callable[..., Node], tmp_path: Path,
) -> None:
    arguments = write(
        tmp_path, '/**: {ros__parameters: {rate: 1, period: 2}}\n'
                  'gimbal: {ros__parameters: {rate: 3, period: 4, use_sim_time: true}}\n'
                  'gimbal_1_9: {ros__parameters: {rate: 5, use_sim_time: true}}')

    assert ignored_parameters(
        arguments, [node('illuminator', 'period'), node('gimbal', 'rate')], {'limit'},
        {'gimbal_1_9': set[str]()}.get,
    ) == [f"parameter '{name}' is ignored: it is given for {given}, but is a parameter of {owner}"
          for name, given, owner in (
              ('period', 'gimbal', '/illuminator'), ('rate', 'gimbal_1_9', '/gimbal'))]


def test_unknown_parameters_are_warned_about_and_those_of_other_nodes_are_not(
    ros: Ros, tmp_path: Path,
) -> None:
    file = tmp_path / 'shared.yaml'
    # Values that rcl reads as text, and that PyYAML cannot read.
    file.write_text('/**: {ros__parameters: {robot_description: x, use_sim_time: false,\n'
                    '  day: 2026-02-30, equal: =, angle: !degrees 3, 12: 1, left.wheel: 1,\n'
                    '  restore_configuraton: true}}\n'
                    '---\n'
                    '/*: {ros__parameters: {status_interval: 1.0, azimuth: 3}}\n'
                    'illuminator: {ros__parameters: {elevation: 3}}\n'
                    'boat: {illuminator: {ros__parameters: {brightness: 40}}}\n'
                    'illuminator_1_244: {ros__parameters: {brightness: 40}}\n'
                    'belly: {ros__parameters: {brightness: 40}}')
    expected = [
        "'brightnes' is ignored: it is unknown; did you mean 'brightness'?",
        "'restore_configuraton' is ignored: it is unknown; did you mean 'restore_configuration'?",
        # Names without a similar one: on the command line, in a section of the bridge, and in a
        # section with a parameter of the bridge.
        *(f"'{name}' is ignored: it is unknown" for name in ('zoom', 'elevation', 'azimuth'))]
    with running_bridge(ros.domain, free_port(), '--params-file', str(file), names='[1/244=belly]',
                        brightnes=1, zoom=1) as bridge:
        for text in expected:
            bridge.wait_for(text)
        assert bridge.count('WARN') == len(expected), bridge.log


def test_off_as_yaml_reads_it_and_integers_for_doubles_are_accepted(ros: Ros) -> None:
    assert refusal(ros.context, signing_mode=False, heartbeat_timeout=2, command_timeout=2) == ''
