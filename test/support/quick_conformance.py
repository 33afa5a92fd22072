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

"""Run ``conformance`` as users do, but listen for other lights for a shorter time."""

import sys

from illuminator_ros.cli.conformance import main, run

if __name__ == '__main__':
    # s; the lights of the tests send a heartbeat each second. A target is one of several.
    run.LISTEN_TIME = 1.5 if '--target' in sys.argv else 0.1
    sys.exit(main())
