"""Makes tiles.json beside it from independent implementations: PROJ's tangent plane of WGS84, and mercantile's quadkeys.

pip install pyproj==3.7.2 mercantile==1.2.1
python make_tiles.py                        # Python 3.11
"""

import importlib.metadata
import json
import pathlib
import random

import mercantile
import pyproj

HERE = pathlib.Path(__file__).resolve().parent
# Munich, Tokyo, São Paulo, Nairobi, Reykjavík, Apia (beside the antimeridian), Longyearbyen.
ORIGINS = [(48.137, 11.575), (35.681, 139.767), (-23.550, -46.633), (-1.286, 36.817), (64.147, -21.943),
           (-13.833, -171.767), (78.223, 15.647)]
# Metres from the origin: within a crossing, a town and a region.
REACHES = [100, 5_000, 50_000]
ZOOMS = [1, 12, 14, 16, 20]


def plane(latitude, longitude):
    """From east, north, up at the origin to longitude, latitude, height."""
    return pyproj.Transformer.from_pipeline(
        f"+proj=pipeline +step +inv +proj=topocentric +ellps=WGS84 +lon_0={longitude} +lat_0={latitude} +h_0=0"
        " +step +inv +proj=cart +ellps=WGS84")


def row(rng, origin, reach):
    x, y = (round(rng.uniform(-reach, reach), 3) for _ in range(2))
    longitude, latitude, _ = plane(*origin).transform(x, y, 0)
    quadkeys = {str(zoom): mercantile.quadkey(mercantile.tile(longitude, latitude, zoom)) for zoom in ZOOMS}
    return {"origin": origin, "x": x, "y": y, "latitude_deg": latitude, "longitude_deg": longitude, "quadkeys": quadkeys}


def main():
    rng = random.Random(5)
    rows = [row(rng, origin, reach) for origin in ORIGINS for reach in REACHES for _ in range(4)]
    made_by = {name: importlib.metadata.version(name) for name in ("pyproj", "mercantile")}
    text = json.dumps({"made_by": made_by, "places": rows}, separators=(",", ":"))
    (HERE / "tiles.json").write_text(text.replace('},{"origin"', '},\n{"origin"') + "\n")


main()
