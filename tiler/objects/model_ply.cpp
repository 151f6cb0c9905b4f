#include "tiler/objects/model_ply.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "tiler/objects/model_file.h"
#include "tiler/objects/model_ply_data.h"
#include "tiler/objects/model_polygon.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using core::KnownName;
using Eigen::Array3d;
using Eigen::Vector2f;
using Eigen::Vector3d;

constexpr std::uint64_t kMostVertices = 9 * kMostModelTriangles;

constexpr const char* kNormal = "surfaces face where their corners go round";
constexpr const char* kMeasure = "a measure of how it was scanned, which shows nowhere";
constexpr const char* kOpaque = "surfaces of models without a picture are opaque";
constexpr const char* kText = "words for people";

constexpr auto kNames = std::to_array<KnownName>({
    {"PLY comment TextureFile", "picture that coordinates of textures lie on"},
    {"PLY comment", kText, false},
    {"PLY obj_info", kText, false},
    {"PLY vertex", "corners"},
    {"PLY vertex.x", "place"},
    {"PLY vertex.y", "place"},
    {"PLY vertex.z", "place"},
    {"PLY vertex.red", "colour, sRGB"},
    {"PLY vertex.green", "colour, sRGB"},
    {"PLY vertex.blue", "colour, sRGB"},
    {"PLY vertex.r", "colour, sRGB"},
    {"PLY vertex.g", "colour, sRGB"},
    {"PLY vertex.b", "colour, sRGB"},
    {"PLY vertex.diffuse_red", "colour, sRGB"},
    {"PLY vertex.diffuse_green", "colour, sRGB"},
    {"PLY vertex.diffuse_blue", "colour, sRGB"},
    {"PLY vertex.u", "coordinate of the texture"},
    {"PLY vertex.v", "coordinate of the texture"},
    {"PLY vertex.s", "coordinate of the texture"},
    {"PLY vertex.t", "coordinate of the texture"},
    {"PLY vertex.texture_u", "coordinate of the texture"},
    {"PLY vertex.texture_v", "coordinate of the texture"},
    {"PLY vertex.alpha", kOpaque, false},
    {"PLY vertex.a", kOpaque, false},
    {"PLY vertex.nx", kNormal, false},
    {"PLY vertex.ny", kNormal, false},
    {"PLY vertex.nz", kNormal, false},
    {"PLY vertex.quality", kMeasure, false},
    {"PLY vertex.confidence", kMeasure, false},
    {"PLY vertex.intensity", kMeasure, false},
    {"PLY vertex.flags", "a mark of the program that wrote it", false},
    {"PLY vertex.radius", "of points without surfaces", false},
    {"PLY face", "surfaces"},
    {"PLY face.vertex_indices", "corners of a surface"},
    {"PLY face.vertex_index", "corners of a surface"},
    {"PLY face.red", "colour of a surface, sRGB"},
    {"PLY face.green", "colour of a surface, sRGB"},
    {"PLY face.blue", "colour of a surface, sRGB"},
    {"PLY face.texcoord", "coordinates of the texture, two a corner"},
    {"PLY face.texnumber", "which of the pictures"},
    {"PLY face.alpha", kOpaque, false},
    {"PLY face.nx", kNormal, false},
    {"PLY face.ny", kNormal, false},
    {"PLY face.nz", kNormal, false},
    {"PLY face.quality", kMeasure, false},
    {"PLY face.flags", "a mark of the program that wrote it", false},
    {"PLY tristrips", "strips of triangles"},
    {"PLY tristrips.vertex_indices", "corners of strips, -1 between them"},
    {"PLY tristrips.vertex_index", "corners of strips, -1 between them"},
    {"PLY edge", "lines have no surface", false},
    {"PLY edge.*", "lines have no surface", false},
});

/// Rows of three properties that make a colour, and what their values are divided by.
struct ColorRows {
  std::array<int, 3> rows = {-1, -1, -1};
  std::array<double, 3> most = {1.0, 1.0, 1.0};

  bool is_there() const { return rows[0] >= 0 && rows[1] >= 0 && rows[2] >= 0; }
};

ColorRows color_rows(const PlyElement& element) {
  constexpr std::array<std::array<const char*, 3>, 3> kColors = {{
      {"red", "green", "blue"},
      {"diffuse_red", "diffuse_green", "diffuse_blue"},
      {"r", "g", "b"},
  }};
  ColorRows color;
  for (const auto& names : kColors) {
    for (std::size_t k = 0; k < 3; ++k) {
      color.rows[k] = element.find(names[k]);
      if (color.rows[k] < 0) continue;
      const PlyProperty& property = element.properties[static_cast<std::size_t>(color.rows[k])];
      const double bits = 8.0 * static_cast<double>(property.value->num_bytes) -
                          (property.value->is_signed ? 1 : 0);
      color.most[k] = property.value->is_whole ? std::exp2(bits) - 1.0 : 1.0;
    }
    if (color.is_there()) return color;
  }
  return {};
}

std::array<int, 2> texture_rows(const PlyElement& element) {
  constexpr std::array<std::array<const char*, 2>, 3> kPairs = {
      {{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}}};
  for (const auto& [u, v] : kPairs)
    if (element.find(u) >= 0 && element.find(v) >= 0) return {element.find(u), element.find(v)};
  return {-1, -1};
}

/// A face as it was written; corners and uv begin so far in the lists of all.
struct Face {
  std::size_t first_corner = 0, num_corners = 0;
  std::optional<std::size_t> first_uv = {};
  std::optional<Eigen::Array3f> color = {};
  bool has_picture = true;
  std::size_t picture = 0;
};

class PlyReader {
 public:
  PlyReader(std::span<const std::byte> bytes, ModelFolder& folder)
      : data_(bytes, folder.name()), folder_(folder), name_(folder.name()) {}

  ModelScene read() {
    for (const std::string& line : data_.other_lines()) take_line(line);
    for (const PlyElement& element : data_.elements()) read(element);
    if (const std::size_t left = data_.num_bytes_left(); left > 0)
      scene_.ledger.miss("PLY bytes behind the last element", static_cast<std::int64_t>(left));
    if (places_.empty() && !faces_.empty())
      fail(ErrorKind::Input, "{}: it has faces and no element \"vertex\"", name_);
    add_materials();
    for (std::size_t i = 0; i < faces_.size(); ++i) add_face(i);
    for (auto& [material, part] : parts_) scene_.parts.push_back(std::move(part));
    return std::move(scene_);
  }

 private:
  void take_line(const std::string& line) {
    constexpr std::string_view kTexture = "comment TextureFile ";
    if (!line.starts_with(kTexture)) {
      scene_.ledger.count("PLY " + line.substr(0, line.find(' ')), kNames);
      return;
    }
    scene_.ledger.count("PLY comment TextureFile", kNames);
    const std::size_t begin = line.find_first_not_of(" \t", kTexture.size());
    if (begin != std::string::npos) pictures_.push_back(line.substr(begin));
  }

  void read(const PlyElement& element) {
    scene_.ledger.count("PLY " + element.name, kNames, static_cast<std::int64_t>(element.count));
    for (const PlyProperty& property : element.properties)
      scene_.ledger.count(fmt::format("PLY {}.{}", element.name, property.name), kNames);
    if (element.name == "vertex") return read_vertices(element);
    if (element.name == "face") return read_faces(element);
    if (element.name == "tristrips") return read_strips(element);
    if (element.name == "edge") scene_.counts["faces that are no triangles"] += num_of(element);
    data_.read(element, [](std::uint64_t, PlyData::Row) {});
  }
  static std::int64_t num_of(const PlyElement& element) {
    return static_cast<std::int64_t>(element.count);
  }

  void read_vertices(const PlyElement& element) {
    const std::array<int, 3> at = {element.find("x"), element.find("y"), element.find("z")};
    if (*std::min_element(at.begin(), at.end()) < 0)
      fail(ErrorKind::Input, "{}: its vertices have no x, y and z", name_);
    if (element.count > kMostVertices)
      fail(ErrorKind::Input, "{}: more than {} vertices; simplify the model first", name_,
           kMostVertices);
    const ColorRows color = color_rows(element);
    const std::array<int, 2> uv = texture_rows(element);
    data_.read(element, [&](std::uint64_t row, PlyData::Row values) {
      const auto value = [&](int property) {
        const std::vector<double>& own = values[static_cast<std::size_t>(property)];
        if (own.size() != 1)
          fail(ErrorKind::Input, "{}: vertex {}: {} is a list of {} values, and one is needed",
               name_, row, element.properties[static_cast<std::size_t>(property)].name, own.size());
        return own[0];
      };
      places_.emplace_back(value(at[0]), value(at[1]), value(at[2]));
      if (color.is_there()) colors_.push_back(color_of(color, "vertex", value));
      if (uv[0] >= 0) uv_.emplace_back(float_of(value(uv[0])), float_of(value(uv[1])));
    });
  }
  static float float_of(double value) { return static_cast<float>(value); }

  template <class Value>
  Eigen::Array3f color_of(const ColorRows& color, const char* element, const Value& value) {
    Array3d own;
    for (std::size_t k = 0; k < 3; ++k) {
      const double share = value(color.rows[k]) / color.most[k];
      own[static_cast<int>(k)] = std::clamp(std::isfinite(share) ? share : 0.0, 0.0, 1.0);
      if (!(share >= 0.0 && share <= 1.0))
        scene_.ledger.misunderstand(fmt::format("PLY {}.red", element),
                                    fmt::format("{} of 0 to 1", share));
    }
    return linear_from_srgb(own).cast<float>();
  }

  void read_faces(const PlyElement& element) {
    const int indices = std::max(element.find("vertex_indices"), element.find("vertex_index"));
    if (indices < 0) fail(ErrorKind::Input, "{}: its faces have no vertex_indices", name_);
    const ColorRows color = color_rows(element);
    const int texcoord = element.find("texcoord"), number = element.find("texnumber");
    data_.read(element, [&](std::uint64_t row, PlyData::Row values) {
      const auto value = [&](int property) {
        const std::vector<double>& own = values[static_cast<std::size_t>(property)];
        return own.empty() ? 0.0 : own[0];
      };
      const std::vector<double>& corners = values[static_cast<std::size_t>(indices)];
      if (corners.size() > kMostFaceCorners)
        fail(ErrorKind::Input,
             "{}: face {} has {} corners, and a face has at most {}; save the model as triangles",
             name_, row, corners.size(), kMostFaceCorners);
      Face face = new_face(corners, fmt::format("face {}", row));
      if (color.is_there()) face.color = color_of(color, "face", value);
      if (texcoord >= 0) take_texcoord(values[static_cast<std::size_t>(texcoord)], face);
      if (number >= 0) take_number(value(number), row, face);
      keep(face);
    });
  }

  Face new_face(std::span<const double> corners, const std::string& where) {
    Face face{.first_corner = corners_.size(), .num_corners = corners.size()};
    for (const double corner : corners)
      corners_.push_back(static_cast<std::uint32_t>(
          whole(corner, places_.empty() ? kMostVertices : places_.size(), "vertex", where)));
    return face;
  }
  void keep(const Face& face) {
    if (face.num_corners < 3) {
      corners_.resize(face.first_corner);
      ++scene_.counts["faces that are no triangles"];
      return;
    }
    num_triangles_ += face.num_corners - 2;
    if (num_triangles_ > kMostModelTriangles)
      fail(ErrorKind::Input, "{}: more than {} triangles; simplify it first", name_,
           kMostModelTriangles);
    faces_.push_back(face);
  }
  std::size_t whole(double value, std::size_t size, const char* what, const std::string& where) {
    if (value < 0.0 || value >= static_cast<double>(size) || value != std::floor(value))
      fail(ErrorKind::Input, "{}: {} names {} {} of {}", name_, where, what, value, size);
    return static_cast<std::size_t>(value);
  }

  /// Two values a corner, or none.
  void take_texcoord(std::span<const double> values, Face& face) {
    if (values.empty()) return;
    if (values.size() != 2 * face.num_corners) {
      scene_.ledger.misunderstand(
          "PLY face.texcoord",
          fmt::format("{} values of {} corners", values.size(), face.num_corners));
      return;
    }
    face.first_uv = face_uv_.size();
    for (std::size_t k = 0; k < values.size(); k += 2)
      face_uv_.emplace_back(float_of(values[k]), float_of(values[k + 1]));
  }

  /// Which picture; below 0: none.
  void take_number(double number, std::uint64_t row, Face& face) {
    face.has_picture = number >= 0.0;
    if (face.has_picture && !pictures_.empty())
      face.picture = whole(number, pictures_.size(), "picture", fmt::format("face {}", row));
  }

  void read_strips(const PlyElement& element) {
    const int indices = std::max(element.find("vertex_indices"), element.find("vertex_index"));
    if (indices < 0) fail(ErrorKind::Input, "{}: its strips have no vertex_indices", name_);
    data_.read(element, [&](std::uint64_t row, PlyData::Row values) {
      std::vector<double> strip;
      const auto end_strip = [&] {
        for (std::size_t k = 2; k < strip.size(); ++k) {
          // Each turns the other way than the one before.
          const std::array<double, 3> corners = {strip[k - 2], strip[k - 1 + k % 2],
                                                 strip[k - k % 2]};
          keep(new_face(corners, fmt::format("strip {}", row)));
        }
        strip.clear();
      };
      for (const double corner : values[static_cast<std::size_t>(indices)])
        if (corner == -1.0)
          end_strip();
        else
          strip.push_back(corner);
      end_strip();
    });
  }

  /// The first has no picture; those of the pictures follow.
  void add_materials() {
    const bool has_colors = !colors_.empty() || std::any_of(faces_.begin(), faces_.end(),
                                                            [](const Face& f) { return f.color; });
    ModelMaterial plain;
    if (!has_colors) plain.factor.setConstant(linear_from_srgb(kNoColor_srgb));
    plain.factor_without_image = plain.factor;
    scene_.materials.push_back(plain);
    for (const std::string& picture : pictures_) {
      const std::string where = fmt::format("{}: texture {}", name_, picture);
      scene_.images.push_back(
          {.name = picture, .file = folder_.path_or_beside(picture, where), .bytes = {}});
      scene_.materials.push_back({.factor = Array3d::Ones(),
                                  .factor_without_image = plain.factor,
                                  .image = scene_.images.size() - 1,
                                  // Programs that reconstruct surfaces write both, for one colour.
                                  .tints_image = false,
                                  .shows_through = true});
    }
  }

  void add_face(std::size_t number) {
    const Face& face = faces_[number];
    const bool has_uv = face.has_picture && (face.first_uv || !uv_.empty());
    const std::size_t material = has_uv && !pictures_.empty() ? 1 + face.picture : 0;
    ModelPart& part = parts_[material];
    part.material = material;
    part.name = "PLY";
    std::vector<Vector3d> corners;
    const auto first = static_cast<std::uint32_t>(part.places.size());
    for (std::size_t k = 0; k < face.num_corners; ++k) {
      const std::uint32_t vertex = corners_[face.first_corner + k];
      if (vertex >= places_.size())
        fail(ErrorKind::Input, "{}: face {} names vertex {} of {}", name_, number, vertex,
             places_.size());
      if (!places_[vertex].allFinite())
        fail(ErrorKind::Input, "{}: vertex {} is no number", name_, vertex);
      corners.push_back(places_[vertex]);
      part.places.push_back(places_[vertex]);
      part.uv.push_back(face.first_uv ? face_uv_[*face.first_uv + k]
                        : uv_.empty() ? Vector2f::Zero().eval()
                                      : uv_[vertex]);
      part.colors.push_back(face.color        ? *face.color
                            : colors_.empty() ? Eigen::Array3f::Ones().eval()
                                              : colors_[vertex]);
    }
    for (const auto& triangle : triangles_of_face(corners))
      part.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
  }

  PlyData data_;
  ModelFolder& folder_;
  std::string name_;
  ModelScene scene_;
  std::vector<std::string> pictures_;
  std::vector<Vector3d> places_;
  std::vector<Eigen::Array3f> colors_;  ///< of vertices, or none
  std::vector<Vector2f> uv_;            ///< of vertices, or none
  std::vector<std::uint32_t> corners_;  ///< of all faces
  std::vector<Vector2f> face_uv_;       ///< of all faces
  std::vector<Face> faces_;
  std::map<std::size_t, ModelPart> parts_;  ///< by material
  std::uint64_t num_triangles_ = 0;
};

}  // namespace

std::span<const KnownName> ply_names() { return kNames; }

ModelScene read_ply(std::span<const std::byte> bytes, ModelFolder& folder) {
  return PlyReader(bytes, folder).read();
}

}  // namespace terracast::tiler
