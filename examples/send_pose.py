"""Send the poses of a motion-capture system to `snakewalk run --pose udp:9870`.

Replace ``read_tracker`` by a call of your system. Position in metres, z up, quaternion w, x, y, z.
"""

import argparse
import json
import socket
import time


def read_tracker():
    """Return position (m) and quaternion (w, x, y, z) of the tracked body."""
    return [0.0, 0.0, 0.03], [1.0, 0.0, 0.0, 0.0]


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--to", default="127.0.0.1:9870", help="HOST:PORT of snakewalk")
parser.add_argument("--count", type=int, default=10, help="number of poses, 50 a second")
args = parser.parse_args()
host, port = args.to.rsplit(":", 1)
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
    for sequence in range(args.count):
        position, quaternion = read_tracker()
        row = {"snakewalk_pose": 1, "sequence": sequence, "time_s": time.monotonic()}
        row |= {"frame": "lab", "position_m": position, "quaternion_wxyz": quaternion}
        line.sendto(json.dumps(row).encode(), (host, int(port)))
        time.sleep(0.02)
print(f"sent {args.count} poses to {args.to}")
