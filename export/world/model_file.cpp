#include "export/world/model_file.h"

#include <assimp/mesh.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Exporter.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/progress.h"
#include "core/srgb.h"

namespace terracast::world_export {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

/// assimp's arrays are owned by what holds them and deleted with it.
template <class T>
T** array_of(const std::vector<T*>& items) {
  auto** array = new T*[std::max<std::size_t>(items.size(), 1)];
  std::copy(items.begin(), items.end(), array);
  return array;
}

aiMaterial* material_of(const Part& part, const std::vector<ModelTexture>& textures,
                        const std::vector<std::string>& texture_paths) {
  auto* material = new aiMaterial;
  const aiString name(part.name);
  material->AddProperty(&name, AI_MATKEY_NAME);
  // A picture is multiplied by the colour.
  const auto linear = [&](std::size_t channel) {
    return core::linear_from_srgb8(part.color_srgb[channel]);
  };
  const aiColor4D color(linear(0), linear(1), linear(2), 1.0F);
  material->AddProperty(&color, 1, AI_MATKEY_BASE_COLOR);
  const aiColor3D diffuse(color.r, color.g, color.b);
  material->AddProperty(&diffuse, 1, AI_MATKEY_COLOR_DIFFUSE);
  if (part.texture >= 0) {
    const auto row = static_cast<std::size_t>(part.texture);
    const aiString path(texture_paths[row]);
    material->AddProperty(&path, AI_MATKEY_TEXTURE_DIFFUSE(0));
    const int mode = textures[row].repeats ? aiTextureMapMode_Wrap : aiTextureMapMode_Clamp;
    material->AddProperty(&mode, 1, AI_MATKEY_MAPPINGMODE_U_DIFFUSE(0));
    material->AddProperty(&mode, 1, AI_MATKEY_MAPPINGMODE_V_DIFFUSE(0));
  }
  constexpr float kMetallic = 0.0F;
  constexpr float kRoughness = 1.0F;
  material->AddProperty(&kMetallic, 1, AI_MATKEY_METALLIC_FACTOR);
  material->AddProperty(&kRoughness, 1, AI_MATKEY_ROUGHNESS_FACTOR);
  constexpr int kTwoSided = 1;
  material->AddProperty(&kTwoSided, 1, AI_MATKEY_TWOSIDED);
  return material;
}

/// A picture within the file.
aiTexture* texture_of(const ModelTexture& texture) {
  auto* embedded = new aiTexture;
  embedded->mFilename = aiString(texture.name);
  embedded->mWidth = static_cast<unsigned>(texture.png.size());
  embedded->mHeight = 0;  // as a file has it
  std::strcpy(embedded->achFormatHint, "png");
  embedded->pcData = new aiTexel[(texture.png.size() + sizeof(aiTexel) - 1) / sizeof(aiTexel)];
  std::memcpy(static_cast<void*>(embedded->pcData), texture.png.data(), texture.png.size());
  return embedded;
}

aiMesh* mesh_of(const Part& part, unsigned material) {
  auto* mesh = new aiMesh;
  mesh->mName = aiString(part.name);
  mesh->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  mesh->mMaterialIndex = material;
  mesh->mNumVertices = static_cast<unsigned>(part.vertices.size());
  mesh->mVertices = new aiVector3D[part.vertices.size()];
  for (std::size_t i = 0; i < part.vertices.size(); ++i) {
    const Eigen::Vector3f place = part.vertices[i].cast<float>();
    mesh->mVertices[i] = aiVector3D(place.x(), place.y(), place.z());
  }
  if (part.texture >= 0) {
    mesh->mNumUVComponents[0] = 2;
    mesh->mTextureCoords[0] = new aiVector3D[part.uv.size()];
    for (std::size_t i = 0; i < part.uv.size(); ++i)
      mesh->mTextureCoords[0][i] = aiVector3D(part.uv[i].x(), part.uv[i].y(), 0.0F);
  }
  mesh->mNumFaces = static_cast<unsigned>(part.triangles.size());
  mesh->mFaces = new aiFace[part.triangles.size()];
  for (std::size_t i = 0; i < part.triangles.size(); ++i) {
    mesh->mFaces[i].mNumIndices = 3;
    mesh->mFaces[i].mIndices = new unsigned[3];
    std::copy(part.triangles[i].begin(), part.triangles[i].end(), mesh->mFaces[i].mIndices);
  }
  return mesh;
}

aiMatrix4x4 matrix_of(const Eigen::Matrix4d& m) {
  const auto f = [&](int row, int column) { return static_cast<float>(m(row, column)); };
  return {f(0, 0), f(0, 1), f(0, 2), f(0, 3), f(1, 0), f(1, 1), f(1, 2), f(1, 3),
          f(2, 0), f(2, 1), f(2, 2), f(2, 3), f(3, 0), f(3, 1), f(3, 2), f(3, 3)};
}

/// Collects meshes and their materials.
class SceneMaker {
 public:
  /// texture_paths   of each picture, beside the file; empty: within the file
  SceneMaker(const std::vector<ModelTexture>& textures, std::vector<std::string> texture_paths)
      : textures_(textures),
        texture_paths_(std::move(texture_paths)),
        are_embedded_(texture_paths_.empty()) {
    if (are_embedded_)
      for (std::size_t i = 0; i < textures.size(); ++i)
        texture_paths_.push_back(fmt::format("*{}", i));
  }

  /// A node that holds these parts.
  aiNode* node_of(const std::string& name, const std::vector<unsigned>& mesh_indices) {
    auto* node = new aiNode(name);
    node->mNumMeshes = static_cast<unsigned>(mesh_indices.size());
    node->mMeshes = new unsigned[std::max<std::size_t>(mesh_indices.size(), 1)];
    std::copy(mesh_indices.begin(), mesh_indices.end(), node->mMeshes);
    return node;
  }
  std::vector<unsigned> add(const std::vector<Part>& parts) {
    std::vector<unsigned> indices;
    for (const Part& part : parts) {
      if (part.triangles.empty()) continue;
      indices.push_back(static_cast<unsigned>(meshes_.size()));
      meshes_.push_back(mesh_of(part, static_cast<unsigned>(materials_.size())));
      materials_.push_back(material_of(part, textures_, texture_paths_));
    }
    return indices;
  }
  /// What was added, below a root.
  std::unique_ptr<aiScene> finish(aiNode* root) {
    auto scene = std::make_unique<aiScene>();
    scene->mRootNode = root;
    scene->mNumMeshes = static_cast<unsigned>(meshes_.size());
    scene->mMeshes = array_of(meshes_);
    scene->mNumMaterials = static_cast<unsigned>(materials_.size());
    scene->mMaterials = array_of(materials_);
    if (are_embedded_ && !textures_.empty()) {
      std::vector<aiTexture*> embedded;
      for (const ModelTexture& texture : textures_) embedded.push_back(texture_of(texture));
      scene->mNumTextures = static_cast<unsigned>(embedded.size());
      scene->mTextures = array_of(embedded);
    }
    return scene;
  }

 private:
  const std::vector<ModelTexture>& textures_;
  std::vector<std::string> texture_paths_;
  const bool are_embedded_;
  std::vector<aiMesh*> meshes_;
  std::vector<aiMaterial*> materials_;
};

std::unique_ptr<aiScene> scene_of(const WorldModel& model, bool has_y_up,
                                  std::vector<std::string> texture_paths) {
  SceneMaker maker(model.textures, std::move(texture_paths));
  std::vector<aiNode*> nodes;
  // A node each, for a node's meshes become one mesh with one name.
  for (const Part& part : model.parts) nodes.push_back(maker.node_of(part.name, maker.add({part})));
  std::vector<std::vector<unsigned>> prototypes;
  for (const auto& parts : model.prototypes) prototypes.push_back(maker.add(parts));
  for (std::size_t i = 0; i < model.placed.size(); ++i) {
    aiNode* node = maker.node_of(fmt::format("instance_{}", i), prototypes[model.placed[i].model]);
    node->mTransformation = matrix_of(model.placed[i].frame_from_model);
    nodes.push_back(node);
  }
  auto* root = new aiNode("world");
  if (has_y_up)
    root->mTransformation = matrix_of(
        (Eigen::Matrix4d() << 1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1).finished());
  root->addChildren(static_cast<unsigned>(nodes.size()), nodes.data());
  return maker.finish(root);
}

/// Takes names of extensions away that nothing uses: of what has one it is a member's name.
void drop_unused_extensions(std::string& json) {
  constexpr std::string_view kMember = "\"extensionsUsed\":[";
  const std::size_t begin = json.find(kMember);
  if (begin == std::string::npos) return;
  const std::size_t end = json.find(']', begin) + 1;
  const std::size_t names_at = begin + kMember.size() - 1;
  std::vector<std::string> used;
  for (const std::string& name :
       Json::parse(std::string_view(json).substr(names_at, end - names_at), "extensionsUsed")
           .strings())
    if (json.find(fmt::format("\"{}\":", name)) != std::string::npos) used.push_back(name);
  if (!used.empty()) {
    json.replace(names_at, end - names_at, Json::array_of(used).text(-1));
    return;
  }
  // A list must not be empty: with the member goes the comma on one of its sides.
  if (json[end] == ',')
    json.erase(begin, end + 1 - begin);
  else
    json.erase(begin - 1, end - (begin - 1));
}

/// Of a binary glTF as the exporter writes it (12 bytes of header, its JSON, its buffer): says where its frame is, and
/// uses no more extensions than it does.
void mend_glb(std::string& glb, const geo::Geodetic& origin) {
  constexpr std::size_t kLengthAt = 8;
  constexpr std::size_t kJsonLengthAt = 12;
  constexpr std::size_t kJsonAt = 20;
  std::uint32_t json_bytes = 0;
  std::memcpy(&json_bytes, &glb[kJsonLengthAt], sizeof json_bytes);
  std::string json = glb.substr(kJsonAt, json_bytes);
  drop_unused_extensions(json);
  constexpr std::string_view kAsset = "\"asset\":{";
  const std::size_t asset = json.find(kAsset);
  TERRACAST_CHECK(asset != std::string::npos, "a glTF without its asset");
  Json extras = Json::object();
  extras.set("terracast_frame", frame_text("x east, y up, z south", origin))
      .set("latitude_deg", origin.lat_deg)
      .set("longitude_deg", origin.lon_deg)
      .set("height_m", origin.height_m);
  json.insert(asset + kAsset.size(), fmt::format("\"extras\":{},", extras.text(-1)));
  while (json.size() % 4 != 0) json += ' ';
  if (glb.size() - json_bytes + json.size() > std::numeric_limits<std::uint32_t>::max())
    fail(ErrorKind::Input, "more than the 4 GiB that a glTF holds; give a smaller --region");
  glb.replace(kJsonAt, json_bytes, json);
  json_bytes = static_cast<std::uint32_t>(json.size());
  const auto all_bytes = static_cast<std::uint32_t>(glb.size());
  std::memcpy(&glb[kJsonLengthAt], &json_bytes, sizeof json_bytes);
  std::memcpy(&glb[kLengthAt], &all_bytes, sizeof all_bytes);
}

/// Of an OBJ as the exporter writes it: says where its frame is, and names its materials, whose file the exporter names
/// after one of its own.
void mend_obj(std::string& text, const geo::Geodetic& origin, const std::string& name) {
  const std::size_t begin = text.find("mtllib ");
  if (begin != std::string::npos) {
    const std::size_t end = text.find('\n', begin);
    text.replace(begin, end - begin, fmt::format("mtllib {}.mtl", name));
  }
  text.insert(0, fmt::format("# terracast_frame {}\n# latitude_deg {}\n# longitude_deg {}\n"
                             "# height_m {}\n",
                             frame_text("x east, y north, z up", origin), origin.lat_deg,
                             origin.lon_deg, origin.height_m));
}

}  // namespace

int texture_side_px(const WorldExportInputs& inputs, const std::vector<world::CutTile>& cut,
                    int usual_px, std::size_t num_files) {
  const double most = kMostTexturePixels * static_cast<double>(num_files);
  const auto pixels_of = [&](double side_px) {
    return side_px * side_px * static_cast<double>(cut.size());
  };
  if (!inputs.texel_m) {
    int side_px = usual_px;
    while (side_px > 1 && pixels_of(side_px) > most) side_px /= 2;
    return side_px;
  }
  if (*inputs.texel_m == 0.0) return 0;
  double finest_m = std::numeric_limits<double>::infinity();
  for (const world::CutTile& tile : cut) finest_m = std::min(finest_m, tile.id.side_m());
  double side_px = 1.0;
  while (side_px * *inputs.texel_m < finest_m) side_px *= 2.0;
  if (side_px > kMostTextureSide_px)
    fail(ErrorKind::Input,
         "pictures of {:.0f} pixels a side, where {} are the most; --texel {} or more fits",
         side_px, kMostTextureSide_px, finest_m / kMostTextureSide_px);
  if (pixels_of(side_px) > most)
    fail(ErrorKind::Input,
         "{} pictures of {:.0f} x {:.0f} pixels, where {:.0f} pixels are the most; give a smaller "
         "--region or a coarser --texel",
         cut.size(), side_px, side_px, most);
  return static_cast<int>(side_px);
}

void write_model(const WorldModel& model, const geo::Geodetic& origin,
                 const std::filesystem::path& file, const char* format) {
  if (model.num_triangles() == 0)
    fail(ErrorKind::Input, "{}: the region holds no triangle", file.string());
  const bool is_gltf = std::strcmp(format, "glb2") == 0;
  std::vector<std::string> texture_paths;
  if (!is_gltf)
    for (const ModelTexture& texture : model.textures) {
      texture_paths.push_back(fmt::format("{}_{}.png", file.stem().string(), texture.name));
      core::write_file(file.parent_path() / texture_paths.back(), texture.png);
    }
  const std::unique_ptr<aiScene> scene = scene_of(model, is_gltf, std::move(texture_paths));
  Assimp::Exporter exporter;
  const aiExportDataBlob* blob = exporter.ExportToBlob(scene.get(), format);
  if (blob == nullptr)
    fail(ErrorKind::Internal, "{}: assimp cannot write it: {}", file.string(),
         exporter.GetErrorString());
  // The first is the file itself; further ones, such as materials, are named by their suffix.
  const std::string first_name = file.stem().string();
  for (const aiExportDataBlob* part = blob; part != nullptr; part = part->next) {
    const std::string suffix = part->name.C_Str();
    std::filesystem::path destination = file;
    if (!suffix.empty()) destination.replace_extension(suffix);
    std::string text;
    std::span<const std::byte> bytes(static_cast<const std::byte*>(part->data), part->size);
    if (part == blob) {
      text.assign(static_cast<const char*>(part->data), part->size);
      if (is_gltf)
        mend_glb(text, origin);
      else
        mend_obj(text, origin, first_name);
      bytes = std::as_bytes(std::span(text));
    }
    core::write_file(destination, bytes);
  }
}

void write_region_model(const WorldExportInputs& inputs, const char* format) {
  const geo::WorldFrame frame(inputs.store.manifest().origin);
  const auto cut = cut_of_region(inputs.store, inputs.region, inputs.finest_spacing_m);
  constexpr int kUsualSide_px = 1024;
  core::Progress progress(inputs.context, "tiles", static_cast<std::int64_t>(cut.size()));
  const int side_px = texture_side_px(inputs, cut, kUsualSide_px, 1);
  const geo::Geodetic center = inputs.region.center();
  const WorldModel model = core::with_context(
      [&] {
        return ModelMaker(inputs.store, side_px > 0)
            .make(cut, enu_from_world(frame, center),
                  {.region = inputs.region, .texture_side_px = side_px, .progress = &progress});
      },
      fmt::format("making {}", inputs.destination.string()));
  write_model(model, center, inputs.destination, format);
}

}  // namespace terracast::world_export
