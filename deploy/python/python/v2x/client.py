"""Agents and consumers of a network, over `eclipse-zenoh` (`pip install './deploy/python[client]'` in the repository).

An agent and a consumer, with a hub (`v2x hub`) on this machine:

    from v2x.client import Agent, Consumer
    from v2x.messages import Detection

    with Consumer() as consumer, Agent("camera") as camera:
        camera.publish([Detection("car", 12.0, 5.0)])
        for frame in consumer.frames(timeout=5):
            print(frame.fused_at, frame.to_array()["x"])
            break
"""

from __future__ import annotations

import json
import re
import threading
import time
import weakref
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from types import TracebackType
from typing import Any, Generic, Self, TypeVar

import numpy as np
import numpy.typing as npt

from .follow import AreaFollower, DeltaFollower
from .messages import Detection, DetectionFrame, FusedFrame, Pose, SensorDescription, detections_of

try:
    import zenoh
except ImportError as error:
    raise ImportError("v2x.client needs Zenoh: pip install eclipse-zenoh") from error

#: Where `v2x hub` listens if nothing else is asked for.
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
#: A description is sent this often, s: a hub that was started later gets it, too.
DESCRIPTION_INTERVAL_S = 1.0
#: Lists that wait for a consumer that is slow; the oldest are dropped, and counted.
MAX_WAITING = 64

#: Stamps of today are larger, ns: what is smaller is of another unit.
_FIRST_STAMP = 10**17
_ENDPOINT = re.compile(r"[a-z_-]+/.+")

T = TypeVar("T")
_NAME = re.compile(r"[A-Za-z0-9_.:-]{1,32}")


class NoHub(ConnectionError):
    """Nothing answers at the endpoint."""


class _Client:
    """A Zenoh session of a client."""

    def __init__(self, network: str, connect: str | Sequence[str], config: zenoh.Config | None, patience_s: float) -> None:
        _check_name("network", network)
        endpoints = [connect] if isinstance(connect, str) else list(connect)
        for endpoint in endpoints if config is None else ():
            if not _ENDPOINT.fullmatch(endpoint):
                raise ValueError(f"connect is {endpoint!r}, expected an endpoint such as {DEFAULT_ENDPOINT!r}")
        if config is None:
            config = zenoh.Config()
            config.insert_json5("mode", '"client"')
            config.insert_json5("connect/endpoints", json.dumps(endpoints))
            config.insert_json5("scouting/multicast/enabled", "false")
            config.insert_json5("scouting/gossip/enabled", "false")
            config.insert_json5("connect/timeout_ms", str(round(patience_s * 1000)))
        try:
            self._session = zenoh.open(config)
        except zenoh.ZError as error:
            where = ", ".join(endpoints)
            raise NoHub(f"no hub or router answers at {where}: start one (`v2x hub`), or say where (connect=…)") from error
        self.network = network

    def _key(self, rest: str) -> str:
        return f"v2x/{self.network}/{rest}"

    def close(self) -> None:
        """Leaves the network."""
        self._session.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


class Agent(_Client):
    """An agent of a network: it publishes frames, and is alive as long as it is not closed.

    `description` is sent at once and every second. `connect` is the hub's or a router's endpoint; `config` is Zenoh's own
    configuration in its place.
    """

    def __init__(
        self,
        name: str,
        *,
        network: str = "demo",
        connect: str | Sequence[str] = DEFAULT_ENDPOINT,
        description: SensorDescription | None = None,
        config: zenoh.Config | None = None,
        patience_s: float = 5.0,
    ) -> None:
        _check_name("name", name)
        if description is not None:
            description.check()
        super().__init__(network, connect, config, patience_s)
        self.name = name
        # Any number that grows from boot to boot: µs since 1970, as our own agents have it.
        self.epoch = time.time_ns() // 1000
        self._sequence = 0
        self._lock = threading.Lock()
        self._closed = threading.Event()
        json_encoding = zenoh.Encoding.APPLICATION_JSON
        self._frames = self._session.declare_publisher(self._key(f"agent/{name}/detections"), encoding=json_encoding)
        self._descriptions = self._session.declare_publisher(self._key(f"agent/{name}/sensor"), encoding=json_encoding)
        self._token = self._session.liveliness().declare_token(self._key(f"agent/{name}/alive"))
        self._description = description
        self._describer = threading.Thread(target=self._describe, name=f"v2x-{name}-description", daemon=True)
        if description is not None:
            self._describer.start()

    def _describe(self) -> None:
        assert self._description is not None
        payload = json.dumps(self._description.to_json(), default=_plain)
        while True:
            self._descriptions.put(payload)
            if self._closed.wait(DESCRIPTION_INTERVAL_S):
                return

    def wait_until_heard(self, timeout_s: float = 10.0) -> bool:
        """Waits until a hub subscribes; what is published before that is lost. False after `timeout_s`."""
        heard = threading.Event()
        listener = self._frames.declare_matching_listener(lambda status: heard.set() if status.matching else None)
        try:
            status = self._frames.matching_status
            return bool(getattr(status, "matching", status)) or heard.wait(timeout_s)
        finally:
            listener.undeclare()  # type: ignore[no-untyped-call]

    def publish(
        self,
        detections: Sequence[Detection] | npt.NDArray[np.void],
        *,
        captured_at: int | None = None,
        sensor_pose: Pose | None = None,
        map_frame: str | None = None,
    ) -> DetectionFrame:
        """Publishes what the sensor detected at `captured_at` (ns since 1970; now, if it is not given), and returns it.

        `detections` are `Detection`s or an array of `v2x.DETECTION`; none at all says that the sensor detected nothing. A
        number that is none (a float as a time, NaN as a position) is a `TypeError` or a `ValueError` that names it; in an array
        NaN is what is not known, but for x and y.
        """
        if isinstance(detections, Detection):
            raise TypeError(f"detections is {detections!r}, expected a list of them")
        listed = detections_of(detections) if isinstance(detections, np.ndarray) else tuple(detections)
        at = time.time_ns() if captured_at is None else captured_at
        revision = 0 if self._description is None else self._description.revision
        if isinstance(at, (int, np.integer)) and 0 <= at < _FIRST_STAMP:
            raise ValueError(
                f"captured_at is {at}, expected nanoseconds since 1970, such as time.time_ns(): by these it is of 1970 to 1973; "
                "is it in microseconds or seconds, or of a clock of its own?"
            )
        frame = DetectionFrame(at, listed, self.name, self.epoch, 0, sensor_pose, revision, map_frame)
        # What is refused here has no number: it would be missing at the hub.
        frame.check()
        with self._lock:
            sequence, self._sequence = self._sequence, self._sequence + 1
        frame = replace(frame, sequence=sequence)
        self.put(frame)
        return frame

    def put(self, frame: DetectionFrame) -> None:
        """Publishes a frame as it is. A number that is none is a `TypeError` or a `ValueError`, as in `publish`."""
        frame.check()
        self._frames.put(json.dumps(frame.to_json(), default=_plain))

    def close(self) -> None:
        """Leaves the network."""
        self._closed.set()
        if self._describer.is_alive():
            self._describer.join()
        super().close()


class _Mailbox:
    """What waits for the reader of a stream. The subscriber knows it alone, so that a stream nobody holds ends."""

    def __init__(self) -> None:
        self.waiting: deque[tuple[str, bytes]] = deque()
        self.arrived = threading.Condition()
        self.closed = False
        self.dropped = 0

    def push(self, key: str, payload: bytes) -> None:
        with self.arrived:
            if len(self.waiting) >= MAX_WAITING:
                self.waiting.popleft()
                self.dropped += 1
            self.waiting.append((key, payload))
            self.arrived.notify_all()

    def close(self) -> None:
        with self.arrived:
            self.closed = True
            self.arrived.notify_all()


class Stream(Generic[T]):
    """Messages as they arrive. Iterate over it, or call `next`. It ends with `close`, with the consumer, and when nobody holds
    it any more, as after `for frame in consumer.frames(): break`.

    What cannot be read is left out: it is counted in `unreadable`, and `last_error` says why.
    """

    def __init__(self, read: Callable[[str, dict[str, Any]], T | None], timeout: float | None) -> None:
        self._mailbox = _Mailbox()
        self._timeout = timeout
        self._read = read
        self._undeclare: Callable[[], Any] = lambda: None
        #: Messages that could not be read.
        self.unreadable = 0
        #: Why the last one of them could not be.
        self.last_error: str | None = None

    @property
    def dropped(self) -> int:
        """Messages that were dropped because they waited for too long."""
        return self._mailbox.dropped

    def _begin(self, subscriber: Any) -> None:
        """It is fed by this subscriber, which ends with it."""
        self._undeclare = weakref.finalize(self, _undeclare, subscriber)
        self._undeclare.atexit = False

    def wait_until_fed(self, timeout_s: float = 10.0) -> bool:
        """Waits for the first message, without taking it. False after `timeout_s`.

        A hub publishes JSON only while it knows of a subscriber; what it published before that is not repeated. A list comes
        ten times a second by default, with or without objects.
        """
        box = self._mailbox
        with box.arrived:
            return box.arrived.wait_for(lambda: bool(box.waiting) or box.closed, timeout_s) and not box.closed

    def next(self, timeout: float | None = None) -> T:
        """The next message. A `TimeoutError` after `timeout` seconds without one; `None`: however long it takes."""
        deadline = None if timeout is None else time.monotonic() + timeout
        box = self._mailbox
        while True:
            with box.arrived:
                while not box.waiting:
                    if box.closed:
                        raise EOFError("the stream is closed")
                    left = None if deadline is None else deadline - time.monotonic()
                    if left is not None and left <= 0 or not box.arrived.wait(left):
                        raise TimeoutError(f"no message in {timeout} s")
                key, payload = box.waiting.popleft()
            try:
                message = self._read(key, json.loads(payload))
            except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
                # Whoever may publish may publish anything: the next one is as good as without it.
                self.unreadable += 1
                self.last_error = f"{key}: {type(error).__name__}: {error}"
                continue
            if message is not None:
                return message

    def close(self) -> None:
        """Ends it."""
        self._mailbox.close()
        self._undeclare()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def __iter__(self) -> Iterator[T]:
        while True:
            try:
                yield self.next(self._timeout)
            except EOFError:
                return


class Consumer(_Client):
    """A consumer of a network. `hub` is the hub that it listens to; `*` are all."""

    def __init__(
        self,
        *,
        network: str = "demo",
        hub: str = "*",
        connect: str | Sequence[str] = DEFAULT_ENDPOINT,
        config: zenoh.Config | None = None,
        patience_s: float = 5.0,
    ) -> None:
        if hub != "*":
            _check_name("hub", hub)
        super().__init__(network, connect, config, patience_s)
        self.hub = hub
        self._streams: weakref.WeakSet[Stream[Any]] = weakref.WeakSet()

    def frames(self, timeout: float | None = None) -> Stream[FusedFrame]:
        """Every fused frame: the whole list, with the agents' health and what is new in it.

        Iterating ends in a `TimeoutError` where none comes for `timeout` seconds.
        """
        return self._stream("fused/json", lambda _, frame: FusedFrame.from_json(frame), timeout)

    def lagged(self, timeout: float | None = None) -> Stream[FusedFrame]:
        """Every frame of the second list, a lag behind, where the hub has one."""
        return self._stream("fused/lagged/json", lambda _, frame: FusedFrame.from_json(frame), timeout)

    def deltas(self, timeout: float | None = None) -> Stream[FusedFrame]:
        """The list by what changes, put together again: it costs a tenth of the traffic, within the tolerance of
        deploy/docs/wire.md, and names no agents and contributors."""
        followers: dict[str, DeltaFollower] = {}

        def read(_: str, message: dict[str, Any]) -> FusedFrame | None:
            return followers.setdefault(message["hub"], DeltaFollower()).handle(message)

        return self._stream("fused/delta/json", read, timeout)

    def area(self, quadkey: str, timeout: float | None = None) -> Stream[FusedFrame]:
        """The objects of an area: of the tile of this quadkey (digits 0 to 3), where the hub has tiles."""
        if not re.fullmatch(r"[0-3]{1,26}", quadkey):
            raise ValueError(f"quadkey is {quadkey!r}, expected 1 to 26 digits from 0 to 3")
        followers: dict[str, AreaFollower] = {}

        def read(key: str, message: dict[str, Any]) -> FusedFrame | None:
            return followers.setdefault(message["hub"], AreaFollower()).handle(key, message)

        return self._stream(f"fused/json/tile/{'/'.join(quadkey)}/**", read, timeout)

    def status(self, timeout_s: float = 2.0) -> dict[str, dict[str, Any]]:
        """The status of each hub that answers, as `v2x status` prints it, by the hub's name."""
        statuses: dict[str, dict[str, Any]] = {}
        for reply in self._session.get(self._key(f"hub/{self.hub}/status"), timeout=timeout_s):
            if reply.ok is not None:
                status: dict[str, Any] = json.loads(reply.ok.payload.to_bytes())
                name = str(reply.ok.key_expr).split("/")[3]
                # Nobody answers in the name of another hub; one that stands by adds its lineage to the name.
                if name.split("~")[0] == status.get("hub") and self.hub in ("*", status["hub"]):
                    statuses[name] = status
        return statuses

    def agents(self, timeout_s: float = 2.0) -> list[str]:
        """The names of the agents that are alive."""
        replies = self._session.liveliness().get(self._key("agent/*/alive"), timeout=timeout_s)
        return sorted(str(reply.ok.key_expr).split("/")[3] for reply in replies if reply.ok is not None)

    def _stream(
        self, key: str, read: Callable[[str, dict[str, Any]], T | None], timeout: float | None
    ) -> Stream[T]:
        stream = Stream(read, timeout)
        mailbox, hub = stream._mailbox, self.hub

        def push(sample: zenoh.Sample) -> None:
            # A put on a key with wildcards reaches subscribers of every hub.
            if hub != "*" and str(sample.key_expr).split("/")[3] != hub:
                return
            mailbox.push(str(sample.key_expr), sample.payload.to_bytes())

        stream._begin(self._session.declare_subscriber(self._key(f"hub/{self.hub}/{key}"), push))
        self._streams.add(stream)
        return stream

    def close(self) -> None:
        """Leaves the network, and ends its streams."""
        for stream in list(self._streams):
            stream.close()
        super().close()


def _undeclare(subscriber: Any) -> None:
    try:
        subscriber.undeclare()
    except zenoh.ZError:
        # The session was closed before it.
        pass


def _plain(value: Any) -> Any:
    """NumPy's numbers as those of JSON."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a {type(value).__name__} is no value of JSON")


def _check_name(what: str, name: str) -> None:
    if not _NAME.fullmatch(name):
        raise ValueError(f"{what} is {name!r}, expected 1 to 32 letters, digits, '-', '_', '.' and ':'")
