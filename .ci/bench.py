"""Compares the instructions of a few kernels with the committed baseline.

Usage: bench.py [--write]. Needs valgrind; builds fusion-hub/benches/kernels.rs, without the network.

Each kernel runs under callgrind with one and with three repetitions: half of the difference is what one repetition takes,
without the start of the program. A count does not depend on how busy the machine is; it does depend on the compiler
(rust-toolchain.toml) and the processor's kind. What takes more than the tolerance above the baseline is an error. What
takes less is reported, so that the baseline can be written anew with --write.
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
BASELINE = ROOT / ".ci/bench-baseline.json"
KERNELS = ["codec", "engine-imm", "engine-cv", "engine-csba-wls", "engine-lag"]
TOLERANCE = 0.03


def built():
    """Builds the kernels, and gives the program."""
    command = ["cargo", "bench", "--locked", "-p", "v2x-fusion-hub", "--no-default-features", "--bench", "kernels", "--no-run", "--message-format", "json"]
    lines = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    artifacts = (json.loads(line) for line in lines)
    return next(a["executable"] for a in artifacts if a.get("executable") and a["target"]["name"] == "kernels")


def instructions(program, kernel, repetitions):
    """Instructions of a run, the start included."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "callgrind.out"
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", program, kernel, str(repetitions)]
        # The order of hash tables and addresses is not to count.
        environment = {"PATH": os.environ["PATH"], "LC_ALL": "C"}
        subprocess.run(command, check=True, capture_output=True, env=environment)
        return int(re.search(r"^(?:summary|totals): (\d+)", out.read_text(), re.MULTILINE)[1])


def main():
    program = built()
    counts = {name: (instructions(program, name, 3) - instructions(program, name, 1)) // 2 for name in KERNELS}
    if "--write" in sys.argv:
        BASELINE.write_text(json.dumps(counts, indent=2) + "\n")
    baseline = json.loads(BASELINE.read_text())
    slower = []
    for name, count in counts.items():
        change = count / baseline[name] - 1
        print(f"{name:16} {count:>13,} instructions, {100 * change:+.2f} % of the baseline")
        if change > TOLERANCE:
            slower.append(name)
        elif change < -TOLERANCE:
            print(f"{name} takes less than the baseline: write it anew with python3 .ci/bench.py --write")
    if slower:
        sys.exit(f"slower than the baseline by more than {100 * TOLERANCE:.0f} %: {', '.join(slower)}")


main()
