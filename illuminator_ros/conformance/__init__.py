"""
The executable ``conformance``: checks any light against the illuminator protocol, without ROS.

``bench`` talks to the light, ``requirements`` has the checks, ``suite`` runs them: all without
I/O. ``run`` is the command line.
"""

from __future__ import annotations


def main(args: list[str] | None = None) -> int:
    """
    Check a light; see :mod:`~.run`.

    :param args: the command line without the program's name.
    """
    from .run import run
    return run(args)
