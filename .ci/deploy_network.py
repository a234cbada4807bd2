"""The compose file's network as processes of this machine: its certificates, its commands with its volumes, a Zenoh router in between.

For `deploy_files.py`. A Python session in the mode "router" is in place of zenohd: both are Zenoh with the same configuration.
"""

import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

import zenoh

ROOT = pathlib.Path(__file__).resolve().parent.parent
TIMEOUT_S = 60


def check(report, v2x, compose):
    """Runs the network, and checks who may say what on it; what its hub's /metrics says."""
    exported = []
    with tempfile.TemporaryDirectory() as folder:
        network = Network(v2x, compose, pathlib.Path(folder))
        try:
            report.check("certificates of the compose file's network", network.prepare)
            report.check("Zenoh's configurations", network.load_configurations)
            report.check("the compose file's network, as processes", lambda: exported.append(network.run()))
            report.check("spoofing through the router", network.spoof)
            report.check("a standby behind the router", network.stand_by)
        finally:
            network.end()
    return exported[0] if exported else None


class Network:
    """A copy of the folders that the compose file names, and the processes of its services."""

    def __init__(self, v2x, compose, folder):
        self.v2x, self.services, self.folder = v2x, compose["services"], folder
        self.here = folder / "compose"
        self.processes, self.hub = [], None
        self.port, self.metrics = free_port(), free_port()

    def prepare(self):
        """As the compose file's head says."""
        for name in ("compose", "zenoh", "scenarios", "prometheus", "grafana"):
            shutil.copytree(ROOT / "deploy" / name, self.folder / name, ignore=shutil.ignore_patterns("certs", ".env"))
        for _ in range(2):
            environment = {**os.environ, "V2X": str(self.v2x)}
            command = ["bash", self.here / "prepare.sh", "127.0.0.1"]
            done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
            assert done.returncode == 0, done.stderr
        sources = [volume.split(":")[0] for service in self.services.values() for volume in service.get("volumes", [])]
        missing = [source for source in sources if source.startswith(".") and not (self.here / source).exists()]
        assert not missing, f"prepare.sh does not make {', '.join(missing)}"

    def load_configurations(self):
        """Zenoh takes the router's, the hub's, an agent's and a viewer's configuration."""
        certs = self.here / "certs"
        router = zenoh.Config.from_file(certs / "hub/router/router.json5")
        assert router.get_json("mode") == '"router"' and router.get_json("transport/link/tls/enable_mtls") == "true"
        assert router.get_json("access_control/default_permission") == '"deny"'
        assert zenoh.Config.from_file(certs / "viewer/hub-link/hub.json5").get_json("listen/endpoints") == "[]"
        for path in ("agent/ego", "agent/rsu", "viewer/screen"):
            assert "tls/router:7447" in zenoh.Config.from_file(certs / path / "zenoh.json5").get_json("connect/endpoints")
        plain = zenoh.Config.from_file(self.folder / "zenoh/router-plain.json5")
        assert plain.get_json("listen/endpoints") == '["tcp/127.0.0.1:7447"]'

    def run(self):
        """The router and the services of our image, until a viewer has lists of both agents; what the hub's /metrics says."""
        self.start_router()
        # Container's addresses are those of this machine here, and a recording shows its metrics, too.
        record = ["--record", str(self.folder / "run.mcap")]
        for name, others in {"hub": record, "ego": [], "rsu": []}.items():
            words = self.command(name)
            if name == "hub":
                words[words.index("--metrics") + 1] = f"127.0.0.1:{self.metrics}"
            started = self.start([self.v2x, *words, "--connect", f"tls/127.0.0.1:{self.port}", *others])
            self.hub = started if name == "hub" else self.hub
        screen = self.host_path("screen", "/etc/v2x/viewer/zenoh.json5")
        place = ["--zenoh-config", screen, "--connect", f"tls/127.0.0.1:{self.port}"]
        self.tool(["watch", "--json", "--count", "10", *place])
        deadline = time.monotonic() + TIMEOUT_S
        while (answer := self.ask("/healthz"))[0] != 200:
            assert time.monotonic() < deadline, f"/healthz: {answer}"
            time.sleep(0.2)
        for path in ("/livez", "/readyz"):
            assert self.ask(path)[0] == 200, f"{path}: {self.ask(path)}"
        status = json.loads(self.tool(["status", "--json", *place]))
        alive = {agent["id"] for agent in status["agents"] if agent["alive"]}
        assert alive == {"ego", "rsu"}, f"alive: {alive}"
        return self.ask("/metrics")[1]

    def spoof(self):
        """Through the router an agent speaks for itself only, and the hub's certificate for the hub only."""
        certs, seen = self.here / "certs", set()
        key = "v2x/spoof/{}"
        with self.session(certs / "viewer/screen") as screen:
            subscriber = screen.declare_subscriber(key.format("**"), lambda sample: seen.add(str(sample.key_expr)))
            agent, hub = certs / "agent/ego", certs / "viewer/hub-link"
            own = {agent: "agent/ego/detections", hub: "hub/hub/fused"}
            foreign = {
                certs / "viewer/screen": ["agent/rsu/detections", "hub/other/fused"],
                agent: ["agent/rsu/detections", "hub/other/fused", "hub/hub/status"],
                hub: ["agent/rsu/detections", "hub/other/fused"],
            }
            for folder, rests in foreign.items():
                with self.session(folder) as session:
                    deadline = time.monotonic() + TIMEOUT_S
                    for rest in rests:
                        session.put(key.format(rest), b"{}")
                    # What it may say comes after, on the same link: what was to come before has come, or never will.
                    while folder in own and key.format(own[folder]) not in seen:
                        assert time.monotonic() < deadline, f"{own[folder]} did not arrive"
                        session.put(key.format(own[folder]), b"{}")
                        time.sleep(0.1)
            subscriber.undeclare()
        expected = {key.format(rest) for rest in own.values()}
        assert seen == expected, f"arrived: {sorted(seen)}"

    def stand_by(self):
        """A second hub with the same certificate is seen as one that stands by, and takes over when the first one is gone."""
        words = self.command("hub")
        words[words.index("--metrics") + 1] = "127.0.0.1:0"
        place = ["--connect", f"tls/127.0.0.1:{self.port}"]
        self.start([self.v2x, *words, "--standby", *place])
        place += ["--zenoh-config", self.host_path("screen", "/etc/v2x/viewer/zenoh.json5")]

        # Of this hub alone: its own keys are asked, and not those of all hubs.
        place += ["--hub", words[words.index("--id") + 1] if "--id" in words else "hub"]

        def statuses():
            decoder, text = json.JSONDecoder(), self.tool(["status", "--json", *place]).lstrip()
            while text:
                status, end = decoder.raw_decode(text)
                yield status
                text = text[end:].lstrip()

        def until(what, found):
            deadline = time.monotonic() + TIMEOUT_S
            while not (status := next(filter(found, seen := list(statuses())), None)):
                assert time.monotonic() < deadline, f"{what}: {[(one['lineage'], one.get('standby')) for one in seen]}"
                time.sleep(0.2)
            return status

        follows = until("no standby", lambda one: one.get("standby") and one["standby"]["follows"] is not None and one["objects"] > 0)
        self.hub.kill()
        until("no takeover", lambda one: one["lineage"] == follows["lineage"] and one["standby"]["publishes"])
        lists = [json.loads(line) for line in self.tool(["watch", "--json", "--count", "5", *place]).splitlines()]
        assert {one["lineage"] for one in lists} == {follows["lineage"]}, "another hub's lists"

    def session(self, folder):
        """A client by the certificate of a folder. Zenoh looks for its files in the working folder."""
        config = zenoh.Config.from_file(folder / "zenoh.json5")
        config.insert_json5("connect/endpoints", json.dumps([f"tls/127.0.0.1:{self.port}"]))
        before = pathlib.Path.cwd()
        os.chdir(folder)
        try:
            return zenoh.open(config)
        finally:
            os.chdir(before)

    def start_router(self):
        """Its own configuration, on a free port."""
        service = self.services["router"]
        folder = self.here / service["volumes"][0].split(":")[0]
        path = folder / service["command"][1]
        config = json.loads(path.read_text())
        config["listen"]["endpoints"] = [f"tls/127.0.0.1:{self.port}"]
        path.write_text(json.dumps(config))
        router = self.start([sys.executable, __file__, path.name], cwd=folder, stdout=subprocess.PIPE)
        assert router.stdout.readline() == "open\n", "the router did not start"

    def host_path(self, name, inside):
        """Where a file of a service is on this machine, by its volumes."""
        for volume in self.services[name]["volumes"]:
            source, place, *_ = volume.split(":")
            if inside == place or inside.startswith(f"{place}/"):
                return str((self.here / source).resolve()) + inside[len(place):]
        raise AssertionError(f"{name}: no volume holds {inside}")

    def command(self, name):
        words = [str(word) for word in self.services[name]["command"]]
        return [self.host_path(name, word) if word.startswith("/etc/") else word for word in words]

    def start(self, command, **options):
        log = (self.folder / f"{len(self.processes)}.log").open("w")
        options = {"stdin": subprocess.DEVNULL, "stdout": log, "stderr": log, "text": True, **options}
        self.processes.append(subprocess.Popen(command, **options))
        return self.processes[-1]

    def tool(self, words):
        """Runs a tool to its end; what it printed."""
        done = subprocess.run([self.v2x, *words], capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        logs = "".join(path.read_text() for path in sorted(self.folder.glob("*.log")))
        assert done.returncode == 0, f"v2x {words[0]}: exit code {done.returncode}\n{done.stderr}\n{logs}"
        return done.stdout

    def ask(self, path):
        """The answer of the hub's HTTP, status and text; status 0 where nobody answers."""
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.metrics}{path}", timeout=5) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()
        except OSError as error:
            return 0, str(error)

    def end(self):
        for process in reversed(self.processes):
            process.terminate()
        for process in self.processes:
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def router(path):
    """A router by a configuration, until it is terminated."""
    session = zenoh.open(zenoh.Config.from_file(path))
    print("open", flush=True)
    while not session.is_closed():
        time.sleep(1)


if __name__ == "__main__":
    router(sys.argv[1])
