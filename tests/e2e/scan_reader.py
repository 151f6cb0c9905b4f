"""A second reader of lidar files, written from the formats' descriptions with Python's own modules alone.

usage: scan_reader.py kitti SEQUENCE POSES       velodyne/*.bin, labels/*.label, calib.txt, poses as SemanticKITTI has them
       scan_reader.py kitti_raw DATE DRIVE       velodyne_points, their three stamp files and both calibrations, as KITTI raw has them
       scan_reader.py tartanair SEQUENCE         lidar/*.ply and imu/*.npy, as TartanAir has them

Prints a JSON object of what it finds.
"""

import glob
import json
import math
import os
import struct
import sys


def numbers(line):
    return [float(word) for word in line.split()]


def matrix(values):
    """3 x 4 numbers, row by row, as 4 x 4."""
    return [values[0:4], values[4:8], values[8:12], [0.0, 0.0, 0.0, 1.0]]


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def moved(m, p):
    return [sum(m[i][k] * p[k] for k in range(3)) + m[i][3] for i in range(3)]


def keyed(path):
    values = {}
    with open(path) as file:
        for line in file:
            key, rest = line.split(":", 1)
            values[key] = numbers(rest)
    return values


def scan(path):
    with open(path, "rb") as file:
        data = file.read()
    assert len(data) % 16 == 0, path
    return list(struct.iter_unpack("<4f", data))


def labels_of(path):
    with open(path, "rb") as file:
        data = file.read()
    return [(bits & 0xFFFF, bits >> 16) for (bits,) in struct.iter_unpack("<I", data)]


def ecef(lat_deg, lon_deg, height_m):
    a, f = 6378137.0, 1.0 / 298.257223563
    e2 = f * (2.0 - f)
    lat, lon = math.radians(lat_deg), math.radians(lon_deg)
    n = a / math.sqrt(1.0 - e2 * math.sin(lat) ** 2)
    return [
        (n + height_m) * math.cos(lat) * math.cos(lon),
        (n + height_m) * math.cos(lat) * math.sin(lon),
        (n * (1.0 - e2) + height_m) * math.sin(lat),
    ]


def height_of(point):
    """Above WGS84's ellipsoid, by Bowring's way, tried again."""
    a, f = 6378137.0, 1.0 / 298.257223563
    e2 = f * (2.0 - f)
    x, y, z = point
    r = math.hypot(x, y)
    lat = math.atan2(z, r * (1.0 - e2))
    for _ in range(5):
        n = a / math.sqrt(1.0 - e2 * math.sin(lat) ** 2)
        lat = math.atan2(z + e2 * n * math.sin(lat), r)
    n = a / math.sqrt(1.0 - e2 * math.sin(lat) ** 2)
    return r * math.cos(lat) + z * math.sin(lat) - a * a / n


def ecef_from_camera(sequence, camera):
    """Of the first frame, by georeference.csv."""
    with open(os.path.join(sequence, "georeference.csv")) as file:
        next(file)
        for line in file:
            cells = line.strip().split(",")
            if cells[0] == "0" and cells[1] == camera:
                lat, lon, height, w, x, y, z = [float(cell) for cell in cells[3:]]
                break
    enu = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    la, lo = math.radians(lat), math.radians(lon)
    axes = [
        [-math.sin(lo), -math.sin(la) * math.cos(lo), math.cos(la) * math.cos(lo)],
        [math.cos(lo), -math.sin(la) * math.sin(lo), math.cos(la) * math.sin(lo)],
        [0.0, math.cos(la), math.sin(la)],
    ]
    place = ecef(lat, lon, height)
    rows = []
    for i in range(3):
        rows.append([sum(axes[i][k] * enu[k][j] for k in range(3)) for j in range(3)] + [place[i]])
    return rows + [[0.0, 0.0, 0.0, 1.0]]


def kitti(sequence, poses_file):
    calib = keyed(os.path.join(sequence, "calib.txt"))
    camera_from_velodyne = matrix(calib["Tr"])
    with open(poses_file) as file:
        poses = [matrix(numbers(line)) for line in file]
    world_from_first = ecef_from_camera(sequence, "image_0")
    frames = []
    names = sorted(glob.glob(os.path.join(sequence, "velodyne", "*.bin")))
    for i, name in enumerate(names):
        points = scan(name)
        labels = labels_of(name.replace("velodyne", "labels").replace(".bin", ".label"))
        assert len(points) == len(labels), name
        world_from_velodyne = times(world_from_first, times(poses[i], camera_from_velodyne))
        # Every twentieth point: lists are slow.
        ground = [p for p, (label, _) in zip(points, labels) if label in (40, 49, 72, 0)][::20]
        heights = [height_of(moved(world_from_velodyne, p)) for p in ground]
        counts = {}
        for label, _ in labels:
            counts[label] = counts.get(label, 0) + 1
        frames.append(
            {
                "num_points": len(points),
                "lowest_m": min(heights) if heights else None,
                "highest_m": max(heights) if heights else None,
                "labels": {str(label): count for label, count in sorted(counts.items())},
                "instances": sorted({pair for pair in labels if pair[1] != 0}),
                "most_reflectance": max((p[3] for p in points), default=0.0),
            }
        )
    return {"num_poses": len(poses), "frames": frames}


def seconds_of(line):
    assert len(line) == 30 and line.endswith("\n"), line
    clock = line[11:29].split(":")
    return 3600.0 * int(clock[0]) + 60.0 * int(clock[1]) + float(clock[2])


def kitti_raw(date, drive):
    def rigid(name):
        values = keyed(os.path.join(date, name))
        r, t = values["R"], values["T"]
        return matrix(r[0:3] + [t[0]] + r[3:6] + [t[1]] + r[6:9] + [t[2]])

    folder = os.path.join(drive, "velodyne_points")
    stamps = {}
    for name in ("timestamps", "timestamps_start", "timestamps_end"):
        with open(os.path.join(folder, name + ".txt")) as file:
            stamps[name] = [seconds_of(line) for line in file]
    names = sorted(glob.glob(os.path.join(folder, "data", "*.bin")))
    oxts = sorted(glob.glob(os.path.join(drive.replace("_sync", "_extract"), "oxts", "data", "*.txt")))
    packets = []
    for name in oxts:
        with open(name) as file:
            packets.append(numbers(file.read()))
    return {
        "camera_from_velodyne": rigid("calib_velo_to_cam.txt"),
        "velodyne_from_imu": rigid("calib_imu_to_velo.txt"),
        "stamps": stamps,
        "num_points": [len(scan(name)) for name in names],
        "first_points": [scan(name)[:5] for name in names],
        "packets": packets,
    }


def array(path):
    """An npy of one or two dimensions of floats, as rows."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:6] == b"\x93NUMPY", path
    (length,) = struct.unpack("<H", data[8:10])
    header = eval(data[10 : 10 + length].decode(), {"__builtins__": {}}, {"True": True, "False": False})
    assert not header["fortran_order"], path
    form = {"<f8": "d", "<f4": "f"}[header["descr"]]
    count = 1
    for size in header["shape"]:
        count *= size
    values = struct.unpack("<%d%s" % (count, form), data[10 + length :])
    width = header["shape"][1] if len(header["shape"]) == 2 else 1
    return {"type": header["descr"], "rows": [list(values[i : i + width]) for i in range(0, count, width)]}


def tartanair(sequence):
    clouds = []
    for name in sorted(glob.glob(os.path.join(sequence, "lidar", "*.ply"))):
        with open(name, "rb") as file:
            data = file.read()
        end = data.index(b"end_header\n") + len(b"end_header\n")
        clouds.append(list(struct.iter_unpack("<3f", data[end:])))
    with open(os.path.join(sequence, "pose_lcam_front.txt")) as file:
        poses = [numbers(line) for line in file]
    imu = {}
    for name in glob.glob(os.path.join(sequence, "imu", "*.npy")):
        imu[os.path.basename(name)[:-4]] = array(name)
    texts = {}
    for name in glob.glob(os.path.join(sequence, "imu", "*.txt")):
        with open(name) as file:
            texts[os.path.basename(name)[:-4]] = [numbers(line) for line in file]
    return {
        "num_points": [len(cloud) for cloud in clouds],
        "points": [cloud[::50] for cloud in clouds],
        "poses": poses,
        "imu": imu,
        "texts": texts,
    }


FORMATS = {"kitti": kitti, "kitti_raw": kitti_raw, "tartanair": tartanair}
print(json.dumps(FORMATS[sys.argv[1]](*sys.argv[2:])))
