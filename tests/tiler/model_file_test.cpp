#include "tiler/objects/model_file.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <set>

#include "core/image_io.h"
#include "core/json.h"
#include "tests/support/test_data.h"
#include "tests/tiler/object_worlds.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/tile_stage.h"
#include "validate/world_check/world_check.h"
#include "world/tile_id.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using core::Json;
using Eigen::Matrix4d;
using Eigen::Vector3d;
using tiler::Model;
using tiler::ModelOptions;

Model read(const std::filesystem::path& file,
           const std::function<void(ModelOptions&)>& change = {}) {
  ModelOptions options;
  options.name = "thing";
  options.file = {.written = file.filename().string(), .resolved = file};
  if (change) change(options);
  std::uint64_t texture_bytes_left = world::kMaxTexturesBytes;
  return tiler::read_model(options, texture_bytes_left);
}

struct Extents {
  Vector3d lowest = Vector3d::Constant(1e30);
  Vector3d highest = Vector3d::Constant(-1e30);
  Vector3d size() const { return highest - lowest; }
};
Extents extents_of(const world::Shape& shape) {
  Extents extents;
  for (const Eigen::Vector3i& vertex : shape.vertices_steps) {
    extents.lowest = extents.lowest.cwiseMin(vertex.cast<double>() * world::kHeightStep_m);
    extents.highest = extents.highest.cwiseMax(vertex.cast<double>() * world::kHeightStep_m);
  }
  return extents;
}

std::int64_t count_of(const Model& model, const std::string& name) {
  for (const auto& [own, count] : model.counts)
    if (own == name) return count;
  return 0;
}

/// What a .glb holds, read by hand: every vertex of every node by its own matrix, in glTF's axes.
struct ByHand {
  Extents extents;
  std::int64_t num_triangles = 0;
};
ByHand read_by_hand(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), {});
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  const std::size_t json_size = word(12);
  const Json root = Json::parse(bytes.substr(20, json_size), file.string());
  const std::size_t binary = 20 + json_size + 8;
  ByHand found;
  const std::function<void(std::size_t, const Matrix4d&)> visit = [&](std::size_t number,
                                                                      const Matrix4d& parent) {
    const Json& node = root.at("nodes").at(number);
    Matrix4d own = Matrix4d::Identity();
    if (node.has("matrix")) {
      const std::vector<double> m = node.at("matrix").numbers();
      for (int k = 0; k < 16; ++k) own(k % 4, k / 4) = m[static_cast<std::size_t>(k)];
    } else {
      Eigen::Affine3d affine = Eigen::Affine3d::Identity();
      if (node.has("translation")) {
        const std::vector<double> t = node.at("translation").numbers();
        affine.translate(Vector3d(t[0], t[1], t[2]));
      }
      if (node.has("rotation")) {
        const std::vector<double> q = node.at("rotation").numbers();
        affine.rotate(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized());
      }
      if (node.has("scale")) {
        const std::vector<double> s = node.at("scale").numbers();
        affine.scale(Vector3d(s[0], s[1], s[2]));
      }
      own = affine.matrix();
    }
    const Matrix4d matrix = parent * own;
    if (node.has("mesh")) {
      const Json& mesh = root.at("meshes").at(static_cast<std::size_t>(node.at("mesh").integer()));
      for (std::size_t p = 0; p < mesh.at("primitives").size(); ++p) {
        const Json& primitive = mesh.at("primitives").at(p);
        const Json& accessor =
            root.at("accessors")
                .at(static_cast<std::size_t>(primitive.at("attributes").at("POSITION").integer()));
        const Json& view = root.at("bufferViews")
                               .at(static_cast<std::size_t>(accessor.at("bufferView").integer()));
        const auto offset = [](const Json& of) {
          return of.has("byteOffset") ? static_cast<std::size_t>(of.at("byteOffset").integer())
                                      : 0U;
        };
        const std::size_t stride = view.has("byteStride")
                                       ? static_cast<std::size_t>(view.at("byteStride").integer())
                                       : 12U;
        const auto count = static_cast<std::size_t>(accessor.at("count").integer());
        for (std::size_t i = 0; i < count; ++i) {
          float at[3];
          std::memcpy(at, bytes.data() + binary + offset(view) + offset(accessor) + i * stride, 12);
          const Vector3d place = (matrix * Eigen::Vector4d(at[0], at[1], at[2], 1.0)).head<3>();
          found.extents.lowest = found.extents.lowest.cwiseMin(place);
          found.extents.highest = found.extents.highest.cwiseMax(place);
        }
        found.num_triangles +=
            (primitive.has("indices")
                 ? root.at("accessors")
                       .at(static_cast<std::size_t>(primitive.at("indices").integer()))
                       .at("count")
                       .integer()
                 : accessor.at("count").integer()) /
            3;
      }
    }
    if (node.has("children"))
      for (const double child : node.at("children").numbers())
        visit(static_cast<std::size_t>(child), matrix);
  };
  const std::size_t scene =
      root.has("scene") ? static_cast<std::size_t>(root.at("scene").integer()) : 0U;
  for (const double node : root.at("scenes").at(scene).at("nodes").numbers())
    visit(static_cast<std::size_t>(node), Matrix4d::Identity());
  return found;
}

TEST(Models, PublishedOnesHaveTheSizesThatTheirFilesState) {
  TERRACAST_NEEDS_SHARED_DATA("assets");
  int num_models = 0;
  for (const char* folder : {"kenney_city", "kenney_racing", "quaternius"})
    for (const auto& entry :
         std::filesystem::directory_iterator(shared_data() / "assets" / folder)) {
      if (entry.path().extension() != ".glb") continue;
      SCOPED_TRACE(entry.path().filename().string());
      const ByHand truth = read_by_hand(entry.path());
      const Model model = read(entry.path());
      const world::Shape& shape = model.prototype.levels.at(0).shape;
      const Vector3d size = extents_of(shape).size();
      const Vector3d expected = truth.extents.size();
      // y up, z forward, x left. Half a step of the lattice on each side, and floats of 2^-24 of 30 m.
      const double tolerance = world::kHeightStep_m + 4e-6;
      EXPECT_NEAR(size.x(), expected.z(), tolerance);
      EXPECT_NEAR(size.y(), expected.x(), tolerance);
      EXPECT_NEAR(size.z(), expected.y(), tolerance);
      EXPECT_EQ(extents_of(shape).lowest.z(), 0.0) << "its foot is at 0";
      EXPECT_EQ(count_of(model, "triangles") + count_of(model, "triangles without area"),
                truth.num_triangles);
      const bool is_kenney = std::string(folder) != "quaternius";
      EXPECT_EQ(model.textures.size(), is_kenney ? 1U : 0U);
      EXPECT_EQ(shape.uv.empty(), !is_kenney);
      for (std::size_t k = 1; k < model.prototype.levels.size(); ++k)
        EXPECT_LT(model.prototype.levels[k].shape.triangles.size(),
                  model.prototype.levels[k - 1].shape.triangles.size());
      ++num_models;
    }
  EXPECT_EQ(num_models, 18);
}

/// A cube of a metre with a texture, as .gltf and .bin; members may be changed before it is written.
struct Cube {
  std::string version = "2.0";
  std::string buffer = "cube.bin";
  std::string image = "cube.png";
  std::string extra = {};
  std::int64_t stated_bytes = -1;
  int num_indices = 36;
  std::string nodes = R"([{"mesh": 0}])";
  float first_x = 0.0F;
  bool all_flat = false;

  std::filesystem::path write(const std::filesystem::path& folder) const {
    std::string bytes;
    const auto put = [&](auto value) {
      bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    for (int k = 0; k < 8; ++k)
      for (const int bit : {1, 2, 4})
        put(k == 0 && bit == 1 ? first_x : all_flat ? 0.0F : (k & bit) != 0 ? 1.0F : 0.0F);
    for (int k = 0; k < 8; ++k) {
      put((k & 1) != 0 ? 1.0F : 0.0F);
      put((k & 2) != 0 ? 1.0F : 0.0F);
    }
    constexpr std::uint16_t kFaces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                          2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    for (const std::uint16_t corner : kFaces) put(corner);
    write_text(folder / "cube.bin", bytes);
    core::Image8 image_pixels(2, 2, 3);
    const auto png = core::encode_png(image_pixels);
    write_text(folder / "cube.png",
               std::string(reinterpret_cast<const char*>(png.data()), png.size()));
    write_text(
        folder / "cube.gltf",
        fmt::format(
            R"({{"asset": {{"version": "{}"}}, {} "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": {},
  "buffers": [{{"uri": "{}", "byteLength": {}}}],
  "bufferViews": [{{"buffer": 0, "byteOffset": 0, "byteLength": 96}}, {{"buffer": 0, "byteOffset": 96, "byteLength": 64}},
                  {{"buffer": 0, "byteOffset": 160, "byteLength": 72}}],
  "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}},
                {{"bufferView": 1, "componentType": 5126, "count": 8, "type": "VEC2"}},
                {{"bufferView": 2, "componentType": 5123, "count": {}, "type": "SCALAR"}}],
  "images": [{{"uri": "{}"}}], "textures": [{{"source": 0}}],
  "materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [0.5, 0.25, 0.0, 1], "metallicFactor": 0, "baseColorTexture": {{"index": 0}}}}}}],
  "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 1}}, "indices": 2, "material": 0}}]}}]}})",
            version, extra, nodes, buffer,
            stated_bytes < 0 ? static_cast<std::int64_t>(bytes.size()) : stated_bytes, num_indices,
            image));
    return folder / "cube.gltf";
  }
};

TEST(Models, NodesUnitsTurnsAndOriginsAreApplied) {
  const ScratchFolder folder;
  Cube cube;
  cube.nodes =
      R"([{"children": [1], "translation": [10, 0, 0]}, {"mesh": 0, "scale": [2, 3, 4], "translation": [0, 5, 0]}])";
  const std::filesystem::path file = cube.write(folder.path());
  const Extents own = extents_of(read(file, [](ModelOptions& options) { options.origin = "model"; })
                                     .prototype.levels[0]
                                     .shape);
  // glTF x 10 … 12, y 5 … 8, z 0 … 4: forward is z, left is x, up is y.
  EXPECT_EQ(own.lowest, Vector3d(0, 10, 5));
  EXPECT_EQ(own.highest, Vector3d(4, 12, 8));
  const Extents foot = extents_of(
      read(file, [](ModelOptions& options) { options.unit_m = 0.5; }).prototype.levels[0].shape);
  EXPECT_EQ(foot.lowest, Vector3d(-1, -0.5, 0));
  EXPECT_EQ(foot.highest, Vector3d(1, 0.5, 1.5));
  const Extents turned = extents_of(
      read(file, [](ModelOptions& options) { options.yaw_deg = 90.0; }).prototype.levels[0].shape);
  EXPECT_EQ(turned.size(), Vector3d(2, 4, 3));
  const Extents upright = extents_of(
      read(file, [](ModelOptions& options) { options.up = "z"; }).prototype.levels[0].shape);
  EXPECT_EQ(upright.size(), Vector3d(2, 3, 4));
  // A mirrored node's triangles are turned outward again: the volume stays above 0.
  cube.nodes = R"([{"mesh": 0, "scale": [-1, 1, 1]}])";
  const world::Shape mirrored = read(cube.write(folder.path())).prototype.levels[0].shape;
  double volume = 0.0;
  for (const auto& triangle : mirrored.triangles) {
    Vector3d at[3];
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = mirrored.vertices_steps[triangle.corners[k]].cast<double>() * world::kHeightStep_m;
    volume += at[0].dot(at[1].cross(at[2])) / 6.0;
  }
  EXPECT_NEAR(volume, 1.0, 1e-6);
}

TEST(Models, TexturesComeWithTheirModelOrAreCounted) {
  const ScratchFolder folder;
  Cube cube;
  const Model whole = read(cube.write(folder.path()));
  ASSERT_EQ(whole.textures.size(), 1U);
  EXPECT_EQ(whole.prototype.levels[0].shape.finishes.at(0).material, world::Material::Textured);
  // A texture that is not there: the material's own colour, linear 0.5, 0.25, 0 in sRGB.
  cube.image = "gone.png";
  const Model without = read(cube.write(folder.path()));
  EXPECT_EQ(count_of(without, "textures missing"), 1);
  EXPECT_EQ(without.prototype.levels[0].shape.finishes.at(0).color_srgb,
            (std::array<std::uint8_t, 3>{188, 137, 0}));
  write_text(folder / "strange.ktx2", "what is this");
  cube.image = "strange.ktx2";
  EXPECT_EQ(count_of(read(cube.write(folder.path())), "textures of a kind that is not read"), 1);
  // A PNG that says it has 60 000 x 60 000 pixels is refused before any is decoded.
  std::string huge("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xea\x60\0\0\xea\x60\x08\x02\0\0\0\0\0\0\0",
                   33);
  write_text(folder / "huge.png", huge);
  cube.image = "huge.png";
  const std::filesystem::path file = cube.write(folder.path());
  expect_error(ErrorKind::Input, {"huge.png", "60000"}, [&] { read(file); });
  // So is a JPEG: its frame's head says it, and nothing follows.
  write_text(
      folder / "huge.jpg",
      std::string("\xff\xd8\xff\xc0\0\x11\x08\xea\x60\xea\x60\x03\x01\x11\0\x02\x11\0\x03\x11\0"
                  "\xff\xda\0\x0c\x03\x01\0\x02\0\x03\0\0\x3f\0\0\xff\xd9",
                  38));
  cube.image = "huge.jpg";
  const std::filesystem::path with_jpeg = cube.write(folder.path());
  expect_error(ErrorKind::Input, {"huge.jpg", "60000"}, [&] { read(with_jpeg); });
}

// Files of the working folder are named without one.
TEST(Models, WhatIsNamedAndMissingIsNoWayOutOfTheFolder) {
  ScratchFolder folder;
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  write_text(folder / "gone.obj", "mtllib gone.mtl\n" + corners);
  write_text(folder / "other.obj", "mtllib library.mtl\n" + corners);
  write_text(folder / "out.obj", "mtllib ../library.mtl\n" + corners);
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  for (const char* name : {"gone.obj", "other.obj", "./gone.obj"})
    EXPECT_EQ(count_of(read(name), "libraries of materials missing"), 1) << name;
  write_text(folder / "library.mtl", "newmtl red\nKd 0.8 0.1 0.1\n");
  EXPECT_EQ(count_of(read("other.obj"), "libraries of materials missing"), 0);
  expect_error(ErrorKind::Input, {"leads out of the model's folder"}, [] { read("out.obj"); });
  std::filesystem::current_path(before);
}

TEST(Models, BadFilesAreRefusedSayingWhy) {
  const ScratchFolder folder;
  const auto refuses = [&](const Cube& cube, const std::vector<std::string>& words) {
    SCOPED_TRACE(words[0]);
    const std::filesystem::path file = cube.write(folder.path());
    expect_error(ErrorKind::Input, words, [&] { read(file); });
  };
  refuses({.version = "1.0"}, {"glTF 1.0", "only glTF 2"});
  refuses({.buffer = "../cube.bin"}, {"../cube.bin", "folder"});
  refuses({.buffer = "a/../../cube.bin"}, {"leads out"});
  refuses({.buffer = "%2e%2e/cube.bin"}, {"leads out"});
  refuses({.buffer = "/etc/passwd"}, {"/etc/passwd"});
  refuses({.buffer = "file:///etc/passwd"}, {"file:///etc/passwd"});
  refuses({.buffer = "http://example.org/cube.bin"}, {"http"});
  refuses({.image = "../../secret.png"}, {"secret.png"});
  refuses({.buffer = "gone.bin"}, {"gone.bin", "missing"});
  refuses({.buffer = "data:application/octet-stream;base64,AAAA"}, {"232", "holds 3"});
  refuses({.stated_bytes = 4000000000}, {"byteLength", "4000000000"});
  refuses({.stated_bytes = 100000}, {"100000", "232"});
  refuses({.num_indices = 3000000}, {"accessor 2", "3000000"});
  refuses({.extra = R"("extensionsRequired": ["KHR_draco_mesh_compression"],)"},
          {"KHR_draco_mesh_compression"});
  refuses({.nodes = R"([{"mesh": 0, "children": [1]}, {"children": [0]}])"}, {"circle"});
  refuses({.nodes = R"([{"mesh": 0, "children": [7]}])"}, {"child 7"});
  refuses({.nodes = R"([{"mesh": 3}])"}, {"mesh = 3"});
  refuses({.first_x = std::numeric_limits<float>::quiet_NaN()}, {"vertex 0", "no number"});
  refuses({.nodes = R"([{"mesh": 0, "scale": [9000, 1, 1]}])"}, {"unit_m"});
  refuses({.all_flat = true}, {"no triangle"});
  write_text(folder / "old.glb", std::string("glTF\x01\0\0\0\x14\0\0\0\0\0\0\0\0\0\0\0", 20));
  expect_error(ErrorKind::Input, {"glTF 1.0"}, [&] { read(folder / "old.glb"); });
  write_text(folder / "cut.glb", std::string("glTF\x02\0\0\0\xff\xff\0\0\xf0\xff\0\0JSON", 20));
  expect_error(ErrorKind::Input, {"cut.glb"}, [&] { read(folder / "cut.glb"); });
  write_text(folder / "empty.obj", "# nothing\n");
  expect_error(ErrorKind::Input, {"empty.obj"}, [&] { read(folder / "empty.obj"); });
  for (const char* name : {"none.obj", "none.glb", "none.ply"}) {
    write_text(folder / name, "");
    expect_error(ErrorKind::Input, {name, "0 bytes"}, [&] { read(folder / name); });
  }
  write_text(folder / "bomb.ply",
             "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n0\n");
  expect_error(ErrorKind::Input, {"4000000000"}, [&] { read(folder / "bomb.ply"); });
  // Lists of two billion corners in a file of some hundred bytes, of a size below 0, cut off, in text.
  const auto ply = [](const std::string& form, const std::string& count_type) {
    return "ply\nformat " + form + " 1.0\nelement vertex 1\nproperty float x\nproperty float y\n" +
           "property float z\nelement face 1\nproperty list " + count_type +
           " int vertex_indices\nend_header\n";
  };
  const std::string vertex(12, '\0');
  const auto refuses_ply = [&](const std::string& text, const std::vector<std::string>& words) {
    SCOPED_TRACE(text.substr(0, 40));
    write_text(folder / "list.ply", text);
    expect_error(ErrorKind::Input, words, [&] { read(folder / "list.ply"); });
  };
  refuses_ply(
      ply("binary_little_endian", "uint") + vertex + std::string("\0\x94\x35\x77", 4) + vertex,
      {"face 0", "2000000000", "12 bytes"});
  refuses_ply(ply("binary_big_endian", "uint") + vertex + std::string("\x77\x35\x94\0", 4) + vertex,
              {"face 0", "2000000000"});
  refuses_ply(
      ply("binary_little_endian", "int") + vertex + std::string("\xfb\xff\xff\xff", 4) + vertex,
      {"face 0", "no size"});
  refuses_ply(ply("binary_little_endian", "uchar") + vertex.substr(5), {"vertex 0", "cut off"});
  refuses_ply(ply("binary_little_endian", "float") + vertex, {"property list float"});
  refuses_ply(ply("ascii", "uint") + "0 0 0\n2000000000 0 0 0\n", {"face 0", "2000000000"});
  refuses_ply(ply("ascii", "uint") + "0 0 0\n3 0 0\n", {"face 0", "cut off"});
  refuses_ply(ply("ascii", "uint") + "0 0 0\n-3 0 0 0\n", {"face 0", "no size"});
  refuses_ply("ply\nformat ascii 1.0\nelement vertex 1\n", {"header does not end"});
  write_text(folder / "thing.zip", "PK");
  expect_error(ErrorKind::Config, {".gltf"}, [&] { read(folder / "thing.zip"); });
  expect_error(ErrorKind::Io, {"gone.obj"}, [&] { read(folder / "gone.obj"); });
  // Pictures that an OBJ names, and links that lead out, too.
  std::filesystem::create_directories(folder / "inner");
  const std::string square = "usemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
  write_text(folder / "inner" / "own.mtl", "newmtl a\nmap_Kd ../secret.png\n");
  write_text(folder / "inner" / "picture.obj", "mtllib own.mtl\n" + square);
  write_text(folder / "secret.png", "nobody's business");
  expect_error(ErrorKind::Input, {"secret.png", "folder"},
               [&] { read(folder / "inner" / "picture.obj"); });
  std::filesystem::create_symlink(folder / "secret.mtl", folder / "inner" / "linked.mtl");
  write_text(folder / "secret.mtl", "newmtl a\nKd 1 0 0\n");
  write_text(folder / "inner" / "linked.obj", "mtllib linked.mtl\n" + square);
  expect_error(ErrorKind::Input, {"linked.mtl", "folder"},
               [&] { read(folder / "inner" / "linked.obj"); });
  write_text(folder / "inner" / "out.obj",
             "mtllib ../secret.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write_text(folder / "secret.mtl", "newmtl a\nKd 1 0 0\n");
  expect_error(ErrorKind::Input, {"secret.mtl", "folder"},
               [&] { read(folder / "inner" / "out.obj"); });
}

TEST(Models, PlacesThatAreNoNumbersAreRefusedInObjAndPly) {
  const ScratchFolder folder;
  for (const char* word : {"nan", "inf"}) {
    SCOPED_TRACE(word);
    write_text(folder / "house.obj", fmt::format("v 0 0 0\nv 4 0 0\nv 4 {} 3\nf 1 2 3\n", word));
    expect_error(ErrorKind::Input, {"house.obj"}, [&] { read(folder / "house.obj"); });
    write_text(folder / "flag.ply",
               fmt::format("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty "
                           "float y\nproperty float z\nelement face 1\nproperty list uchar int "
                           "vertex_indices\nend_header\n0 0 0\n2 {} 0\n2 0 1\n3 0 1 2\n",
                           word));
    expect_error(ErrorKind::Input, {"flag.ply"}, [&] { read(folder / "flag.ply"); });
  }
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    SCOPED_TRACE(value);
    const std::array<float, 9> places = {0, 0, 0, 2, 0, 0, 2, 0, value};
    const std::array<int, 3> corners = {0, 1, 2};
    write_text(folder / "flag.ply",
               "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty "
               "float y\nproperty float z\nelement face 1\nproperty list uchar int "
               "vertex_indices\nend_header\n" +
                   std::string(reinterpret_cast<const char*>(places.data()), sizeof places) + '\3' +
                   std::string(reinterpret_cast<const char*>(corners.data()), sizeof corners));
    expect_error(ErrorKind::Input, {"flag.ply", "vertex", "no number"},
                 [&] { read(folder / "flag.ply"); });
  }
}

/// A round of so many corners, as one face.
std::string round_obj(int num_corners) {
  std::string text;
  std::string face = "f";
  for (int i = 0; i < num_corners; ++i) {
    const double turn = 2.0 * 3.14159265358979 * i / num_corners;
    text += fmt::format("v {:.4f} {:.4f} 0\n", 100.0 * std::cos(turn), 100.0 * std::sin(turn));
    face += fmt::format(" {}", i + 1);
  }
  return text + face + "\n";
}
std::string round_ply(int num_corners) {
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float "
      "y\nproperty float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n",
      num_corners);
  const auto put = [&](auto value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (int i = 0; i < num_corners; ++i) {
    const double turn = 2.0 * 3.14159265358979 * i / num_corners;
    put(static_cast<float>(100.0 * std::cos(turn)));
    put(static_cast<float>(100.0 * std::sin(turn)));
    put(0.0F);
  }
  put(num_corners);
  for (int i = 0; i < num_corners; ++i) put(i);
  return text;
}

/// Triangulation took the square of a face's corners (2026-11: 10 s of 40 000, and no end was seen of a million).
TEST(Models, FacesOfVeryManyCornersAreRefusedAtOnce) {
  const ScratchFolder folder;
  const std::vector<std::pair<std::string, std::function<std::string(int)>>> kinds = {
      {"round.obj", round_obj}, {"round.ply", round_ply}};
  for (const auto& [name, text] : kinds) {
    SCOPED_TRACE(name);
    // A polygon of n corners is n - 2 triangles.
    write_text(folder / name, text(1000));
    EXPECT_EQ(read(folder / name, [](ModelOptions& options) { options.up = "z"; })
                  .prototype.levels[0]
                  .shape.triangles.size(),
              998U);
    write_text(folder / name, text(1001));
    expect_error(ErrorKind::Input, {name, "face 0 has 1001 corners", "at most 1000", "triangles"},
                 [&] { read(folder / name); });
    write_text(folder / name, text(1'000'000));
    const auto start = std::chrono::steady_clock::now();
    expect_error(ErrorKind::Input, {name, "face 0 has 1000000 corners"},
                 [&] { read(folder / name); });
    // Seconds where reading grows with the file; hours where it grows with its square.
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  }
}

TEST(Models, ObjAndPlyWithoutNormalsAreRead) {
  const ScratchFolder folder;
  write_text(folder / "red.mtl", "newmtl red\nKd 0.8 0.1 0.1\n");
  write_text(folder / "house.obj",
             "mtllib red.mtl\nusemtl red\nv 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nv 2 5 1.5\nf 1 2 3 "
             "4\nf 1 5 2\nf 2 5 3\nf 3 5 4\nf 4 5 1\n");
  const Model house = read(folder / "house.obj");
  EXPECT_EQ(house.prototype.levels[0].shape.triangles.size(), 6U);
  EXPECT_EQ(extents_of(house.prototype.levels[0].shape).size(), Vector3d(3, 4, 5));
  std::set<std::array<std::uint8_t, 3>> colors;
  for (const auto& triangle : house.prototype.levels[0].shape.triangles)
    colors.insert(house.prototype.levels[0].shape.finishes[triangle.finish].color_srgb);
  EXPECT_EQ(colors, (std::set<std::array<std::uint8_t, 3>>{{204, 26, 26}}));
  write_text(folder / "flag.ply",
             "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float "
             "y\nproperty float z\nproperty uchar red\nproperty uchar "
             "green\nproperty uchar blue\nelement face 2\nproperty list uchar int "
             "vertex_indices\nend_header\n0 0 0 255 0 0\n2 0 0 255 0 0\n2 0 1 255 0 "
             "0\n0 0 1 255 0 0\n3 0 1 2\n3 0 2 3\n");
  const Model flag = read(folder / "flag.ply", [](ModelOptions& options) { options.up = "z"; });
  EXPECT_EQ(flag.prototype.levels[0].shape.triangles.size(), 2U);
  EXPECT_EQ(extents_of(flag.prototype.levels[0].shape).size(), Vector3d(2, 0, 1));
  const world::Finish& finish =
      flag.prototype.levels[0].shape.finishes[flag.prototype.levels[0].shape.triangles[0].finish];
  EXPECT_GT(finish.color_srgb[0], 240);
  EXPECT_LT(finish.color_srgb[1], 16);
}

/// Tiled, and checked as `terracast world check` does.
TEST(Models, ThatAreOpenMeshesAreToldOfAndNotWrong) {
  const ScratchFolder folder;
  write_text(folder / "card.obj", "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nf 1 2 3 4\n");
  write_text(folder / "wedge.obj",
             "v 0 0 0\nv 2 0 0\nv 0 0 2\nv 0 2 0\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  write_text(folder / "list.csv", "thing,x,y\ncard,10,20\nwedge,-30,5\nvan,60,60\n");
  const auto model = [&](const std::string& name) {
    return fmt::format("[[models]]\nname = \"{}\"\nfile = \"{}\"\n", name,
                       (folder / (name + ".obj")).string());
  };
  tiler::WorldOptions options = world_of("plane");
  options.layers = {
      objects_of(fmt::format("placements = [\"{}\"]\n", (folder / "list.csv").string()) +
                 model("card") + model("wedge"))};
  const core::Log log("test", core::LogLevel::Off);
  const core::Context context{.log = log, .num_threads = 0, .events_file = {}};
  const world::TileStore store =
      tiler::run_tile_stage(*prepare(options), {}, folder / "world", context);
  const world_check::WorldFaults faults = world_check::check_world(store, context);
  EXPECT_TRUE(faults.is_right()) << world_check::table_of(faults, store.manifest());
  // What the files say is in the manifest: five faces.
  const auto& entries = store.manifest().layers.at(0).ledger.entries();
  ASSERT_EQ(entries.count("OBJ f"), 1U);
  EXPECT_EQ(entries.at("OBJ f").num_used, 5);
  ASSERT_EQ(store.manifest().prototypes.size(), 3U);
  for (const world::PrototypeInfo& prototype : store.manifest().prototypes)
    EXPECT_EQ(prototype.is_model, prototype.name == "card" || prototype.name == "wedge")
        << prototype.name;
  const Json told = world_check::json_from(faults, store.manifest()).at("information");
  EXPECT_EQ(told.at(0).at("name").string(), "open_model");
  EXPECT_EQ(told.at(0).at("asked").integer(), 2);
  EXPECT_EQ(told.at(0).at("found").integer(), 1);
  EXPECT_EQ(told.at(0).at("examples").strings(),
            std::vector<std::string>{"model card: 4 open edges"});
  EXPECT_EQ(told.at(1).at("found").integer(), 0);
}

}  // namespace
}  // namespace terracast::test
