#include "tiler/objects/model_obj.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <set>

#include "core/error.h"
#include "tiler/objects/model_mtl.h"
#include "tiler/objects/model_polygon.h"
#include "tiler/objects/model_statements.h"
#include "tiler/objects/obj_check.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using core::KnownName;
using Eigen::Array3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr const char* kParts = "a model is one thing";
constexpr const char* kFreeForm = "curved surfaces are not read; save the model as polygons";
constexpr const char* kViewer = "what a program of its time does with the model";

constexpr auto kNames = std::to_array<KnownName>({
    {"OBJ v", "place of a corner, and its colour (sRGB) where six numbers stand"},
    {"OBJ vt", "place on a picture"},
    {"OBJ f", "surface"},
    {"OBJ fo", "surface"},
    {"OBJ usemtl", "material of what follows"},
    {"OBJ mtllib", "library of materials"},
    {"OBJ l", "lines have no surface; they are counted"},
    {"OBJ p", "points have no surface; they are counted"},
    {"OBJ vn", "surfaces face where their corners go round", false},
    {"OBJ s", "surfaces are flat", false},
    {"OBJ g", kParts, false},
    {"OBJ o", kParts, false},
    {"OBJ mg", kFreeForm, false},
    {"OBJ vp", kFreeForm, false},
    {"OBJ cstype", kFreeForm, false},
    {"OBJ curv", kFreeForm, false},
    {"OBJ curv2", kFreeForm, false},
    {"OBJ surf", kFreeForm, false},
    {"OBJ deg", kFreeForm, false},
    {"OBJ bmat", kFreeForm, false},
    {"OBJ step", kFreeForm, false},
    {"OBJ parm", kFreeForm, false},
    {"OBJ trim", kFreeForm, false},
    {"OBJ hole", kFreeForm, false},
    {"OBJ scrv", kFreeForm, false},
    {"OBJ sp", kFreeForm, false},
    {"OBJ end", kFreeForm, false},
    {"OBJ con", kFreeForm, false},
    {"OBJ ctech", kFreeForm, false},
    {"OBJ stech", kFreeForm, false},
    {"OBJ lod", kViewer, false},
    {"OBJ bevel", kViewer, false},
    {"OBJ c_interp", kViewer, false},
    {"OBJ d_interp", kViewer, false},
    {"OBJ shadow_obj", kViewer, false},
    {"OBJ trace_obj", kViewer, false},
    {"OBJ call", "other files' commands are not run", false},
    {"OBJ csh", "other programs' commands are not run", false},
    {"OBJ #MRGB", "colours of vertices in comments are not read; export them behind the places",
     false},
});

struct Corner {
  std::int64_t vertex = 0, texture = -1;
};
struct Face {
  std::size_t first_corner = 0, num_corners = 0;
  std::size_t material = 0;
  std::uint64_t line = 0;
};

class ObjReader {
 public:
  explicit ObjReader(ModelFolder& folder)
      : folder_(folder), name_(folder.name()), check_(folder.name()) {}

  ModelScene read(std::span<const std::byte> bytes) {
    check_letters(bytes);
    check_.look_at_model(bytes);
    each_statement(bytes, [&](const ModelStatement& statement) { take(statement); });
    add_materials();
    parts_.resize(materials_.size());
    for (const Face& face : faces_) add(face);
    for (ModelPart& part : parts_)
      if (!part.triangles.empty()) scene_.parts.push_back(std::move(part));
    return std::move(scene_);
  }

 private:
  void check_letters(std::span<const std::byte> bytes) const {
    const auto byte = [&](std::size_t at) { return static_cast<unsigned>(bytes[at]); };
    if (bytes.size() > 1 && (byte(0) ^ byte(1)) == 1U && byte(0) + byte(1) == 0x1fdU)
      fail(ErrorKind::Input, "{}: it is UTF-16; save it as UTF-8", name_);
  }

  void take(const ModelStatement& statement) {
    if (statement.name.starts_with("#MRGB")) scene_.ledger.count("OBJ #MRGB", kNames);
    if (statement.name.starts_with('#')) return;
    line_ = statement.line;
    const std::string_view name = statement.name;
    if (name == "v") {
      ++num_v_;
      return take_vertex(statement.rest);
    }
    if (name == "vn") {
      ++num_vn_;
      return;
    }
    if (name == "vt") {
      ++num_vt_;
      return take_texture(statement.rest);
    }
    if (name == "f" || name == "fo") {
      ++(name == "f" ? num_f_ : num_fo_);
      return take_face(statement.rest);
    }
    scene_.ledger.count(fmt::format("OBJ {}", name), kNames);
    if (name == "l" || name == "p") ++scene_.counts["faces that are no triangles"];
    if (name == "usemtl") material_ = material_of(std::string(statement.rest));
    if (name == "mtllib") take_libraries(statement.rest);
    if (name == "curv" || name == "curv2" || name == "surf")
      ++scene_.counts["curved surfaces and curves (curv, surf) left out"];
  }

  double number(std::string_view word, const char* what) const {
    if (const auto value = number_of(word)) return *value;
    fail(ErrorKind::Input, "{}: line {}: {}: \"{}\" is no number", name_, line_, what,
         word.substr(0, 40));
  }

  void take_vertex(std::string_view rest) {
    const std::vector<std::string_view> words = words_of(rest);
    if (words.size() < 3)
      fail(ErrorKind::Input, "{}: line {}: v has {} numbers, and a place has three", name_, line_,
           words.size());
    std::array<double, 7> values{};
    for (std::size_t k = 0; k < std::min<std::size_t>(words.size(), 7); ++k)
      values[k] = number(words[k], "v");
    places_.emplace_back(values[0], values[1], values[2]);
    if (words.size() == 6) return take_color(values[3], values[4], values[5]);
    if (words.size() == 7) return take_color(values[4], values[5], values[6]);
    // The fourth is a weight of curves, which polygons have not.
    if (words.size() != 3 && (words.size() != 4 || values[3] != 1.0))
      scene_.ledger.misunderstand("OBJ v", fmt::format("{} numbers", words.size()));
  }
  void take_color(double red, double green, double blue) {
    const Array3d color(red, green, blue);
    if (!(color >= 0.0 && color <= 1.0).all())
      scene_.ledger.misunderstand("OBJ v", "a colour outside 0 to 1");
    colors_.resize(places_.size(), Eigen::Array3f::Ones());
    colors_.back() =
        linear_from_srgb(Array3d(color.isNaN().select(0.0, color).max(0.0).min(1.0))).cast<float>();
  }

  void take_texture(std::string_view rest) {
    const std::vector<std::string_view> words = words_of(rest);
    if (words.empty()) fail(ErrorKind::Input, "{}: line {}: vt has no number", name_, line_);
    textures_.emplace_back(number(words[0], "vt"), words.size() > 1 ? number(words[1], "vt") : 0.0);
  }

  void take_face(std::string_view rest) {
    const std::vector<std::string_view> words = words_of(rest);
    if (words.size() < 3) {
      ++scene_.counts["faces that are no triangles"];
      return;
    }
    faces_.push_back({.first_corner = corners_.size(),
                      .num_corners = words.size(),
                      .material = material_,
                      .line = line_});
    for (const std::string_view word : words) corners_.push_back(corner_of(word));
  }
  /// v, v/vt, v/vt/vn or v//vn.
  Corner corner_of(std::string_view word) const {
    const std::size_t slash = word.find('/');
    Corner corner{.vertex = row_of(word.substr(0, slash), places_.size(), word)};
    if (slash == std::string_view::npos) return corner;
    const std::string_view behind = word.substr(slash + 1);
    const std::string_view texture = behind.substr(0, behind.find('/'));
    if (!texture.empty()) corner.texture = row_of(texture, textures_.size(), word);
    return corner;
  }
  /// From 0. Those below 0 count back from the last that stands before them.
  std::int64_t row_of(std::string_view text, std::size_t num_before, std::string_view word) const {
    std::int64_t row = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), row);
    if (error != std::errc() || end != text.data() + text.size() || row == 0)
      fail(ErrorKind::Input,
           "{}: line {}: \"{}\" is no corner of a face; numbers of corners begin with 1", name_,
           line_, word.substr(0, 40));
    if (row > 0) return row - 1;
    const auto before = static_cast<std::int64_t>(num_before);
    if (row < -before)
      fail(ErrorKind::Input, "{}: line {}: \"{}\" counts back beyond the first of {}", name_, line_,
           word.substr(0, 40), before);
    return before + row;
  }

  std::size_t material_of(const std::string& name) {
    const auto [known, is_new] = material_rows_.try_emplace(name, materials_.size());
    if (is_new) materials_.push_back(name);
    return known->second;
  }

  /// One name with blanks, or several.
  void take_libraries(std::string_view rest) {
    if (rest.empty()) return scene_.ledger.misunderstand("OBJ mtllib", "");
    if (is_there(std::string(rest))) {
      take_library(std::string(rest));
      return;
    }
    const std::vector<std::string_view> words = words_of(rest);
    if (std::none_of(words.begin(), words.end(),
                     [&](std::string_view word) { return is_there(std::string(word)); }))
      return miss_library(std::string(rest));
    for (const std::string_view word : words) {
      const std::string name(word);
      if (is_there(name))
        take_library(name);
      else
        miss_library(name);
    }
  }
  bool is_there(const std::string& library) const {
    std::error_code error;
    return std::filesystem::is_regular_file(
        folder_.path_or_beside(library, fmt::format("{}: library {}", name_, library)), error);
  }
  void miss_library(const std::string& library) {
    if (!libraries_.insert(library).second) return;
    ++scene_.counts["libraries of materials missing"];
    scene_.ledger.misunderstand("OBJ mtllib", library + " is not there");
    // A pair that was renamed.
    const std::filesystem::path beside = folder_.beside(".mtl");
    std::error_code error;
    if (!std::filesystem::is_regular_file(beside, error)) return;
    if (take_library(beside.filename().string()))
      ++scene_.counts["libraries of the model's own name, read for missing ones"];
  }
  /// Returns whether it was not read before.
  bool take_library(const std::string& library) {
    const std::filesystem::path file = folder_.path_or_beside(library, name_);
    if (!libraries_.insert(file.string()).second) return false;
    const std::vector<std::byte> bytes = folder_.read(file, library);
    check_.look_at_library(bytes, library);
    std::string own = library;
    std::replace(own.begin(), own.end(), '\\', '/');
    const std::filesystem::path parent = ModelFolder::is_absolute(own)
                                             ? std::filesystem::path()
                                             : std::filesystem::path(own).parent_path();
    read_mtl(bytes, parent, folder_, library_, scene_.ledger);
    return true;
  }

  /// One for each usemtl, the first for what has none.
  void add_materials() {
    for (const auto& [name, number] :
         {std::pair("OBJ v", num_v_), std::pair("OBJ vt", num_vt_), std::pair("OBJ vn", num_vn_),
          std::pair("OBJ f", num_f_), std::pair("OBJ fo", num_fo_)})
      if (number > 0) scene_.ledger.count(name, kNames, number);
    colors_.resize(colors_.empty() ? 0 : places_.size(), Eigen::Array3f::Ones());
    const double no_color = colors_.empty() ? linear_from_srgb(kNoColor_srgb) : 1.0;
    for (const std::string& name : materials_) {
      ModelMaterial material{.factor = Array3d::Constant(no_color),
                             .factor_without_image = Array3d::Constant(no_color),
                             .tints_image = false};
      const auto found = library_.find(name);
      pictures_.push_back(found == library_.end() ? nullptr
                                                  : take_material(found->second, material));
      if (found == library_.end() && !name.empty()) {
        ++scene_.counts["materials that no library has"];
        scene_.ledger.misunderstand("OBJ usemtl", name + " is in no library");
      }
      scene_.materials.push_back(material);
    }
  }

  const MtlPicture* take_material(const MtlMaterial& own, ModelMaterial& material) {
    if (own.kd_srgb) material.factor = linear_from_srgb(*own.kd_srgb);
    material.factor_without_image = material.factor;
    if (own.is_see_through) ++scene_.counts["materials that let light through, shown opaque"];
    if (!own.picture) return nullptr;
    if (!own.kd_srgb) material.factor.setOnes();
    if (own.kd_srgb && own.kd_srgb->isZero()) {
      // Programs write it where the picture alone is meant.
      material.factor.setOnes();
      ++scene_.counts["materials of Kd 0 0 0, shown by their picture alone"];
    }
    const auto [known, is_new] =
        image_rows_.try_emplace(own.picture->file.string(), scene_.images.size());
    if (is_new)
      scene_.images.push_back({.name = own.picture->name, .file = own.picture->file, .bytes = {}});
    material.image = known->second;
    material.shows_through = true;
    material.repeats = own.picture->repeats;
    return &*own.picture;
  }

  void add(const Face& face) {
    ModelPart& part = parts_[face.material];
    part.material = face.material;
    part.name = materials_[face.material];
    const MtlPicture* picture = pictures_[face.material];
    std::vector<Vector3d> corners;
    const auto first = static_cast<std::uint32_t>(part.places.size());
    for (std::size_t k = 0; k < face.num_corners; ++k) {
      const Corner& corner = corners_[face.first_corner + k];
      check(corner.vertex, places_.size(), "vertex", face.line);
      const auto vertex = static_cast<std::size_t>(corner.vertex);
      if (!places_[vertex].allFinite())
        fail(ErrorKind::Input, "{}: line {}: its vertex {} is no number", name_, face.line,
             vertex + 1);
      corners.push_back(places_[vertex]);
      part.places.push_back(places_[vertex]);
      part.colors.push_back(colors_.empty() ? Eigen::Array3f::Ones().eval() : colors_[vertex]);
      const Vector2d vt = texture_of(corner, picture != nullptr);
      part.uv.push_back((picture != nullptr ? picture->place_of(vt) : vt).cast<float>());
    }
    for (const auto& triangle : triangles_of_face(corners))
      part.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
  }
  /// Surfaces are shown whatever their place on a picture; programs write rows of a list that they left out.
  Vector2d texture_of(const Corner& corner, bool is_needed) {
    if (corner.texture < 0) {
      if (is_needed) ++scene_.counts["corners without a vt"];
      return Vector2d::Zero();
    }
    const auto row = static_cast<std::size_t>(corner.texture);
    if (row < textures_.size()) return textures_[row];
    scene_.ledger.misunderstand("OBJ f",
                                fmt::format("a vt beyond the last of {}", textures_.size()));
    return Vector2d::Zero();
  }
  void check(std::int64_t row, std::size_t size, const char* what, std::uint64_t line) const {
    if (row < 0 || row >= static_cast<std::int64_t>(size))
      fail(ErrorKind::Input, "{}: line {}: a face names {} {} of {}", name_, line, what, row + 1,
           size);
  }

  ModelFolder& folder_;
  std::string name_;
  ObjCheck check_;
  ModelScene scene_;
  std::uint64_t line_ = 0;
  std::int64_t num_v_ = 0, num_vt_ = 0, num_vn_ = 0, num_f_ = 0, num_fo_ = 0;
  std::vector<Vector3d> places_;
  std::vector<Eigen::Array3f> colors_;  ///< of the places, or none; may be shorter
  std::vector<Vector2d> textures_;
  std::vector<Corner> corners_;  ///< of all faces
  std::vector<Face> faces_;
  std::size_t material_ = 0;
  std::vector<std::string> materials_ = {""};  ///< by usemtl; the first for what has none
  std::map<std::string, std::size_t> material_rows_ = {{"", 0}};
  std::map<std::string, MtlMaterial> library_;
  std::set<std::string> libraries_;  ///< read or missed
  std::vector<const MtlPicture*> pictures_;
  std::map<std::string, std::size_t> image_rows_;
  std::vector<ModelPart> parts_;
};

}  // namespace

std::span<const KnownName> obj_names() { return kNames; }

ModelScene read_obj(std::span<const std::byte> bytes, ModelFolder& folder) {
  return ObjReader(folder).read(bytes);
}

}  // namespace terracast::tiler
