# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The bridge in the test's own process, where a test can make its parts fail."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import contextlib
from pathlib import Path
import tempfile
import threading
from unittest import mock

from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.ros import bridge as bridge_module
from illuminator_ros.ros.bridge import Bridge
from illuminator_ros.ros.parameters import ParameterError
from illuminator_ros.ros.payload_node import PayloadNode
import rclpy
from rclpy.context import Context
from support.slow import SlowLink
from support.waiting import PATIENCE
import yaml


@contextlib.contextmanager
def _arguments(parameters: Mapping[str, object]) -> Iterator[list[str]]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, 'given.yaml')
        file.write_text(yaml.safe_dump({'illuminator': {'ros__parameters': {**parameters}}}))
        yield ['--ros-args', '--params-file', str(file)]


@contextlib.contextmanager
def embedded_bridge(domain: int, port: int, **parameters: object) -> Iterator[Bridge]:
    """Run the bridge in a thread, by the slow clock, listening on a UDP port of loopback."""
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    given = {'connection_url': f'udpin://127.0.0.1:{port}', **parameters}
    with mock.patch.object(bridge_module, 'Link', SlowLink), _arguments(given) as arguments:
        node = PayloadNode('illuminator', context=context, cli_args=arguments)
        process = Bridge(node, [], PAYLOADS, 'illuminator')
    thread = threading.Thread(target=process.run)
    thread.start()
    try:
        yield process
    finally:
        process.end()
        thread.join(PATIENCE)
        has_ended = not thread.is_alive()
        rclpy.try_shutdown(context=context)
        assert has_ended


def refusal(context: Context, **parameters: object) -> str:
    """Return the reason why a bridge cannot start with these parameters."""
    with _arguments(parameters) as arguments:
        node = PayloadNode('illuminator', context=context, cli_args=arguments)
        try:
            Bridge(node, arguments, PAYLOADS, 'illuminator')
        except ParameterError as error:
            return str(error)
        finally:
            node.destroy_node()
    return ''
