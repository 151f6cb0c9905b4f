#include <gtest/gtest.h>

#include <cmath>

#include "tests/tiler/model_files.h"

/// glTF 2 as its specification has it. Expected places and colours are worked out by hand; codes are those of IEC 61966-2-1
/// (linear 0.0625: 71, 0.125: 99, 0.25: 137, 0.5: 188).
namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2f;
using Eigen::Vector3d;
using tiler::Model;

const std::string kScene = R"("scene": 0, "scenes": [{"nodes": [0]}])";

class Gltf : public testing::Test {
 protected:
  Model read(const GltfText& gltf, const std::string& members) {
    write_text(folder_ / "model.gltf", gltf.text(members));
    return read_as_it_is(folder_ / "model.gltf");
  }
  void refuses(const GltfText& gltf, const std::string& members,
               const std::vector<std::string>& words) {
    SCOPED_TRACE(words[0]);
    expect_error(ErrorKind::Input, words, [&] { read(gltf, members); });
  }
  /// A square with an attribute more, and a material.
  Model square(GltfText gltf, const std::string& attributes, const std::string& material,
               const std::string& more = "") {
    const int position = gltf.add("VEC3", kSquare);
    const int indices = gltf.add("SCALAR", kSquareIndices);
    return read(
        gltf,
        fmt::format(
            R"({}, "nodes": [{{"mesh": 0}}], "materials": [{}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {}{}}}, "indices": {}, "material": 0}}]}}]{})",
            kScene, material, position, attributes, indices, more));
  }
  const ScratchFolder folder_;
};

template <class Value>
std::vector<Value> four_times(const std::vector<Value>& values) {
  std::vector<Value> all;
  for (int i = 0; i < 4; ++i) all.insert(all.end(), values.begin(), values.end());
  return all;
}

// Until 2026-11 colours of vertices were taken for sRGB, and stood for the factor.
TEST_F(Gltf, FactorsAndColoursOfVerticesAreLinearAndMultiply) {
  const std::string factor =
      R"({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 1], "metallicFactor": 0}})";
  EXPECT_EQ(color(square({}, "", factor)), (Codes{188, 137, 255}));
  const auto with_colors = [&](auto values, const std::string& type, bool is_share) {
    GltfText gltf;
    const int row = gltf.add(type, four_times(values), is_share);
    return color(square(gltf, fmt::format(R"(, "COLOR_0": {})", row), factor));
  };
  const Codes expected = {137, 71, 188};  // 0.25, 0.0625, 0.5
  EXPECT_EQ(with_colors(std::vector<float>{0.5, 0.25, 0.5}, "VEC3", false), expected);
  EXPECT_EQ(with_colors(std::vector<float>{0.5, 0.25, 0.5, 0.1F}, "VEC4", false), expected);
  EXPECT_EQ(with_colors(std::vector<std::uint16_t>{32768, 16384, 32768, 65535}, "VEC4", true),
            expected);
  // 0.5 x 102 / 255 = 0.2: 124. 0.25 x 204 / 255 = 0.2: 124. 51 / 255 = 0.2: 124.
  EXPECT_EQ(with_colors(std::vector<std::uint8_t>{102, 204, 51, 255}, "VEC4", true),
            (Codes{124, 124, 124}));
}

TEST_F(Gltf, ColoursOfCornersAreMixedInLinearLight) {
  GltfText gltf;
  // Of the first triangle red is 1, 0.5 and 0, of the second 1, 0 and 0.5; green is 0 but once.
  const int row = gltf.add("VEC3", std::vector<float>{1, 0, 0, 0.5, 0, 0, 0, 0, 0, 0.5, 0.75, 0});
  const Model model = square(gltf, fmt::format(R"(, "COLOR_0": {})", row),
                             R"({"pbrMetallicRoughness": {"metallicFactor": 0}})");
  EXPECT_EQ(color(model, 0), (Codes{188, 0, 0}));
  EXPECT_EQ(color(model, 1), (Codes{188, 137, 0}));
}

TEST_F(Gltf, PicturesAreMultipliedByFactorsAndColoursOfVertices) {
  write_halves(folder_ / "halves.png");
  GltfText gltf;
  const int colors = gltf.add("VEC3", four_times<float>({0.5, 1, 0.5}));
  const int places = gltf.add("VEC2", std::vector<float>{0, 1, 1, 1, 1, 0, 0, 0});
  const Model model = square(
      gltf, fmt::format(R"(, "COLOR_0": {}, "TEXCOORD_0": {})", colors, places),
      R"({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 1, 1], "baseColorTexture": {"index": 0}}})",
      R"(, "textures": [{"source": 0}], "images": [{"uri": "halves.png"}])");
  EXPECT_EQ(look(model).material, world::Material::Textured);
  EXPECT_EQ(color(model), (Codes{137, 188, 188}));
  ASSERT_EQ(model.textures.size(), 1U);
  EXPECT_EQ(model.textures[0].image(0, 0, 0), 255) << "the picture stays as it is";
  // Its first row is the upper one: y of glTF runs downward.
  EXPECT_EQ(uv(finest(model), 0, 0), Vector2f(0, 0));
  EXPECT_EQ(uv(finest(model), 0, 2), Vector2f(1, 1));
}

TEST_F(Gltf, AlphaOfPicturesCountsWhereTheMaterialSaysSo) {
  write_halves(folder_ / "halves.png", 4);
  for (const auto& [mode, channels] :
       {std::pair("OPAQUE", 3), std::pair("MASK", 4), std::pair("BLEND", 4)}) {
    GltfText gltf;
    const int places = gltf.add("VEC2", std::vector<float>{0, 1, 1, 1, 1, 0, 0, 0});
    const Model model = square(
        gltf, fmt::format(R"(, "TEXCOORD_0": {})", places),
        fmt::format(
            R"({{"alphaMode": "{}", "pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0}}}}}})",
            mode),
        R"(, "textures": [{"source": 0}], "images": [{"uri": "halves.png"}])");
    EXPECT_EQ(model.textures.at(0).image.channels(), channels) << mode;
    EXPECT_EQ(count_in(model, "materials that let light through, shown opaque"),
              mode == std::string("BLEND") ? 1 : 0);
  }
}

/// The place on the picture of the square's corner at (1, 1, 0), of three sets that say (0.1 n, 0.2 n).
class GltfSets : public Gltf {
 protected:
  Vector2f place(const std::string& info) {
    write_halves(folder_ / "halves.png");
    GltfText gltf;
    std::string attributes;
    for (int set = 0; set < 3; ++set) {
      const float n = static_cast<float>(set + 1);
      attributes += fmt::format(R"(, "TEXCOORD_{}": {})", set,
                                gltf.add("VEC2", four_times<float>({0.1F * n, 0.2F * n})));
    }
    model_ =
        square(gltf, attributes,
               fmt::format(
                   R"({{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0{}}}}}}})", info),
               R"(, "textures": [{"source": 0}], "images": [{"uri": "halves.png"}])");
    return uv(finest(model_), 0, 2);
  }
  static std::string transform(const std::string& members) {
    return R"(, "extensions": {"KHR_texture_transform": {)" + members + "}}";
  }
  Model model_;
};

void expect_near(const Vector2f& found, double u, double v) {
  EXPECT_NEAR(found.x(), u, 1e-6);
  EXPECT_NEAR(found.y(), v, 1e-6);
}

// Until 2026-11 the first was read whatever the texture named.
TEST_F(GltfSets, TheSetThatATextureNamesIsRead) {
  expect_near(place(""), 0.1, 1 - 0.2);
  expect_near(place(R"(, "texCoord": 1)"), 0.2, 1 - 0.4);
  expect_near(place(R"(, "texCoord": 2)"), 0.3, 1 - 0.6);
  expect_near(place(R"(, "texCoord": 1)" + transform(R"("texCoord": 2)")), 0.3, 1 - 0.6);
  EXPECT_EQ(entry(model_, "glTF attribute TEXCOORD_2").num_used, 1);
  EXPECT_EQ(entry(model_, "glTF attribute TEXCOORD_0").num_ignored, 1);
  // A set that is not there is told.
  place(R"(, "texCoord": 7)");
  EXPECT_EQ(entry(model_, "glTF textureInfo.texCoord").num_not_understood(), 1);
}

TEST_F(GltfSets, TransformationsScaleTurnAndMove) {
  expect_near(place(transform(R"("offset": [0.25, 0.5])")), 0.35, 1 - 0.7);
  expect_near(place(transform(R"("scale": [2, 3])")), 0.2, 1 - 0.6);
  // A quarter turn anticlockwise where v runs downward: (u, v) to (v, -u).
  expect_near(place(transform(R"("rotation": 1.5707963267948966)")), 0.2, 1 + 0.1);
  // Scaled to (0.2, 0.6), turned to (0.6, -0.2), moved to (1.6, 0.3).
  expect_near(
      place(transform(R"("offset": [1, 0.5], "scale": [2, 3], "rotation": 1.5707963267948966)")),
      1.6, 1 - 0.3);
}

TEST_F(Gltf, SamplersThatDoNotRepeatAreCountedWherePicturesEnd) {
  write_halves(folder_ / "halves.png");
  for (const bool is_beyond : {false, true}) {
    GltfText gltf;
    const float far = is_beyond ? 1.5F : 1.0F;
    const int places = gltf.add("VEC2", std::vector<float>{0, 1, 1, 1, far, 0, 0, 0});
    const Model model = square(
        gltf, fmt::format(R"(, "TEXCOORD_0": {})", places),
        R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})",
        R"(, "textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 33071}], "images": [{"uri": "halves.png"}])");
    EXPECT_EQ(count_in(model, "triangles beyond a picture's edge, where it repeats all the same"),
              is_beyond ? 2 : 0);
  }
}

/// A square that two joints hold, of which the second is moved; its own node is moved, scaled and turned, which moves
/// nothing.
class GltfSkin : public Gltf {
 protected:
  GltfText gltf_;
  std::string members(const std::vector<float>& weights,
                      const std::vector<std::uint8_t>& joints = four_times<std::uint8_t>({0, 1, 0,
                                                                                          0}),
                      const std::string& attributes = R"(, "JOINTS_0": 2, "WEIGHTS_0": 3)") {
    gltf_ = {};
    gltf_.add("VEC3", kSquare);
    gltf_.add("SCALAR", kSquareIndices);
    gltf_.add("VEC4", joints);
    gltf_.add("VEC4", weights);
    // The second joint stood at x = 5 when the square was bound to it.
    gltf_.add("MAT4", std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,  0, 0, 1,
                                         1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -5, 0, 0, 1});
    return R"("scenes": [{"nodes": [0, 1]}], "nodes": [
        {"mesh": 0, "skin": 0, "scale": [0.1, 0.1, 0.1], "translation": [7, 7, 7]},
        {"children": [2, 3], "translation": [0, 0, 2]}, {}, {"translation": [5, 0, 4]}],
        "skins": [{"joints": [2, 3], "inverseBindMatrices": 4}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0)" +
           attributes + R"(}, "indices": 1}]}])";
  }
};

// Until 2026-11 its own node moved it.
TEST_F(GltfSkin, JointsMoveItAndItsOwnNodeDoesNot) {
  const auto height = [&](const std::vector<float>& weights) {
    const std::string text = members(weights);
    const Model model = read(gltf_, text);
    EXPECT_EQ(corner(finest(model), 0, 1).x(), 1.0);
    return corner(finest(model), 0, 1).z();
  };
  EXPECT_EQ(height(four_times<float>({1, 0, 0, 0})), 2.0);
  EXPECT_EQ(height(four_times<float>({0, 1, 0, 0})), 6.0);
  EXPECT_EQ(height(four_times<float>({0.75, 0.25, 0, 0})), 3.0);
  // Shares that do not add up to 1 are shares all the same.
  EXPECT_EQ(height(four_times<float>({0.5, 0.5, 0, 0})), 4.0);
  EXPECT_EQ(height(four_times<float>({0.25, 0.25, 0, 0})), 4.0);
}

TEST_F(GltfSkin, WhatHasNoSharesIsHeldByTheFirstJointAndCounted) {
  const std::string text = members(four_times<float>({0, 0, 0, 0}));
  const Model model = read(gltf_, text);
  EXPECT_EQ(corner(finest(model), 0, 1), Vector3d(1, 0, 2));
  EXPECT_EQ(count_in(model, "vertices without shares of joints"), 4);
}

TEST_F(GltfSkin, JointsThatAreNotThereAreRefused) {
  const std::string far =
      members(four_times<float>({1, 0, 0, 0}), four_times<std::uint8_t>({9, 0, 0, 0}));
  refuses(gltf_, far, {"joint 9 of 2"});
  const std::string none =
      members(four_times<float>({1, 0, 0, 0}), four_times<std::uint8_t>({0, 0, 0, 0}), "");
  refuses(gltf_, none, {"has a skin", "JOINTS_0"});
}

TEST_F(Gltf, TargetsAreMixedInByTheSharesOfTheFile) {
  const auto height = [&](const std::string& of_mesh, const std::string& of_node) {
    GltfText gltf;
    gltf.add("VEC3", kSquare);
    gltf.add("SCALAR", kSquareIndices);
    gltf.add("VEC3", four_times<float>({0, 0, 1}));
    gltf.add("VEC3", four_times<float>({0, 0, 16}));
    const Model model = read(
        gltf,
        fmt::format(
            R"("nodes": [{{"mesh": 0{}}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1, "targets": [{{"POSITION": 2}}, {{"POSITION": 3}}]}}]{}}}])",
            of_node, of_mesh));
    return corner(finest(model), 0, 0).z();
  };
  EXPECT_EQ(height("", ""), 0.0);
  EXPECT_EQ(height(R"(, "weights": [0.5, 0])", ""), 0.5);
  EXPECT_EQ(height(R"(, "weights": [0.5, 0.25])", ""), 4.5);
  EXPECT_EQ(height(R"(, "weights": [0.5, 0])", R"(, "weights": [0, 1])"), 16.0) << "a node's own";
}

TEST_F(Gltf, SparseAccessorsTakeOthersPlaces) {
  for (const bool has_base : {true, false}) {
    GltfText gltf;
    const int base = gltf.add_view(kSquare);
    const int rows = gltf.add_view(std::vector<std::uint16_t>{1, 2});
    const int values = gltf.add_view(std::vector<float>{3, 0, 0, 3, 1, 0});
    gltf.add_text(fmt::format(
        R"({{{}"componentType": 5126, "type": "VEC3", "count": 4, "sparse": {{"count": 2, "indices": {{"bufferView": {}, "componentType": 5123}}, "values": {{"bufferView": {}}}}}}})",
        has_base ? fmt::format(R"("bufferView": {}, )", base) : "", rows, values));
    gltf.add("SCALAR", kSquareIndices);
    const Model model = read(
        gltf,
        R"("nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}])");
    // Without a base the others are 0, and the second triangle has no area.
    EXPECT_EQ(finest(model).triangles.size(), has_base ? 2U : 1U);
    EXPECT_EQ(corner(finest(model), 0, 1), Vector3d(3, 0, 0));
    EXPECT_EQ(corner(finest(model), 0, 2), Vector3d(3, 1, 0));
  }
}

TEST_F(Gltf, SparseRowsThatDoNotGrowOrLieBeyondAreRefused) {
  for (const auto& rows : {std::vector<std::uint16_t>{2, 1}, {1, 1}, {1, 4}}) {
    GltfText gltf;
    const int base = gltf.add_view(kSquare);
    const int indices = gltf.add_view(rows);
    const int values = gltf.add_view(std::vector<float>{3, 0, 0, 3, 1, 0});
    gltf.add_text(fmt::format(
        R"({{"bufferView": {}, "componentType": 5126, "type": "VEC3", "count": 4, "sparse": {{"count": 2, "indices": {{"bufferView": {}, "componentType": 5123}}, "values": {{"bufferView": {}}}}}}})",
        base, indices, values));
    refuses(
        gltf,
        R"("nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}])",
        {"sparse index 1"});
  }
}

TEST_F(Gltf, StripsAndFansAreTriangles) {
  // A strip zigzags; a fan goes round its first corner.
  for (const auto& [mode, places] :
       {std::pair(5, std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0}),
        std::pair(6, std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0.5, 1.5, 0, 0, 1, 0})}) {
    GltfText gltf;
    gltf.add("VEC3", places);
    const Model model = read(
        gltf,
        fmt::format(
            R"("nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "mode": {}}}]}}])",
            mode));
    ASSERT_EQ(finest(model).triangles.size(), 3U) << mode;
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_GT(doubled_area(finest(model), i).z(), 0.0) << "mode " << mode << ", " << i;
      sum += doubled_area(finest(model), i).z();
    }
    EXPECT_EQ(sum, mode == 5 ? 3.0 : 2.5);
  }
}

TEST_F(Gltf, PointsAndLinesAreCountedBesideTriangles) {
  GltfText gltf;
  gltf.add("VEC3", kSquare);
  gltf.add("SCALAR", kSquareIndices);
  std::string primitives = R"({"attributes": {"POSITION": 0}, "indices": 1})";
  for (const int mode : {0, 1, 2, 3})
    primitives += fmt::format(R"(, {{"attributes": {{"POSITION": 0}}, "mode": {}}})", mode);
  const Model model = read(
      gltf,
      fmt::format(R"("nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{}]}}])", primitives));
  EXPECT_EQ(count_in(model, "triangles"), 2);
  EXPECT_EQ(count_in(model, "points, which have no surface"), 4);
  EXPECT_EQ(count_in(model, "lines, which have no surface"), 2 + 4 + 3);
  refuses(
      gltf,
      R"("nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 1}]}])",
      {"no triangle"});
  refuses(
      gltf,
      R"("nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 7}]}])",
      {"mode 7", "0 to 6"});
}

TEST_F(Gltf, WholeNumbersArePlacesAndSharesAsTheySay) {
  for (const bool is_share : {false, true}) {
    GltfText gltf;
    gltf.add("VEC3", std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 32767, -32768, 0}, is_share);
    const Model model = read(
        gltf,
        fmt::format(
            R"("extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"], "nodes": [{{"mesh": 0, "scale": [{0}, {0}, {0}]}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}])",
            is_share ? 4.0 : 1.0 / 1024.0));
    // Shares lie between -1 and 1: the lowest two are alike.
    const double side = is_share ? 4.0 : 32767.0 / 1024.0;
    EXPECT_NEAR(corner(finest(model), 0, 1).x(), side, world::kHeightStep_m);
    EXPECT_NEAR(corner(finest(model), 0, 2).y(), is_share ? -4.0 : -32.0, world::kHeightStep_m);
  }
}

TEST_F(Gltf, CopiesAndHiddenNodesAreShownAsTheirExtensionsSay) {
  GltfText gltf;
  gltf.add("VEC3", kSquare);
  gltf.add("SCALAR", kSquareIndices);
  gltf.add("VEC3", std::vector<float>{0, 0, 0, 10, 0, 0, 20, 0, 0});
  gltf.add("VEC3", std::vector<float>{1, 1, 1, 2, 2, 2, 3, 3, 3});
  const std::string meshes =
      R"("meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}])";
  const Model copies = read(
      gltf,
      R"("extensionsUsed": ["EXT_mesh_gpu_instancing"], "nodes": [{"mesh": 0, "translation": [0, 0, 5], "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2, "SCALE": 3}}}}], )" +
          meshes);
  ASSERT_EQ(finest(copies).triangles.size(), 6U);
  EXPECT_EQ(corner(finest(copies), 4, 2), Vector3d(23, 3, 5));
  const Model hidden = read(
      gltf,
      R"("nodes": [{"mesh": 0}, {"extensions": {"KHR_node_visibility": {"visible": false}}, "children": [2]}, {"mesh": 0, "translation": [9, 9, 9]}], )" +
          meshes);
  EXPECT_EQ(finest(hidden).triangles.size(), 2U);
  EXPECT_EQ(count_in(hidden, "nodes that are not visible"), 1);
}

TEST_F(Gltf, ColoursOfSpecularAndGlossyMaterialsAreTheirDiffuseOnes) {
  const Model model = square(
      {}, "",
      R"({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1]}, "extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.25, 0.5, 0.125, 1]}}})");
  EXPECT_EQ(color(model), (Codes{137, 188, 99}));
  EXPECT_EQ(look(model).material, world::Material::Plain);
}

TEST_F(Gltf, ExtensionsThatAreNotReadAreToldOrRefused) {
  GltfText gltf;
  gltf.add("VEC3", kSquare);
  const std::string rest =
      R"("nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}])";
  const Model model = read(
      gltf,
      R"("extensionsUsed": ["ACME_glow", "KHR_lights_punctual"], "extensions": {"ACME_glow": {}}, )" +
          rest);
  EXPECT_EQ(entry(model, "glTF extension ACME_glow").num_unknown, 2);
  EXPECT_EQ(entry(model, "glTF extension KHR_lights_punctual").num_ignored, 1);
  for (const char* name :
       {"ACME_glow", "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_texture_basisu"})
    refuses(gltf, fmt::format(R"("extensionsRequired": ["{}"], )", name) + rest,
            {name, "export the model without it"});
  for (const char* name :
       {"KHR_materials_unlit", "KHR_texture_transform", "KHR_materials_variants"})
    EXPECT_NO_THROW(read(gltf, fmt::format(R"("extensionsRequired": ["{}"], )", name) + rest));
  // Compressed meshes without a plain copy, though nothing is said to be required.
  gltf.add_text(R"({"componentType": 5126, "type": "VEC3", "count": 4})");
  refuses(
      gltf,
      R"("nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "extensions": {"KHR_draco_mesh_compression": {}}}]}])",
      {"KHR_draco_mesh_compression"});
}

/// As .glb; programs differ in whether a part's length counts the blanks that fill it up, or leave these out.
TEST_F(Gltf, BinaryPartsFollowTheTextFilledUpOrNot) {
  std::string binary;
  for (const float value : kSquare)
    binary.append(reinterpret_cast<const char*>(&value), sizeof value);
  const auto word = [](std::size_t value) {
    std::string bytes;
    for (int k = 0; k < 4; ++k) bytes += static_cast<char>(value >> (8 * k) & 255U);
    return bytes;
  };
  std::string text =
      R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 48}], "bufferViews": [{"buffer": 0, "byteLength": 48}], "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}]})";
  while (text.size() % 4 != 1) text.insert(1, " ");
  for (const auto& [blanks_counted, blanks] : {std::pair(3, 3), std::pair(0, 3), std::pair(0, 0)}) {
    const std::string filled = text + std::string(static_cast<std::size_t>(blanks), ' ');
    const std::string parts = word(text.size() + static_cast<std::size_t>(blanks_counted)) +
                              "JSON" + filled + word(binary.size()) + std::string("BIN\0", 4) +
                              binary;
    write_text(folder_ / "model.glb", "glTF" + word(2) + word(12 + parts.size()) + parts);
    const Model model = read_as_it_is(folder_ / "model.glb");
    EXPECT_EQ(finest(model).triangles.size(), 2U) << blanks_counted << " of " << blanks;
  }
}

TEST_F(Gltf, NumbersThatDoNotFitTogetherAreRefused) {
  GltfText gltf;
  gltf.add("VEC3", kSquare);
  gltf.add("VEC2", kSquareIndices);
  gltf.add("SCALAR", std::vector<std::uint16_t>{0, 1, 4});
  const auto primitive = [&](const std::string& text, const std::vector<std::string>& words) {
    refuses(
        gltf,
        fmt::format(R"("nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{{{}}}]}}])", text),
        words);
  };
  primitive(R"("attributes": {"POSITION": 0}, "indices": 2)", {"face 0 names vertex 4 of 4"});
  primitive(R"("attributes": {"POSITION": 1})", {"POSITION has 2 components"});
  primitive(R"("attributes": {"POSITION": 0}, "indices": 0)", {"indices", "whole numbers"});
  primitive(R"("attributes": {"NORMAL": 0})", {"no POSITION"});
  primitive(R"("attributes": {"POSITION": 0}, "material": 3)", {"material = 3"});
  refuses(gltf, R"("meshes": 7)", {"model.gltf", "meshes"});
  refuses(gltf, R"("nodes": [{"translation": [1, 2]}])", {"translation has 2 numbers"});
  write_text(
      folder_ / "bad.gltf",
      R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 3, "uri": "data:;base64,A*A="}]})");
  expect_error(ErrorKind::Input, {"base64", "*"}, [&] { read_as_it_is(folder_ / "bad.gltf"); });
}

}  // namespace
}  // namespace terracast::test
