#include "tiler/objects/model_gltf_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

#include "tiler/objects/gltf_check.h"

namespace terracast::tiler {
namespace {

using core::Json;
using core::KnownName;
using core::Ledger;

constexpr const char* kShine = "how a surface shines is left to its kind";
constexpr const char* kMoves = "a model stands still, as its nodes have it";
constexpr const char* kText = "words for people";
constexpr const char* kOwn = "data of a program's own";
constexpr const char* kBounds = "follows from the values";
constexpr const char* kHint = "a hint for programs of graphics cards";
constexpr const char* kLight = "surfaces of models give no light";
constexpr const char* kSides = "surfaces are seen from both sides";
constexpr const char* kClear = "surfaces are opaque";
constexpr const char* kOther = "the picture or mesh beside it is read";

constexpr auto kNames = std::to_array<KnownName>({
    {"glTF asset.version", "version 2 is read"},
    {"glTF asset.minVersion", "version 2 is read", false},
    {"glTF asset.generator", kText, false},
    {"glTF asset.copyright", kText, false},
    {"glTF root.asset", "version"},
    {"glTF root.scene", "which of the scenes is shown"},
    {"glTF root.scenes", "what is shown"},
    {"glTF root.nodes", "where meshes stand"},
    {"glTF root.meshes", "surfaces"},
    {"glTF root.materials", "how surfaces look"},
    {"glTF root.textures", "pictures of surfaces"},
    {"glTF root.images", "pictures"},
    {"glTF root.samplers", "how pictures repeat"},
    {"glTF root.accessors", "values"},
    {"glTF root.bufferViews", "values"},
    {"glTF root.buffers", "values"},
    {"glTF root.skins", "joints that move meshes"},
    {"glTF root.extensionsUsed", "extensions"},
    {"glTF root.extensionsRequired",
     "extensions; a model that requires one that is not read is refused"},
    {"glTF root.animations", kMoves, false},
    {"glTF root.cameras", "cameras are those of the job", false},
    {"glTF scene.nodes", "nodes that are shown"},
    {"glTF scene.name", kText, false},
    {"glTF node.children", "nodes that move with it"},
    {"glTF node.matrix", "place"},
    {"glTF node.translation", "place"},
    {"glTF node.rotation", "turn"},
    {"glTF node.scale", "size"},
    {"glTF node.mesh", "mesh"},
    {"glTF node.skin", "joints of its mesh"},
    {"glTF node.weights", "shares of its mesh's targets"},
    {"glTF node.camera", "cameras are those of the job", false},
    {"glTF node.name", kText, false},
    {"glTF mesh.primitives", "surfaces"},
    {"glTF mesh.weights", "shares of its targets"},
    {"glTF mesh.name", kText, false},
    {"glTF primitive.attributes", "values of vertices"},
    {"glTF primitive.indices", "corners of triangles"},
    {"glTF primitive.material", "how it looks"},
    {"glTF primitive.mode", "triangles, strips and fans are shown; points and lines are counted"},
    {"glTF primitive.targets", "shapes that are mixed in, by their shares"},
    {"glTF attribute POSITION", "place"},
    {"glTF attribute TEXCOORD_*", "place on the picture, of the set that the material names"},
    {"glTF attribute COLOR_0", "colour, linear; multiplies factor and picture"},
    {"glTF attribute COLOR_*", "the first set of colours is shown", false},
    {"glTF attribute JOINTS_*", "joints that move a vertex"},
    {"glTF attribute WEIGHTS_*", "shares of joints"},
    {"glTF attribute NORMAL", "surfaces face where their corners go round", false},
    {"glTF attribute TANGENT", "of maps of normals, which are not read", false},
    {"glTF attribute _*", kOwn, false},
    {"glTF material.pbrMetallicRoughness", "colour"},
    {"glTF material.alphaMode", "whether a picture's alpha counts"},
    {"glTF material.alphaCutoff", kClear, false},
    {"glTF material.doubleSided", kSides, false},
    {"glTF material.normalTexture", "surfaces are as fine as their triangles", false},
    {"glTF material.occlusionTexture", "shadows are cast by rays", false},
    {"glTF material.emissiveTexture", kLight, false},
    {"glTF material.emissiveFactor", kLight, false},
    {"glTF material.name", kText, false},
    {"glTF pbr.baseColorFactor", "colour, linear"},
    {"glTF pbr.baseColorTexture", "picture, sRGB; multiplies the factor"},
    {"glTF pbr.metallicFactor", "above 0.6 a surface without a picture is metal"},
    {"glTF pbr.roughnessFactor", kShine, false},
    {"glTF pbr.metallicRoughnessTexture", kShine, false},
    {"glTF textureInfo.index", "which picture"},
    {"glTF textureInfo.texCoord", "which set of coordinates"},
    {"glTF KHR_texture_transform.offset", "where the picture lies"},
    {"glTF KHR_texture_transform.rotation", "how the picture is turned"},
    {"glTF KHR_texture_transform.scale", "how often the picture repeats"},
    {"glTF KHR_texture_transform.texCoord", "which set of coordinates, in the other's place"},
    {"glTF KHR_materials_pbrSpecularGlossiness.diffuseFactor", "colour, linear"},
    {"glTF KHR_materials_pbrSpecularGlossiness.diffuseTexture", "picture, sRGB"},
    {"glTF KHR_materials_pbrSpecularGlossiness.specularFactor", kShine, false},
    {"glTF KHR_materials_pbrSpecularGlossiness.glossinessFactor", kShine, false},
    {"glTF KHR_materials_pbrSpecularGlossiness.specularGlossinessTexture", kShine, false},
    {"glTF EXT_mesh_gpu_instancing.attributes", "places of a node's copies"},
    {"glTF attribute TRANSLATION", "place of a copy"},
    {"glTF attribute ROTATION", "turn of a copy"},
    {"glTF attribute SCALE", "size of a copy"},
    {"glTF KHR_node_visibility.visible", "whether a node and its children are shown"},
    {"glTF texture.source", "picture"},
    {"glTF texture.sampler", "how the picture repeats"},
    {"glTF texture.name", kText, false},
    {"glTF image.uri", "file of the picture"},
    {"glTF image.bufferView", "bytes of the picture"},
    {"glTF image.mimeType", "the picture's own first bytes say it", false},
    {"glTF image.name", "name of the picture"},
    {"glTF sampler.wrapS", "how the picture repeats"},
    {"glTF sampler.wrapT", "how the picture repeats"},
    {"glTF sampler.magFilter", kHint, false},
    {"glTF sampler.minFilter", kHint, false},
    {"glTF sampler.name", kText, false},
    {"glTF accessor.bufferView", "bytes of the values"},
    {"glTF accessor.byteOffset", "bytes of the values"},
    {"glTF accessor.componentType", "type of the values"},
    {"glTF accessor.normalized", "whether whole numbers are shares"},
    {"glTF accessor.count", "number of the values"},
    {"glTF accessor.type", "type of the values"},
    {"glTF accessor.sparse", "values in the place of others"},
    {"glTF accessor.min", kBounds, false},
    {"glTF accessor.max", kBounds, false},
    {"glTF accessor.name", kText, false},
    {"glTF sparse.count", "number of the values"},
    {"glTF sparse.indices", "whose place they take"},
    {"glTF sparse.values", "the values"},
    {"glTF bufferView.buffer", "bytes of the values"},
    {"glTF bufferView.byteOffset", "bytes of the values"},
    {"glTF bufferView.byteLength", "bytes of the values"},
    {"glTF bufferView.byteStride", "bytes of the values"},
    {"glTF bufferView.target", kHint, false},
    {"glTF bufferView.name", kText, false},
    {"glTF buffer.uri", "file of the bytes"},
    {"glTF buffer.byteLength", "number of the bytes"},
    {"glTF buffer.name", kText, false},
    {"glTF skin.joints", "nodes that move vertices"},
    {"glTF skin.inverseBindMatrices", "where joints stood when vertices were bound to them"},
    {"glTF skin.skeleton", "joints move vertices wherever their root is", false},
    {"glTF skin.name", kText, false},
    {"glTF extras", kOwn, false},
    {"glTF extension KHR_texture_transform", "how pictures lie"},
    {"glTF extension KHR_mesh_quantization", "values that are whole numbers"},
    {"glTF extension KHR_materials_unlit", "colour is the surface's, and light falls on it", false},
    {"glTF extension KHR_materials_pbrSpecularGlossiness", "colour"},
    {"glTF extension EXT_mesh_gpu_instancing", "copies of a node's mesh"},
    {"glTF extension KHR_node_visibility", "which nodes are shown"},
    {"glTF extension KHR_lights_punctual", "light is the sky's and that of the job", false},
    {"glTF extension EXT_lights_image_based", "light is the sky's and that of the job", false},
    {"glTF extension EXT_lights_ies", "light is the sky's and that of the job", false},
    {"glTF extension KHR_materials_anisotropy", kShine, false},
    {"glTF extension KHR_materials_clearcoat", kShine, false},
    {"glTF extension KHR_materials_ior", kShine, false},
    {"glTF extension KHR_materials_iridescence", kShine, false},
    {"glTF extension KHR_materials_sheen", kShine, false},
    {"glTF extension KHR_materials_specular", kShine, false},
    {"glTF extension KHR_materials_dispersion", kClear, false},
    {"glTF extension KHR_materials_transmission", kClear, false},
    {"glTF extension KHR_materials_diffuse_transmission", kClear, false},
    {"glTF extension KHR_materials_volume", kClear, false},
    {"glTF extension KHR_materials_emissive_strength", kLight, false},
    {"glTF extension KHR_materials_variants", "the first look is the one that its primitives state",
     false},
    {"glTF extension KHR_animation_pointer", kMoves, false},
    {"glTF extension KHR_xmp", kText, false},
    {"glTF extension KHR_xmp_json_ld", kText, false},
    {"glTF extension KHR_draco_mesh_compression", kOther, false},
    {"glTF extension EXT_meshopt_compression", kOther, false},
    {"glTF extension KHR_meshopt_compression", kOther, false},
    {"glTF extension KHR_texture_basisu", kOther, false},
    {"glTF extension EXT_texture_webp", kOther, false},
    {"glTF extension EXT_texture_avif", kOther, false},
    {"glTF extension MSFT_texture_dds", kOther, false},
    {"glTF extension FB_ngon_encoding", "which triangles were one face shows nowhere", false},
    {"glTF extension MSFT_lod", "coarser levels are made from the finest", false},
});

/// Without them there would be other surfaces or no pictures.
constexpr std::array<std::string_view, 7> kNeverRead = {"KHR_draco_mesh_compression",
                                                        "EXT_meshopt_compression",
                                                        "KHR_meshopt_compression",
                                                        "KHR_texture_basisu",
                                                        "EXT_texture_webp",
                                                        "EXT_texture_avif",
                                                        "MSFT_texture_dds"};

/// Members of an object that are objects or lists of them, and what these are.
struct Inner {
  std::string_view kind, member, inner_kind;
};
constexpr auto kInner = std::to_array<Inner>({
    {"root", "asset", "asset"},
    {"root", "scenes", "scene"},
    {"root", "nodes", "node"},
    {"root", "meshes", "mesh"},
    {"root", "materials", "material"},
    {"root", "textures", "texture"},
    {"root", "images", "image"},
    {"root", "samplers", "sampler"},
    {"root", "accessors", "accessor"},
    {"root", "bufferViews", "bufferView"},
    {"root", "buffers", "buffer"},
    {"root", "skins", "skin"},
    {"mesh", "primitives", "primitive"},
    {"material", "pbrMetallicRoughness", "pbr"},
    {"pbr", "baseColorTexture", "textureInfo"},
    {"KHR_materials_pbrSpecularGlossiness", "diffuseTexture", "textureInfo"},
    {"accessor", "sparse", "sparse"},
});

class Counter {
 public:
  explicit Counter(Ledger& ledger) : ledger_(ledger) {}

  void count(const Json& object, std::string_view kind) {
    if (!object.is_object()) return;
    for (const auto& [member, value] : object.members()) {
      if (member == "extensions") {
        count_extensions(value);
      } else if (member == "extras") {
        ledger_.count("glTF extras", kNames);
      } else {
        ledger_.count(fmt::format("glTF {}.{}", kind, member), kNames);
        count_inner(kind, member, value);
      }
    }
  }

 private:
  void count_inner(std::string_view kind, std::string_view member, const Json& value) {
    const auto inner = std::find_if(kInner.begin(), kInner.end(), [&](const Inner& one) {
      return one.kind == kind && one.member == member;
    });
    if (inner == kInner.end()) return;
    if (!value.is_array()) return count(value, inner->inner_kind);
    for (std::size_t i = 0; i < value.size(); ++i) count(value.at(i), inner->inner_kind);
  }

  void count_extensions(const Json& extensions) {
    if (!extensions.is_object()) return;
    for (const auto& [name, value] : extensions.members()) {
      const std::string whole = "glTF extension " + name;
      ledger_.count(whole, kNames);
      const KnownName* known = core::find_known(kNames, whole);
      if (known != nullptr && known->is_used) count(value, name);
    }
  }

  Ledger& ledger_;
};

}  // namespace

std::span<const KnownName> gltf_names() { return kNames; }

bool is_gltf_extension_read(std::string_view extension) {
  return core::find_known(kNames, fmt::format("glTF extension {}", extension)) != nullptr &&
         std::find(kNeverRead.begin(), kNeverRead.end(), extension) == kNeverRead.end();
}

void count_gltf(const Json& root, Ledger& ledger) {
  Counter(ledger).count(root, "root");
  // Those that are stated and stand nowhere, too.
  for (const char* list : {"extensionsUsed", "extensionsRequired"})
    if (root.has(list))
      for (const std::string& name : root.at(list).strings())
        ledger.count("glTF extension " + name, kNames);
}

}  // namespace terracast::tiler
