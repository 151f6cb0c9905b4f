#include "tiler/objects/model_file.h"

#include <assimp/GltfMaterial.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>

#include "core/error.h"
#include "core/hash.h"
#include "core/semantic_class.h"
#include "tiler/objects/gltf_check.h"
#include "tiler/objects/model_folder.h"
#include "tiler/objects/model_texture.h"
#include "tiler/objects/ply_check.h"
#include "tiler/objects/vertex_clusters.h"
#include "world/tile_id.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Matrix4d;
using Eigen::Vector2f;
using Eigen::Vector3d;
using world::Material;
using world::Shape;

/// Raised when the same file gives another model.
constexpr int kModelVersion = 1;

/// No model is larger: its vertices would not fit beside a tile.
constexpr double kLargest_m = 2000.0;
constexpr std::size_t kMostFinishes = 256;
constexpr int kCoarsestModelLevel = 6;
/// So many are numbered by finishes.
constexpr std::size_t kMostTextures = 65535;

std::uint8_t code_of(double value) {
  return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
}
double srgb_from_linear(double value) {
  return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}

class ModelReader {
 public:
  ModelReader(const ModelOptions& options, std::uint64_t& texture_bytes_left, Model& model)
      : options_(options),
        texture_bytes_left_(texture_bytes_left),
        model_(model),
        name_(options.file.written) {
    for (std::size_t i = 0; i < core::semantic_classes().size(); ++i)
      if (core::semantic_class_names()[i] == options.semantic_class)
        semantic_class_ = core::semantic_classes()[i].id;
  }

  void read() {
    // Of a relative path to what is not there, as a library of materials may be, nobody could say
    // whether it leads out of the folder.
    const std::filesystem::path file = std::filesystem::absolute(options_.file.resolved);
    const std::filesystem::path folder = file.parent_path();
    std::string kind = file.extension().string();
    std::transform(kind.begin(), kind.end(), kind.begin(), [](char c) {
      return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    if (kind != ".gltf" && kind != ".glb" && kind != ".obj" && kind != ".ply")
      fail(ErrorKind::Config, "{}: models are .gltf, .glb, .obj or .ply", name_);
    const std::vector<std::byte> bytes = bytes_of(file, name_);
    if (bytes.empty())
      fail(ErrorKind::Input, "{}: is empty, a file of 0 bytes; fetch or write it again", name_);
    hashes_ = core::content_hash(bytes);
    is_gltf_ = kind == ".gltf" || kind == ".glb";
    if (is_gltf_) check_gltf(bytes, folder, name_);
    if (kind == ".ply") check_ply(bytes, name_);
    ObjCheck obj(name_);
    if (kind == ".obj") obj.look_at_model(bytes);
    folder_ = folder;

    Assimp::Importer importer;
    auto* files = new ModelFolder(file, folder, kind == ".obj" ? &obj : nullptr);
    importer.SetIOHandler(files);  // which it deletes
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                                aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    scene_ = importer.ReadFile(file.string(), 0);
    files->check(name_);
    check_read(importer);
    num_missing_libraries_ = files->num_missing();
    check_faces();
    std::uint64_t num_triangles = 0;
    count(*scene_->mRootNode, num_triangles, 0);
    scene_ = importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_SortByPType);
    check_read(importer);
    axes_ = Matrix4d::Identity();
    // y up, front along z: to x forward, y left, z up.
    if (options_.up == "y") axes_ << 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1;
    const double turn = options_.yaw_deg * std::numbers::pi / 180.0;
    Matrix4d yaw = Matrix4d::Identity();
    yaw.topLeftCorner<3, 3>() = Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix();
    axes_ = yaw * axes_;
    axes_.topRows<3>() *= options_.unit_m;
    add(*scene_->mRootNode, axes_);
    finish();
  }

 private:
  [[noreturn]] void fail_empty() const {
    fail(ErrorKind::Input, "{}: it holds no triangle", name_);
  }

  void check_read(const Assimp::Importer& importer) const {
    if (scene_ != nullptr && scene_->mRootNode != nullptr) return;
    const std::string error = importer.GetErrorString();
    if (error.find("no meshes") != std::string::npos) fail_empty();
    fail(ErrorKind::Input, "{}: it cannot be read: {}", name_, error);
  }

  void check_faces() const {
    for (unsigned m = 0; m < scene_->mNumMeshes; ++m) {
      const aiMesh& mesh = *scene_->mMeshes[m];
      for (unsigned f = 0; f < mesh.mNumFaces; ++f)
        if (mesh.mFaces[f].mNumIndices > kMostFaceCorners)
          fail(ErrorKind::Input,
               "{}: mesh \"{}\": face {} has {} corners, and a face has at most {}; save the model "
               "as triangles",
               name_, mesh.mName.C_Str(), f, mesh.mFaces[f].mNumIndices, kMostFaceCorners);
    }
  }

  /// Triangles of its faces as they are in the file, each as often as nodes show it.
  void count(const aiNode& node, std::uint64_t& num_triangles, int depth) const {
    if (depth > 400) fail(ErrorKind::Input, "{}: its nodes lie deeper than 400", name_);
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = *scene_->mMeshes[node.mMeshes[i]];
      for (unsigned f = 0; f < mesh.mNumFaces; ++f)
        num_triangles += std::max(mesh.mFaces[f].mNumIndices, 2U) - 2;
    }
    if (num_triangles > kMostModelTriangles)
      fail(ErrorKind::Input, "{}: more than {} triangles; simplify it first", name_,
           kMostModelTriangles);
    for (unsigned i = 0; i < node.mNumChildren; ++i)
      count(*node.mChildren[i], num_triangles, depth + 1);
  }

  void add(const aiNode& node, const Matrix4d& parent) {
    const aiMatrix4x4& own = node.mTransformation;
    Matrix4d matrix;
    matrix << own.a1, own.a2, own.a3, own.a4, own.b1, own.b2, own.b3, own.b4, own.c1, own.c2,
        own.c3, own.c4, own.d1, own.d2, own.d3, own.d4;
    const Matrix4d world = parent * matrix;
    if (!world.allFinite())
      fail(ErrorKind::Input, "{}: node \"{}\" has a transformation that is no number", name_,
           node.mName.C_Str());
    for (unsigned i = 0; i < node.mNumMeshes; ++i) add(*scene_->mMeshes[node.mMeshes[i]], world);
    for (unsigned i = 0; i < node.mNumChildren; ++i) add(*node.mChildren[i], world);
  }

  struct Look {
    std::uint8_t finish = 0;
    bool is_textured = false;
    Eigen::Matrix3d uv = Eigen::Matrix3d::Identity();
  };

  void add(const aiMesh& mesh, const Matrix4d& matrix) {
    const Look look = look_of(mesh);
    // Mirrored nodes turn triangles inside out.
    const bool is_mirrored = matrix.topLeftCorner<3, 3>().determinant() < 0.0;
    std::vector<std::uint32_t> numbers(mesh.mNumVertices);
    const bool has_uv = look.is_textured && mesh.HasTextureCoords(0);
    std::map<std::tuple<std::int64_t, std::int64_t, std::int64_t, float, float>, std::uint32_t>
        known;
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D& at = mesh.mVertices[i];
      const Vector3d place = (matrix * Eigen::Vector4d(at.x, at.y, at.z, 1.0)).head<3>();
      if (!place.allFinite())
        fail(ErrorKind::Input, "{}: mesh \"{}\": vertex {} is no number", name_, mesh.mName.C_Str(),
             i);
      if (place.cwiseAbs().maxCoeff() > 1e6)
        fail(ErrorKind::Input, "{}: mesh \"{}\": vertex {} lies at {:.3g} m; set unit_m", name_,
             mesh.mName.C_Str(), i, place.cwiseAbs().maxCoeff());
      Vector2f uv = Vector2f::Zero();
      if (has_uv) {
        const Vector3d coordinate =
            look.uv * Vector3d(mesh.mTextureCoords[0][i].x, mesh.mTextureCoords[0][i].y, 1.0);
        uv = coordinate.head<2>().cast<float>();
        if (!uv.allFinite() || uv.cwiseAbs().maxCoeff() > 1e6F) uv = Vector2f::Zero();
      }
      const Eigen::Matrix<std::int64_t, 3, 1> steps =
          (place / world::kHeightStep_m).array().round().cast<std::int64_t>();
      const auto [entry, is_new] =
          known.try_emplace({steps.x(), steps.y(), steps.z(), uv.x(), uv.y()},
                            static_cast<std::uint32_t>(places_.size()));
      if (is_new) {
        places_.push_back(steps);
        uv_.push_back(uv);
      }
      numbers[i] = entry->second;
    }
    const bool has_colors = mesh.HasVertexColors(0) && !look.is_textured;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) {
        ++num_other_faces_;
        continue;
      }
      std::array<std::uint32_t, 3> corners{};
      for (unsigned k = 0; k < 3; ++k) {
        if (face.mIndices[k] >= mesh.mNumVertices)
          fail(ErrorKind::Input, "{}: mesh \"{}\": face {} names vertex {} of {}", name_,
               mesh.mName.C_Str(), f, face.mIndices[k], mesh.mNumVertices);
        corners[k] = numbers[face.mIndices[k]];
      }
      if (is_mirrored) std::swap(corners[1], corners[2]);
      const auto at = [&](std::size_t k) -> Vector3d { return places_[corners[k]].cast<double>(); };
      if ((at(1) - at(0)).cross(at(2) - at(0)).squaredNorm() == 0.0) {
        ++num_flat_;
        continue;
      }
      std::uint8_t finish = look.finish;
      if (has_colors) {
        Vector3d mean = Vector3d::Zero();
        for (unsigned k = 0; k < 3; ++k) {
          const aiColor4D& color = mesh.mColors[0][face.mIndices[k]];
          mean += Vector3d(color.r, color.g, color.b) / 3.0;
        }
        // Few enough of them: 32 steps a channel.
        const auto coarse = [](double value) {
          return static_cast<std::uint8_t>(std::min(255, (code_of(value) / 8) * 8 + 4));
        };
        finish = finish_of({.material = Material::Plain,
                            .semantic_class = semantic_class_,
                            .color_srgb = {coarse(mean.x()), coarse(mean.y()), coarse(mean.z())}});
      }
      triangles_.push_back({.corners = corners, .finish = finish});
      has_texture_ = has_texture_ || look.is_textured;
    }
  }

  std::uint8_t finish_of(const world::Finish& wanted) {
    const auto found = std::find(finishes_.begin(), finishes_.end(), wanted);
    if (found != finishes_.end()) return static_cast<std::uint8_t>(found - finishes_.begin());
    if (finishes_.size() < kMostFinishes) {
      finishes_.push_back(wanted);
      return static_cast<std::uint8_t>(finishes_.size() - 1);
    }
    // The nearest colour there is.
    ++num_merged_;
    std::size_t best = 0;
    int least = 1 << 30;
    for (std::size_t i = 0; i < finishes_.size(); ++i) {
      int distance = finishes_[i].material == wanted.material ? 0 : 1 << 20;
      for (std::size_t k = 0; k < 3; ++k) {
        const int step =
            static_cast<int>(finishes_[i].color_srgb[k]) - static_cast<int>(wanted.color_srgb[k]);
        distance += step * step;
      }
      if (distance < least) {
        least = distance;
        best = i;
      }
    }
    return static_cast<std::uint8_t>(best);
  }

  Look look_of(const aiMesh& mesh) {
    const auto [known, is_new] = looks_.try_emplace(mesh.mMaterialIndex);
    if (!is_new) return known->second;
    Look& look = known->second;
    world::Finish finish{.material = Material::Plain,
                         .semantic_class = semantic_class_,
                         .color_srgb = {200, 200, 200},
                         .pattern = 0};
    if (mesh.mMaterialIndex < scene_->mNumMaterials) {
      const aiMaterial& material = *scene_->mMaterials[mesh.mMaterialIndex];
      aiColor4D color(0.6F, 0.6F, 0.6F, 1.0F);
      if (material.Get(AI_MATKEY_BASE_COLOR, color) != AI_SUCCESS)
        material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
      for (std::size_t k = 0; k < 3; ++k) {
        const double value = static_cast<double>(color[static_cast<unsigned>(k)]);
        // glTF's factors are linear, Kd of OBJ is what a screen shows.
        finish.color_srgb[k] =
            std::isfinite(value)
                ? code_of(is_gltf_ ? srgb_from_linear(std::max(value, 0.0)) : value)
                : 128;
      }
      float metallic = 0.0F;
      if (is_gltf_ && material.Get(AI_MATKEY_METALLIC_FACTOR, metallic) == AI_SUCCESS &&
          metallic > 0.6F)
        finish.material = Material::Metal;
      if (const auto texture = texture_of(material)) {
        finish.material = Material::Textured;
        finish.pattern = *texture;
        finish.color_srgb = {255, 255, 255};
        look.is_textured = true;
        aiUVTransform transform;
        if (material.Get(AI_MATKEY_UVTRANSFORM(aiTextureType_BASE_COLOR, 0), transform) ==
                AI_SUCCESS ||
            material.Get(AI_MATKEY_UVTRANSFORM(aiTextureType_DIFFUSE, 0), transform) == AI_SUCCESS)
          look.uv = uv_matrix(transform);
      }
    }
    look.finish = finish_of(finish);
    return look;
  }

  /// assimp's form of KHR_texture_transform: scaled, then turned about the texture's middle, then moved.
  static Eigen::Matrix3d uv_matrix(const aiUVTransform& transform) {
    const double c = std::cos(static_cast<double>(transform.mRotation));
    const double s = std::sin(static_cast<double>(transform.mRotation));
    Eigen::Matrix3d scale = Eigen::Matrix3d::Identity();
    scale(0, 0) = static_cast<double>(transform.mScaling.x);
    scale(1, 1) = static_cast<double>(transform.mScaling.y);
    Eigen::Matrix3d turn;
    turn << c, -s, 0.5 - 0.5 * c + 0.5 * s, s, c, 0.5 - 0.5 * s - 0.5 * c, 0, 0, 1;
    Eigen::Matrix3d move = Eigen::Matrix3d::Identity();
    move(0, 2) = static_cast<double>(transform.mTranslation.x);
    move(1, 2) = static_cast<double>(transform.mTranslation.y);
    const Eigen::Matrix3d whole =
        move * (transform.mRotation != 0.0F ? turn : Eigen::Matrix3d::Identity().eval()) * scale;
    return whole.allFinite() ? whole : Eigen::Matrix3d::Identity().eval();
  }

  std::optional<std::uint16_t> texture_of(const aiMaterial& material) {
    aiString path;
    if (material.GetTexture(aiTextureType_BASE_COLOR, 0, &path) != AI_SUCCESS &&
        material.GetTexture(aiTextureType_DIFFUSE, 0, &path) != AI_SUCCESS)
      return std::nullopt;
    const std::string uri = path.C_Str();
    const auto [known, is_new] = textures_.try_emplace(uri);
    if (!is_new) return known->second;
    const std::string where =
        fmt::format("{}: texture {}", name_, uri.size() > 80 ? uri.substr(0, 80) : uri);
    std::vector<std::byte> bytes;
    if (const aiTexture* embedded = scene_->GetEmbeddedTexture(uri.c_str()); embedded != nullptr) {
      if (embedded->mHeight !=
          0) {  // pixels as they are: no kind of file that is read here has them
        ++num_unread_;
        return std::nullopt;
      }
      const auto* data = reinterpret_cast<const std::byte*>(embedded->pcData);
      bytes.assign(data, data + embedded->mWidth);
    } else {
      const std::filesystem::path file = path_in_folder(uri, folder_, where);
      std::error_code error;
      if (!std::filesystem::is_regular_file(file, error)) {
        ++num_missing_;
        return std::nullopt;
      }
      bytes = bytes_of(file, where);
    }
    const auto byte = [&](std::size_t at) {
      return at < bytes.size() ? static_cast<unsigned>(bytes[at]) : 0U;
    };
    const bool is_png = byte(0) == 0x89 && byte(1) == 'P';
    const bool is_jpeg = byte(0) == 0xff && byte(1) == 0xd8;
    if (!is_png && !is_jpeg) {
      ++num_unread_;
      return std::nullopt;
    }
    hashes_ += core::content_hash(bytes);
    if (model_.textures.size() >= kMostTextures)
      fail(ErrorKind::Input, "{}: a model has at most {} textures", where, kMostTextures);
    known->second = static_cast<std::uint16_t>(model_.textures.size());
    model_.textures.push_back({.name = fmt::format("{}/{}", options_.name,
                                                   std::filesystem::path(uri).filename().string()),
                               .image = decode_texture(bytes, where, texture_bytes_left_)});
    return known->second;
  }

  void finish() {
    if (triangles_.empty()) fail_empty();
    Eigen::Matrix<std::int64_t, 3, 1> low = places_[triangles_[0].corners[0]];
    Eigen::Matrix<std::int64_t, 3, 1> high = low;
    for (const Shape::Triangle& triangle : triangles_)
      for (const std::uint32_t corner : triangle.corners) {
        low = low.cwiseMin(places_[corner]);
        high = high.cwiseMax(places_[corner]);
      }
    Eigen::Matrix<std::int64_t, 3, 1> shift = Eigen::Matrix<std::int64_t, 3, 1>::Zero();
    if (options_.origin == "foot")
      shift << (low.x() + high.x()) / 2, (low.y() + high.y()) / 2, low.z();
    const Vector3d size_m = (high - low).cast<double>() * world::kHeightStep_m;
    const double reach_m = std::max((low - shift).cast<double>().cwiseAbs().maxCoeff(),
                                    (high - shift).cast<double>().cwiseAbs().maxCoeff()) *
                           world::kHeightStep_m;
    if (reach_m > kLargest_m)
      fail(ErrorKind::Input,
           "{}: it reaches {:.0f} m from its origin, and a model at most {:.0f} m; set unit_m",
           name_, reach_m, kLargest_m);
    Shape shape;
    for (const auto& place : places_) shape.vertices_steps.push_back((place - shift).cast<int>());
    if (has_texture_) shape.uv = uv_;
    shape.triangles = triangles_;
    shape.finishes = finishes_;
    add_levels(std::move(shape), size_m.maxCoeff());
    // What it covers, wherever its origin is.
    const Vector3d far =
        (low - shift).cast<double>().cwiseAbs().cwiseMax((high - shift).cast<double>().cwiseAbs()) *
        world::kHeightStep_m;
    model_.footprint_m = 2.0 * far.head<2>();
    model_.prototype.name = options_.name;
    model_.prototype.is_model = true;
    model_.content_hash = core::content_hash(fmt::format(
        "{} {} {} {} {} {} {} {}", kModelVersion, hashes_, options_.name, options_.semantic_class,
        options_.up, options_.origin, options_.unit_m, options_.yaw_deg));
    const auto counted = [&](const char* what, std::int64_t number) {
      if (number > 0) model_.counts.emplace_back(what, number);
    };
    counted("triangles", static_cast<std::int64_t>(triangles_.size()));
    counted("triangles without area", num_flat_);
    counted("faces that are no triangles", num_other_faces_);
    counted("libraries of materials missing", num_missing_libraries_);
    counted("textures missing", num_missing_);
    counted("textures of a kind that is not read", num_unread_);
    counted("colours merged", num_merged_);
  }

  /// A tile of level L shows a metre as 2^(1 - L) pixels and more: cells are half a pixel.
  void add_levels(Shape shape, double size_m) {
    const int last = std::clamp(static_cast<int>(std::ceil(std::log2(std::max(size_m, 0.25)))), 0,
                                kCoarsestModelLevel);
    model_.prototype.levels.push_back({.coarsest_level = 0, .shape = std::move(shape)});
    for (int level = 1; level <= last; ++level) {
      const Shape& finest = model_.prototype.levels.front().shape;
      Shape coarse = clustered(finest, 0.25 * std::exp2(level));
      world::ShapeLevel& before = model_.prototype.levels.back();
      // Not worth a level of its own, or nothing left: what is there goes on.
      if (coarse.triangles.size() < 4 ||
          10 * coarse.triangles.size() > 7 * before.shape.triangles.size())
        before.coarsest_level = static_cast<std::int8_t>(level);
      else
        model_.prototype.levels.push_back(
            {.coarsest_level = static_cast<std::int8_t>(level), .shape = std::move(coarse)});
    }
  }

  const ModelOptions& options_;
  std::uint64_t& texture_bytes_left_;
  Model& model_;
  std::string name_;
  std::filesystem::path folder_;
  std::string hashes_;
  bool is_gltf_ = false;
  core::SemanticClass semantic_class_ = core::SemanticClass::Object;
  const aiScene* scene_ = nullptr;
  Matrix4d axes_;
  std::vector<Eigen::Matrix<std::int64_t, 3, 1>> places_;
  std::vector<Vector2f> uv_;
  std::vector<Shape::Triangle> triangles_;
  std::vector<world::Finish> finishes_;
  std::map<unsigned, Look> looks_;
  std::map<std::string, std::optional<std::uint16_t>> textures_;
  bool has_texture_ = false;
  std::int64_t num_flat_ = 0;
  std::int64_t num_other_faces_ = 0;
  std::int64_t num_missing_libraries_ = 0;
  std::int64_t num_missing_ = 0;  ///< textures
  std::int64_t num_unread_ = 0;
  std::int64_t num_merged_ = 0;
};

}  // namespace

void ModelOptions::describe(core::SchemaVisitor& visit) {
  std::vector<std::string> classes;
  for (const std::string_view known : core::semantic_class_names()) classes.emplace_back(known);
  visit.key("name", name, "By which lists name it.", core::required());
  visit.key("file", file,
            "A .gltf or .glb (glTF 2), .obj or .ply; what it names lies in its folder.");
  visit.key("class", semantic_class, "What it is.", core::one_of(classes));
  visit.key("up", up, "Its upward axis. y: z is its front, as in glTF; z: x is its front.",
            core::one_of({"y", "z"}));
  visit.key(
      "origin", origin,
      "What stands at a place: foot, the middle of its lowest level; or the model's own origin.",
      core::one_of({"foot", "model"}));
  visit.key("unit_m", unit_m, "Length of its unit.", core::between(1e-4, 1e3));
  visit.key("yaw_deg", yaw_deg,
            "By which it is turned anticlockwise about up, so that its front is forward.",
            core::between(-360.0, 360.0));
}

void ModelOptions::validate() const {
  if (name.empty()) fail(ErrorKind::Config, "a model has no name");
  if (file.empty()) fail(ErrorKind::Config, "model {}: file is missing", name);
}

Model read_model(const ModelOptions& options, std::uint64_t& texture_bytes_left) {
  Model model;
  core::with_context([&] { ModelReader(options, texture_bytes_left, model).read(); },
                     fmt::format("reading model {}", options.name));
  return model;
}

}  // namespace terracast::tiler
