"""Reads a sequence in EuRoC's layout as its users do, by its documentation alone, and holds its parts against each other.

Usage: euroc_reader.py SEQUENCE (the folder that holds mav0). Prints a line for each measure: its name and how large it is.
"""

import math
import os
import sys


def rows_of(path, num_columns):
    """As evo reads them: comments begin with #, stamps are nanoseconds."""
    rows = []
    with open(path, encoding="ascii") as file:
        for line in file:
            if line.startswith("#"):
                continue
            cells = line.strip().split(",")
            assert len(cells) == num_columns, f"{path}: {len(cells)} columns"
            rows.append([int(cells[0])] + cells[1:])
    return rows


def turned(q, v):
    """A vector by a quaternion w x y z."""
    w, x, y, z = q
    tx, ty, tz = (2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0]))
    return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx]


def turn_between(a, b):
    """The rotation vector that takes attitude a to b, along the body's axes."""
    w = sum(p * q for p, q in zip(a, b))
    x = a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2]
    y = a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1]
    z = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]
    size = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(size, w) / size if size > 0.0 else 2.0
    return [factor * x, factor * y, factor * z]


def length(v):
    return math.sqrt(sum(c * c for c in v))


def main():
    mav = os.path.join(sys.argv[1], "mav0")
    truth = {r[0]: [float(c) for c in r[1:]] for r in rows_of(mav + "/state_groundtruth_estimate0/data.csv", 17)}
    for camera in ("cam0", "cam1"):
        images = rows_of(f"{mav}/{camera}/data.csv", 2)
        for stamp, name in images:
            assert name == f"{stamp}.png" and len(name) == 23, name
            with open(f"{mav}/{camera}/data/{name}", "rb") as file:
                assert file.read(8) == b"\x89PNG\r\n\x1a\n", name
            assert stamp in truth, f"no truth at {stamp}"
    print("images", len(images))

    # Velocities against places, turn rates and forces against both; a gravity that points down along R's z.
    imu = rows_of(mav + "/imu0/data.csv", 7)
    step = 5_000_000
    worst_velocity = 0.0
    rate_sum, force_sum, count = [0.0] * 3, [0.0] * 3, 0
    for stamp, *cells in imu:
        if stamp - step not in truth or stamp + step not in truth:
            continue
        before, now, after = truth[stamp - step], truth[stamp], truth[stamp + step]
        seconds = 1e-9 * step
        velocity = [(a - b) / (2 * seconds) for a, b in zip(after[:3], before[:3])]
        worst_velocity = max(worst_velocity, length([p - q for p, q in zip(velocity, now[7:10])]))
        shown = [float(c) for c in cells]
        rate = [c / (2 * seconds) for c in turn_between(before[3:7], after[3:7])]
        acceleration = [(a - b) / (2 * seconds) for a, b in zip(after[7:10], before[7:10])]
        inverse = [now[3], -now[4], -now[5], -now[6]]
        force = turned(inverse, [acceleration[0], acceleration[1], acceleration[2] + 9.8062])
        for i in range(3):
            rate_sum[i] += shown[i] - now[10 + i] - rate[i]
            force_sum[i] += shown[3 + i] - now[13 + i] - force[i]
        count += 1
    print("velocity", worst_velocity)
    print("rate", length(rate_sum) / count)
    print("force", length(force_sum) / count)


main()
