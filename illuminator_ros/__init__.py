# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""MAVLink payloads (lights, gimbals, MicaSense cameras) as ordinary ROS 2 devices."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    __version__: str
else:
    def __getattr__(name):
        """Look ``__version__`` up when it is used (PEP 562): the import takes 20 ms."""
        if name != '__version__':
            raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
        from importlib.metadata import PackageNotFoundError, version
        from pathlib import Path
        import re
        manifest = Path(__file__).parents[1] / 'package.xml'
        try:
            # The manifest of a working tree comes first: another version may be installed.
            if manifest.exists():
                return re.findall('<version>(.+)</version>', manifest.read_text())[0]
            return version(__name__)
        except PackageNotFoundError:
            return 'unknown'


def lazy_exports(
    package: str, modules: Mapping[str, Sequence[str]],
) -> Callable[[str], object]:
    """
    Return ``__getattr__`` of a package that imports its public names when they are used.

    So a program that needs one module of the package does not wait for all (PEP 562).

    :param modules: the public names, by the module of the package that has them.
    """
    module_of = {name: module for module, names in modules.items() for name in names}

    def look_up(name: str) -> object:
        if name not in module_of:
            raise AttributeError(f'module {package!r} has no attribute {name!r}')
        from importlib import import_module
        return getattr(import_module(f'.{module_of[name]}', package), name)

    return look_up
