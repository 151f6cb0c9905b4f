#include <gtest/gtest.h>

#include "tests/tiler/model_files.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2f;
using Eigen::Vector3d;
using tiler::Model;

const std::string kPlaces = "property float x\nproperty float y\nproperty float z\n";
const std::string kCorners = "property list uchar int vertex_indices\n";

class Ply : public testing::Test {
 protected:
  Model read(const std::string& text) {
    write_text(folder_ / "model.ply", text);
    return read_as_it_is(folder_ / "model.ply");
  }
  /// A square's corners with values more each, and faces.
  static std::string text(const std::string& vertex_properties, const std::string& values,
                          const std::string& face_properties, int num_faces,
                          const std::string& faces, const std::string& head = "") {
    std::string text = "ply\nformat ascii 1.0\n" + head + "element vertex 4\n" + kPlaces +
                       vertex_properties + fmt::format("element face {}\n", num_faces) +
                       face_properties + "end_header\n";
    for (const char* place : {"0 0 0", "1 0 0", "1 1 0", "0 1 0"})
      text += fmt::format("{} {}\n", place, values);
    return text + faces;
  }
  const ScratchFolder folder_;
};

template <class Value>
void put(std::string& text, Value value, bool is_big) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (is_big) std::reverse(bytes.begin(), bytes.end());
  text += bytes;
}
std::string binary(const std::vector<std::vector<int>>& faces, bool is_big) {
  std::string text = fmt::format("ply\nformat binary_{}_endian 1.0\nelement vertex 4\n",
                                 is_big ? "big" : "little") +
                     kPlaces + fmt::format("element face {}\n", faces.size()) + kCorners +
                     "end_header\n";
  for (const float value : kSquare) put(text, value, is_big);
  for (const std::vector<int>& face : faces) {
    put(text, static_cast<std::uint8_t>(face.size()), is_big);
    for (const int corner : face) put(text, corner, is_big);
  }
  return text;
}

// Until 2026-11 one without corners ended the process where it was the last (SIGABRT).
TEST_F(Ply, FacesOfFewerThanThreeCornersAreCountedWhereverTheyStand) {
  const std::vector<std::vector<std::vector<int>>> cases = {
      {{0, 1, 2}, {}}, {{}, {0, 1, 2}}, {{0, 1, 2}, {}, {}}, {{0, 1, 2}, {3}}, {{2, 1}, {0, 1, 2}}};
  for (const auto& faces : cases) {
    std::string lines;
    for (const auto& face : faces)
      lines += fmt::format("{} {}\n", face.size(), fmt::join(face, " "));
    const auto num_left_out = static_cast<std::int64_t>(faces.size()) - 1;
    for (const std::string& file : {text("", "", kCorners, static_cast<int>(faces.size()), lines),
                                    binary(faces, false), binary(faces, true)}) {
      const Model model = read(file);
      EXPECT_EQ(finest(model).triangles.size(), 1U);
      EXPECT_EQ(corner(finest(model), 0, 2), Vector3d(1, 1, 0));
      EXPECT_EQ(count_in(model, "faces that are no triangles"), num_left_out);
    }
  }
  for (const std::vector<std::vector<int>>& faces :
       std::vector<std::vector<std::vector<int>>>{{{}}, {{0}}, {{0, 1}}, {}})
    expect_error(ErrorKind::Input, {"model.ply", "no triangle"},
                 [&] { read(binary(faces, false)); });
}

TEST_F(Ply, CornersThatAreNotThereAreRefused) {
  for (const char* face : {"3 0 1 4", "3 0 1 -1", "3 0 1 1.5", "3 0 1 4294967296"})
    expect_error(ErrorKind::Input, {"face 0 names vertex", "of 4"},
                 [&] { read(text("", "", kCorners, 1, std::string(face) + "\n")); });
  expect_error(ErrorKind::Input, {"face 0", "\"one\" is no number"},
               [&] { read(text("", "", kCorners, 1, "3 0 one 2\n")); });
  expect_error(ErrorKind::Input, {"no vertex_indices"},
               [&] { read(text("", "", "property list uchar int corners\n", 1, "3 0 1 2\n")); });
  expect_error(ErrorKind::Input, {"no x, y and z"}, [&] {
    read("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n");
  });
}

TEST_F(Ply, ColoursOfVerticesAreSrgbOfTheirTypesRange) {
  const auto colored = [&](const std::string& type, const std::string& names,
                           const std::string& values) {
    std::string properties;
    for (std::size_t at = 0; at < names.size();) {
      const std::size_t end = std::min(names.find(' ', at), names.size());
      properties += fmt::format("property {} {}\n", type, names.substr(at, end - at));
      at = end + 1;
    }
    return color(read(text(properties, values, kCorners, 1, "3 0 1 2\n")));
  };
  EXPECT_EQ(color(read(text("", "", kCorners, 1, "3 0 1 2\n"))), (Codes{153, 153, 153})) << "none";
  EXPECT_EQ(colored("uchar", "red green blue", "10 20 250"), (Codes{10, 20, 250}));
  EXPECT_EQ(colored("uchar", "red green blue alpha", "10 20 250 0"), (Codes{10, 20, 250}));
  EXPECT_EQ(colored("uchar", "r g b", "10 20 250"), (Codes{10, 20, 250}));
  EXPECT_EQ(colored("uint8", "diffuse_red diffuse_green diffuse_blue", "10 20 250"),
            (Codes{10, 20, 250}));
  EXPECT_EQ(colored("ushort", "red green blue", "0 32896 65535"), (Codes{0, 128, 255}));
  EXPECT_EQ(colored("float", "red green blue", "0 0.5 1"), (Codes{0, 128, 255}));
}

TEST_F(Ply, FacesMayHaveColoursOfTheirOwn) {
  const Model model =
      read(text("property uchar red\nproperty uchar green\nproperty uchar blue\n", "1 2 3",
                kCorners + "property uchar red\nproperty uchar green\nproperty uchar blue\n", 2,
                "3 0 1 2 200 0 0\n3 0 2 3 0 200 0\n"));
  EXPECT_EQ(color(model, 0), (Codes{200, 0, 0}));
  EXPECT_EQ(color(model, 1), (Codes{0, 200, 0}));
}

TEST_F(Ply, PicturesOfCommentsLieByVerticesOrCornersOfFaces) {
  std::filesystem::create_directories(folder_ / "tex");
  write_halves(folder_ / "halves.png");
  write_halves(folder_ / "tex" / "other.png");
  for (const char* names : {"s t", "u v", "texture_u texture_v"}) {
    const std::string own = names;
    const std::size_t blank = own.find(' ');
    const Model model =
        read(text(fmt::format("property float {}\nproperty float {}\n", own.substr(0, blank),
                              own.substr(blank + 1)),
                  "0.25 0.75", kCorners, 1, "3 0 1 2\n", "comment TextureFile halves.png\n"));
    ASSERT_EQ(model.textures.size(), 1U) << names;
    EXPECT_EQ(uv(finest(model), 0, 1), Vector2f(0.25, 0.75));
  }
  const Model corners =
      read(text("", "", kCorners + "property list uchar float texcoord\nproperty int texnumber\n",
                3, "3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0 0 0.5 0.5 0 1 1\n3 0 1 3 2 0 0 0\n",
                "comment TextureFile halves.png\ncomment TextureFile tex\\other.png\n"));
  ASSERT_EQ(corners.textures.size(), 2U);
  // Those without a picture come first.
  EXPECT_EQ(corners.textures[look(corners, 2).pattern].name, "thing/other.png");
  EXPECT_EQ(uv(finest(corners), 2, 1), Vector2f(0.5, 0.5));
  // Two values of three corners.
  EXPECT_EQ(look(corners, 0).material, world::Material::Plain);
  EXPECT_EQ(entry(corners, "PLY face.texcoord").num_not_understood(), 1);
  expect_error(ErrorKind::Input, {"picture 7 of 1"}, [&] {
    read(text("", "", kCorners + "property int texnumber\n", 1, "3 0 1 2 7\n",
              "comment TextureFile halves.png\n"));
  });
}

TEST_F(Ply, StripsAreTriangles) {
  const std::string head = "ply\nformat ascii 1.0\nelement vertex 4\n" + kPlaces +
                           "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                           "0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
  const Model model = read(head + "8 0 1 2 3 -1 1 3 2\n");
  ASSERT_EQ(finest(model).triangles.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(doubled_area(finest(model), i), Vector3d(0, 0, 1)) << i;
}

TEST_F(Ply, OtherElementsArePassedOverAndTold) {
  const Model model = read(
      "ply\nformat ascii 1.0\nobj_info a scan\nelement camera 2\nproperty list uchar float "
      "parameters\n"
      "property int flag\nelement vertex 3\n" +
      kPlaces + "property double glow\nelement face 1\n" + kCorners +
      "end_header\n2 0.5 0.5 1\n0 2\n0 0 0 9\n1 0 0 9\n0 1 0 9\n3 0 1 2\n7 7\n");
  EXPECT_EQ(corner(finest(model), 0, 2), Vector3d(0, 1, 0));
  EXPECT_EQ(entry(model, "PLY camera").num_unknown, 2);
  EXPECT_EQ(entry(model, "PLY vertex.glow").num_unknown, 1);
  EXPECT_EQ(entry(model, "PLY obj_info").num_ignored, 1);
  EXPECT_EQ(entry(model, "PLY bytes behind the last element").num_unknown, 4);
}

}  // namespace
}  // namespace terracast::test
