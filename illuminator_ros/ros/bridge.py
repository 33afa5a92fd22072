# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The bridge's process: one link, one component, any number of payloads and their nodes."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence, Set
import contextlib
import functools
import itertools
import logging
import math
import queue
import threading
import time
from typing import NamedTuple

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from .diagnostics import SIGNING_NEEDED
from .diagnostics_publisher import DiagnosticsPublisher
from .graph import shared_names, unheard_publishers
from .ignored_parameters import ignored_parameters
from .link_call import ENDING
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
from .payload import BridgeContext, RosPayload, ServedPayload, ShutdownReport
from .payload_node import PayloadNode
from .throttled_log import LogForwarder, NodeLog
from ..mavlink.command_sender import CommandSender
from ..mavlink.component import Component
from ..mavlink.device_kind import DeviceKind
from ..mavlink.errors import InvalidValue
from ..mavlink.link import Link
from ..mavlink.link_state import LinkEvent
from ..mavlink.retries import RESOURCE
from ..mavlink.transport.ports import unusual_rate
from ..payload.payload_type import PayloadType

# s; SIGINT and SIGTERM end the process within 1 s, including these limits and the exit of ROS.
OFF_LIMIT = 0.6
STOP_LIMIT = 0.15
ACKNOWLEDGEMENT_LIMIT = 0.05
# Callbacks of the executor after that.
LAST_SPINS = 20
# s between checks of the diagnostics, and from an event to the check that it causes.
TICK = 1.0
CHECK_INTERVAL = 0.02
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
        names = declare_payloads(node, payload)
        kinds = [_load(name, types) for name in names]
        nodes = [node, *(
            PayloadNode(kind.node_name, namespace=node.get_namespace(), context=node.context,
                        cli_args=without_node_name(arguments), use_global_arguments=False)
            for kind in kinds[1:])]
        _refuse_same_names(nodes)
        devices = {name: one.device for name, one in types.items() if one.device}
        parameters = _link_parameters(
            node, dict(zip(names, kinds, strict=True)), devices, url)
        values = [declare_given(own, kind.parameters)
                  for own, kind in zip(nodes, kinds, strict=True)]
        signing, store = parameters.signing()
        commands = CommandSender(
            parameters.address, parameters.command_timeout, parameters.command_retries,
            lambda: signing.clock_fault(time.time()))
        clients = [kind.make_client(commands, value)
                   for kind, value in zip(kinds, values, strict=True)]
        self._component = Component(commands, clients)
        try:
            (label, first), *further = parameters.urls.items()
            self.link = Link(
                first, self._component, label=label, further=dict(further),
                on_event=self._link_event, signing=signing, store=store,
                mavlink_version=parameters.mavlink_version)
        except InvalidValue as error:
            raise ParameterError(f'mavlink_version: {error}') from None
        self._ended = threading.Event()
        self._ending = threading.Lock()
        # The lines for the devices that are not in their final state at the end, by log and key.
        self._late: dict[tuple[NodeLog, Hashable], str] = {
            (self.log, None): 'the link does not answer: devices may still be on'}
        self._closed = threading.Event()
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        # Runs once after each reset.
        self._check = node.create_timer(CHECK_INTERVAL, self._work, clock=steady)
        # rclpy's EventsExecutor queues an event for each message, without a bound. After a flood
        # of a best-effort topic it takes longer for each: requests wait for minutes (7.1.6).
        self._executor = SingleThreadedExecutor(context=node.context)
        self._nodes = NodeManager(
            node, arguments, self.log, self._executor, self._wake)
        self._diagnostics = DiagnosticsPublisher(
            node, self.link, self._component, urls=tuple(parameters.urls),
            known=devices.values(), period=parameters.diagnostics_period)
        self._served: list[_Served] = []
        for own in nodes:
            self._executor.add_node(own)
        for own, kind, client, value in zip(nodes, kinds, clients, values, strict=True):
            log = self.log if own is node else NodeLog(own.get_logger())
            self._served.append(_Served(own, log, kind.serve(client, BridgeContext(
                own, self.link, log, frame_log, self._nodes, self._diagnostics, value,
                self._wake))))
        specs = itertools.chain(LINK_PARAMETERS, *(kind.parameters for kind in kinds))
        for warning in ignored_parameters(
                arguments, nodes, {spec.name for spec in specs if spec.restricts},
                self._of_further_node):
            self.log.warning(warning)
        for warning in filter(None, map(unusual_rate, parameters.urls.values())):
            self.log.warning(warning)
        # A period is a whole number of ticks, otherwise some periods would be a tick too long.
        self._tick = parameters.diagnostics_period / math.ceil(
            parameters.diagnostics_period / TICK)
        node.create_timer(self._tick, self._work, clock=steady)
        node.create_timer(GRAPH_INTERVAL, self._check_graph, clock=steady)

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
            self._start_link()
            while not self._ended.is_set() and self.node.context.ok():
                self._spin_once()
        finally:
            self.end()
        self._closed.wait(OFF_LIMIT + STOP_LIMIT)
        # The executor sends some answers, and refuses the requests that came meanwhile.
        for _ in range(LAST_SPINS):
            if self.node.context.ok():
                self._spin_once(0.0)
        for payload in self._served:
            payload.payload.close()
        self._await_acknowledgements()
        # The first one last, since the others use its publisher of parameter events.
        for node in reversed(self.nodes):
            node.destroy_node()

    def _await_acknowledgements(self) -> None:
        """Let other processes receive the last messages, such as the removal of a marker."""
        deadline = time.monotonic() + ACKNOWLEDGEMENT_LIMIT
        for publisher in (one for node in self.nodes for one in node.publishers):
            # After a shutdown of the context nothing can be sent.
            with contextlib.suppress(RuntimeError):
                publisher.wait_for_all_acked(
                    Duration(seconds=max(deadline - time.monotonic(), 0.0)))

    def _spin_once(self, timeout: float | None = None) -> None:
        try:
            self._executor.spin_once(timeout)
        except ExternalShutdownException:
            pass
        except Exception as error:
            self.log.error(f'internal error: {error!r}', 'executor')

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
        # It stops, so that the link's thread does not wait for it. It does so with work only.
        self._executor.create_task(lambda: None)
        if self.link.is_running():
            self._shut_down_devices()
        self.link.stop(STOP_LIMIT)
        self._closed.set()

    def _start_link(self) -> None:
        while not self._ended.is_set():
            try:
                self.link.start()
                return
            except RuntimeError as error:
                self.log.error(f'{error}: too many threads or processes; trying again', 'thread')
                self._ended.wait(RESOURCE.first)

    def _shut_down_devices(self) -> None:
        reports: queue.SimpleQueue[tuple[NodeLog, Hashable, int | None, str]] = queue.SimpleQueue()

        def reporter(log: NodeLog) -> ShutdownReport:
            return lambda key, severity, text: reports.put((log, key, severity, text))

        def start(now: float) -> None:
            steps: list[Callable[[float], None]] = [
                functools.partial(self._component.close, reason=ENDING)]
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

    def _wake(self) -> None:
        """Have :meth:`_work` called soon; callable from any thread."""
        # The nodes may leave before the link's thread has ended.
        with contextlib.suppress(InvalidHandle):
            if self._check.is_canceled():
                self._check.reset()

    # In the executor's thread

    def _work(self) -> None:
        self._check.cancel()
        if self._nodes.work():
            self._wake()
        self.link.call(self._poll)
        self._diagnostics.poll(self._tick / 2)
        for one in self._served:
            one.log.flush()
        # A service of rclpy sets the levels of loggers.
        self._frame_log.adjust()

    def _check_graph(self) -> None:
        nodes = self.nodes
        self.log.write_conditions(shared_names(nodes), 'name')
        self.log.write_conditions(itertools.chain.from_iterable(
            map(unheard_publishers, nodes)), 'publisher')

    # In the link's thread

    def _poll(self, now: float) -> None:
        needs_signing = (self._component.commands.unanswering
                         and self.link.snapshot(now).signing.unchecked)
        self.log.write_conditions(
            [f'{SIGNING_NEEDED}: set signing_mode and signing_key_file'] if needs_signing else [],
            'signing')
        self.log.write_conditions(filter(None, [self._component.commands.clock_fault()]), 'clock')
        self.log.write_conditions(self._diagnostics.loops(now), 'loop')
        self.log.write_conditions(
            [f'{line.status.label}: {line.silence}' for line in self.link.lines if line.silence],
            'silence')
        for one in self._served:
            one.payload.poll(now)

    def _link_event(self, event: LinkEvent) -> None:
        self.log.write(logging.INFO if event.is_open else logging.WARNING, str(event),
                       f'link {event.label}')
        self._wake()


def _link_parameters(
    node: Node, payloads: Mapping[str, RosPayload], known: Mapping[str, DeviceKind], url: str,
) -> LinkParameters:
    """Declare the parameters of a link that carries these payloads."""
    given = given_parameters(node).get('connection_url')
    if url and given is not None and given.value != url:
        raise ParameterError(f'connection_url: {given.value!r}, but the argument is {url!r}: '
                             'give one of them only')
    kinds = [*payloads.values()]
    defaults = {**kinds[0].all_link_defaults, **({'connection_url': url} if url else {})}
    parameters = declare_link_parameters(node, defaults, [
        devices for name, kind in payloads.items() for devices in kind.devices or (
            [frozenset({known[name].name})] if name in known else [])], known.values())
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
