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

"""``bridge`` and ``simulator`` on the command line."""

from pathlib import Path
import re
import subprocess
import sys

from illuminator_ros import __version__
from illuminator_ros.cli.simulator.options import parser
from illuminator_ros.illuminator.ros.parameters import DEVICE_PARAMETERS, LIGHT_PARAMETERS
from illuminator_ros.ros.parameters import LINK_PARAMETERS
import pytest
from support.open_channel import bound_socket
from support.processes import ended, environment, Program, ROOT, run

BRIDGE, SIMULATOR = 'illuminator_ros.bridge', 'illuminator_ros.simulator'
MONITOR = 'illuminator_ros.monitor'


class TestHelp:

    @pytest.mark.parametrize('module', [BRIDGE, SIMULATOR, MONITOR])
    @pytest.mark.parametrize('option', ['--help', '-h'])
    def test_it_is_printed_and_that_is_all(self, module: str, option: str) -> None:
        outcome = run(module, option)

        assert (outcome.returncode, outcome.stderr) == (0, '')
        assert outcome.stdout.startswith(f'usage: {module.rpartition(".")[2]} ')
        assert 'examples:' in outcome.stdout
        assert re.findall(r'\b\d\b', outcome.stdout.partition('exit status:')[2]) == [*'012']

    def test_the_bridge_s_tells_every_parameter_and_form_of_url(self) -> None:
        text = run(BRIDGE, '--help').stdout

        for spec in (*LINK_PARAMETERS, *LIGHT_PARAMETERS, *DEVICE_PARAMETERS):
            assert re.search(rf'^  {spec.name} .*{re.escape(spec.description)}', text, re.M)
        for scheme in ('udp://', 'udpin://', 'udpout://', 'tcp://', 'tcp-l://', 'serial://',
                       '/dev/ttyUSB0,57600', 'udpin:'):
            assert scheme in text
        assert 'ros2 service call' in text
        assert 'ros2 param set' in text

    def test_it_fits_a_terminal(self) -> None:
        assert max(map(len, run(BRIDGE, '--help').stdout.splitlines())) < 132

    def test_the_simulator_s_tells_every_option(self) -> None:
        text = run(SIMULATOR, '--help').stdout

        for action in parser()._actions:
            assert (action.option_strings or [action.dest])[-1] in text

    @pytest.mark.parametrize('module', [BRIDGE, SIMULATOR, MONITOR])
    def test_the_version_is_the_package_s(self, module: str) -> None:
        outcome = run(module, '--version')

        assert (outcome.returncode, outcome.stdout) == (0, f'{__version__}\n')
        assert f'<version>{__version__}</version>' in (ROOT / 'package.xml').read_text()


@pytest.mark.parametrize(('arguments', 'text'), [
    (['--banana'], "unknown argument '--banana'; parameters go behind --ros-args"),
    (['-p', 'brightness:=60'], "unknown argument '-p'"),
    (['udpin://127.0.0.1:14550', '--ros-args', '-p', 'brightness:=60', '--', 'more'],
     "unknown argument 'more'"),
])
def test_the_bridge_refuses_what_it_does_not_know_in_one_line(
    arguments: list[str], text: str,
) -> None:
    outcome = run(BRIDGE, *arguments)

    [line] = outcome.stderr.splitlines()
    assert line.startswith('bridge: ')
    assert text in line
    assert outcome.returncode == 2


@pytest.mark.parametrize(('arguments', 'text'), [
    (['--banana'], 'unrecognized arguments: --banana'),
    (['udpin://127.0.0.1:14550', 'more'], 'unrecognized arguments: more'),
    (['http://x'], "unknown scheme 'http'"),
    (['udpin://127.0.0.1:0'], 'port 0 is outside 1..65535'),
    (['--count', '0'], 'argument --count: 0 is outside 1 to 200'),
    (['--count', 'many'], "argument --count: invalid integer value: 'many'"),
    (['--count', '100', '--component-id', '200'], 'component ids end at 255'),
    (['--system-id', '256'], 'argument --system-id: 256 is outside 1 to 255'),
    (['--status-interval', 'nan'], 'argument --status-interval: nan is outside 0 to 3600'),
    (['--status-interval', '-1'], 'argument --status-interval: -1 is outside'),
    (['--ambient', 'inf'], 'argument --ambient: inf is outside -60 to 150'),
    (['--time-scale', '0'], 'argument --time-scale: 0 is outside'),
    (['--min-strobe-period', '2', '--max-strobe-period', '1'],
     'min_strobe_period is above max_strobe_period'),
    (['--signing-mode', 'maybe'], "invalid choice: 'maybe'"),
    (['--signing-mode', 'require'], 'no key file is given'),
    (['--signing-mode', 'sign', '--signing-key-file', '/nonexistent'],
     "key file '/nonexistent': No such file or directory"),
    (['--signing-key-file', '/etc/hostname'],
     '--signing-key-file is given, but --signing-mode is off'),
    (['--count'], 'argument --count: expected one argument'),
])
def test_the_simulator_refuses_what_is_wrong_in_one_line(
    arguments: list[str], text: str,
) -> None:
    outcome = run(SIMULATOR, *arguments)

    [line] = outcome.stderr.splitlines()
    assert line.startswith('simulator: ')
    assert text in line
    assert (outcome.returncode, outcome.stdout) == (2, '')


@pytest.mark.parametrize('output', ['>&-', '> /dev/full'], ids=['closed', 'full'])
def test_the_simulator_goes_on_where_its_output_leads_nowhere(output: str) -> None:
    with bound_socket() as bridge:
        url = f'udpout://127.0.0.1:{bridge.getsockname()[1]}'
        with ended(Program('sh', '-c', f'exec {sys.executable} -m {SIMULATOR} '
                           f'--status-interval 0.1 {url} {output}')) as simulator:
            for _ in range(20):
                assert bridge.recv(300)
            assert simulator.running


class TestMissingPackages:

    def run_without(self, package: str, module: str, tmp_path: Path) -> tuple[int, str]:
        blocker = tmp_path / 'sitecustomize.py'
        blocker.write_text(f'import sys\nsys.modules[{package!r}] = None\n')
        paths = {'PYTHONPATH': f'{tmp_path}:{ROOT}'}
        outcome = subprocess.run(
            [sys.executable, '-m', module], env=environment(paths), text=True,
            capture_output=True, timeout=30)
        return outcome.returncode, outcome.stderr

    def test_the_bridge_without_ros_says_what_to_do(self, tmp_path: Path) -> None:
        assert self.run_without('rclpy', BRIDGE, tmp_path) == (
            1, 'bridge: rclpy is not installed: source the setup file of ROS 2, as in '
            '"source /opt/ros/jazzy/setup.bash"\n')

    @pytest.mark.parametrize('module', [BRIDGE, SIMULATOR])
    def test_both_without_pymavlink_say_what_to_do(self, tmp_path: Path, module: str) -> None:
        status, text = self.run_without('pymavlink', module, tmp_path)

        assert status == 1
        assert text.endswith(': pymavlink is not installed: pip install pymavlink\n')

    @pytest.mark.parametrize(('package', 'remedy'), [
        ('rclpy', 'source the setup file of ROS 2, as in "source /opt/ros/jazzy/setup.bash"'),
        ('rich', "sudo apt install python3-rich, or pip install 'rich>=13.3'")])
    def test_the_monitor_says_what_to_install(
        self, tmp_path: Path, package: str, remedy: str,
    ) -> None:
        assert self.run_without(package, MONITOR, tmp_path) == (
            1, f'monitor: {package} is not installed: {remedy}\n')

    def test_the_simulator_needs_no_ros(self, tmp_path: Path) -> None:
        blocker = tmp_path / 'sitecustomize.py'
        blocker.write_text("import sys\nsys.modules['rclpy'] = None\n")

        outcome = run(SIMULATOR, '--version', env={'PYTHONPATH': f'{tmp_path}:{ROOT}'})

        assert outcome.returncode == 0
