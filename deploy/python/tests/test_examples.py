"""The examples run, and the notebook's committed outputs are what its cells print."""

import contextlib
import io
import json
import pathlib
import re
import signal
import subprocess
import sys

EXAMPLES = pathlib.Path(__file__).resolve().parents[1] / "examples"
README = EXAMPLES.parent / "README.md"


def output_of(name, *arguments):
    command = [sys.executable, str(EXAMPLES / name), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_engine_in_a_process_is_near_the_truth():
    found = re.fullmatch(r"vehicle\.car: x (\S+) m \(σ (\S+), truth (\S+)\), vx (\S+) m/s\n", output_of("engine.py"))
    x, sigma, truth, vx = map(float, found.groups())
    assert abs(x - truth) < 4 * sigma < 2.0 and abs(vx - 10.0) < 2.0


def test_a_detector_on_a_network_gets_its_car_back(hub):
    lines = output_of("network.py", hub.locator).splitlines()
    assert len(lines) >= 15 and re.fullmatch(r"vehicle\.car: x \S+ m, vx \S+ m/s, \S+ ms after it was seen", lines[-1])


def test_without_a_hub_a_detector_says_which_command_starts_one_and_waits_unless_told_otherwise():
    command = [sys.executable, str(EXAMPLES / "network.py"), "tcp/127.0.0.1:1"]
    once = subprocess.run([*command, "--once"], capture_output=True, text=True, timeout=60, check=False)
    assert once.returncode == 1 and "`v2x hub`" in once.stderr and len(once.stderr.splitlines()) == 1, once.stderr
    waiting = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    said = waiting.stderr.readline()
    waiting.send_signal(signal.SIGINT)
    assert "waiting for it" in said and waiting.communicate(timeout=20)[1] == ""


def test_the_example_of_a_test_passes(tmp_path):
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(EXAMPLES / "test_with_a_hub.py")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stdout


def test_the_notebook_prints_what_it_shows():
    notebook = json.loads((EXAMPLES / "score_a_method.ipynb").read_text(encoding="utf-8"))
    names, n_outputs = {}, 0
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code" or "IPython" in "".join(cell["source"]):
            continue
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile("".join(cell["source"]), "cell", "exec"), names)  # noqa: S102
        shown = "".join("".join(one["text"]) for one in cell["outputs"] if one["output_type"] == "stream")
        assert printed.getvalue() == shown
        n_outputs += bool(shown)
    assert n_outputs == 3


def test_the_programs_of_the_readme_run():
    blocks = re.findall(r"^```python\n(.*?)^```", README.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 2
    for block in blocks:
        if "Agent(" not in block and "def test_" not in block:
            exec(compile(block, "README.md", "exec"), {})  # noqa: S102
