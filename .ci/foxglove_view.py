"""Reads a running network as Foxglove does: over its WebSocket, scenes and lists.

Usage: foxglove_view.py V2X, where V2X was built with --features foxglove. Needs the package websockets.
"""

import json
import re
import signal
import struct
import subprocess
import sys

from websockets.sync.client import connect

PATIENCE_S = 60
MESSAGE_DATA = 1  # the binary opcode: subscription (u32), time (u64), payload, all little endian


def started(command, until):
    """A process, and what its standard error said when it was ready."""
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    for line in process.stderr:
        if found := re.search(until, line):
            return process, found[1]
    raise AssertionError(f"{command} ended before it said {until}")


def advertised(socket, wanted):
    """The channels by topic, once all the wanted ones are there."""
    channels = {}
    while not all(any(topic.endswith(end) for topic in channels) for end in wanted):
        message = socket.recv(timeout=PATIENCE_S)
        if isinstance(message, str) and (message := json.loads(message))["op"] == "advertise":
            channels |= {each["topic"]: each for each in message["channels"]}
    return channels


def first_messages(socket, channels):
    """The first message of each channel."""
    wanted = dict(enumerate(channels))
    subscriptions = [{"id": place, "channelId": channel["id"]} for place, channel in wanted.items()]
    socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
    found = {}
    while len(found) < len(wanted):
        message = socket.recv(timeout=PATIENCE_S)
        if isinstance(message, bytes) and message[0] == MESSAGE_DATA:
            place, _ = struct.unpack_from("<IQ", message, 1)
            found[wanted[place]["topic"]] = json.loads(message[13:])
    return found


def main():
    v2x = sys.argv[1]
    network, endpoint = started([v2x, "up", "crossing", "--listen", "tcp/127.0.0.1:0"], r"(tcp/127\.0\.0\.1:\d+)")
    try:
        watch, address = started([v2x, "watch", "--foxglove", "0", "--connect", endpoint], r"(ws://\S+)")
        ends = ["fused/scene", "detections/scene", "/fused"]
        with connect(address, subprotocols=["foxglove.sdk.v1"], max_size=1 << 24) as socket:
            topics = advertised(socket, ends)
            channels = [next(each for topic, each in topics.items() if topic.endswith(end)) for end in ends]
            assert channels[0]["schemaName"] == "foxglove.SceneUpdate", channels[0]
            messages = first_messages(socket, channels)
        for channel in channels[:2]:
            entities = messages[channel["topic"]]["entities"]
            assert entities and {"timestamp", "frame_id", "cubes"} <= entities[0].keys(), entities
        assert "objects" in messages[channels[2]["topic"]]
        watch.send_signal(signal.SIGINT)
        assert watch.wait(PATIENCE_S) == 0, "watch did not end cleanly"
        print(f"ok: {len(topics)} channels; scenes and lists come over Foxglove's WebSocket")
    finally:
        network.send_signal(signal.SIGINT)
        assert network.wait(PATIENCE_S) == 0


main()
