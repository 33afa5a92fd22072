# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Running a program: signals, output, and missing packages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
import io
import os
import re
import signal
import sys

from .termination import Termination

# How to install a missing package.
_REMEDIES = {
    'rclpy': 'source the setup file of ROS 2, as in "source /opt/ros/jazzy/setup.bash"',
    'fastcrc': 'pip install fastcrc',
    'pymavlink': "pip install 'pymavlink>=2.4.50'",
    **dict.fromkeys(('textual', 'textual_serve', 'aiohttp'),
                    "PIP_BREAK_SYSTEM_PACKAGES=1 pip install 'textual>=8' 'textual-serve>=1.1'"),
    # rclpy needs it.
    'yaml': 'sudo apt install python3-yaml, or pip install pyyaml',
    'visualization_msgs': 'sudo apt install ros-jazzy-visualization-msgs',
}
_MONITOR = _REMEDIES['textual']
# The oldest version of each package that works, by the module that it has, and the remedy.
OLDEST = {
    'pymavlink': ('pymavlink', '2.4.50', "pip install 'pymavlink>=2.4.50'"),
    'rclpy': ('rclpy', '7.1', 'install ROS 2 Jazzy or newer'),
    'serial': ('pyserial', '3.5', "pip install 'pyserial>=3.5'"),
    'textual': ('textual', '8', _MONITOR),
    'textual_serve': ('textual_serve', '1.1', _MONITOR),
}

OLDEST_PYTHON = (3, 10)

# Domains above have no ports.
MAX_DOMAIN = 232

# The beginning of an error, once the arguments have been parsed.
CANNOT_CREATE = 'cannot create the node'


class Refusal(Exception):
    """Why a program cannot start, for people."""


def run_program(name: str, run: Callable[[Termination], int]) -> int:
    """
    Run a program and return its exit status.

    :param run: must import its modules itself, so that a signal meanwhile ends the process.
    """
    escape_output()
    termination = Termination()
    status = explained(name, lambda: run(termination))
    termination.finish()
    return status


def end_on_signals() -> None:
    """Have signals end this process with status 1, until the run handles them."""
    for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        if signal.getsignal(one) != signal.SIG_IGN:
            signal.signal(one, lambda *_: os._exit(1))


def escape_output() -> None:
    """
    Escape characters that the encoding of stdout and stderr lacks, instead of failing.

    Call it before an output queue makes pipes of files, which cannot be reconfigured.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')


def explained(name: str, run: Callable[[], int]) -> int:
    """Run a program and return its exit status; name a refusal, or a missing or old package."""
    if sys.version_info[:2] < OLDEST_PYTHON:
        print(f'{name}: Python {sys.version.split()[0]} is too old; '
              f'{".".join(map(str, OLDEST_PYTHON))} or newer is needed', file=sys.stderr)
        return 1
    try:
        return run()
    except Exception as error:
        status, reason = 1, _missing_package(error) or _old_package()
        if not reason and isinstance(error, Refusal):
            status, reason = 2, one_line(error)
        if not reason:
            raise
        print(f'{name}: {reason}', file=sys.stderr)
        return status


def _missing_package(error: Exception) -> str:
    """Return which package an error says is missing, with the remedy; '' if none is."""
    module = isinstance(error, ModuleNotFoundError) and (error.name or '').partition('.')[0]
    # A package without one of its modules is an old one.
    if not module or module not in _REMEDIES or sys.modules.get(module):
        return ''
    return f'{module} is not installed: {_REMEDIES[module]}'


def _old_package() -> str:
    """Return which imported package is too old, with the remedy; '' if none is."""
    return next((problem for module in OLDEST if module in sys.modules
                 and 'too old' in (problem := package(module)[1])), '')


def package(module: str) -> tuple[str, str]:
    """Return a package of :data:`OLDEST` with its version, and why it does not do, or ''."""
    name, oldest, remedy = OLDEST[module]
    # Slow to import, and impossible where descriptors are lacking.
    try:
        from importlib.metadata import PackageNotFoundError, version
    except (ImportError, OSError):
        return name, ''
    try:
        found = version(name)
    except PackageNotFoundError:
        return name, f'{name} is not installed: {remedy}'
    except OSError:
        return name, ''
    versions = [[int(number) for number in re.findall(r'\d+', text)] for text in (found, oldest)]
    return f'{name} {found}', '' if versions[0] >= versions[1] else (
        f'{name} {found} is too old; {oldest} or newer is needed: {remedy}')


def complainer(name: str) -> Callable[[str], None]:
    """Return what prints why a program failed."""
    return lambda reason: print(f'{name}: {reason}', file=sys.stderr)


def print_output(complain: Callable[[str], object], *texts: str, end: str = '\n') -> bool:
    """
    Print texts, so that a reader at the other end of a pipe sees them immediately.

    A pipe that its reader has closed is not an error.

    :param complain: takes the reason why they cannot be written, once.
    :return: whether they were written, or the reader has closed the pipe.
    """
    if sys.stdout is None:
        complain('standard output is closed')
        return False
    try:
        print(*texts, sep='\n', end=end, flush=True)
    except OSError as error:
        discard_output()
        if not isinstance(error, BrokenPipeError):
            complain(f'standard output: {error.strerror}')
            return False
    return True


def discard_output() -> None:
    """Discard buffered and later output to stdout, also at the exit."""
    with open(os.devnull, 'wb') as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())


@contextlib.contextmanager
def refusing(failed: str) -> Iterator[None]:
    """
    Raise a :class:`Refusal` where ROS cannot be started.

    :param failed: the beginning where the system does not lack anything.
    """
    try:
        yield
    except (ModuleNotFoundError, Refusal):
        raise
    except Exception as error:
        # The middleware has no special exception for a lack of descriptors or threads, and rclpy
        # has one for each kind of wrong argument.
        if isinstance(error, OSError | ImportError) or type(error) is RuntimeError:
            failed = 'cannot start'
        raise Refusal(f'{failed}: {error}') from None


def _wrong_arguments(name: str) -> str:
    # rcl does not explain the syntax of arguments.
    return f'wrong ROS arguments, see {name} --help'


def own_arguments(name: str, arguments: Sequence[str]) -> list[str]:
    """
    Return the arguments that are not for ROS.

    :raises Refusal: if those for ROS are wrong.
    """
    # rcl reads the files as soon as it parses the arguments.
    if refusal := parameter_file_refusal(arguments):
        raise Refusal(refusal)
    if '--ros-args' not in arguments:
        return list(arguments)
    ros = arguments[arguments.index('--ros-args'):]
    for option, value in zip(ros, ros[1:], strict=False):
        # rcl's own error is "Expected lexeme type (22) not found".
        if option in ('-p', '--param', '-r', '--remap') and ':=' not in value:
            first, _, second = value.partition('=')
            raise Refusal(f'{option} {value}: write {option} {first}:={second or "VALUE"}')
    # Slow to import.
    from rclpy.utilities import remove_ros_args
    with refusing(_wrong_arguments(name)):
        return list(remove_ros_args([name, *arguments])[1:])


def start_ros(name: str, arguments: Sequence[str]) -> None:
    """
    Start ROS, without its handlers of signals.

    :raises Refusal: if it cannot be started.
    """
    import rclpy
    from rclpy.signals import SignalHandlerOptions
    if refusal := environment_refusal() or log_directory_refusal():
        raise Refusal(refusal)
    with refusing(_wrong_arguments(name)):
        rclpy.init(args=[name, *arguments], signal_handler_options=SignalHandlerOptions.NO)


def environment_refusal() -> str:
    """
    Return which variable of the environment prevents the start of ROS, '' if none does.

    Fast DDS ends the process at once if the domain is out of range, and rcl gives no reason if
    there is no keystore.
    """
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    if domain and not (re.fullmatch(r'\d{1,3}', domain) and int(domain) <= MAX_DOMAIN):
        return f'ROS_DOMAIN_ID: {domain!r} is not a number from 0 to {MAX_DOMAIN}'
    security = [os.environ.get(f'ROS_SECURITY_{name}', '') for name in ('ENABLE', 'STRATEGY')]
    keystore = os.environ.get('ROS_SECURITY_KEYSTORE', '')
    if security == ['true', 'Enforce'] and not os.path.isdir(keystore):
        return (f'ROS_SECURITY_KEYSTORE: {keystore!r} is not a folder, but '
                'ROS_SECURITY_ENABLE is true')
    return ''


def log_directory_refusal() -> str:
    """Return why log files cannot be written to their directory, '' if they can."""
    home = os.environ.get('ROS_HOME') or '~/.ros'
    directory = os.environ.get('ROS_LOG_DIR') or os.path.join(home, 'log')
    # rcl takes the home directory from HOME only, which a systemd service without User= lacks.
    if directory.startswith('~') and not os.environ.get('HOME'):
        return (f'log files cannot be written to {directory}: HOME is not set; set HOME or '
                'ROS_LOG_DIR')
    directory = os.path.expanduser(directory)
    try:
        os.makedirs(directory, exist_ok=True)
        if os.access(directory, os.W_OK | os.X_OK):
            return ''
        reason = 'no permission'
    except OSError as error:
        reason = error.strerror or str(error)
    return (f'log files cannot be written to {directory}: {reason}; set ROS_LOG_DIR to a '
            'directory that can be written')


def parameter_file_refusal(arguments: Sequence[str]) -> str:
    """
    Return which parameter file is not a regular file or has a tab as indentation, '' if none.

    rcl and this program read each file again: a pipe would be empty, and its parameters lost. rcl
    waits for the writer of a FIFO, and no signal ends that. Its own error names no tab.
    """
    for option, path in zip(arguments, arguments[1:], strict=False):
        if option != '--params-file' or not os.path.exists(path):
            continue
        if not os.path.isfile(path):
            return f'parameter file {path}: it is not a regular file'
        with contextlib.suppress(OSError), open(path, encoding='utf-8', errors='replace') as file:
            for number, line in enumerate(file, 1):
                if line.strip() and '\t' in line[:len(line) - len(line.lstrip())]:
                    return (f'parameter file {path}, line {number}: it begins with a tab; YAML '
                            'takes spaces only')
    return ''


def one_line(message: object) -> str:
    """Return a message of rcl in one line, without its positions in the sources of rcl."""
    return re.sub(r', at /[^ ,]+:\d+', '', ' '.join(str(message).split()))
