# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Completion of names of nodes and settings by a shell, where argcomplete is installed."""

from __future__ import annotations

import argparse
import contextlib
import os
import time

import rclpy
from rclpy.node import Node

from ..monitor.ros_graph import devices_among
from ..payloads import PAYLOADS
from ...ros.monitor_view import View

# s for the discovery of a device.
DISCOVERY = 1.0


def complete(parser: argparse.ArgumentParser) -> None:
    """Give a shell the completions that it asks for and end the process, or return."""
    if '_ARGCOMPLETE' in os.environ:
        with contextlib.suppress(ImportError):
            from argcomplete import autocomplete
            autocomplete(parser)


def names(**_: object) -> list[str]:
    """Return the names of all devices."""
    return [*_devices()]


def settings(parsed_args: argparse.Namespace, **_: object) -> list[str]:
    """Return the beginnings of the settings of the device that was typed."""
    view = _devices(parsed_args.device).get(parsed_args.device)
    return [f'{name}=' for name in view.settings] if view else []


def _devices(wanted: str = '') -> dict[str, View]:
    """Return the devices in the graph: when the wanted one is found, or after DISCOVERY."""
    rclpy.init()
    node = Node('illuminator_set_completion', enable_rosout=False, start_parameter_services=False)
    views, until = [one.load('view') for one in PAYLOADS.values() if one.view], (
        time.monotonic() + DISCOVERY)
    found: dict[str, View] = {}
    while wanted not in found and time.monotonic() < until:
        rclpy.spin_once(node, timeout_sec=0.05)
        found = devices_among(node.get_topic_names_and_types(), views, node.count_publishers)
    rclpy.shutdown()
    return found
