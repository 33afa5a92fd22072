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

"""What the monitor does to a terminal, and gets from it."""

from collections.abc import Iterator
import os
import pty
import termios

from illuminator_ros.cli.monitor.terminal import Keyboard, quiet_errors, unbuffered
import pytest


class Ended(Exception):
    """The terminal is gone."""


def end() -> None:
    raise Ended


@pytest.fixture
def line() -> Iterator[tuple[int, int]]:
    """Return both ends of a terminal: where keys are pressed, and where they arrive."""
    master, slave = pty.openpty()
    yield master, slave
    for descriptor in (master, slave):
        os.close(descriptor)


class TestKeyboard:

    @pytest.fixture
    def keyboard(self, line: tuple[int, int]) -> Iterator[Keyboard]:
        """Return the keyboard of a terminal that passes on each key."""
        with unbuffered(line[1]):
            keyboard = Keyboard(line[1])
            yield keyboard
            keyboard.close()

    def test_a_key_comes_at_once(self, line: tuple[int, int], keyboard: Keyboard) -> None:
        os.write(line[0], b'q')

        assert keyboard.read(30.0, end) == b'q'

    def test_without_a_key_it_returns_in_time(self, keyboard: Keyboard) -> None:
        assert keyboard.read(0.0, end) == b''

    def test_another_thread_can_wake_it_as_often_as_it_likes(self, keyboard: Keyboard) -> None:
        for _ in range(100_000):
            keyboard.wake()

        assert keyboard.read(30.0, end) == b''

    def test_a_terminal_that_goes_is_told(self) -> None:
        reading, writing = os.pipe()
        os.close(writing)
        keyboard = Keyboard(reading)

        with pytest.raises(Ended):
            keyboard.read(30.0, end)

        keyboard.close()
        os.close(reading)


class TestUnbuffered:

    def test_a_terminal_is_as_before_whatever_happens(self, line: tuple[int, int]) -> None:
        before = termios.tcgetattr(line[1])

        with pytest.raises(Ended), unbuffered(line[1]):
            assert termios.tcgetattr(line[1]) != before
            end()

        assert termios.tcgetattr(line[1]) == before

    def test_only_ctrl_c_is_still_a_signal(self, line: tuple[int, int]) -> None:
        with unbuffered(line[1]):
            modes, characters = termios.tcgetattr(line[1])[3], termios.tcgetattr(line[1])[6]

        assert modes & termios.ISIG
        assert [characters[key] for key in (termios.VINTR, termios.VQUIT, termios.VSUSP)] == [
            b'\x03', b'\0', b'\0']

    def test_a_terminal_that_is_gone_is_no_error(self) -> None:
        master, slave = pty.openpty()

        with unbuffered(slave):
            os.close(master)

        os.close(slave)

    def test_it_can_be_brought_back_from_another_thread(self, line: tuple[int, int]) -> None:
        before = termios.tcgetattr(line[1])

        with unbuffered(line[1]) as restore:
            restore()

            assert termios.tcgetattr(line[1]) == before


def test_errors_meanwhile_are_shown_afterwards(capfd: pytest.CaptureFixture[str]) -> None:
    with quiet_errors():
        os.write(2, b'from the middleware\n')
        assert capfd.readouterr().err == ''

    assert capfd.readouterr().err == 'from the middleware\n'
