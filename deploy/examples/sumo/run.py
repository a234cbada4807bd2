"""Simulates the crossing of this folder with SUMO and writes fcd.xml, the world of crossing.toml.

Usage: python3 run.py [SECONDS]      needs: pip install eclipse-sumo
Then:  v2x up crossing.toml --web
Live, without this script: v2x up live.toml --web
"""

import pathlib
import signal
import subprocess
import sys

signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it
try:
    import sumo
except ImportError:
    sys.exit("this needs SUMO: pip install eclipse-sumo")

HERE = pathlib.Path(__file__).resolve().parent
SUMO = pathlib.Path(sumo.SUMO_HOME) / "bin" / "sumo"

seconds = sys.argv[1] if len(sys.argv) > 1 else "120"
subprocess.run([SUMO, "--configuration-file", "crossing.sumocfg", "--end", seconds,
                "--fcd-output", "fcd.xml", "--no-step-log"], cwd=HERE, check=True)
