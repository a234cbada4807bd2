"""Runs the commands that the documents show.

Usage: readme.py BIN, where BIN is the folder with the built programs, such as target/debug.

Every line `$ …` of a block ```console is checked. The quick ones are run, with shorter durations. Of the others every
option and value is checked: by `--help` behind them, which is read after them. Files and packages that they name must be
there. Of the README's example output the words are compared with the output of the demo.
"""

import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = ["README.md", "CONTRIBUTING.md", "deploy/links/README.md", "deploy/python/README.md"]
DOCUMENTS = [*[ROOT / page for page in PAGES], *sorted((ROOT / "deploy/docs").glob("*.md"))]
TIMEOUT_S = 300
# Programs of a system or of others, which are not run: the files of this repository that they are given must be there.
SYSTEM = {
    "apt-get", "cd", "chronyc", "docker", "gpg", "install", "journalctl", "kubectl", "mv", "nft", "scp", "systemctl",
    "seq", "systemd-sysusers", "tar", "xargs", "zenohd",
}


def console_lines(document):
    """The commands of a document, each in one line, without prompt and comment."""
    for block in re.findall(r"^```console\n(.*?)^```", document.read_text(), re.MULTILINE | re.DOTALL):
        for command in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            yield command.strip()


def stages(command):
    """The programs of a pipeline, each as its words; `&` at the end is left out."""
    lexer = shlex.shlex(command, posix=True, punctuation_chars="|&")
    lexer.whitespace_split = True
    stage, found = [], []
    for word in lexer:
        if word == "|":
            found, stage = [*found, stage], []
        elif word != "&":
            stage.append(word)
    return [*found, stage]


class Failure(Exception):
    """A command of a document that does not work."""


class Checker:
    """Knows the built programs, and what has been run already."""

    def __init__(self, binaries, folder):
        self.binaries, self.folder = binaries.resolve(), folder
        # Commands run in a folder of their own, and find the repository's files as in its root.
        (folder / "deploy").symlink_to(ROOT / "deploy")
        self.packages = packages()
        self.outputs = {}
        self.network = None

    def check(self, command):
        """Runs or reads one command; says which."""
        first, *others = stages(command)
        for other in others:
            self.check_other(other)
        words = self.ours(first)
        if words is None:
            return self.check_other(first)
        shorter = self.shortened(words)
        if shorter is None:
            self.run([*words, "--help"])
            return "read"
        self.run(shorter)
        return "run"

    def ours(self, words):
        """A command with the built program in place of its alias; None where it is not one of ours."""
        aliases = {"demo": ["v2x", "demo"], "v2x": ["v2x"], "lab": ["lab"]}
        if words[0] == "cargo" and words[1] in aliases:
            words = [*aliases[words[1]], *words[2:]]
        if words[0] == "cargo" and words[1] == "run" and "--example" in words:
            example = words[words.index("--example") + 1]
            words = [f"examples/{example}", *words[words.index("--") + 1:]]
        known = words[0] in ("v2x", "lab") or words[0].startswith("examples/")
        return [str(self.binaries / words[0]), *words[1:]] if known else None

    def shortened(self, words):
        """What is run in place of a command; None where it takes too long or needs what is not here."""
        command, rest = words[1] if len(words) > 1 else "", words[2:]
        if "--web" in rest:
            # It ends with Ctrl-C only: .ci/web_view.py tests it.
            return None
        if command == "demo":
            return replaced(words, "--duration", "4s")
        if command == "simulate":
            # An agent that rides on a recorded object may begin seconds after the others.
            return replaced(words, "--duration", "12s")
        if command in ("world", "scenario") and self.needs_what_is_not_here(rest):
            return None
        if command == "world":
            return words
        if command == "scenario":
            return [*words, "--force"]
        if command == "links":
            # The whole list takes a minute of an unoptimised program.
            return [*words, "lte-uu"] if not rest else words
        if words[0].endswith("lab") and words[1:] == ["sweep", "latency"]:
            return [words[0], "sweep", "latency=0,100", "--seeds", "1", "--duration", "6s", "--methods", "replay,ours"]
        if command == "retrack":
            # Of a recording that an earlier command of the document made.
            return words if (self.folder / rest[0]).exists() else None
        # A place or certificates of its own: there is no such hub here.
        if "--listen" in rest or "--zenoh-config" in rest:
            return None
        if command in ("watch", "status", "check", "record") and "--connect" not in rest:
            ending = {"watch": ["--count", "5"], "record": ["--count", "20", "--force"]}.get(command, [])
            return [*words, *ending, "--connect", self.endpoint(words[0])]
        return None

    def needs_what_is_not_here(self, words):
        """nuScenes' data set, or SUMO: not everybody's CI has them."""
        return any(word.startswith("nuscenes/") for word in words) or (
            any(word.startswith("sumo:") for word in words) and not (shutil.which("sumo") or os.environ.get("SUMO_HOME")))

    def endpoint(self, v2x):
        """The hub of a network that is started for the first command that needs one."""
        if self.network is None:
            command = [v2x, "up", "crossing", "--listen", "tcp/127.0.0.1:0"]
            self.network = subprocess.Popen(command, cwd=self.folder, stderr=subprocess.PIPE, text=True)
            line = self.network.stderr.readline()
            self.hub = re.search(r"tcp/\S+?(?=,|$)", line)[0]
        return self.hub

    def check_other(self, words):
        """Programs of others: the files and packages that they are given must be there."""
        if words[0] == "sudo":
            words = words[1:]
        if words[0] in SYSTEM or (words[0] == "cp" and words[1].startswith("-")):
            missing = [word for word in words if word.startswith(("deploy/", ".ci/")) and not (ROOT / word).exists()]
            if missing:
                raise Failure(f"no file {', '.join(missing)}")
        elif words[0] == "jq":
            self.run(["jq", words[1]] if "jq" in words[0] else words, stdin="")
        elif words[0].endswith("netem.sh"):
            self.run([str(ROOT / words[0]), *([] if words[1] == "--dry-run" else ["--dry-run"]), *words[1:]])
            if words[1] in ("hub", "agent") and (ours := self.ours(words[2:])):
                self.run([*ours, "--help"])
        elif words[0] == "printf":
            pass
        elif words[0] == "curl":
            # What a hub of the document's own would answer; deploy/it/monitoring.rs asks one.
            if not all(re.fullmatch(r"http://127\.0\.0\.1:9464/(metrics|healthz|readyz|livez)", word) for word in words if "://" in word):
                raise Failure(f"nothing of ours answers {' '.join(words)}")
        elif words[0] == "cargo":
            self.check_cargo(words[1:])
        elif words[0] in ("cp", "bash", "python3"):
            if not (ROOT / words[1]).exists():
                raise Failure(f"no file {words[1]}")
            if words[0] == "cp":
                (self.folder / words[2]).write_text((ROOT / words[1]).read_text())
        elif words[0] in ("pip", "maturin", "pytest"):
            # `./deploy/python[client]` is the folder with extras.
            for path, _, extras in (word.partition("[") for word in words if "deploy/" in word):
                if not (ROOT / path).exists():
                    raise Failure(f"no file {path}")
                if extras:
                    table = (ROOT / path / "pyproject.toml").read_text().partition("[project.optional-dependencies]")[2].partition("\n[")[0]
                    known = re.findall(r"^([\w-]+) =", table, re.MULTILINE)
                    if unknown := set(extras.rstrip("]").split(",")) - set(known):
                        raise Failure(f"{path} has no extras {', '.join(sorted(unknown))}")
        else:
            raise Failure(f"no rule for {words[0]}: give .ci/readme.py one")
        return "read"

    def check_cargo(self, words):
        """Its packages and targets must be there."""
        for flag, word in zip(words, words[1:]):
            if flag in ("-p", "--package") and word not in self.packages:
                raise Failure(f"no package {word}")
            if flag in ("--test", "--bench", "--example") and not any(word in names for names in self.packages.values()):
                raise Failure(f"no target {word}")
            if flag in ("--path", "--fuzz-dir") and not (ROOT / word / "Cargo.toml").exists():
                raise Failure(f"no package in {word}")

    def run(self, words, stdin=None):
        """Runs a program to its end, once for the same words."""
        key = (*words, stdin)
        if key in self.outputs:
            return
        options = {"capture_output": True, "text": True, "timeout": TIMEOUT_S, "cwd": self.folder}
        done = subprocess.run(words, input=stdin, check=False, **options)
        if done.returncode != 0:
            raise Failure(f"{shlex.join(words)}: exit code {done.returncode}\n{done.stderr}")
        self.outputs[key] = done.stdout

    def end(self):
        """Ends the network."""
        if self.network is not None:
            self.network.terminate()
            _, said = self.network.communicate(timeout=TIMEOUT_S)
            assert self.network.returncode == 0, f"v2x up: exit code {self.network.returncode}\n{said}"


def replaced(words, flag, value):
    """The words with another value of a flag."""
    if flag in words:
        at = words.index(flag)
        words = words[:at] + words[at + 2:]
    return [*words, flag, value]


def packages():
    """The names of all targets by package."""
    command = ["cargo", "metadata", "--no-deps", "--format-version", "1", "--offline"]
    metadata = json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout)
    return {package["name"]: {target["name"] for target in package["targets"]} for package in metadata["packages"]}


def shape(text):
    """The words of an output, with one sign for each number."""
    lines = (re.sub(r"\d+(\.\d+)?", "#", line).split() for line in text.splitlines())
    return [" ".join(words) for words in lines if words]


def check_example_output(checker):
    """The README's example is what the demo prints, but for the numbers."""
    example = re.search(r"^```text\n(.*?)^```", (ROOT / "README.md").read_text(), re.MULTILINE | re.DOTALL)[1]
    command = (str(checker.binaries / "v2x"), "demo", "--duration", "4s", None)
    printed = checker.outputs[command]
    if shape(example) != shape(printed):
        raise Failure(f"the README's example output is not what the demo prints:\n{printed}")


def main():
    with tempfile.TemporaryDirectory() as folder:
        checker = Checker(pathlib.Path(sys.argv[1]), pathlib.Path(folder))
        failures, counts = [], {"run": 0, "read": 0}

        def attempt(place, action):
            try:
                counts[action() or "read"] += 1
            except (Failure, subprocess.TimeoutExpired) as failure:
                failures.append(f"{place}: {failure}")

        for document in DOCUMENTS:
            for command in console_lines(document):
                place = f"{document.relative_to(ROOT)}: {command}"
                attempt(place, lambda command=command: checker.check(command))
        attempt("README.md", lambda: check_example_output(checker))
        try:
            checker.check("v2x watch --no-such-option")
            failures.append("an option that no command has was not noticed")
        except Failure:
            pass
        checker.end()
    for failure in failures:
        print(failure, file=sys.stderr)
    print(f"{counts['run']} commands of the documents were run, {counts['read']} read, {len(failures)} do not work")
    sys.exit(bool(failures))


main()
