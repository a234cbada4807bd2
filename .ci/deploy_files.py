"""Checks the files by which a network is deployed, as far as that can be without an engine of containers or a cluster.

Usage: deploy_files.py BIN [EXPOSITION], where BIN is the folder with the built programs, such as target/debug, and EXPOSITION a
file with what a hub's /metrics says; without it that is asked of a hub which is started.

Everything parses; command lines of v2x are read by v2x itself; dashboard and alerts use names that a hub exports; manifests
obey Kubernetes' schemas, and unit files systemd's checker; Zenoh loads its configurations; the compose file's network runs, with TLS, as
processes of this machine. What cannot be checked here is printed as NOT CHECKED. It needs `pip install pyyaml eclipse-zenoh`, and
takes further: pip's kubernetes-validate, and promtool, hadolint, systemd-analyze, kubectl, docker compose, shellcheck from the path.
"""

import json
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

import deploy_network
import yaml

ROOT = pathlib.Path(__file__).resolve().parent.parent
DEPLOY = ROOT / "deploy"
IMAGE = "v2x"
PROGRAM = "/usr/local/bin/v2x"
# The worst exposure that a unit may have, by `systemd-analyze security`: 0 is none, 10 all.
EXPOSURE = 2.5
TIMEOUT_S = 60


class Report:
    """What was checked, what failed, and what could not be checked."""

    def __init__(self):
        self.passed, self.failures, self.unchecked = 0, [], []

    def check(self, what, action):
        """Runs one check; a check fails by an exception."""
        try:
            action()
            self.passed += 1
        except (AssertionError, subprocess.SubprocessError, ValueError, KeyError, OSError, yaml.YAMLError) as failure:
            self.failures.append(f"{what}: {failure}")

    def not_checked(self, what):
        self.unchecked.append(what)

    def by_tool(self, tool, what, command):
        """A check by a program of others, where it is installed."""
        if shutil.which(tool) is None:
            return self.not_checked(f"{what}: {tool} is not installed")
        self.check(what, lambda: run(command))


def run(command, **options):
    """Runs a program to its end; what it printed."""
    options = {"capture_output": True, "text": True, "timeout": TIMEOUT_S, "check": False, **options}
    done = subprocess.run([str(word) for word in command], **options)
    assert done.returncode == 0, f"{shlex.join(map(str, command))}: exit code {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


def named(path):
    return str(path.relative_to(ROOT))


def documents(path):
    """What a YAML file holds."""
    return [document for document in yaml.safe_load_all(path.read_text()) if document is not None]


def check_syntax(report):
    """YAML and JSON parse; scripts are shell."""
    for path in sorted([*DEPLOY.rglob("*.yml"), *DEPLOY.rglob("*.yaml"), *(ROOT / ".github").rglob("*.yml")]):
        report.check(named(path), lambda path=path: documents(path))
    report.check("deploy/grafana/hub.json", lambda: json.loads((DEPLOY / "grafana/hub.json").read_text()))
    scripts = sorted(path for path in DEPLOY.rglob("*.sh") if "target" not in path.parts)
    for path in scripts:
        report.check(named(path), lambda path=path: run(["bash", "-n", path]))
    report.by_tool("shellcheck", "scripts by shellcheck", ["shellcheck", "--severity=warning", *scripts])


def container_file():
    """The instructions of the container file: each with its text, without comments, on one line."""
    lines = [line for line in (DEPLOY / "container/Containerfile").read_text().splitlines() if not line.startswith("#")]
    text = re.sub(r"\\\n", " ", "\n".join(lines))
    return [tuple(line.split(maxsplit=1)) for line in text.splitlines() if line.strip()]


def check_container(report):
    """The image is small, not root's, and of the compiler that everything else is built with."""
    instructions = container_file()

    def last(name):
        return [text for instruction, text in instructions if instruction == name][-1]

    def shape():
        known = {"ARG", "FROM", "RUN", "WORKDIR", "COPY", "ENV", "SHELL", "LABEL", "USER", "EXPOSE", "HEALTHCHECK", "ENTRYPOINT", "CMD"}
        assert {instruction for instruction, _ in instructions} <= known, "an instruction that is not known here"
        assert last("FROM") == "scratch", "the last stage has more than the program"
        assert re.fullmatch(r"[1-9]\d*:[1-9]\d*", last("USER")), "root runs it, or a user that Kubernetes cannot distinguish from root"
        toolchain = re.search(r'channel = "(.+)"', (ROOT / "rust-toolchain.toml").read_text())[1]
        assert f"RUST={toolchain}" in [text for instruction, text in instructions if instruction == "ARG"], f"not {toolchain}"
        assert "org.opencontainers.image.licenses" in last("LABEL") and "/livez" in last("HEALTHCHECK")

    report.check("container file", shape)
    report.by_tool("hadolint", "container file by hadolint", ["hadolint", DEPLOY / "container/Containerfile"])
    report.not_checked("container file by a build: the images that it begins with are not here")


def compose():
    return documents(DEPLOY / "compose/compose.yaml")[0]


def is_ours(service):
    return service["image"] == IMAGE


def check_compose(report):
    """Every service is confined, and every name in the file is declared."""
    file = compose()

    def confined(name, service):
        assert service.get("read_only") is True, "its root filesystem can be written"
        assert service.get("cap_drop") == ["ALL"] and not service.get("cap_add"), "it has capabilities"
        assert "no-new-privileges:true" in service["security_opt"], "it can get privileges"
        assert service.get("user", "0").split(":")[0] != "0", "root runs it"
        assert set(service["networks"]) <= set(file["networks"]), "a network that is not declared"
        for volume in service.get("volumes", []):
            source, _, *mode = volume.split(":")
            assert source in file["volumes"] or mode == ["ro"], f"{volume} can be written"
        assert is_ours(service) or re.search(r":v?\d+\.\d+\.\d+$", service["image"]), f"{service['image']} is no version"
        assert set(service.get("depends_on", [])) <= set(file["services"]), f"{name} waits for nobody"

    for name, service in file["services"].items():
        report.check(f"compose file, {name}", lambda name=name, service=service: confined(name, service))
    has_docker = shutil.which("docker") is not None
    if has_docker and subprocess.run(["docker", "compose", "version"], capture_output=True, check=False).returncode == 0:
        command = ["docker", "compose", "--file", DEPLOY / "compose/compose.yaml", "config", "--quiet"]
        report.check("compose file by docker compose", lambda: run(command, env={"GRAFANA_PASSWORD": "x", "PATH": "/usr/bin:/bin"}))
    else:
        report.not_checked("compose file by docker compose: it is not installed")


def command_lines():
    """The command lines of v2x in files for other programs, each with its place."""
    instructions = dict(container_file())
    yield "container file", [*json.loads(instructions["ENTRYPOINT"])[1:], *json.loads(instructions["CMD"])]
    for name, service in compose()["services"].items():
        if is_ours(service):
            yield f"compose file, {name}", [str(word) for word in service["command"]]
    for path in sorted((DEPLOY / "kubernetes").glob("*.yaml")):
        for document in documents(path):
            for container in document.get("spec", {}).get("template", {}).get("spec", {}).get("containers", []):
                yield f"{named(path)}, {document['metadata']['name']}", container["args"]
    for path in sorted((DEPLOY / "systemd").glob("*.service")):
        for line in re.findall(rf"^ExecStart={PROGRAM} (.*)$", path.read_text(), re.MULTILINE):
            yield named(path), shlex.split(line.replace("%i", "ego"))
    for path in [DEPLOY / "zenoh/router.sh", DEPLOY / "zenoh/router-plain.json5", DEPLOY / "kubernetes/kustomization.yaml"]:
        # In comments, with an explanation behind two spaces or three points.
        for line in re.findall(r"^(?:#|//)\s+(v2x .*)$", path.read_text(), re.MULTILINE):
            for command in re.split(r"\s{2,}|\.\.\.|;", line):
                if command.strip().startswith("v2x "):
                    yield named(path), shlex.split(command)[1:]


def check_commands(report, v2x):
    """v2x knows every option of the command lines: help is printed for what comes before it only where that can be read."""
    for place, words in command_lines():
        report.check(f"{place}: v2x {shlex.join(words)}", lambda words=words: run([v2x, *words, "--help"]))
    wrong = subprocess.run([v2x, "hub", "--no-such-option", "--help"], capture_output=True, check=False)
    assert wrong.returncode == 2, "an option that no command has was not noticed"


def check_names(report, exposition):
    """Dashboard and alerts use names that a hub exports."""
    known = set()
    for kind in re.findall(r"^# TYPE (\S+) (\S+)$", exposition, re.MULTILINE):
        known |= {f"{kind[0]}{suffix}" for suffix in SUFFIXES.get(kind[1], [""])}
    paths = [DEPLOY / "grafana/hub.json", *sorted((DEPLOY / "prometheus").glob("hub.rules*.yml"))]

    def uses_known(path):
        used = set(re.findall(r"\bv2x_hub_[a-z0-9_]+", path.read_text()))
        assert used, "no name of a metric"
        unknown = sorted(used - known)
        assert not unknown, f"a hub does not export {', '.join(unknown)}"

    for path in paths:
        report.check(f"{named(path)}: names of metrics", lambda path=path: uses_known(path))


# The samples of a metric by its type, in OpenMetrics.
SUFFIXES = {"counter": ["_total"], "histogram": ["_bucket", "_sum", "_count"], "info": ["_info"]}


def check_prometheus(report):
    folder = DEPLOY / "prometheus"
    report.by_tool("promtool", "Prometheus' configuration by promtool", ["promtool", "check", "config", folder / "prometheus.yml"])
    report.by_tool("promtool", "alerts by their tests", ["promtool", "test", "rules", folder / "hub.rules.test.yml"])
    with tempfile.NamedTemporaryFile("w", suffix=".yml") as rules:
        # Prometheus reads the dashboard's questions as rules, with values in place of Grafana's variables.
        panels = json.loads((DEPLOY / "grafana/hub.json").read_text())["panels"]
        asked = [target["expr"] for panel in panels for target in panel.get("targets", [])]
        asked = [expr.replace("$__rate_interval", "1m").replace("$instance", ".*").replace("$agent", ".*") for expr in asked]
        recorded = [{"record": f"asked_{number}", "expr": expr} for number, expr in enumerate(asked)]
        yaml.safe_dump({"groups": [{"name": "dashboard", "rules": recorded}]}, rules)
        rules.flush()
        report.by_tool("promtool", "the dashboard's questions by promtool", ["promtool", "check", "rules", "--lint=none", rules.name])
    names = {rule["alert"] for group in documents(folder / "hub.rules.yml")[0]["groups"] for rule in group["rules"]}
    guide = DEPLOY / "docs/intersection.md"

    def explained():
        text = guide.read_text()
        missing = sorted(name for name in names if f"`{name}`" not in text)
        assert not missing, f"the guide does not say what to do about {', '.join(missing)}"

    report.check("alerts in the guide", explained)


def check_systemd(report, v2x):
    """Units as systemd reads them, with the built program in place of the installed one."""
    if shutil.which("systemd-analyze") is None:
        return report.not_checked("unit files: systemd-analyze is not installed")
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted((DEPLOY / "systemd").glob("*.*")):
            if path.suffix in (".service", ".timer"):
                (pathlib.Path(folder) / path.name).write_text(path.read_text().replace(PROGRAM, str(v2x)))
        units = sorted(pathlib.Path(folder).glob("v2x*"))
        if subprocess.run(["systemd-analyze", "verify", "--help"], capture_output=True, check=False).returncode == 0:
            report.check("unit files by systemd-analyze verify", lambda: verify(units))
        for unit in (unit for unit in units if unit.suffix == ".service"):
            report.check(f"sandbox of {unit.name}", lambda unit=unit: check_exposure(unit))
    report.by_tool("systemd-sysusers", "users of the services", ["systemd-sysusers", "--dry-run", DEPLOY / "systemd/v2x.conf"])
    report.not_checked("unit files by a start: systemd does not run everywhere where this does")


def verify(units):
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", *units], capture_output=True, text=True, check=False
    )
    # Units of the machine itself are read, too, and some say things.
    said = [line for line in done.stderr.splitlines() if "v2x" in line]
    assert done.returncode == 0 and not said, "\n".join(said) or done.stderr


def check_exposure(unit):
    said = run(["systemd-analyze", "security", "--offline=true", unit])
    exposure = float(re.search(r"Overall exposure level for \S+: ([\d.]+)", said)[1])
    assert exposure <= EXPOSURE, f"exposure {exposure}, more than {EXPOSURE}"
    print(f"{unit.name}: exposure {exposure} of 10")


def check_kubernetes(report):
    folder = DEPLOY / "kubernetes"
    same = (folder / "hub.toml").read_text() == (DEPLOY / "scenarios/crossing.toml").read_text()
    report.check("deploy/kubernetes/hub.toml", lambda: require(same, "not the shipped crossing.toml: copy it"))
    try:
        import kubernetes_validate
    except ImportError:
        return report.not_checked("Kubernetes' manifests: pip's kubernetes-validate is not installed")
    manifests = [document for path in sorted(folder.glob("*.yaml")) if path.name != "kustomization.yaml" for document in documents(path)]
    version = kubernetes_validate.latest_version()
    for manifest in manifests:
        what = f"manifest {manifest['kind']} {manifest['metadata']['name']}, Kubernetes {version}"
        report.check(what, lambda manifest=manifest: validated(manifest, version))
    report.by_tool("kubectl", "Kubernetes' kustomization", ["kubectl", "kustomize", folder])
    report.not_checked("Kubernetes' manifests by a cluster: there is none")


def validated(manifest, version):
    import kubernetes_validate

    try:
        kubernetes_validate.validate(manifest, version, strict=True)
    except kubernetes_validate.ValidationError as error:
        raise AssertionError(f"{'/'.join(map(str, error.path))}: {error.message}") from error


def check_threats(report):
    """Each test that SECURITY.md names is there."""
    sources = "".join(path.read_text() for path in ROOT.rglob("*.rs") if "target" not in path.relative_to(ROOT).parts)
    # Names of tests are sentences; keys and features are shorter.
    names = set(re.findall(r"`([a-z0-9]+(?:_[a-z0-9]+){4,})`", (ROOT / "SECURITY.md").read_text()))
    missing = sorted(name for name in names if not re.search(rf"fn {name}\b", sources))
    report.check(f"the {len(names)} tests of SECURITY.md", lambda: require(names and not missing, f"no test {', '.join(missing)}"))
    # By these words they are found and run: cargo test WORD.
    words = re.compile("cert|acl|tls|spoof|flood|standby|restart|fault")
    unnamed = sorted(name for name in names if not words.search(name))
    report.check("the names of these tests", lambda: require(not unnamed, f"none of {words.pattern} in {', '.join(unnamed)}"))


def require(condition, message):
    assert condition, message


def main():
    v2x = pathlib.Path(sys.argv[1]).resolve() / "v2x"
    report = Report()
    check_syntax(report)
    check_container(report)
    check_compose(report)
    check_commands(report, v2x)
    check_prometheus(report)
    check_systemd(report, v2x)
    check_kubernetes(report)
    check_threats(report)
    exported = deploy_network.check(report, v2x, compose())
    if len(sys.argv) > 2:
        exported = pathlib.Path(sys.argv[2]).read_text()
    if exported:
        check_names(report, exported)
    else:
        report.failures.append("names of metrics: no hub said them")
    for what in report.unchecked:
        print(f"NOT CHECKED: {what}")
    for failure in report.failures:
        print(failure, file=sys.stderr)
    print(f"files to deploy: {report.passed} checks passed, {len(report.failures)} failed")
    sys.exit(bool(report.failures))


if __name__ == "__main__":
    main()
