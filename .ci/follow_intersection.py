"""Follows "Try all of it on one machine" of the guide of an intersection, word for word: with TLS, real processes, and its ports.

Usage: follow_intersection.py BIN, where BIN is the folder with the built programs. Needs `pip install eclipse-zenoh`.

Each command of the section is run in its order (an installed program is the built one); what the text says of it must be so. A
command for which there is no rule here is a failure.
"""

import contextlib
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parent.parent
GUIDE = ROOT / "deploy/docs/intersection.md"
TIMEOUT_S = 60
HEALTH = "http://127.0.0.1:9464/healthz"
VIEW = "http://127.0.0.1:8088/"


def commands():
    """The commands of the section, each in one line."""
    section = GUIDE.read_text().split("\n## Try all of it on one machine\n")[1].split("\n## ")[0]
    for block in re.findall(r"^ *```console\n(.*?)^ *```", section, re.MULTILINE | re.DOTALL):
        for line in block.splitlines():
            yield line.strip().removeprefix("$ ")


def wait(what, condition):
    """Until something is so; what it is then."""
    end = time.monotonic() + TIMEOUT_S
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.2)
    raise AssertionError(f"not within {TIMEOUT_S} s: {what}")


def answer(address):
    """Status and body, or None where nobody answers."""
    try:
        with urllib.request.urlopen(address, timeout=5) as reply:
            return reply.status, reply.read().decode()
    except urllib.error.HTTPError as refusal:
        return refusal.code, refusal.read().decode()
    except OSError:
        return None


class Follower:
    """A reader of the guide with several terminals."""

    def __init__(self, binaries, folder):
        self.folder = folder
        path = [binaries.resolve(), pathlib.Path(sys.executable).parent, os.environ["PATH"]]
        self.environment = {**os.environ, "PATH": ":".join(map(str, path)), "NO_COLOR": "1"}
        self.terminals, self.hub = {}, None
        (folder / "deploy").symlink_to(ROOT / "deploy")

    def run(self, command, code=0):
        """Runs a command to its end; what it printed."""
        options = {"capture_output": True, "text": True, "timeout": TIMEOUT_S, "cwd": self.folder, "env": self.environment}
        done = subprocess.run(command, shell=True, check=False, **options)
        assert done.returncode == code, f"{command}: exit code {done.returncode}, not {code}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def start(self, command):
        """Runs a command in a terminal of its own, in place of the same one before."""
        self.end(command)
        log = open(self.folder / f"terminal-{len(self.terminals)}.log", "a+")
        options = {"cwd": self.folder, "env": self.environment, "start_new_session": True}
        self.terminals[command] = subprocess.Popen(f"exec {command}", shell=True, stdout=log, stderr=log, **options), log

    def end(self, command):
        """Ctrl-C in a terminal, where that is open."""
        if command not in self.terminals:
            return ""
        process, log = self.terminals.pop(command)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGINT)
        process.wait(timeout=TIMEOUT_S)
        log.seek(0)
        return log.read()

    def until(self, command, text):
        """Runs a command again until it prints something."""
        printed = []

        def is_there():
            printed.append(self.run(f"{command} || true"))
            return re.search(text, printed[-1])

        try:
            return wait(f"{command}: {text}", is_there)
        except AssertionError as error:
            raise AssertionError(f"{error}\n{printed[-1]}") from error

    # What the section says of its commands, in its order.

    def start_hub(self, command):
        self.hub = command
        self.start(command)
        wait("the hub is ready", lambda: (self.folder / "ready.json").exists())

    def watch(self, command):
        self.start(command)
        path = self.folder / f"terminal-{len(self.terminals) - 1}.log"
        wait("a list in the table", lambda: "car" in path.read_text())
        self.end(command)

    def look_at_the_map(self, command):
        self.start(command)
        status, page = wait("the live view", lambda: answer(VIEW))
        assert status == 200 and "<canvas" in page, page[:200]
        self.end(command)

    def check(self, command):
        # Cameras that have only just come are judged when there is enough of them.
        wait("the hub is healthy", lambda: (answer(HEALTH) or (0,))[0] == 200)
        # A machine that does other things beside may be slow for a moment, which is a finding, too.
        self.until(command, "(?m)^healthy")

    def ask_health(self, command):
        self.run(command)
        self.break_a_convention()

    def break_a_convention(self):
        """The first bullet, which has no commands of its own."""
        settings = self.folder / "hub.toml"
        whole = settings.read_text()
        without = re.sub(r"^yaw = .*\n", "", whole, count=1, flags=re.MULTILINE)
        assert without != whole, "hub.toml has no line `yaw = …` of cam1"
        settings.write_text(without)
        self.start_hub(self.hub)
        wait("/healthz answers 503", lambda: (answer(HEALTH) or (0,))[0] == 503 and "cam1" in answer(HEALTH)[1])
        said = self.run("v2x check --zenoh-config certs/viewer/screen/zenoh.json5", code=1)
        assert re.search(r"cam1.*degrees", said) and 'yaw = { unit = "deg"' in said, said
        settings.write_text(whole)
        self.start_hub(self.hub)
        # It must have been there to be gone.
        self.until("v2x status --zenoh-config certs/viewer/screen/zenoh.json5", r"(?m)^cam2")
        cam2 = next(command for command in self.terminals if "camera.py cam2" in command)
        self.end(cam2)
        # The list `only_agents` names it: that it is gone is a fault.
        gone = r"(?ms)^cam2 +no.*^FAULT +cam2: `only_agents` names it"
        self.until("v2x status --zenoh-config certs/viewer/screen/zenoh.json5", gone)

    def status_after(self, before):
        expected = {"intruder": r"(?i)cam1.*(denied|may not)|(denied|refused).*cam1", "revoked": r"(?m)^cam2 +no"}[before]
        return lambda command: self.until(command, expected)

    def record(self, command):
        self.run(command)

    def retrack(self, command):
        said = self.run(command.replace("cargo lab", "lab"))
        assert "identical" in said, said

    def rules(self):
        """Of each command its beginning, and what a reader does with it."""
        return [
            ("cargo install", lambda _: None),
            ("v2x certs init", self.run), ("v2x certs agent cam1", self.run), ("v2x certs agent cam2", self.run),
            ("v2x certs viewer screen", self.run), ("v2x certs list", self.run),
            ("cp ", self.run), ("v2x hub", self.start_hub),
            ("python3 deploy/examples/intersection/camera.py cam1", self.start),
            ("python3 deploy/examples/intersection/camera.py cam2", self.start),
            ("v2x watch", self.watch), ("v2x watch", self.look_at_the_map), ("v2x check", self.check), ("curl", self.ask_health),
            ("python3 deploy/examples/intersection/camera.py cam2 certs/agent/cam1 10", self.start),
            ("v2x status", self.status_after("intruder")),
            ("python3 deploy/examples/intersection/camera.py cam2", self.start),
            ("v2x certs revoke cam2", self.run), ("v2x status", self.status_after("revoked")),
            ("v2x certs agent cam2", self.run), ("python3 deploy/examples/intersection/camera.py cam2", self.start),
            ("v2x record", self.record), ("cargo lab retrack", self.retrack),
        ]

    def follow(self):
        """The whole section."""
        rules = self.rules()
        for command in commands():
            assert rules and command.startswith(rules[0][0]), f"no rule for {command}: give .ci/follow_intersection.py one"
            print(f"$ {command}", flush=True)
            rules.pop(0)[1](command)
        assert not rules, f"the guide has no command {rules[0][0]} any more"


def main():
    # A shell's background job ignores Ctrl-C, and so would all that is started here.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with tempfile.TemporaryDirectory() as folder:
        follower = Follower(pathlib.Path(sys.argv[1]), pathlib.Path(folder))
        begin = time.monotonic()
        try:
            follower.follow()
        finally:
            for command in list(follower.terminals):
                print(f"== {command}\n{follower.end(command)[-1500:]}", file=sys.stderr)
    print(f"the guide's first section was followed in {time.monotonic() - begin:.0f} s")


main()
