"""Renders the scene that cycles_bench.cpp wrote with Cycles, and writes down how long frames take.

    blender -b --factory-startup --python render.py -- FOLDER THREADS SAMPLES

FOLDER holds scene.json, vertices.f32, triangles.i32; times.json is written beside them. Each series
renders all frames of the flight with persistent data; its first frame, which builds the scene, stands
apart from the others. Passes and light are as cheap as Cycles has them for the same picture: one
sun, no bounces, a diffuse ground with one noise texture, uncompressed EXR.
"""

import array
import json
import os
import resource
import sys
import time

import bpy
import mathutils

folder, num_threads, many_samples = sys.argv[sys.argv.index("--") + 1 :][:3]
with open(f"{folder}/scene.json") as file:
    description = json.load(file)


def read(name, kind):
    path = f"{folder}/{name}"
    numbers = array.array(kind)
    with open(path, "rb") as file:
        numbers.fromfile(file, os.path.getsize(path) // numbers.itemsize)
    return numbers


def make_ground():
    vertices = read("vertices.f32", "f")
    triangles = read("triangles.i32", "i")
    num_triangles = len(triangles) // 3
    mesh = bpy.data.meshes.new("ground")
    mesh.vertices.add(len(vertices) // 3)
    mesh.vertices.foreach_set("co", vertices)
    mesh.loops.add(len(triangles))
    mesh.loops.foreach_set("vertex_index", triangles)
    mesh.polygons.add(num_triangles)
    mesh.polygons.foreach_set("loop_start", array.array("i", range(0, len(triangles), 3)))
    mesh.polygons.foreach_set("loop_total", array.array("i", [3]) * num_triangles)
    mesh.update(calc_edges=True)
    material = bpy.data.materials.new("ground")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    noise = nodes.new("ShaderNodeTexNoise")
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(noise.outputs["Color"], diffuse.inputs["Color"])
    material.node_tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    mesh.materials.append(material)
    ground = bpy.data.objects.new("ground", mesh)
    ground.pass_index = 1
    bpy.context.collection.objects.link(ground)


def make_light():
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.angle = 0.0
    sun.data.energy = 3.0
    towards = mathutils.Vector(description["sun_direction_world"])
    sun.rotation_euler = towards.to_track_quat("Z", "Y").to_euler()
    bpy.context.collection.objects.link(sun)
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.4, 0.6, 0.9, 1.0)
    bpy.context.scene.world = world


def make_camera():
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "HORIZONTAL"
    data.lens = data.sensor_width * description["focal_px"] / description["width_px"]
    data.clip_start, data.clip_end = 1.0, 1e5
    camera = bpy.data.objects.new("camera", data)
    camera.rotation_mode = "QUATERNION"
    bpy.context.collection.objects.link(camera)
    for frame, rows in enumerate(description["world_from_camera"]):
        # Blender's cameras look along -z, with y up.
        matrix = mathutils.Matrix(rows) @ mathutils.Matrix.Diagonal((1.0, -1.0, -1.0, 1.0))
        camera.location, camera.rotation_quaternion, _ = matrix.decompose()
        camera.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("rotation_quaternion", frame=frame)
    bpy.context.scene.camera = camera


def frame_times(num_samples, has_passes):
    """Seconds of the first frame, and of each of the others."""
    scene = bpy.context.scene
    scene.cycles.samples = num_samples
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = has_passes
    layer.use_pass_vector = layer.use_pass_object_index = has_passes
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER" if has_passes else "PNG"
    if has_passes:
        scene.render.image_settings.exr_codec = "NONE"
        scene.render.image_settings.color_depth = "32"
    else:
        scene.render.image_settings.color_depth = "8"
        scene.render.image_settings.compression = 10
    times = []
    for frame in range(len(description["world_from_camera"])):
        scene.frame_set(frame)
        scene.render.filepath = f"{folder}/{num_samples}-{int(has_passes)}-{frame}"
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        times.append(time.perf_counter() - start)
    return {"first_s": times[0], "warm_s": times[1:]}


bpy.ops.wm.read_factory_settings(use_empty=True)
make_ground()
make_light()
make_camera()
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.use_adaptive_sampling = False
scene.cycles.use_denoising = False
scene.cycles.max_bounces = 0
scene.cycles.pixel_filter_type = "BOX"
scene.cycles.filter_width = 1.0
scene.render.use_persistent_data = True
scene.render.threads_mode = "FIXED"
scene.render.threads = int(num_threads)
scene.render.resolution_x = description["width_px"]
scene.render.resolution_y = description["height_px"]
scene.render.resolution_percentage = 100
times = {
    "facts": frame_times(1, True),
    "one": frame_times(1, False),
    "many": frame_times(int(many_samples), False),
}
times["peak_bytes"] = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
with open(f"{folder}/times.json", "w") as file:
    json.dump(times, file)
