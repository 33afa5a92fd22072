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

"""The version, as package.xml says it."""

import os
import re


def read_version() -> str:
    """Return the version of this working tree, or of the package where it is installed."""
    manifest = os.path.join(os.path.dirname(os.path.dirname(__file__)), 'package.xml')
    try:
        with open(manifest, encoding='utf-8') as file:
            found = re.search('<version>(.+)</version>', file.read())
    except OSError:
        # Slow to import, and needed by those only who ask an installed package.
        from importlib.metadata import PackageNotFoundError, version
        try:
            return version('illuminator_ros')
        except PackageNotFoundError:
            return 'unknown'
    assert found is not None, f'{manifest} has no version'
    return found[1]
