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

"""The bridge's process: one link, one node for each light on it."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from ..illuminator.controller import Controller
from ..illuminator.light import Light, Settings
from ..mavlink.link import Link, LinkEvent
from ..mavlink.signing import Signing, SigningMode
from ..mavlink.signing_files import KeyFileError, load_key, TimestampStore
from .node import IlluminatorNode
from .parameters import declare_link_parameters, LinkParameters, ParameterError

# s; SIGINT and SIGTERM end the process within 1 s, of which ROS takes 0.2 s.
OFF_LIMIT = 0.5
STOP_LIMIT = 0.15
# s between looks at whether diagnostics are due or have got worse. One timer does for all nodes:
# each of their own would have rclpy wake up for it and look through all of them.
TICK = 0.25


class BridgeProcess:
    """
    Connects the nodes of the lights on one link with that link.

    :param node: that of the first light.
    :param arguments: the command line, which the nodes of further lights follow too.
    :raises ParameterError: if a parameter is wrong.
    """

    def __init__(self, node: IlluminatorNode, arguments: list[str]) -> None:
        self.node = node
        self.nodes = [node]
        self._arguments = without_node_name(arguments)
        self.parameters = parameters = declare_link_parameters(node)
        self.controller = Controller(
            parameters.identity, Settings(
                parameters.heartbeat_timeout, parameters.status_interval,
                parameters.restore_configuration),
            command_timeout=parameters.command_timeout,
            command_retries=parameters.command_retries, on_light=self._found)
        signing, store = _signing(parameters)
        self.link = Link(
            parameters.url, self.controller, label=parameters.connection_url,
            on_event=self._link_event, signing=signing, store=store)
        self._serve(node)
        _forward_logs(node)
        self._ended = threading.Event()
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)
        self._tick = min(TICK, parameters.diagnostics_period)
        # On a steady clock: with use_sim_time and no /clock a ROS timer never fires.
        node.create_timer(self._tick, self._poll, ReentrantCallbackGroup(),
                          Clock(clock_type=ClockType.STEADY_TIME))

    def _poll(self) -> None:
        for node in list(self.nodes):
            node.poll(self._tick / 2)

    def run(self) -> None:
        """Serve until :meth:`end` is called or the context is shut down."""
        self.link.start()
        while not self._ended.is_set() and self.node.context.ok():
            try:
                self._executor.spin_once()
            except ExternalShutdownException:
                break
            except Exception as error:
                # Our own callbacks answer for what goes wrong in them; rclpy's may not.
                self.node.get_logger().error(
                    f'internal error: {error!r}', throttle_duration_sec=5.0)
        self._stop()
        # Whoever looks at the ROS graph is to see at once that they are gone.
        for node in self.nodes:
            node.destroy_node()

    def end(self) -> None:
        """Have :meth:`run` return; callable from any thread."""
        self._ended.set()
        # Waking the executor is not enough: it goes on waiting until it has something to do.
        self._executor.create_task(lambda: None)

    def _found(self, light: Light) -> None:
        """Give a light its node, in the link's thread."""
        target = self.parameters.target
        wanted = (target.system in (0, light.source.system)
                  and target.component in (0, light.source.component))
        if self.node.light is None and wanted:
            self.node.bind(light, self.link.clock())
        else:
            # Making a node takes long: not here, where all lights would wait for it.
            self._executor.create_task(self._add_node, light)

    def _serve(self, node: IlluminatorNode) -> None:
        node.serve(
            self.link, self.controller, url=self.parameters.connection_url,
            frame_id=self.parameters.frame_id, period=self.parameters.diagnostics_period)

    def _add_node(self, light: Light) -> None:
        """Make the node of a further light, on the executor."""
        system, component = light.source
        name = (self.parameters.names.get(light.source)
                or f'{self.node.get_name()}_{system}_{component}')
        logger = self.node.get_logger()
        try:
            node = IlluminatorNode(
                name, namespace=self.node.get_namespace(), context=self.node.context,
                cli_args=self._arguments, use_global_arguments=False)
            self._serve(node)
        except Exception as error:
            logger.error(f'light {light.source} gets no node: {error}')
            return
        logger.info(f'light {light.source} is served by {node.get_fully_qualified_name()}')
        self.nodes.append(node)
        self._executor.add_node(node)
        self.link.call(lambda now: node.bind(light, now))

    def _link_event(self, event: LinkEvent) -> None:
        logger = self.node.get_logger()
        if event.is_open:
            logger.info(f'link open: {event.name}')
        else:
            logger.warning(f'link not open: {event.name}: {event.reason}; trying again')
        for node in list(self.nodes):
            node.publish_diagnostics()

    def _stop(self) -> None:
        """Switch the lights off if that is wanted, and close the link; takes 0.65 s at most."""
        if self.parameters.off_on_shutdown:
            lights = [node.light for node in self.nodes if node.light and node.light.connected]
            answers = threading.Semaphore(0)

            def off(now: float) -> None:
                for light in lights:
                    light.cancel(now)
                    light.enable(False, now, lambda result, now: answers.release())

            self.link.call(off)
            deadline = time.monotonic() + OFF_LIMIT
            for _ in lights:
                answers.acquire(timeout=max(deadline - time.monotonic(), 0))
        self.link.stop(STOP_LIMIT)


def without_node_name(arguments: list[str]) -> list[str]:
    """
    Return the ROS arguments without those that name the node.

    ``-r __node:=spot`` names every node of a process; further lights keep names of their own.
    """
    kept: list[str] = []
    for argument in arguments:
        if argument.startswith(('__node:=', '__name:=')) and kept[-1:] in (['-r'], ['--remap']):
            kept.pop()
        else:
            kept.append(argument)
    return kept


def _signing(parameters: LinkParameters) -> tuple[Signing, TimestampStore | None]:
    if parameters.signing_mode is SigningMode.OFF:
        return Signing(), None
    try:
        key = load_key(parameters.signing_key_file)
    except KeyFileError as error:
        raise ParameterError(f'signing_key_file: {error}') from None
    store = TimestampStore(parameters.signing_key_file, f'bridge {parameters.identity}')
    return Signing(parameters.signing_mode, key, timestamp=store.load()), store


class _LogForwarder(logging.Handler):
    """Shows what the protocol's modules log in the node's log."""

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._logger = node.get_logger()

    def emit(self, record: logging.LogRecord) -> None:
        text = self.format(record)
        if record.levelno >= logging.ERROR:
            self._logger.error(text)
        elif record.levelno >= logging.WARNING:
            self._logger.warning(text)
        else:
            self._logger.info(text)


def _forward_logs(node: Node) -> None:
    logger = logging.getLogger('illuminator_ros')
    handlers: list[Any] = list(logger.handlers)
    for handler in handlers:
        logger.removeHandler(handler)
    logger.addHandler(_LogForwarder(node))
    logger.propagate = False
