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

import contextlib
import functools
import logging
import math
import queue
import threading
import time
from typing import Any

from rclpy.node import Node

from .fleet_inputs import FleetInputs
from .light_names import LightNames
from .mounting import Mounting, not_its_own
from .node import IlluminatorNode
from .parameter_spec import ParameterError
from .parameters import declare_link_parameters, LinkParameters
from .spinner import Spinner
from ..illuminator.client import IlluminatorClient
from ..illuminator.events import AnyLightEvent, LightFound
from ..illuminator.light import Light, Settings
from ..illuminator.operation import Result
from ..mavlink.command import CommandSender, format_seconds
from ..mavlink.component import Component
from ..mavlink.link import Link
from ..mavlink.link_state import LinkEvent
from ..mavlink.messages import Address
from ..mavlink.signing import Signing, SigningMode
from ..mavlink.signing_files import keyed, KeyFileError, TimestampStore

# s; SIGINT and SIGTERM end the process within 1 s, these and the leaving of ROS included.
OFF_LIMIT = 0.6
STOP_LIMIT = 0.15
THREADS_LIMIT = 0.1
# s between looks at whether diagnostics are due or have got worse. One thread does for all nodes:
# timers of their own would have as many executors wake up each time.
TICK = 0.25


class BridgeProcess:
    """
    Connects the nodes of the lights on one link with that link.

    Each node has a thread: nothing that one of them does delays another.

    :param node: that of the first light.
    :param arguments: the command line, which the nodes of further lights follow too.
    :raises ParameterError: if a parameter is wrong.
    """

    def __init__(self, node: IlluminatorNode, arguments: list[str]) -> None:
        self.node = node
        self.nodes = [node]
        self._arguments = without_node_name(arguments)
        self.parameters = parameters = declare_link_parameters(node)
        commands = CommandSender(
            parameters.identity, parameters.command_timeout, parameters.command_retries)
        self.client = IlluminatorClient(
            commands, Settings(
                parameters.heartbeat_timeout, parameters.status_interval,
                parameters.restore_configuration),
            wanted=self._served)
        self.client.events.subscribe(self._light_event)
        self._serving: dict[Address, IlluminatorNode] = {}
        self.component = Component(commands, [self.client])
        signing, store = _signing(parameters)
        self.link = Link(
            parameters.url, self.component, label=parameters.connection_url,
            on_event=self._link_event, signing=signing, store=store)
        self._names = LightNames(
            parameters.names, node.get_name(), served=self._served,
            warn=node.get_logger().warning)
        self._mounting = Mounting.of_first(parameters)
        self._serve(node, self._mounting)
        FleetInputs(node, self.link, self._lights, self._name_of, node.absence)
        _forward_logs(node)
        self._ended = threading.Event()
        self._spinners = [Spinner(node)]
        # A whole number of them makes a period, which else would now and then be one too long.
        period = parameters.diagnostics_period
        self._tick = period / math.ceil(period / TICK)
        self._threads = [threading.Thread(target=self._poll, name='diagnostics', daemon=True)]
        # Nodes are made one after the other: each takes time of everybody.
        self._making = threading.Lock()

    def _poll(self) -> None:
        while not self._ended.wait(self._tick):
            for node in list(self.nodes):
                try:
                    self._names.look(self.client.lights, self.link.clock())
                    node.poll(self._tick / 2)
                except Exception as error:
                    node.get_logger().error(
                        f'internal error: {error!r}', throttle_duration_sec=5.0)

    def run(self) -> None:
        """Serve until :meth:`end` is called or the context is shut down."""
        self._threads[0].start()
        self.link.start()
        self._spinners[0].run()
        self._stop()
        # Whoever looks at the ROS graph is to see at once that they are gone.
        for node in self.nodes:
            node.end()
            node.destroy_node()

    def end(self) -> None:
        """Have :meth:`run` return; callable from any thread."""
        self._ended.set()
        for spinner in list(self._spinners):
            spinner.end()

    def _selected(self, source: Address) -> bool:
        target = self.parameters.target
        return (target.system in (0, source.system)
                and target.component in (0, source.component))

    def _served(self, source: Address) -> bool:
        return not self.parameters.only_target or self._selected(source)

    def _light_event(self, event: AnyLightEvent) -> None:
        if isinstance(event, LightFound):
            self._found(self.client.lights[event.address])
        elif node := self._serving.get(event.address):
            node.outputs.take(event)

    def _bind(self, node: IlluminatorNode, light: Light, now: float) -> None:
        self._serving[light.address] = node
        node.bind(light, now)

    def _found(self, light: Light) -> None:
        """Give a light its node, in the link's thread."""
        if self.node.light is None and self._selected(light.address):
            self._names.begin(light.address, self.link.clock())
            self._bind(self.node, light, self.link.clock())
            return
        if self._selected(light.address):
            first = self.node.light
            assert first is not None
            self.node.get_logger().info(
                f'light {light.address} is there besides {first.address}, which '
                f'{self.node.get_fully_qualified_name()} serves since it was heard first; '
                'target_system and target_component choose', once=True)
        # Making a node takes long: not here, where all lights would wait for it.
        thread = threading.Thread(
            target=self._run_further, args=(light,), name=f'light {light.address}', daemon=True)
        self._threads.append(thread)
        thread.start()

    def _lights(self) -> list[Light]:
        """Return the lights by their addresses, in the link's thread."""
        return sorted(self.client.lights.values(), key=lambda light: light.address)

    def _name_of(self, light: Light) -> str:
        """Return what a light is called in answers about several."""
        names = [node.get_name() for node in list(self.nodes) if node.light is light]
        return f'{names[0]} ({light.address})' if names else str(light.address)

    def _serve(self, node: IlluminatorNode, mounting: Mounting) -> None:
        node.serve(
            self.link, self.component, self.client, url=self.parameters.connection_url,
            mounting=mounting, period=self.parameters.diagnostics_period)

    def _run_further(self, light: Light) -> None:
        """Make and run the node of a further light, in a thread of its own."""
        with self._making:
            node = None if self._ended.is_set() else self._make_node(light)
            if node is None:
                return
            spinner = Spinner(node)
            self.nodes.append(node)
            self._spinners.append(spinner)
        self.link.call(lambda now: self._bind(node, light, now))
        if not self._ended.is_set():
            spinner.run()

    def _make_node(self, light: Light) -> IlluminatorNode | None:
        logger = self.node.get_logger()
        try:
            node = IlluminatorNode(
                self._names.of(light.address), namespace=self.node.get_namespace(),
                context=self.node.context, cli_args=self._arguments,
                use_global_arguments=False)
            self._serve(node, self._mounting.declare(node))
            for warning in not_its_own(node, self.node):
                node.get_logger().warning(warning)
        except Exception as error:
            logger.error(f'light {light.address} gets no node: {error}')
            return None
        logger.info(f'light {light.address} is served by {node.get_fully_qualified_name()}')
        return node

    def _link_event(self, event: LinkEvent) -> None:
        logger = self.node.get_logger()
        if event.is_open:
            logger.info(str(event))
        else:
            logger.warning(str(event))
        for node in list(self.nodes):
            node.publish_diagnostics()

    def _stop(self) -> None:
        """Switch the lights off if that is wanted, and end all; takes 0.85 s at most."""
        if self.parameters.off_on_shutdown:
            self._switch_off()
        self.link.stop(STOP_LIMIT)
        self.end()
        deadline = time.monotonic() + THREADS_LIMIT
        for thread in self._threads:
            thread.join(max(deadline - time.monotonic(), 0))

    def _switch_off(self) -> None:
        """Switch the lights off and say which may still be on; takes 0.6 s at most."""
        served = [(node, node.light) for node in self.nodes if node.light]
        answers: queue.SimpleQueue[tuple[Light, Result]] = queue.SimpleQueue()

        def answer(light: Light, result: Result, now: float) -> None:
            answers.put((light, result))

        def off(now: float) -> None:
            for _, light in served:
                light.cancel(now)
                light.enable(False, now, functools.partial(answer, light))

        self.link.call(off)
        deadline = time.monotonic() + OFF_LIMIT
        results: dict[Light, Result] = {}
        with contextlib.suppress(queue.Empty):
            while len(results) < len(served):
                light, result = answers.get(timeout=max(deadline - time.monotonic(), 0))
                results[light] = result
        late = Result(False, f'no confirmation within {format_seconds(OFF_LIMIT)}')
        for node, light in served:
            result = results.get(light, late)
            logger = node.get_logger()
            if result.success:
                logger.info(f'light {light.address} is dark: {result.message}')
            else:
                logger.error(f'light {light.address} may still be on: {result.message}')


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
    if parameters.signing_mode is SigningMode.OFF and parameters.signing_key_file:
        raise ParameterError('signing_key_file: is given, but signing_mode is off')
    if parameters.signing_mode is SigningMode.OFF:
        return Signing(), None
    try:
        return keyed(parameters.signing_mode, parameters.signing_key_file,
                     f'bridge {parameters.identity}', time.time())
    except KeyFileError as error:
        raise ParameterError(f'signing_key_file: {error}') from None


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
