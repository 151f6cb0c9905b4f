#include "tiler/objects/model_gltf.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_map>

#include "core/error.h"
#include "core/stop.h"
#include "tiler/objects/model_file.h"
#include "tiler/objects/model_gltf_data.h"
#include "tiler/objects/model_gltf_materials.h"
#include "tiler/objects/model_gltf_names.h"
#include "tiler/objects/model_gltf_vertices.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;
using Eigen::Matrix4d;
using Eigen::Vector3d;

/// Modes of primitives.
enum Mode : std::int64_t { kPoints, kLines, kLineLoop, kLineStrip, kTriangles, kStrip, kFan };

class GltfReader {
 public:
  GltfReader(const GltfFile& file, ModelFolder& folder)
      : root_(file.root), name_(folder.name()), buffers_(file, folder) {
    count_gltf(root_, scene_.ledger);
    pictures_ = add_gltf_materials(buffers_, folder, scene_);
  }

  ModelScene read() {
    find_transformations();
    const Json& scenes = gltf_list(root_, "scenes");
    if (scenes.size() > 1)
      scene_.counts["scenes beside the one that is shown"] =
          static_cast<std::int64_t>(scenes.size()) - 1;
    if (scenes.size() > 0) {
      const std::size_t own =
          root_.has("scene") ? static_cast<std::size_t>(root_.at("scene").integer()) : 0;
      const Json& nodes = gltf_list(scenes.at(own), "nodes");
      for (std::size_t k = 0; k < nodes.size(); ++k)
        visit(static_cast<std::size_t>(nodes.at(k).integer()));
    } else {
      for (std::size_t i = 0; i < parents_.size(); ++i)
        if (parents_[i] < 0) visit(i);
    }
    return std::move(scene_);
  }

 private:
  /// Of all nodes, shown or not: joints may lie anywhere.
  void find_transformations() {
    const Json& nodes = gltf_list(root_, "nodes");
    parents_.assign(nodes.size(), -1);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Json& children = gltf_list(nodes.at(i), "children");
      for (std::size_t k = 0; k < children.size(); ++k)
        parents_[static_cast<std::size_t>(children.at(k).integer())] = static_cast<int>(i);
    }
    std::vector<Matrix4d> own;
    for (std::size_t i = 0; i < nodes.size(); ++i) own.push_back(own_of(nodes.at(i), i));
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      Matrix4d whole = own[i];
      for (int at = parents_[i]; at >= 0; at = parents_[static_cast<std::size_t>(at)])
        whole = own[static_cast<std::size_t>(at)] * whole;
      if (!whole.allFinite())
        fail(ErrorKind::Input, "{}: node {} has a transformation that is no number", name_, i);
      scene_from_node_.push_back(whole);
    }
  }

  std::vector<double> numbers(const Json& node, const char* member, std::size_t size,
                              std::size_t number) const {
    std::vector<double> values = node.at(member).numbers();
    if (values.size() != size)
      fail(ErrorKind::Input, "{}: node {}: {} has {} numbers, and {} are right", name_, number,
           member, values.size(), size);
    return values;
  }

  Matrix4d own_of(const Json& node, std::size_t number) {
    if (node.has("matrix"))
      return Eigen::Map<const Matrix4d>(numbers(node, "matrix", 16, number).data());
    Eigen::Affine3d affine = Eigen::Affine3d::Identity();
    if (node.has("translation")) {
      const std::vector<double> t = numbers(node, "translation", 3, number);
      affine.translate(Vector3d(t[0], t[1], t[2]));
    }
    if (node.has("rotation")) {
      const std::vector<double> q = numbers(node, "rotation", 4, number);
      affine.rotate(turn_of({q[3], q[0], q[1], q[2]}));
    }
    if (node.has("scale")) {
      const std::vector<double> s = numbers(node, "scale", 3, number);
      affine.scale(Vector3d(s[0], s[1], s[2]));
    }
    return affine.matrix();
  }
  Eigen::Quaterniond turn_of(const Eigen::Quaterniond& turn) {
    if (turn.norm() > 0.0) return turn.normalized();
    scene_.ledger.misunderstand("glTF node.rotation", "0 0 0 0");
    return Eigen::Quaterniond::Identity();
  }

  void visit(std::size_t number) {
    core::throw_if_stop_asked();
    const Json& node = gltf_list(root_, "nodes").at(number);
    const Json* visibility = extension(node, "KHR_node_visibility");
    if (visibility != nullptr && visibility->has("visible") &&
        !visibility->at("visible").boolean()) {
      ++scene_.counts["nodes that are not visible"];
      return;
    }
    if (node.has("mesh")) add_mesh(node, number);
    const Json& children = gltf_list(node, "children");
    for (std::size_t k = 0; k < children.size(); ++k)
      visit(static_cast<std::size_t>(children.at(k).integer()));
  }
  static const Json* extension(const Json& object, const char* name) {
    return object.has("extensions") && object.at("extensions").has(name)
               ? &object.at("extensions").at(name)
               : nullptr;
  }

  void add_mesh(const Json& node, std::size_t number) {
    const auto row = static_cast<std::size_t>(node.at("mesh").integer());
    const Json& mesh = gltf_list(root_, "meshes").at(row);
    GltfVertexInputs inputs;
    if (node.has("weights"))
      inputs.weights = node.at("weights").numbers();
    else if (mesh.has("weights"))
      inputs.weights = mesh.at("weights").numbers();
    if (node.has("skin"))
      inputs.joints = joints_of(static_cast<std::size_t>(node.at("skin").integer()));
    const std::string name = mesh.has("name") ? mesh.at("name").string() : fmt::format("{}", row);
    const Json& primitives = gltf_list(mesh, "primitives");
    const std::vector<Matrix4d> copies = copies_of(node, number);
    num_placed_ += copies.size() * primitives.size();
    if (num_placed_ > kMostModelTriangles)
      fail(ErrorKind::Input, "{}: its nodes place more than {} primitives", name_,
           kMostModelTriangles);
    for (const Matrix4d& matrix : copies) {
      core::throw_if_stop_asked();
      for (std::size_t k = 0; k < primitives.size(); ++k) {
        inputs.where = fmt::format("{}: mesh \"{}\", primitive {}", name_, name, k);
        // Joints alone move a mesh that has a skin.
        add_primitive(primitives.at(k), inputs,
                      inputs.joints.empty() ? matrix : Matrix4d::Identity().eval());
      }
    }
  }

  /// Scene from bound vertices.
  std::vector<Matrix4d> joints_of(std::size_t number) {
    const Json& skin = gltf_list(root_, "skins").at(number);
    const Json& nodes = gltf_list(skin, "joints");
    if (nodes.size() == 0) fail(ErrorKind::Input, "{}: skin {} has no joints", name_, number);
    std::optional<GltfAccessor> inverse;
    if (skin.has("inverseBindMatrices"))
      inverse.emplace(buffers_, skin.at("inverseBindMatrices").integer(), name_);
    std::vector<Matrix4d> joints;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      Matrix4d joint_from_bound = Matrix4d::Identity();
      if (inverse)
        for (int i = 0; i < 16; ++i) joint_from_bound(i % 4, i / 4) = inverse->value(k, i);
      joints.push_back(scene_from_node_[static_cast<std::size_t>(nodes.at(k).integer())] *
                       joint_from_bound);
    }
    return joints;
  }

  /// Where a node's mesh stands: once, or as often as EXT_mesh_gpu_instancing has it.
  std::vector<Matrix4d> copies_of(const Json& node, std::size_t number) {
    const Json* instancing = extension(node, "EXT_mesh_gpu_instancing");
    if (instancing == nullptr || !instancing->has("attributes")) return {scene_from_node_[number]};
    const Json& attributes = instancing->at("attributes");
    std::map<std::string, GltfAccessor> values;
    std::size_t size = 0;
    for (const auto& [name, row] : attributes.members()) {
      scene_.ledger.count("glTF attribute " + name, gltf_names());
      const auto where = fmt::format("{}: node {}: {}", name_, number, name);
      const int components = name == "ROTATION" ? 4 : 3;
      if (name != "TRANSLATION" && name != "ROTATION" && name != "SCALE") continue;  // told above
      const auto& added = values.emplace(name, GltfAccessor(buffers_, row.integer(), where));
      const GltfAccessor& own = added.first->second;
      if (own.num_components() != components || (values.size() > 1 && own.size() != size))
        fail(ErrorKind::Input, "{}: {} values of {} components do not fit the others", where,
             own.size(), own.num_components());
      size = own.size();
    }
    if (size > kMostModelTriangles)
      fail(ErrorKind::Input,
           "{}: node {} has more than {} copies; list them as things of their own", name_, number,
           kMostModelTriangles);
    if (values.empty()) return {scene_from_node_[number]};
    std::vector<Matrix4d> copies;
    for (std::size_t i = 0; i < size; ++i) copies.push_back(copy_of(values, i, number));
    return copies;
  }
  Matrix4d copy_of(const std::map<std::string, GltfAccessor>& values, std::size_t i,
                   std::size_t number) {
    const auto vector = [&](const char* name, double otherwise) -> Vector3d {
      const auto found = values.find(name);
      if (found == values.end()) return Vector3d::Constant(otherwise);
      const GltfAccessor& own = found->second;
      return {own.value(i, 0), own.value(i, 1), own.value(i, 2)};
    };
    Eigen::Affine3d affine = Eigen::Affine3d::Identity();
    affine.translate(vector("TRANSLATION", 0.0));
    if (const auto found = values.find("ROTATION"); found != values.end()) {
      const GltfAccessor& q = found->second;
      affine.rotate(turn_of({q.value(i, 3), q.value(i, 0), q.value(i, 1), q.value(i, 2)}));
    }
    affine.scale(vector("SCALE", 1.0));
    return scene_from_node_[number] * affine.matrix();
  }

  void add_primitive(const Json& primitive, GltfVertexInputs inputs, const Matrix4d& matrix) {
    check_is_plain(primitive, inputs.where);
    const std::size_t material = primitive.has("material")
                                     ? static_cast<std::size_t>(primitive.at("material").integer())
                                     : scene_.materials.size() - 1;
    const GltfPicture& picture = pictures_[material];
    inputs.texture_attribute = picture.attribute;
    const std::string where = inputs.where;
    // Mirrored nodes turn triangles inside out; of those with joints these do.
    const Matrix4d& turning = inputs.joints.empty() ? matrix : inputs.joints.front();
    const bool is_mirrored = turning.topLeftCorner<3, 3>().determinant() < 0.0;
    GltfVertices vertices(buffers_, primitive, std::move(inputs), scene_.ledger);
    if (!picture.attribute.empty() && !vertices.has_texture())
      scene_.ledger.misunderstand("glTF textureInfo.texCoord",
                                  picture.attribute + ", which its primitives have not");
    const auto triangles = triangles_of(primitive, vertices.size(), where);
    if (triangles.empty()) return;
    ModelPart part{.name = where, .material = material};
    std::unordered_map<std::uint32_t, std::uint32_t> known;
    for (const auto& triangle : triangles) {
      std::array<std::uint32_t, 3>& own = part.triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [entry, is_new] =
            known.try_emplace(triangle[k], static_cast<std::uint32_t>(part.places.size()));
        own[k] = entry->second;
        if (is_new) add_vertex(vertices, triangle[k], picture, matrix, part);
      }
      if (is_mirrored) std::swap(own[1], own[2]);
    }
    if (vertices.num_unbound() > 0)
      scene_.counts["vertices without shares of joints"] += vertices.num_unbound();
    scene_.parts.push_back(std::move(part));
  }

  void add_vertex(GltfVertices& vertices, std::uint32_t vertex, const GltfPicture& picture,
                  const Matrix4d& matrix, ModelPart& part) {
    part.places.push_back((matrix * vertices.place(vertex).homogeneous()).head<3>());
    if (vertices.has_texture())
      part.uv.push_back(
          (picture.uv * vertices.texture(vertex).homogeneous()).head<2>().cast<float>());
    if (!vertices.has_color()) return;
    Eigen::Array3d color = vertices.color(vertex);
    if (!(color >= 0.0 && color <= 1.0).all()) {
      scene_.ledger.misunderstand("glTF attribute COLOR_0", "a colour outside 0 to 1");
      color = color.isNaN().select(0.0, color).max(0.0).min(1.0).eval();
    }
    part.colors.push_back(color.cast<float>());
  }

  void check_is_plain(const Json& primitive, const std::string& where) const {
    constexpr const char* kDraco = "KHR_draco_mesh_compression";
    if (extension(primitive, kDraco) == nullptr || !primitive.at("attributes").has("POSITION"))
      return;
    const Json& position =
        gltf_list(root_, "accessors")
            .at(static_cast<std::size_t>(primitive.at("attributes").at("POSITION").integer()));
    if (!position.has("bufferView"))
      fail(ErrorKind::Input,
           "{}: it is compressed by {}, which is not read; export the model without it", where,
           kDraco);
  }

  /// As numbers of vertices, anticlockwise. Of points and lines none; they are counted.
  std::vector<std::array<std::uint32_t, 3>> triangles_of(const Json& primitive,
                                                         std::size_t num_vertices,
                                                         const std::string& where) {
    const std::int64_t mode = primitive.has("mode") ? primitive.at("mode").integer() : kTriangles;
    std::optional<GltfAccessor> indices;
    if (primitive.has("indices")) {
      indices.emplace(buffers_, primitive.at("indices").integer(), where + ": indices");
      if (!indices->is_whole() || indices->num_components() != 1)
        fail(ErrorKind::Input, "{}: its indices are no whole numbers", where);
    }
    const std::size_t size = indices ? indices->size() : num_vertices;
    if (mode < kPoints || mode > kFan)
      fail(ErrorKind::Input, "{}: mode {} is none of glTF 2's, 0 to 6", where, mode);
    if (mode < kTriangles) {
      count_lines(mode, size);
      return {};
    }
    const std::size_t num_triangles = mode == kTriangles ? size / 3 : size < 3 ? 0 : size - 2;
    if (mode == kTriangles && size % 3 != 0)
      scene_.counts["corners behind the last triangle"] += static_cast<std::int64_t>(size % 3);
    num_triangles_ += num_triangles;
    if (num_triangles_ > kMostModelTriangles)
      fail(ErrorKind::Input, "{}: more than {} triangles; simplify it first", name_,
           kMostModelTriangles);
    std::vector<std::array<std::uint32_t, 3>> triangles(num_triangles);
    for (std::size_t i = 0; i < num_triangles; ++i) {
      std::array<std::size_t, 3> at = {3 * i, 3 * i + 1, 3 * i + 2};
      if (mode == kStrip) at = {i, i + 1 + i % 2, i + 2 - i % 2};
      if (mode == kFan) at = {i + 1, i + 2, 0};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t vertex =
            indices ? indices->whole(at[k]) : static_cast<std::uint32_t>(at[k]);
        if (vertex >= num_vertices)
          fail(ErrorKind::Input, "{}: face {} names vertex {} of {}", where, i, vertex,
               num_vertices);
        triangles[i][k] = vertex;
      }
    }
    return triangles;
  }

  void count_lines(std::int64_t mode, std::size_t size) {
    const auto number = static_cast<std::int64_t>(size);
    if (mode == kPoints)
      scene_.counts["points, which have no surface"] += number;
    else
      scene_.counts["lines, which have no surface"] += mode == kLines ? number / 2
                                                       : mode == kLineLoop
                                                           ? number
                                                           : std::max<std::int64_t>(number - 1, 0);
  }

  const Json& root_;
  std::string name_;
  GltfBuffers buffers_;
  ModelScene scene_;
  std::vector<GltfPicture> pictures_;  ///< of the scene's materials
  std::vector<int> parents_;
  std::uint64_t num_placed_ = 0;  ///< primitives, by all nodes
  std::vector<Matrix4d> scene_from_node_;
  std::uint64_t num_triangles_ = 0;
};

}  // namespace

ModelScene read_gltf(std::span<const std::byte> bytes, ModelFolder& folder) {
  const GltfFile file = open_gltf(bytes, folder.name());
  check_gltf(file, folder);
  return GltfReader(file, folder).read();
}

}  // namespace terracast::tiler
