# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The parser of each executable. No MAVLink."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
import shutil
import sys
from typing import NoReturn, TYPE_CHECKING, TypeVar

from .entry_point import print_output
from .. import __version__

if TYPE_CHECKING:
    from _typeshed import SupportsWrite  # A name of type checkers only.

T = TypeVar('T')


class Parser(argparse.ArgumentParser):
    """
    A parser whose error is one line without the usage.

    Options cannot be abbreviated: scripts with abbreviations would break when an option is added.

    :param prog: the name of the program.
    :param parents: parsers whose options it has, too.
    :param is_complete: whether it has ``--help`` and ``--version``.
    """

    def __init__(
        self, prog: str, description: str = '', epilog: str = '', *,
        parents: Sequence[argparse.ArgumentParser] = (), is_complete: bool = True,
    ) -> None:
        super().__init__(
            prog=prog, description=description, epilog=epilog, parents=parents,
            formatter_class=argparse.RawDescriptionHelpFormatter, add_help=is_complete,
            allow_abbrev=False)
        if is_complete:
            self.add_argument('--version', action='version', version=__version__)

    def error(self, message: str) -> NoReturn:
        """See :meth:`argparse.ArgumentParser.error`."""
        self.exit(2, f'{self.prog}: {message}; see {self.prog} --help\n')

    def _print_message(self, message: str, file: SupportsWrite[str] | None = None) -> None:
        """Write a text; argparse itself ignores errors of writing."""
        if file is not sys.stdout or sys.stdout is None:
            super()._print_message(message, file)
            return
        print_output(lambda reason: self.exit(1, f'{self.prog}: {reason}\n'), message, end='')


def invocation(name: str) -> str:
    """Return the command that starts a program in the way in which this process was started."""
    started = Path(sys.argv[0])
    if started.suffix == '.py':
        python = Path(sys.executable)
        if python.is_relative_to(Path.cwd()):
            python = python.relative_to(Path.cwd())
        elif shutil.which('python3') == sys.executable:
            python = Path('python3')
        return f'{python} -m illuminator_ros.{name}'
    # colcon installs the executables of a package, which may be another one, in lib/PACKAGE.
    return (f'ros2 run {started.parent.name} {started.name}'
            if started.parent.parent.name == 'lib' else started.name)


def option(read: Callable[[str], T]) -> Callable[[str], T]:
    """Return a reader whose ValueError argparse shows; it hides the text of a plain ValueError."""
    def read_option(text: str) -> T:
        try:
            return read(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from error
    return read_option
