#include "tiler/objects/model_gltf_materials.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "tiler/objects/model_file.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;
using Eigen::Matrix3d;

/// Samplers' word for an image that goes on by repeating.
constexpr std::int64_t kRepeat = 10497;
constexpr double kMetal = 0.6;

const Json* member(const Json& object, const char* name) {
  return object.has(name) ? &object.at(name) : nullptr;
}
const Json* extension(const Json& object, const char* name) {
  const Json* extensions = member(object, "extensions");
  return extensions != nullptr && extensions->is_object() ? member(*extensions, name) : nullptr;
}

Matrix3d matrix_of(const std::array<double, 9>& rows) {
  Matrix3d matrix;
  matrix << rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7], rows[8];
  return matrix;
}

class Materials {
 public:
  Materials(const GltfBuffers& buffers, const ModelFolder& folder, ModelScene& scene)
      : buffers_(buffers), root_(buffers.root()), folder_(folder), scene_(scene) {}

  std::vector<GltfPicture> add() {
    add_images();
    const Json& materials = gltf_list(root_, "materials");
    for (std::size_t i = 0; i < materials.size(); ++i) {
      where_ = fmt::format("{}: material {}", folder_.name(), i);
      scene_.materials.emplace_back();
      pictures_.emplace_back();
      add_material(materials.at(i));
    }
    scene_.materials.push_back({.is_metal = true});  // as glTF has it: white, and all metal
    pictures_.emplace_back();
    return std::move(pictures_);
  }

 private:
  void add_images() {
    const Json& images = gltf_list(root_, "images");
    for (std::size_t i = 0; i < images.size(); ++i) {
      const Json& image = images.at(i);
      const std::string where = fmt::format("{}: image {}", folder_.name(), i);
      ModelImage own{.name = fmt::format("image {}", i), .file = {}, .bytes = {}};
      if (image.has("name")) own.name = image.at("name").string();
      if (image.has("uri") && image.at("uri").string().starts_with("data:")) {
        own.bytes = bytes_of_data_uri(image.at("uri").string(), where);
      } else if (image.has("uri")) {
        own.name = image.at("uri").string();
        own.file = folder_.path_of_uri(own.name, where);
      } else if (image.has("bufferView")) {
        const auto bytes = buffers_.view(
            row_of(image, "bufferView", gltf_list(root_, "bufferViews").size(), where));
        inner_bytes_ += bytes.size();
        if (inner_bytes_ > kMostModelBytes)
          fail(ErrorKind::Input, "{}: images within the model hold more than {} bytes", where,
               kMostModelBytes);
        own.bytes.assign(bytes.begin(), bytes.end());
      }
      scene_.images.push_back(std::move(own));
    }
  }

  static std::size_t row_of(const Json& object, const char* name, std::size_t size,
                            const std::string& where) {
    const std::int64_t row = object.at(name).integer();
    if (row < 0 || static_cast<std::size_t>(row) >= size)
      fail(ErrorKind::Input, "{}: {} = {}, and there are {}", where, name, row, size);
    return static_cast<std::size_t>(row);
  }

  void add_material(const Json& json) {
    ModelMaterial& material = scene_.materials.back();
    take_alpha(json, material);
    const Json* factor = nullptr;
    const Json* texture = nullptr;
    material.is_metal = true;
    if (const Json* pbr = member(json, "pbrMetallicRoughness")) {
      factor = member(*pbr, "baseColorFactor");
      texture = member(*pbr, "baseColorTexture");
      if (const Json* metallic = member(*pbr, "metallicFactor"))
        material.is_metal = metallic->number() > kMetal;
      else if (member(*pbr, "metallicRoughnessTexture") != nullptr)
        material.is_metal = false;  // its picture says where
    }
    // Who knows it takes its colours, and leaves the others to who does not.
    if (const Json* glossy = extension(json, "KHR_materials_pbrSpecularGlossiness")) {
      factor = member(*glossy, "diffuseFactor");
      texture = member(*glossy, "diffuseTexture");
      material.is_metal = false;
    }
    if (extension(json, "KHR_materials_unlit") != nullptr) material.is_metal = false;
    if (factor != nullptr) take_factor(*factor, material);
    material.factor_without_image = material.factor;
    if (texture != nullptr) take_texture(*texture, material);
  }

  void take_alpha(const Json& json, ModelMaterial& material) {
    const std::string mode = json.has("alphaMode") ? json.at("alphaMode").string() : "OPAQUE";
    material.shows_through = mode != "OPAQUE";
    if (mode == "BLEND") ++scene_.counts["materials that let light through, shown opaque"];
    if (mode != "OPAQUE" && mode != "BLEND" && mode != "MASK")
      scene_.ledger.misunderstand("glTF material.alphaMode", mode);
  }

  void take_factor(const Json& json, ModelMaterial& material) {
    const std::vector<double> values = json.numbers();
    const auto is_right = [](double value) { return value >= 0.0 && value <= 1.0; };
    if (values.size() < 3 || values.size() > 4 ||
        !std::all_of(values.begin(), values.end(), is_right)) {
      scene_.ledger.misunderstand("glTF pbr.baseColorFactor", json.text(-1));
      if (values.size() < 3) return;
    }
    for (int k = 0; k < 3; ++k)
      material.factor[k] = std::clamp(values[static_cast<std::size_t>(k)], 0.0, 1.0);
  }

  void take_texture(const Json& info, ModelMaterial& material) {
    const Json& textures = gltf_list(root_, "textures");
    const Json& texture = textures.at(row_of(info, "index", textures.size(), where_));
    std::int64_t set = info.has("texCoord") ? info.at("texCoord").integer() : 0;
    GltfPicture& picture = pictures_.back();
    // y of textures runs downward here, upward there.
    const Matrix3d upward = matrix_of({1, 0, 0, 0, -1, 1, 0, 0, 1});
    picture.uv = upward;
    if (const Json* transform = extension(info, "KHR_texture_transform")) {
      picture.uv = upward * transform_of(*transform);
      if (transform->has("texCoord")) set = transform->at("texCoord").integer();
    }
    picture.attribute = fmt::format("TEXCOORD_{}", set);
    if (!texture.has("source")) {  // an extension has one of another kind
      ++scene_.counts["textures of a kind that is not read"];
      return;
    }
    material.image = row_of(texture, "source", scene_.images.size(), where_);
    if (texture.has("sampler")) take_sampler(texture, material);
  }

  /// Scaled, then turned, then moved. The turn goes anticlockwise as seen on the picture, whose y runs downward; so Khronos'
  /// viewer, Babylon.js, three.js and Blender have it, whereas the extension's own lines of code turn the other way.
  Matrix3d transform_of(const Json& json) {
    const auto pair = [&](const char* name, double otherwise) -> std::array<double, 2> {
      if (!json.has(name)) return {otherwise, otherwise};
      const std::vector<double> values = json.at(name).numbers();
      if (values.size() == 2) return {values[0], values[1]};
      scene_.ledger.misunderstand(fmt::format("glTF KHR_texture_transform.{}", name),
                                  json.at(name).text(-1));
      return {otherwise, otherwise};
    };
    const double turn = json.has("rotation") ? json.at("rotation").number() : 0.0;
    const double c = std::cos(turn), s = std::sin(turn);
    const auto [x, y] = pair("offset", 0.0);
    const auto [scale_x, scale_y] = pair("scale", 1.0);
    return matrix_of({1, 0, x, 0, 1, y, 0, 0, 1}) * matrix_of({c, s, 0, -s, c, 0, 0, 0, 1}) *
           matrix_of({scale_x, 0, 0, 0, scale_y, 0, 0, 0, 1});
  }

  void take_sampler(const Json& texture, ModelMaterial& material) {
    const Json& samplers = gltf_list(root_, "samplers");
    const Json& sampler = samplers.at(row_of(texture, "sampler", samplers.size(), where_));
    for (const char* wrap : {"wrapS", "wrapT"})
      if (sampler.has(wrap) && sampler.at(wrap).integer() != kRepeat) material.repeats = false;
  }

  const GltfBuffers& buffers_;
  const Json& root_;
  const ModelFolder& folder_;
  ModelScene& scene_;
  std::vector<GltfPicture> pictures_;
  std::string where_;
  std::uint64_t inner_bytes_ = 0;  ///< of images in views, each as often as it is named
};

}  // namespace

std::vector<GltfPicture> add_gltf_materials(const GltfBuffers& buffers, const ModelFolder& folder,
                                            ModelScene& scene) {
  return Materials(buffers, folder, scene).add();
}

}  // namespace terracast::tiler
