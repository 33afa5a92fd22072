# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A camera behind a pseudo-terminal that runs on pymavlink and a strict parser alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from dataclasses import dataclass, field
import os
import select
import threading
import tty
from typing import Any, cast

from pymavlink.dialects.v10 import ardupilotmega
from support.strict_mavlink_1 import strict_frames, StrictFrame
from support.waiting import eventually

# Any: pymavlink has no types.
MAVLINK_1 = cast(Any, ardupilotmega)
HEARTBEAT_INTERVAL = 0.5
CLOSEDLOOP = 3


@dataclass
class FakeCamera:
    """
    Answers PING and DIGICAM_CONTROL, and keeps all frames.

    :param answers: whether it answers.
    :ivar device: the terminal that the node opens.
    :ivar fault: the reason why the received bytes are not MAVLink 1.
    """

    answers: bool = True
    feedback: dict[str, Any] = field(default_factory=dict)
    frames: list[StrictFrame] = field(default_factory=list)
    fault: str = ''
    images: int = 0
    device: str = ''
    _far: int = -1

    def messages(self, name: str) -> list[Any]:
        """Return the received messages of a kind, decoded by pymavlink."""
        cls = getattr(MAVLINK_1, f'MAVLink_{name.lower()}_message')
        found = []
        for frame in list(self.frames):
            if frame.message_id == cls.id:
                values = cls.unpacker.unpack(frame.payload)
                wire = dict(zip(cls.ordered_fieldnames, values, strict=False))
                found.append(cls(*(wire[name] for name in cls.fieldnames)))
        return found

    def wait(self, name: str, condition: Callable[[Any], bool] = lambda one: True) -> Any:
        """Wait for a message that is received from now on, and return it."""
        before = len(self.messages(name))
        return eventually(lambda: next(
            (one for one in self.messages(name)[before:] if condition(one)), None), name)

    def send(self, data: bytes) -> None:
        """Send bytes to the node."""
        os.write(self._far, data)

    def _pack(self, system: int, message: Any) -> None:
        self.send(message.pack(MAVLINK_1.MAVLink(None, srcSystem=system, srcComponent=100)))

    def run(self, stop: int) -> None:
        """Act as a camera until a byte is written to the other end of ``stop``."""
        rest, system = b'', 255
        # The heartbeat of real cameras.
        beat = MAVLINK_1.MAVLink_heartbeat_message(0, 1, 2, 3, 4, 3)
        while True:
            ready = select.select([self._far, stop], [], [], HEARTBEAT_INTERVAL)[0]
            if stop in ready:
                return
            if not ready:
                self._pack(system, beat)
                continue
            try:
                found, rest = strict_frames(rest + os.read(self._far, 4096))
            except OSError:
                continue
            except (AssertionError, KeyError) as error:
                self.fault = repr(error)
                return
            for frame in found:
                if frame.message_id == 0:
                    self._pack(system, beat)
                system = frame.system
                self.frames.append(frame)
                if self.answers:
                    self._answer(frame, system)

    def _answer(self, frame: StrictFrame, system: int) -> None:
        if frame.message_id == 4:
            sequence = int.from_bytes(frame.payload[8:12], 'little')
            self._pack(system, MAVLINK_1.MAVLink_ping_message(
                0, sequence, frame.system, frame.component))
        elif frame.message_id == 155:
            self.images += 1
            self._pack(system, MAVLINK_1.MAVLink_camera_status_message(
                0, frame.system, 0, self.images, 1, 0, 0, 0, 0))
            self._pack(system, MAVLINK_1.MAVLink_camera_feedback_message(**{
                'time_usec': 0, 'target_system': frame.system, 'cam_idx': 0,
                'img_idx': self.images, 'lat': 470000000, 'lng': 80000000, 'alt_msl': 452.0,
                'alt_rel': 0, 'roll': 0, 'pitch': 0, 'yaw': 0, 'foc_len': 5.4,
                'flags': CLOSEDLOOP, **self.feedback}))


@contextlib.contextmanager
def running_camera(**options: Any) -> Iterator[FakeCamera]:
    """Run a camera; every frame that it receives must be MAVLink 1."""
    far, near = os.openpty()
    tty.setraw(near)
    stopping, stop = os.pipe()
    camera = FakeCamera(device=os.ttyname(near), _far=far, **options)
    thread = threading.Thread(target=camera.run, args=(stopping,))
    thread.start()
    try:
        yield camera
    finally:
        os.write(stop, b'\0')
        thread.join()
        for descriptor in (far, near, stopping, stop):
            os.close(descriptor)
    assert not camera.fault
