#include <gtest/gtest.h>

#include <algorithm>

#include "tests/tiler/model_files.h"
#include "tiler/objects/model_file.h"

/// Files that say all that the readers of models use. Nothing of them is unknown, each name that a table has as used is
/// met, and what is added is unknown.
namespace terracast::test {
namespace {

using core::KnownName;
using core::KnownTable;
using core::Ledger;
using tiler::Model;

std::span<const KnownName> table(std::string_view reader) {
  static const std::vector<KnownTable> tables = tiler::model_tables();
  const auto found = std::find_if(tables.begin(), tables.end(),
                                  [&](const KnownTable& one) { return one.reader == reader; });
  return found == tables.end() ? std::span<const KnownName>() : found->names;
}

bool is_met(const Ledger& ledger, std::string_view name) {
  const std::array<KnownName, 1> pattern = {{{name, ""}}};
  return std::any_of(ledger.entries().begin(), ledger.entries().end(), [&](const auto& one) {
    return one.second.num_used > 0 && core::find_known(pattern, one.first) != nullptr;
  });
}
std::vector<std::string> unknown(const Ledger& ledger) {
  std::vector<std::string> names;
  for (const auto& [name, one] : ledger.entries())
    if (one.num_unknown > 0 || one.num_not_understood() > 0) names.push_back(name);
  return names;
}

void expect_law(const Model& model, std::string_view reader) {
  ASSERT_FALSE(table(reader).empty()) << reader;
  for (const KnownName& one : table(reader)) {
    EXPECT_FALSE(one.words.empty()) << one.name;
    EXPECT_TRUE(!one.is_used || is_met(model.ledger, one.name)) << one.name;
  }
}

class ModelLedger : public testing::Test {
 protected:
  Model read(const std::string& name, const std::string& text) {
    write_text(folder_ / name, text);
    return read_as_it_is(folder_ / name);
  }
  const ScratchFolder folder_;
};

TEST_F(ModelLedger, OfObjAndItsLibraries) {
  write_halves(folder_ / "halves.png");
  const std::string library =
      "newmtl a\nKd 1 1 1\nTr 0\nd 1\nmap_Kd -s 1 1 -o 0 0 -clamp off halves.png\n"
      "Ka 0 0 0\nKs 0 0 0\nNs 10\nillum 2\n";
  const std::string text =
      "mtllib a.mtl\no a\ng b\ns off\nv 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 1 1 0 1 1 1\nvt 0 0\nvn 0 0 "
      "1\n"
      "usemtl a\nf 1/1/1 2/1/1 3/1/1\nfo 1/1/1 2/1/1 3/1/1\nl 1 2\np 1\n";
  write_text(folder_ / "a.mtl", library);
  const Model model = read("a.obj", text);
  EXPECT_EQ(unknown(model.ledger), std::vector<std::string>{});
  expect_law(model, "OBJ");
  expect_law(model, "MTL");
  EXPECT_EQ(unknown(read("a.obj", text + "glow 1\n").ledger), std::vector<std::string>{"OBJ glow"});
  write_text(folder_ / "a.mtl", library + "glow 1\n");
  EXPECT_EQ(unknown(read("a.obj", text).ledger), std::vector<std::string>{"MTL glow"});
}

TEST_F(ModelLedger, OfPly) {
  write_halves(folder_ / "halves.png");
  const auto text = [](const std::string& head, const std::string& value) {
    std::string vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    int num_more = 0;
    for (const char* name : {"red", "green", "blue", "r", "g", "b", "diffuse_red", "diffuse_green",
                             "diffuse_blue", "u", "v", "s", "t", "texture_u", "texture_v"}) {
      vertex += fmt::format("property float {}\n", name);
      ++num_more;
    }
    std::string rows;
    for (const char* place : {"0 0 0", "1 0 0", "0 1 0"}) {
      rows += place;
      for (int k = 0; k < num_more; ++k) rows += " 1";
      rows += "\n";
    }
    return "ply\nformat ascii 1.0\ncomment TextureFile halves.png\n" + vertex +
           "element face 1\nproperty list uchar int vertex_indices\nproperty list uchar int "
           "vertex_index\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty "
           "list "
           "uchar float texcoord\nproperty int texnumber\n"
           "element tristrips 1\nproperty list int int vertex_indices\nproperty list int int "
           "vertex_index\n" +
           head + "end_header\n" + rows +
           "3 0 1 2 3 0 1 2 1 1 1 6 0 0 1 0 0 1 0\n3 0 1 2 3 0 1 2\n" + value;
  };
  const Model model = read("a.ply", text("", ""));
  EXPECT_EQ(unknown(model.ledger), std::vector<std::string>{});
  expect_law(model, "PLY");
  const Model more = read("a.ply", text("element glow 1\nproperty int heat\n", "7\n"));
  EXPECT_EQ(unknown(more.ledger), (std::vector<std::string>{"PLY glow", "PLY glow.heat"}));
}

/// All members that are used, in one file.
std::string gltf_text(const std::string& more) {
  const auto png = core::encode_png(core::Image8(2, 2, 3));
  GltfText gltf;
  gltf.add("VEC3", kSquare);
  gltf.add("SCALAR", kSquareIndices);
  gltf.add("VEC2", std::vector<float>(8, 0.5F));
  gltf.add("VEC4", std::vector<float>(16, 1.0F));
  gltf.add("VEC4", std::vector<std::uint8_t>(16, 0));
  gltf.add("VEC4", std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  gltf.add("MAT4", std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  const int strided = gltf.add_view(kSquare, R"(, "byteStride": 12)");
  const int rows = gltf.add_view(std::vector<std::uint16_t>{0});
  const int values = gltf.add_view(std::vector<float>{0, 0, 1});
  const int target = gltf.add_text(fmt::format(
      R"({{"bufferView": {}, "byteOffset": 0, "componentType": 5126, "normalized": false, "type": "VEC3", "count": 4, "sparse": {{"count": 1, "indices": {{"bufferView": {}, "componentType": 5123}}, "values": {{"bufferView": {}}}}}}})",
      strided, rows, values));
  gltf.add("VEC3", std::vector<float>(6, 1.0F));
  gltf.add("VEC4", std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1});
  const int image = gltf.add_view(std::vector<std::byte>(png.begin(), png.end()));
  return gltf.text(fmt::format(
      R"("scene": 0, "scenes": [{{"nodes": [0, 1, 2, 3, 4]}}],
"extensionsUsed": ["KHR_texture_transform", "KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"],
"nodes": [
  {{"mesh": 0, "skin": 0, "weights": [0.5]}},
  {{"mesh": 1, "translation": [1, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]}},
  {{"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1], "children": [5]}},
  {{"mesh": 1, "extensions": {{"EXT_mesh_gpu_instancing": {{"attributes": {{"TRANSLATION": {0}, "ROTATION": {1}, "SCALE": {0}}}}}}}}},
  {{"extensions": {{"KHR_node_visibility": {{"visible": false}}}}}}, {{}}],
"skins": [{{"joints": [2], "inverseBindMatrices": 6}}],
"meshes": [
  {{"weights": [1], "primitives": [{{"mode": 4, "attributes": {{"POSITION": 0, "TEXCOORD_0": 2, "COLOR_0": 3, "JOINTS_0": 4, "WEIGHTS_0": 5}}, "indices": 1, "material": 0, "targets": [{{"POSITION": {2}}}]}}]}},
  {{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 2}}, "indices": 1, "material": 1}}]}}],
"materials": [
  {{"alphaMode": "OPAQUE", "pbrMetallicRoughness": {{"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0,
    "baseColorTexture": {{"index": 0, "texCoord": 0, "extensions": {{"KHR_texture_transform": {{"offset": [0, 0], "rotation": 0, "scale": [1, 1], "texCoord": 0}}}}}}}}}},
  {{"extensions": {{"KHR_materials_pbrSpecularGlossiness": {{"diffuseFactor": [1, 1, 1, 1], "diffuseTexture": {{"index": 1}}}}}}}}],
"textures": [{{"source": 0, "sampler": 0}}, {{"source": 1}}], "samplers": [{{"wrapS": 10497, "wrapT": 10497}}],
"images": [{{"bufferView": {3}, "mimeType": "image/png", "name": "inner"}}, {{"uri": "halves.png"}}]{4})",
      target + 1, target + 2, target, image, more));
}

TEST_F(ModelLedger, OfGltf) {
  write_halves(folder_ / "halves.png");
  const Model model = read("a.gltf", gltf_text(""));
  EXPECT_EQ(unknown(model.ledger), std::vector<std::string>{});
  expect_law(model, "glTF");
  EXPECT_EQ(model.textures.size(), 2U);
  const auto more = [&](const std::string& text) {
    return unknown(read("a.gltf", gltf_text(text)).ledger);
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(more(R"(, "glow": 1)"), Names{"glTF root.glow"});
  EXPECT_EQ(more(R"(, "extensions": {"ACME_glow": {}})"), Names{"glTF extension ACME_glow"});
}

}  // namespace
}  // namespace terracast::test
