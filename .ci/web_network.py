"""The processes that the test of the live view watches: a hub, agents, a view, and another consumer."""

import json
import pathlib
import queue
import re
import socket
import subprocess
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENARIO = ROOT / "deploy/scenarios/crossing.toml"
PATIENCE_S = 60


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Network:
    """A hub, two agents and a view, each a process that can be ended alone."""

    def __init__(self, v2x, folder):
        self.v2x, self.folder = v2x, folder
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.processes = {}
        self.url = self.start_view()

    def start(self, name, *words, **options):
        log = open(self.folder / f"{name}.log", "a")
        self.processes[name] = subprocess.Popen([self.v2x, *words], stderr=log, cwd=self.folder, **options)
        log.close()
        return self.processes[name]

    def start_view(self):
        self.start("view", "watch", "--web", "0", "--connect", self.endpoint, "--scenario", str(SCENARIO))
        return self.logged("view", r"http://\S+")

    def logged(self, name, pattern):
        """Waits for a text in a process's log."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            if found := re.search(pattern, (self.folder / f"{name}.log").read_text()):
                return found[0]
            assert self.processes[name].poll() is None, f"{name} ended: {(self.folder / f'{name}.log').read_text()}"
            time.sleep(0.02)
        raise AssertionError(f"{name} did not print {pattern}")

    def start_hub(self, name="hub", *more):
        self.start(name, "hub", "--listen", self.endpoint, "--config", str(SCENARIO), *more)

    def start_agents(self):
        for agent in ("ego", "rsu"):
            self.start_agent(agent)

    def start_agent(self, agent):
        self.start(agent, "agent", "--scenario", str(SCENARIO), "--id", agent, "--connect", self.endpoint)

    def end(self, name, has_to_succeed=True):
        process = self.processes.pop(name)
        process.terminate()
        code = process.wait(timeout=PATIENCE_S)
        assert code == 0 or not has_to_succeed, f"{name}: exit code {code}\n{(self.folder / f'{name}.log').read_text()}"

    def kill(self, name):
        process = self.processes.pop(name)
        process.kill()
        process.wait()

    def end_all(self):
        for name in list(self.processes):
            self.end(name, has_to_succeed=False)


class Published:
    """The fused frames as another consumer gets them."""

    def __init__(self, network):
        words = ["watch", "--json", "--connect", network.endpoint]
        self.process = network.start(f"watch-{free_port()}", *words, stdout=subprocess.PIPE, text=True)
        self.frames, self.arrived = {}, queue.Queue()
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            self.arrived.put(json.loads(line))

    def frame(self, lineage, sequence):
        """The frame of a number; None where it came before the first one here."""
        newest = (0, 0)
        while (lineage, sequence) not in self.frames and newest <= (lineage, sequence):
            frame = self.arrived.get(timeout=PATIENCE_S)
            newest = int(frame["lineage"]), int(frame["sequence"])
            self.frames[newest] = frame
        return self.frames.get((lineage, sequence))
