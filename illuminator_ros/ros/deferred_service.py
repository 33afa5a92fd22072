# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Services that answer later, with each executor of rclpy."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
import contextlib
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import QoSProfile

from .throttled_log import NodeLog

# Sends a response; callable once, from any thread. Untyped: messages of ROS have no types.
Respond = Callable[[Any], None]
# Handles a request, given the function that sends the response.
Handler = Callable[[Any, Respond], None]


class DeferredService:
    """
    A service that answers later.

    An executor sends what the callback returns by ``Service.send_response``. Here the callback
    returns a future, and the ``send_response`` of this service waits for its result. With a
    coroutine in place of the future, rclpy 7.1 would spin at full load while it waits.

    :param handle: called with the request, and with the function that sends the response.
    """

    def __init__(
        self, node: Node, type_: type[Any], name: str, handle: Handler, qos: QoSProfile,
        log: NodeLog,
    ) -> None:
        self.handle = handle
        self._node = node
        self._log = log
        service = node.create_service(type_, name, self, qos_profile=qos)
        self._send_now = service.send_response
        setattr(service, 'send_response', self._send)  # noqa: B010 - mypy forbids an assignment

    def __call__(self, request: Any, response: Any) -> Future[Any]:
        """Handle a request; return the future of its response."""
        future: Future[Any] = Future()
        try:
            self.handle(request, future.set_result)
        except Exception as error:
            # The client gets an answer after internal errors, too.
            self._log.error(f'internal error: {error!r}', 'service')
            if not future.done():
                future.set_result(response)
        return future

    # Any: the header has a type of rclpy's private parts.
    def _send(self, response: Future[Any], header: Any) -> None:
        def send(future: Future[Any]) -> None:
            # The node of a forgotten device may be gone.
            with contextlib.suppress(InvalidHandle):
                self._send_now(future.result(), header)

        def answered(future: Future[Any]) -> None:
            # The middleware waits up to 0.1 s before it sends an answer to a client that it has
            # not discovered yet. The link's thread must not wait.
            executor = self._node.executor
            if header.request_id.sequence_number <= 1 and executor is not None:
                executor.create_task(send, future)
            else:
                send(future)

        response.add_done_callback(answered)
