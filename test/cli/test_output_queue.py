# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The queue between a descriptor and a reader that stops reading."""

import os
import select

from illuminator_ros.cli.output_queue import OutputQueue, PIPE_SIZE
from support.waiting import eventually, PATIENCE

LINE = b'x' * 4095 + b'\n'


def test_lines_that_do_not_fit_into_the_queue_are_dropped_and_counted() -> None:
    reading, writing = os.pipe()
    queue = OutputQueue(writing)
    sent = 3 * PIPE_SIZE // len(LINE)
    for _ in range(sent):
        assert select.select([], [writing], [], PATIENCE)[1]
        os.write(writing, LINE)
    with open(reading, 'rb') as reader:
        written = [reader.readline() for _ in range(2)]
        assert select.select([], [writing], [], PATIENCE)[1]
        os.write(writing, b'a last line\n' * 2)
        while written[-1] != b'a last line\n':
            written.append(reader.readline())
        [note] = [line for line in written if b'dropped' in line]
        whole, lost = written.count(LINE), int(note.split()[0][1:])
        assert lost > PIPE_SIZE // len(LINE)
        # The line after the note is lost in part.
        assert whole + lost in (sent, sent - 1)
        queue.finish(PATIENCE)


def test_a_write_fails_once_the_reader_is_gone_as_without_a_queue() -> None:
    reading, writing = os.pipe()
    OutputQueue(writing)
    os.close(reading)

    def fails() -> bool:
        try:
            return os.write(writing, LINE) < 0
        except BrokenPipeError:
            return True

    eventually(fails)
