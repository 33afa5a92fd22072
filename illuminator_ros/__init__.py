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

"""MAVLink payloads (lights, gimbals, MicaSense cameras) as ordinary ROS 2 devices."""

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
