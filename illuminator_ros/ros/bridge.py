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

"""The bridge's process: one link, one component, any number of payloads and their nodes."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence, Set
import contextlib
import functools
import itertools
import logging
import math
import queue
import sys
import threading
import time
from typing import NamedTuple

from rclpy.node import Node

from .diagnostics import SIGNING_NEEDED
from .diagnostics_publisher import DiagnosticsPublisher
from .executor import NodeExecutor
from .graph import shared_names, unheard_publishers
from .ignored_parameters import ignored_parameters
from .node_manager import NodeManager, without_node_name
from .parameters import (
    declare_given,
    declare_link_parameters,
    declare_payloads,
    given_parameters,
    LINK_PARAMETERS,
    LinkParameters,
    ParameterError,
)
from .payload import Host, RosPayload, ServedPayload, ShutdownReport
from .payload_node import PayloadNode
from .throttled_log import LogForwarder, NodeLog
from ..mavlink.command_sender import CommandSender
from ..mavlink.component import Component
from ..mavlink.link import Link
from ..mavlink.link_state import LinkEvent
from ..payload.payload_type import PayloadType

# s; SIGINT and SIGTERM end the process within 1 s, including these limits and the exit of ROS.
OFF_LIMIT = 0.6
STOP_LIMIT = 0.15
THREADS_LIMIT = 0.05
# s for which the interpreter runs one of several busy threads, at the end.
SWITCH_INTERVAL = 0.0005
# s in which other processes read the last messages; no event tells that they have.
READING_TIME = 0.02
# s between checks of the diagnostics, and the minimum between two checks after events.
TICK = 1.0
CHECK_INTERVAL = 0.02
# s between attempts to start a thread while the system has none to spare.
START_RETRY = 0.5
# s between checks for another node of the same name, and for publishers that cannot be heard.
GRAPH_INTERVAL = 5.0


class _Served(NamedTuple):
    """A payload with its own node and the log of that."""

    node: Node
    log: NodeLog
    payload: ServedPayload


class Bridge:
    """
    Connects the nodes of payloads with one link.

    It has more than 15 fields: the parts of the process, which it starts and ends.

    :param node: the node of the first payload.
    :param arguments: the command line, which the nodes of further devices follow too.
    :param types: the kinds of payloads that the parameter ``payloads`` may name.
    :param payload: the default of that parameter.
    :param url: the connection URL if the command line has one outside of the parameters, else ''.
    :raises ParameterError: if a parameter is wrong, or if one that restricts something is
        misspelt.
    """

    def __init__(
        self, node: PayloadNode, arguments: Sequence[str], types: Mapping[str, PayloadType],
        payload: str, url: str = '',
    ) -> None:
        self.node = node
        self.log = NodeLog(node.get_logger())
        frame_log = self._frame_log = LogForwarder(self.log)
        kinds = [_load(name, types) for name in declare_payloads(node, payload)]
        nodes = [node, *(
            PayloadNode(kind.node_name, namespace=node.get_namespace(), context=node.context,
                        cli_args=without_node_name(arguments), use_global_arguments=False)
            for kind in kinds[1:])]
        _refuse_same_names(nodes)
        parameters = _link_parameters(node, kinds, url)
        values = [declare_given(own, kind.parameters)
                  for own, kind in zip(nodes, kinds, strict=True)]
        commands = CommandSender(
            parameters.address, parameters.command_timeout, parameters.command_retries)
        clients = [kind.make_client(commands, value)
                   for kind, value in zip(kinds, values, strict=True)]
        self._component = Component(commands, clients)
        signing, store = parameters.signing()
        try:
            (label, first), *further = parameters.urls.items()
            self.link = Link(
                first, self._component, label=label, further=dict(further),
                on_event=self._link_event, signing=signing, store=store,
                mavlink_version=parameters.mavlink_version)
        except ValueError as error:
            raise ParameterError(f'mavlink_version: {error}') from None
        # Set if there is work before the next tick.
        self._wake = threading.Event()
        self._ended = threading.Event()
        self._ending = threading.Lock()
        # The lines for the devices that are not in their final state at the end, by log and key.
        self._late: dict[tuple[NodeLog, Hashable], str] = {
            (self.log, None): 'the link does not answer: devices may still be on'}
        self._closed = threading.Event()
        self._housekeeping = threading.Thread(
            target=self._keep_house, name='housekeeping', daemon=True)
        self._nodes = NodeManager(node, arguments, self.log, self._wake.set)
        self._diagnostics = DiagnosticsPublisher(
            node, self.link, self._component, urls=tuple(parameters.urls),
            period=parameters.diagnostics_period)
        self._executor = NodeExecutor(node.context, self.log)
        self._served: list[_Served] = []
        for own, kind, client, value in zip(nodes, kinds, clients, values, strict=True):
            log = self.log if own is node else NodeLog(own.get_logger())
            self._served.append(_Served(own, log, kind.serve(client, Host(
                own, self.link, log, frame_log, self._nodes, self._diagnostics, value,
                self._wake.set))))
            self._executor.add_node(own)
        specs = itertools.chain(LINK_PARAMETERS, *(kind.parameters for kind in kinds))
        for warning in ignored_parameters(
                arguments, nodes, {spec.name for spec in specs if spec.restricts},
                self._of_further_node):
            self.log.warning(warning)
        # A period is a whole number of ticks, otherwise some periods would be a tick too long.
        self._tick = parameters.diagnostics_period / math.ceil(
            parameters.diagnostics_period / TICK)

    @property
    def nodes(self) -> list[Node]:
        """Return all nodes of the process."""
        return [*(one.node for one in self._served), *self._nodes.nodes]

    def _of_further_node(self, name: str) -> Set[str] | None:
        """Return the parameters of a node that is made later; None if none may have the name."""
        return next((names for one in self._served
                     if (names := one.payload.further_parameters(name)) is not None), None)

    def run(self) -> None:
        """Serve until :meth:`end` is called or the context is shut down."""
        try:
            self._start(self._housekeeping.start)
            self._start(self.link.start)
            self._executor.run()
        finally:
            self.end()
        self._closed.wait(OFF_LIMIT + STOP_LIMIT)
        self._nodes.end()
        deadline = time.monotonic() + THREADS_LIMIT
        if self._housekeeping.ident is not None:
            self._housekeeping.join(max(deadline - time.monotonic(), 0.0))
        self._nodes.join(deadline)
        for one in self._served:
            one.payload.close()
        self._leave_graph()

    def end(self) -> None:
        """
        Bring the devices into their final state, and make :meth:`run` return.

        Does not need the executor, which may be busy. Takes 0.75 s at most; callable from any
        thread. Another call while it runs, or later, returns at once.
        """
        with self._ending:
            if self._ended.is_set():
                return
            self._ended.set()
        # By default the link's thread waits for 5 ms after each OFF that it sends while the
        # executor's thread is busy.
        sys.setswitchinterval(SWITCH_INTERVAL)
        if self.link.is_running():
            self._shut_down_devices()
        self.link.stop(STOP_LIMIT)
        self._closed.set()
        self._wake.set()
        self._executor.end()

    def _leave_graph(self) -> None:
        # A process reads the last messages of another one, and learns of its end, in two threads.
        # If it learns of the end of a service before it has read an answer, it drops the answer.
        time.sleep(READING_TIME)
        # If it learns of the end of the process before it has read that a node is gone, it lists
        # that node for ever. One more node, which has nothing else to announce, delays that end.
        with contextlib.ExitStack() as held:
            nodes = self.nodes
            # Without it, after a shutdown of the context for example, the nodes end all the same.
            with contextlib.suppress(Exception):
                last = PayloadNode('_leaving', first=self.node, enable_rosout=False)
                held.enter_context(last.handle)
                nodes.append(last)
            # The first one last, since the others use its publisher of parameter events.
            for node in reversed(nodes):
                node.destroy_node()
            time.sleep(READING_TIME)

    def _start(self, start: Callable[[], None]) -> None:
        while not self._ended.is_set():
            try:
                start()
                return
            except RuntimeError as error:
                self.log.error(f'{error}: too many threads or processes; trying again', 'thread')
                self._ended.wait(START_RETRY)

    def _shut_down_devices(self) -> None:
        reports: queue.SimpleQueue[tuple[NodeLog, Hashable, int | None, str]] = queue.SimpleQueue()

        def reporter(log: NodeLog) -> ShutdownReport:
            return lambda key, severity, text: reports.put((log, key, severity, text))

        def start(now: float) -> None:
            steps: list[Callable[[float], None]] = [self._component.close]
            steps += (functools.partial(one.payload.shut_down, report=reporter(one.log))
                      for one in self._served)
            for step in steps:
                # The failure of one payload must not leave the devices of another one on.
                try:
                    step(now)
                except Exception as error:
                    self.log.error(f'internal error: {error!r}')
            reports.put((self.log, None, logging.DEBUG, 'the link answers'))

        deadline = time.monotonic() + OFF_LIMIT
        self.link.call_first(start)
        with contextlib.suppress(queue.Empty):
            while self._late:
                log, key, severity, text = reports.get(
                    timeout=max(deadline - time.monotonic(), 0.0))
                if severity is None:
                    self._late[log, key] = text
                else:
                    self._late.pop((log, key), None)
                    log.write(severity, text)
        self.report_late()

    def report_late(self) -> None:
        """Log the devices that are not in their final state, at the end; from any thread."""
        late, self._late = self._late, {}
        for (log, _), text in list(late.items()):
            log.error(text)

    def _keep_house(self) -> None:
        graph_due = 0.0
        while not self._ended.is_set():
            try:
                more = self._nodes.work()
                self.link.call(self._poll)
                self._diagnostics.poll(self._tick / 2)
                for one in self._served:
                    one.log.flush()
                # A service of rclpy sets the levels of loggers.
                self._frame_log.adjust()
                if self.link.clock() >= graph_due:
                    graph_due = self.link.clock() + GRAPH_INTERVAL
                    nodes = self.nodes
                    self.log.write_conditions(shared_names(nodes), 'name')
                    self.log.write_conditions(itertools.chain.from_iterable(
                        map(unheard_publishers, nodes)), 'publisher')
            except Exception as error:
                self.log.error(f'internal error: {error!r}', 'housekeeping')
                more = False
            self._ended.wait(CHECK_INTERVAL)
            if not more:
                self._wake.wait(self._tick)
            self._wake.clear()

    def _poll(self, now: float) -> None:
        needs_signing = (self._component.commands.unanswering
                         and self.link.snapshot(now).signing.unchecked)
        self.log.write_conditions(
            [f'{SIGNING_NEEDED}: set signing_mode and signing_key_file'] if needs_signing else [],
            'signing')
        self.log.write_conditions(self._diagnostics.loops(now), 'loop')
        for one in self._served:
            one.payload.poll(now)

    def _link_event(self, event: LinkEvent) -> None:
        self.log.write(logging.INFO if event.is_open else logging.WARNING, str(event),
                       f'link {event.label}')
        self._wake.set()


def _link_parameters(node: Node, kinds: Sequence[RosPayload], url: str) -> LinkParameters:
    """Declare the parameters of a link that carries these payloads."""
    given = given_parameters(node).get('connection_url')
    if url and given is not None and given.value != url:
        raise ParameterError(f'connection_url: {given.value!r}, but the argument is {url!r}: '
                             'give one of them only')
    defaults = {**kinds[0].all_link_defaults, **({'connection_url': url} if url else {})}
    parameters = declare_link_parameters(node, defaults)
    needed = {kind.node_name: kind.mavlink_version for kind in kinds if kind.mavlink_version}
    if set(needed.values()) - {parameters.mavlink_version}:
        needs = ', '.join(f'{name} needs {version}' for name, version in needed.items())
        raise ParameterError(
            f'mavlink_version: {parameters.mavlink_version}, but {needs}; a link sends one '
            'version, so payloads that need different ones need a process each')
    return parameters


def _refuse_same_names(nodes: Sequence[Node]) -> None:
    names = [node.get_name() for node in nodes]
    if shared := {name for name in names if names.count(name) > 1}:
        raise ParameterError(
            f'payloads: two nodes would be called {", ".join(shared)!r}: name that payload first, '
            'or give the first node another name with -r __node:=NAME')


def _load(name: str, types: Mapping[str, PayloadType]) -> RosPayload:
    try:
        payload = types[name].load('ros')
    except LookupError:
        raise ParameterError(
            f'payloads: {name!r} is not one of {", ".join(types)}') from None
    assert isinstance(payload, RosPayload)
    return payload
