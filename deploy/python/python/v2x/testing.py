"""A hub for your tests: pytest finds the fixtures `hub` and `hub_factory` by itself once `v2x` is installed.

    def test_a_car_comes_back(hub):
        with Consumer(connect=hub.locator) as consumer, Agent("camera", connect=hub.locator) as camera:
            ...

The program `v2x` is found by `$V2X_BINARY`, or on the path.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
import threading
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import pytest

from .engine import _plain

#: How long a hub may take to start, and to end, s.
PATIENCE_S = 20.0


class HubError(RuntimeError):
    """A hub that cannot be started, or that does not end cleanly."""


def binary() -> str:
    """The program `v2x`."""
    named = os.environ.get("V2X_BINARY")
    found = shutil.which(named) if named else shutil.which("v2x")
    if found is None:
        missing = f"$V2X_BINARY is {named!r}, which is no program" if named else "there is no program v2x on the path"
        raise HubError(
            f"{missing}. Build it in its repository (`cargo install --path deploy --locked`), or say where it is: "
            "V2X_BINARY=/path/to/v2x"
        )
    return found


class Hub:
    """A hub on a free port of this machine, as a process. It ends with `close`, and when this process ends.

    `config` are its settings, as `v2x.Engine` takes them: the `[hub]` table as a dict or as TOML text, or either with a table
    `hub`. `record` is an MCAP file for all that arrives and is published.
    """

    def __init__(
        self,
        config: str | Mapping[str, Any] | None = None,
        *,
        network: str = "demo",
        record: str | os.PathLike[str] | None = None,
    ) -> None:
        program = binary()
        self.network = network
        self._folder = tempfile.TemporaryDirectory(prefix="v2x-hub-")
        self._log = Path(self._folder.name) / "log"
        command = [program, "hub", "--network", network, "--listen", "tcp/127.0.0.1:0", "--events", "--exit-with-stdin"]
        if config is not None:
            settings = Path(self._folder.name) / "hub.toml"
            settings.write_text(_settings(config), encoding="utf-8")
            command += ["--config", str(settings)]
        if record is not None:
            command += ["--record", os.fspath(record)]
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log)
        first: list[bytes] = []
        self._reader = threading.Thread(target=self._read, args=(first, started := threading.Event()), daemon=True)
        self._reader.start()
        started.wait(PATIENCE_S)
        if not first or not first[0]:
            self._process.kill()
            said = self._end()
            raise HubError(f"the hub did not start:\n{said}")
        #: Where agents and consumers connect to it.
        self.locator: str = json.loads(first[0])["locators"][0]

    def _read(self, first: list[bytes], started: threading.Event) -> None:
        """Reads the hub's events, so that it never waits for a reader; the first one says where it listens."""
        assert self._process.stdout is not None
        first.append(self._process.stdout.readline())
        started.set()
        while self._process.stdout.read(1 << 16):
            pass

    def _end(self) -> str:
        """What it has logged, once it has ended; nothing of it is left then."""
        self._process.wait()
        self._reader.join(PATIENCE_S)
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()
        log = self.log()
        self._folder.cleanup()
        return log

    def log(self) -> str:
        """What it has logged."""
        return self._log.read_text(encoding="utf-8", errors="replace")

    def close(self) -> None:
        """Ends it, and waits until it has ended."""
        if self._process.returncode is not None:
            return
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            code = self._process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise HubError(f"the hub did not end in {PATIENCE_S:.0f} s:\n{self._end()}") from None
        log = self._end()
        if code != 0:
            raise HubError(f"the hub ended with code {code}:\n{log}")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


def _settings(config: str | Mapping[str, Any]) -> str:
    """The text of a settings file."""
    if isinstance(config, str):
        try:
            table: Any = tomllib.loads(config)
        except tomllib.TOMLDecodeError:
            # The hub says what is wrong, and where.
            return config
        return config if "hub" in table else _toml({"hub": table})
    # Tuples, numbers of NumPy and keys that are no texts become what they are for the engine.
    table = json.loads(json.dumps(config, default=_plain))
    return _toml({"hub": table.get("hub", table)})


def _toml(table: Mapping[str, Any]) -> str:
    """A dict as TOML: numbers, texts, booleans, lists and tables."""
    return "".join(f"{_text(key)} = {_value(value, key)}\n" for key, value in table.items())


def _value(value: Any, path: str) -> str:
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    # `nan` and `inf` are TOML's words, too.
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, Mapping):
        inner = (f"{_text(key)} = {_value(one, f'{path}.{key}')}" for key, one in value.items())
        return "{ " + ", ".join(inner) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(one, f"{path}[{n}]") for n, one in enumerate(value)) + "]"
    if value is None:
        raise ValueError(f"{path} is None: there is no such value in TOML; leave the key out")
    raise TypeError(f"{path} is a {type(value).__name__}, which no setting is")


def _text(text: str) -> str:
    # As in JSON, but for characters beyond 16 bits, which JSON may write in two parts, and for one control character.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _close_all(hubs: list[Hub]) -> None:
    """Ends all of them, whatever any of them does."""
    errors = []
    for one in reversed(hubs):
        try:
            one.close()
        except HubError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise ExceptionGroup(f"{len(errors)} hubs did not end cleanly", errors)


@pytest.fixture
def hub_factory() -> Iterator[Callable[..., Hub]]:
    """Starts hubs, each with its settings: `hub_factory({"method": "nms"}, network="test")`. They end after the test."""
    hubs: list[Hub] = []

    def start(config: str | Mapping[str, Any] | None = None, **options: Any) -> Hub:
        hubs.append(Hub(config, **options))
        return hubs[-1]

    yield start
    _close_all(hubs)


@pytest.fixture
def hub(hub_factory: Callable[..., Hub]) -> Hub:
    """A hub on a free port with default settings: `hub.locator` is its endpoint."""
    return hub_factory()
