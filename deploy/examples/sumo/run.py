"""Simulates the crossing of this folder with SUMO and writes fcd.xml, the world of crossing.toml.

Usage: python3 run.py [SECONDS]      needs: pip install eclipse-sumo
Then:  v2x up crossing.toml --web
"""

import pathlib
import subprocess
import sys

import sumo

HERE = pathlib.Path(__file__).resolve().parent
BIN = pathlib.Path(sumo.SUMO_HOME) / "bin"
STEP_S = 0.2


def run(program, *options):
    subprocess.run([BIN / program, *options], cwd=HERE, check=True)


seconds = sys.argv[1] if len(sys.argv) > 1 else "120"
# The network's own offset is kept at 0, so that its coordinates are those of the nodes.
run("netconvert", "--node-files", "nodes.nod.xml", "--edge-files", "edges.edg.xml",
    "--offset.disable-normalization", "--output-file", "crossing.net.xml")
run("sumo", "--net-file", "crossing.net.xml", "--route-files", "demand.rou.xml", "--end", seconds,
    "--step-length", str(STEP_S), "--fcd-output", "fcd.xml", "--no-step-log")
