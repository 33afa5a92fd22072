# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

from pathlib import Path
import sys

from setuptools import find_packages, setup

package_name = 'illuminator_ros'


def files(folder: str) -> list[str]:
    """Return the files that lie in a folder."""
    return sorted(str(path) for path in Path(folder).iterdir() if path.is_file())


# A wheel's executables go on the PATH, where "bridge" is iproute2's. colcon runs "install" or
# "develop", which put them into lib/illuminator_ros (setup.cfg), where "ros2 run" looks.
prefix = 'illuminator-' if {'bdist_wheel', 'dist_info', 'editable_wheel'} & {*sys.argv} else ''

# Dependencies and extras are in pyproject.toml.
setup(
    name=package_name,
    # With package.xml's set by catkin_prepare_release, which wants it written here in full.
    version='0.1.0',
    packages=find_packages(include=[f'{package_name}*']),
    package_data={package_name: [
        'py.typed', 'ros/fastdds.xml', 'cli/monitor/monitor.tcss', 'cli/monitor/page.html',
        'cli/discover/unit.service']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        *((f'share/{package_name}/{folder}', files(folder))
          for folder in ('config', 'config/sros2', 'examples', 'launch')),
    ],
    python_requires='>=3.10',
    zip_safe=True,
    maintainer='The illuminator_ros developers',
    maintainer_email='illuminator_ros@example.org',
    description='MAVLink lights, gimbals and MicaSense cameras as ordinary ROS 2 devices',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            *(f'{prefix}{name} = illuminator_ros.cli.{name}:main'
              for name in ('bridge', 'conformance', 'discover', 'doctor', 'monitor', 'set',
                           'simulator')),
            *(f'{prefix}{name} = illuminator_ros.cli.bridge:{name}'
              for name in ('gimbal', 'gimbal_manager', 'rededge')),
        ],
    },
)
