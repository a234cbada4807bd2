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
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import pytest

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

    `config` are its settings: the `[hub]` table as a dict, or the text of a settings file. `record` is an MCAP file for all that
    arrives and is published.
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
            settings.write_text(config if isinstance(config, str) else _toml({"hub": config}), encoding="utf-8")
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


def _toml(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> str:
    """A dict as TOML: numbers, texts, booleans, lists of these, and tables."""
    here = [f"{json.dumps(key)} = {json.dumps(value)}" for key, value in table.items() if not isinstance(value, Mapping)]
    text = f"[{'.'.join(map(json.dumps, path))}]\n" if path else ""
    text += "".join(line + "\n" for line in here)
    return text + "".join(_toml(value, (*path, key)) for key, value in table.items() if isinstance(value, Mapping))


@pytest.fixture
def hub_factory() -> Iterator[Callable[..., Hub]]:
    """Starts hubs, each with its settings: `hub_factory({"method": "nms"}, network="test")`. They end after the test."""
    hubs: list[Hub] = []

    def start(config: str | Mapping[str, Any] | None = None, **options: Any) -> Hub:
        hubs.append(Hub(config, **options))
        return hubs[-1]

    yield start
    for one in reversed(hubs):
        one.close()


@pytest.fixture
def hub(hub_factory: Callable[..., Hub]) -> Hub:
    """A hub on a free port with default settings: `hub.locator` is its endpoint."""
    return hub_factory()
