"""A part of a settled world in Blender's Cycles and in terracast: the same views, how long they take.

    blender -b --factory-startup --python tests/bench/cycles/settled.py -- PROGRAM WORLD STORE OUT \\
        [--data FOLDER] [--view EAST,NORTH,HEIGHT,HEADING,PITCH] [--region WEST,SOUTH,EAST,NORTH] \\
        [--frames 4] [--samples 5] [--bounces 0] [--repetitions 3] [--threads 2]

PROGRAM   terracast
WORLD     the config of the world, as configs/worlds/archipelago.toml
STORE     that world, tiled; tiles that the views want beside are added, and a store where there is none
OUT       a folder for what is exported and rendered; what stands there is removed
--data    the folder of the world's data, where it has any
--view    the first camera: metres east and north of the world's origin and above the ground, degrees
          clockwise from north and down; the others follow it, 2 m further each
--region  what is exported, in metres east and north of the first camera, with all that the views and
          the rays to the sun meet
--bounces of Cycles' light; with 0 it has the sun and the sky alone, as terracast has

`terracast world export --format gltf` writes the region, and Blender reads it with the materials that
it gives (one colour each). In each repetition Cycles renders the frames with one sample a pixel and
ground truth (depth, normal, flow, object index), with one sample, and with more; then `terracast
render` renders the same frames with one sample and with more, from the whole world: with all facts,
which are more (edges, what is seen from other frames), and "plain", without these (`facts.flags = []`):
range, normal, class, instance, triangle; flow follows from these without a ray. Both have persistent scenes, write uncompressed EXR and fast PNG, and use as many
threads. A frame's time is that of all but the first, which builds the scene; a sample's the difference
of such times by that of the samples. Printed are medians over the repetitions with the least and the
most, and by how much the two depths of a frame differ in the median: both must see the same.

Needs Debian's packages blender and python3-numpy.
"""

import argparse
import json
import math
import os
import pathlib
import resource
import shutil
import struct
import subprocess
import sys
import time

import bpy
import mathutils
import numpy

# Blender 3.4's reader of glTF calls it as NumPy did up to 1.23.
numpy.bool = bool

WIDTH_PX, HEIGHT_PX, FOCAL_PX = 1280, 720, 1000.0
SUN_AZIMUTH_DEG, SUN_ELEVATION_DEG = 150.0, 50.0
STEP_M = 2.0
# Shapes are the same to half a millimetre, and rays through a pixel go through its middle or any of it:
# of ground 500 m away, seen at 45 degrees, a pixel holds one part in a thousand of its depth.
SAME_VIEW = 1e-3


def options():
    parser = argparse.ArgumentParser(prog="settled.py")
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("world", type=pathlib.Path)
    parser.add_argument("store", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--data", type=pathlib.Path)
    numbers = lambda text: [float(number) for number in text.split(",")]
    parser.add_argument("--view", type=numbers, default=[-7900.0, -1500.0, 200.0, 0.0, 40.0])
    parser.add_argument("--region", type=numbers, default=[-450.0, -250.0, 450.0, 900.0])
    parser.add_argument("--frames", type=int, default=4)
    parser.add_argument("--samples", type=int, default=5)
    parser.add_argument("--bounces", type=int, default=0)
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])


class Geodesy:
    """WGS84, written here anew: the world's frame, and that of the exported region."""

    A, F = 6378137.0, 1.0 / 298.257223563

    def ecef(self, lat_deg, lon_deg, height_m=0.0):
        lat, lon = math.radians(lat_deg), math.radians(lon_deg)
        e2 = self.F * (2.0 - self.F)
        n = self.A / math.sqrt(1.0 - e2 * math.sin(lat) ** 2)
        return numpy.array(
            [
                (n + height_m) * math.cos(lat) * math.cos(lon),
                (n + height_m) * math.cos(lat) * math.sin(lon),
                (n * (1.0 - e2) + height_m) * math.sin(lat),
            ]
        )

    def ecef_from_enu(self, lat_deg, lon_deg):
        lat, lon = math.radians(lat_deg), math.radians(lon_deg)
        east = [-math.sin(lon), math.cos(lon), 0.0]
        up = [math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)]
        return numpy.array([east, numpy.cross(up, east), up]).T

    def geodetic(self, origin, east_m, north_m):
        """Latitude and longitude of a place of the ellipsoid above or below a world (x, y), to a metre."""
        place = numpy.array(origin)
        for _ in range(20):
            rotation = self.ecef_from_enu(*origin)
            world = rotation.T @ (self.ecef(*place) - self.ecef(*origin))
            missing_m = numpy.array([north_m - world[1], east_m - world[0]])
            place += numpy.degrees(missing_m / self.A) / [1.0, math.cos(math.radians(place[0]))]
        return place


def write_job(args, name, num_samples, has_flags):
    east_m, north_m, height_m, heading_deg, pitch_deg = args.view
    file = args.out / f"{name}.toml"
    data = f'data = "{args.data.resolve()}"' if args.data else ""
    file.write_text(
        f"""name = "{name}"
seed = 1
{data}
world = "{args.world.resolve()}"

[[rigs]]
name = "one"
mount_pitch_deg = {pitch_deg}
[[rigs.cameras]]
name = "c"
width_px = {WIDTH_PX}
height_px = {HEIGHT_PX}
fx_px = {FOCAL_PX}

[[trajectories]]
name = "P000"
kind = "forward"
rate_hz = 1.0
num_frames = {args.frames}
speed_mps = {STEP_M}
heading_deg = {heading_deg}
length_m = {STEP_M * (args.frames + 1)}
start = {{east_m = {east_m}, north_m = {north_m}, height_m = {height_m}}}

[conditions]
sun_azimuth_deg = {SUN_AZIMUTH_DEG}
sun_elevation_deg = {SUN_ELEVATION_DEG}
color_samples = {num_samples}
{"" if has_flags else "[facts]" + chr(10) + "flags = []"}
"""
    )
    return file


def run(*command):
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)


def sequence_of(folder):
    return next(folder.rglob("sequence.json")).parent


def ours(args, name, num_samples, has_flags=True):
    """Seconds a frame, between the frames' records, which are written last; and the capture."""
    folder = args.out / name
    shutil.rmtree(folder, ignore_errors=True)
    run(args.program, "render", write_job(args, name, num_samples, has_flags), "--out", folder,
        "--world", args.store, "--threads", args.threads, "--quiet")
    sequence = sequence_of(folder)
    written_s = sorted(1e-9 * os.stat(record).st_mtime_ns for record in records_of(sequence))
    return [b - a for a, b in zip(written_s, written_s[1:])], sequence


def records_of(sequence):
    return sorted(
        file for file in sequence.rglob("*.json") if file.stem.isdigit() and len(file.stem) == 6
    )


def rotation_of(wxyz):
    return numpy.array(mathutils.Quaternion(wxyz).to_matrix())


def cameras_of(sequence):
    """Rotation and place of the frames' camera in the world."""
    camera = json.loads((sequence / "sequence.json").read_text())["cameras"][0]
    body_from_camera = numpy.eye(4)
    for name in ("body_from_rig", "rig_from_camera"):
        step = numpy.eye(4)
        step[:3, :3] = rotation_of(camera[name]["rotation_wxyz"])
        step[:3, 3] = camera[name]["translation_m"]
        body_from_camera = body_from_camera @ step
    poses = []
    for record in records_of(sequence):
        body = json.loads(record.read_text())["world_from_body"]
        world_from_body = numpy.eye(4)
        world_from_body[:3, :3] = rotation_of(body["rotation_wxyz"])
        world_from_body[:3, 3] = body["translation_m"]
        poses.append(world_from_body @ body_from_camera)
    return poses


def read_exr(file):
    """Channels of an uncompressed EXR of scan lines, of one part or several, by name."""
    data = file.read_bytes()
    at = 8
    is_multipart = struct.unpack_from("<I", data, 4)[0] & 0x1000

    def text():
        nonlocal at
        end = data.index(b"\0", at)
        value, at = data[at:end].decode(), end + 1
        return value

    parts = []
    while True:
        attributes = {}
        while name := text():
            text()
            size = struct.unpack_from("<I", data, at)[0]
            attributes[name] = data[at + 4 : at + 4 + size]
            at += 4 + size
        if not attributes:
            break
        parts.append(attributes)
        if not is_multipart:
            break
    images = {}
    layouts = []
    num_chunks = 0
    for attributes in parts:
        assert attributes["compression"][0] == 0, f"{file}: compressed"
        x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
        channels, names = attributes["channels"], []
        k = 0
        while channels[k] != 0:
            end = channels.index(b"\0", k)
            kind = struct.unpack_from("<I", channels, end + 1)[0]
            names.append((channels[k:end].decode(), [numpy.uint32, numpy.float16, numpy.float32][kind]))
            k = end + 17
        for name, kind in names:
            images[name] = numpy.empty((y1 - y0 + 1, x1 - x0 + 1), kind)
        layouts.append((y0, x1 - x0 + 1, names))
        num_chunks += y1 - y0 + 1
    at += 8 * num_chunks
    for _ in range(num_chunks):
        part = 0
        if is_multipart:
            part = struct.unpack_from("<I", data, at)[0]
            at += 4
        y, _ = struct.unpack_from("<iI", data, at)
        at += 8
        y0, width, names = layouts[part]
        for name, kind in names:
            images[name][y - y0] = numpy.frombuffer(data, kind, width, at)
            at += width * numpy.dtype(kind).itemsize
    return images


def depth_difference(sequence, frame, exr):
    """Median difference of the depths of a frame, as a share of ours."""
    facts = sorted(file for file in sequence.rglob("*.exr"))[frame]
    range_m = read_exr(facts)["range_m"].astype(float)
    x = (numpy.arange(WIDTH_PX) + 0.5 - 0.5 * WIDTH_PX) / FOCAL_PX
    y = (numpy.arange(HEIGHT_PX) + 0.5 - 0.5 * HEIGHT_PX) / FOCAL_PX
    ours_m = range_m / numpy.sqrt(1.0 + x[None, :] ** 2 + y[:, None] ** 2)
    theirs_m = read_exr(exr)["ViewLayer.Depth.Z"]
    is_ground = numpy.isfinite(ours_m)
    shares = numpy.abs(theirs_m[is_ground] - ours_m[is_ground]) / ours_m[is_ground]
    return float(numpy.median(shares)), float(numpy.mean(shares > 0.01))


def make_scene(args, poses, origin):
    geodesy = Geodesy()
    west_m, south_m, east_m, north_m = args.region
    place = poses[0][:3, 3]
    south, west = geodesy.geodetic(origin, place[0] + west_m, place[1] + south_m)
    north, east = geodesy.geodetic(origin, place[0] + east_m, place[1] + north_m)
    model = args.out / "region.glb"
    # One colour each, as when the figures of docs/performance.md were measured.
    run(args.program, "world", "export", args.store, "--format", "gltf", "-o", model, "--quiet", "--texel", "0",
        "--region", f"{south:.7f},{west:.7f},{north:.7f},{east:.7f}")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    start = time.perf_counter()
    bpy.ops.import_scene.gltf(filepath=str(model))
    import_s = time.perf_counter() - start
    for number, item in enumerate(bpy.data.objects):
        item.pass_index = number % 32767 + 1

    # The exported frame: east, north, up about the region's centre.
    center = (0.5 * (south + north), 0.5 * (west + east))
    enu_from_ecef = geodesy.ecef_from_enu(*center).T
    region_from_world = numpy.eye(4)
    region_from_world[:3, :3] = enu_from_ecef @ geodesy.ecef_from_enu(*origin)
    region_from_world[:3, 3] = enu_from_ecef @ (geodesy.ecef(*origin) - geodesy.ecef(*center))

    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "HORIZONTAL"
    data.lens = data.sensor_width * FOCAL_PX / WIDTH_PX
    data.clip_start, data.clip_end = 0.5, 1e5
    camera = bpy.data.objects.new("camera", data)
    camera.rotation_mode = "QUATERNION"
    bpy.context.collection.objects.link(camera)
    for frame, pose in enumerate(poses):
        # Blender's cameras look along -z, with y up.
        matrix = mathutils.Matrix(region_from_world @ pose) @ mathutils.Matrix.Diagonal(
            (1.0, -1.0, -1.0, 1.0)
        )
        camera.location, camera.rotation_quaternion, _ = matrix.decompose()
        camera.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("rotation_quaternion", frame=frame)
    bpy.context.scene.camera = camera

    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.angle = math.radians(0.54)
    sun.data.energy = 3.0
    azimuth, elevation = math.radians(SUN_AZIMUTH_DEG), math.radians(SUN_ELEVATION_DEG)
    towards = mathutils.Vector(
        (
            math.sin(azimuth) * math.cos(elevation),
            math.cos(azimuth) * math.cos(elevation),
            math.sin(elevation),
        )
    )
    sun.rotation_euler = towards.to_track_quat("Z", "Y").to_euler()
    bpy.context.collection.objects.link(sun)
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.4, 0.6, 0.9, 1.0)
    scene = bpy.context.scene
    scene.world = world
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = args.bounces
    scene.cycles.diffuse_bounces = args.bounces
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1.0
    scene.render.use_persistent_data = True
    scene.render.threads_mode = "FIXED"
    scene.render.threads = args.threads
    scene.render.resolution_x = WIDTH_PX
    scene.render.resolution_y = HEIGHT_PX
    scene.render.resolution_percentage = 100
    return import_s


def cycles(args, num_samples, has_passes):
    """Seconds of the first frame, and of each of the others."""
    scene = bpy.context.scene
    scene.cycles.samples = num_samples
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = has_passes
    layer.use_pass_vector = layer.use_pass_object_index = has_passes
    image = scene.render.image_settings
    image.file_format = "OPEN_EXR_MULTILAYER" if has_passes else "PNG"
    image.color_depth = "32" if has_passes else "8"
    if has_passes:
        image.exr_codec = "NONE"
    else:
        image.compression = 10
    times_s = []
    for frame in range(args.frames):
        scene.frame_set(frame)
        scene.render.filepath = str(args.out / f"cycles-{num_samples}-{int(has_passes)}-{frame}")
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        times_s.append(time.perf_counter() - start)
    return times_s[0], times_s[1:]


def median(values):
    return float(numpy.median(values))


def main():
    args = options()
    shutil.rmtree(args.out, ignore_errors=True)
    args.out.mkdir(parents=True)
    run(args.program, "tile", write_job(args, "views", 1, True), "--out", args.out / "views",
        "--world", args.store, "--threads", args.threads, "--quiet")
    origin_of = json.loads((args.store / "manifest.json").read_text())["origin"]
    origin = (origin_of["lat_deg"], origin_of["lon_deg"])
    _, sequence = ours(args, "views", 1)
    import_s = make_scene(args, cameras_of(sequence), origin)
    rows = []
    first_s = None
    for _ in range(args.repetitions):
        theirs_first_s, theirs_facts = cycles(args, 1, True)
        first_s = first_s or theirs_first_s
        _, theirs_one = cycles(args, 1, False)
        _, theirs_many = cycles(args, args.samples, False)
        ours_one, sequence = ours(args, "one", 1)
        ours_many, _ = ours(args, "many", args.samples)
        ours_plain, _ = ours(args, "plain", 1, has_flags=False)
        by = args.samples - 1
        rows.append(
            {
                "cycles_sample_s": (median(theirs_many) - median(theirs_one)) / by,
                "ours_sample_s": (median(ours_many) - median(ours_one)) / by,
                "cycles_frame_s": median(theirs_facts),
                "ours_frame_s": median(ours_one),
                "ours_plain_frame_s": median(ours_plain),
            }
        )
        rows[-1]["sample_ratio"] = rows[-1]["cycles_sample_s"] / rows[-1]["ours_sample_s"]
        rows[-1]["frame_ratio"] = rows[-1]["cycles_frame_s"] / rows[-1]["ours_frame_s"]
        rows[-1]["plain_frame_ratio"] = (
            rows[-1]["cycles_frame_s"] / rows[-1]["ours_plain_frame_s"]
        )
        print(json.dumps(rows[-1]), flush=True)
    difference, share_apart = depth_difference(
        sequence, args.frames - 1, args.out / f"cycles-1-1-{args.frames - 1}.exr"
    )
    meshes = {item.data for item in bpy.data.objects if item.type == "MESH"}
    triangles = {mesh: sum(len(p.vertices) - 2 for p in mesh.polygons) for mesh in meshes}
    placed = [item for item in bpy.data.objects if item.type == "MESH"]
    peak_bytes = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"load {os.getloadavg()[0]:.1f}; {args.bounces} bounces; {len(placed)} objects,",
          f"{1e-6 * sum(triangles[item.data] for item in placed):.1f} million triangles,",
          f"{1e-6 * sum(triangles.values()):.2f} million of them in memory")
    print(f"Blender: reading {import_s:.0f} s, first frame {first_s:.1f} s, {1e-9 * peak_bytes:.2f} GB")
    print(f"depths: {difference:.1e} apart in the median, {100 * share_apart:.1f} % by more than 1 %")
    for name in rows[0]:
        values = [row[name] for row in rows]
        print(f"{name:16} {median(values):8.3f}  ({min(values):.3f} to {max(values):.3f})")
    if difference > SAME_VIEW:
        sys.exit("Cycles does not see what terracast sees")


main()
