#include "tiler/objects/gltf_check.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <set>
#include <vector>

#include "core/error.h"
#include "tiler/objects/model_gltf_names.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

constexpr std::int64_t kMostBytes = std::int64_t{1} << 30;
constexpr std::int64_t kMostCount = 50'000'000;
constexpr int kDeepest = 200;

std::uint32_t word(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value |= static_cast<std::uint32_t>(bytes[at + k]) << (8 * k);
  return value;
}

std::int64_t whole(const Json& object, const char* member, std::int64_t otherwise,
                   std::int64_t most, const std::string& where) {
  if (!object.has(member)) return otherwise;
  const std::int64_t value = object.at(member).integer();
  if (value < 0 || value > most)
    fail(ErrorKind::Input, "{}: {} = {} is outside 0 to {}", where, member, value, most);
  return value;
}

const Json& list(const Json& root, const char* member) { return gltf_list(root, member); }

std::size_t index_of(const Json& object, const char* member, std::size_t size,
                     const std::string& where) {
  const std::int64_t value = object.at(member).integer();
  if (value < 0 || static_cast<std::size_t>(value) >= size)
    fail(ErrorKind::Input, "{}: {} = {}, and there are {}", where, member, value, size);
  return static_cast<std::size_t>(value);
}

std::int64_t component_bytes(std::int64_t type, const std::string& where) {
  switch (type) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5125:
    case 5126:
      return 4;
    default:
      fail(ErrorKind::Input, "{}: componentType {} is none of glTF 2's", where, type);
  }
}

std::int64_t num_components(const std::string& type, const std::string& where) {
  static const std::pair<const char*, std::int64_t> kTypes[] = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
  for (const auto& [name, count] : kTypes)
    if (type == name) return count;
  fail(ErrorKind::Input, "{}: type {} is none of glTF 2's", where, type);
}

/// The most bytes that the base64 of a data URI can stand for, which may lack what fills it up; 0: it has none.
std::int64_t data_bytes(const std::string& uri) {
  const std::size_t comma = uri.find(',');
  if (comma == std::string::npos) return 0;
  return static_cast<std::int64_t>((uri.size() - comma + 2) / 4 * 3);
}

void check_buffers(const Json& root, std::int64_t binary_bytes, const ModelFolder& folder,
                   std::vector<std::int64_t>& sizes) {
  const std::string& name = folder.name();
  const Json& buffers = list(root, "buffers");
  std::int64_t total = 0;
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const std::string where = fmt::format("{}: buffer {}", name, i);
    const Json& buffer = buffers.at(i);
    const std::int64_t size = whole(buffer, "byteLength", 0, kMostBytes, where);
    total += size;
    if (total > kMostBytes)
      fail(ErrorKind::Input, "{}: its buffers hold more than {} bytes", name, kMostBytes);
    std::int64_t there = i == 0 ? binary_bytes : 0;
    std::string source = "the file's binary part";
    for (const char* extension : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
      if (!buffer.has("uri") && buffer.has("extensions") && buffer.at("extensions").has(extension))
        fail(ErrorKind::Input,
             "{}: it is compressed by {}, which is not read; export the model without it", where,
             extension);
    if (buffer.has("uri")) {
      const std::string& uri = buffer.at("uri").string();
      if (uri.rfind("data:", 0) == 0) {
        there = data_bytes(uri);
        source = "its data URI";
      } else {
        const std::filesystem::path file = folder.path_of_uri(uri, where);
        std::error_code error;
        const std::uintmax_t bytes = std::filesystem::file_size(file, error);
        if (error) fail(ErrorKind::Input, "{}: {} is missing", where, uri);
        there = static_cast<std::int64_t>(
            std::min<std::uintmax_t>(bytes, static_cast<std::uintmax_t>(kMostBytes)));
        source = uri;
      }
    }
    if (there < size)
      fail(ErrorKind::Input, "{}: {} bytes are stated, and {} holds {}", where, size, source,
           there);
    sizes.push_back(size);
  }
}

/// So many elements of so many bytes, one behind the other, lie in a view.
void check_row(const Json& row, std::int64_t count, std::int64_t element,
               const std::vector<std::int64_t>& views, const std::string& where) {
  const std::size_t view = index_of(row, "bufferView", views.size(), where);
  const std::int64_t offset = whole(row, "byteOffset", 0, kMostBytes, where);
  if (offset + element * count > views[view])
    fail(ErrorKind::Input, "{}: {} elements end at byte {} of a bufferView of {}", where, count,
         offset + element * count, views[view]);
}

void check_sparse(const Json& accessor, std::int64_t count, std::int64_t element,
                  const std::vector<std::int64_t>& views, const std::string& where) {
  const Json& sparse = accessor.at("sparse");
  const std::string own = where + ".sparse";
  const std::int64_t num = whole(sparse, "count", 0, count, own);
  const Json& indices = sparse.at("indices");
  check_row(indices, num, component_bytes(indices.at("componentType").integer(), own), views,
            own + ".indices");
  check_row(sparse.at("values"), num, element, views, own + ".values");
}

void check_views(const Json& root, const std::vector<std::int64_t>& buffers,
                 const std::string& name) {
  const Json& views = list(root, "bufferViews");
  std::vector<std::int64_t> sizes;
  std::vector<std::int64_t> strides;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string where = fmt::format("{}: bufferView {}", name, i);
    const std::size_t buffer = index_of(views.at(i), "buffer", buffers.size(), where);
    const std::int64_t offset = whole(views.at(i), "byteOffset", 0, kMostBytes, where);
    const std::int64_t size = whole(views.at(i), "byteLength", 0, kMostBytes, where);
    if (offset + size > buffers[buffer])
      fail(ErrorKind::Input, "{}: it ends at byte {}, and its buffer at {}", where, offset + size,
           buffers[buffer]);
    sizes.push_back(size);
    strides.push_back(whole(views.at(i), "byteStride", 0, 252, where));
  }
  const Json& accessors = list(root, "accessors");
  for (std::size_t i = 0; i < accessors.size(); ++i) {
    const Json& accessor = accessors.at(i);
    const std::string where = fmt::format("{}: accessor {}", name, i);
    const std::int64_t count = whole(accessor, "count", 0, kMostCount, where);
    const std::int64_t element = component_bytes(accessor.at("componentType").integer(), where) *
                                 num_components(accessor.at("type").string(), where);
    if (accessor.has("sparse")) check_sparse(accessor, count, element, sizes, where);
    if (!accessor.has("bufferView")) continue;  // all zero
    const std::size_t view = index_of(accessor, "bufferView", sizes.size(), where);
    const std::int64_t offset = whole(accessor, "byteOffset", 0, kMostBytes, where);
    const std::int64_t stride = strides[view] != 0 ? strides[view] : element;
    if (count > 0 && offset + stride * (count - 1) + element > sizes[view])
      fail(ErrorKind::Input, "{}: {} elements end at byte {} of a bufferView of {}", where, count,
           offset + stride * (count - 1) + element, sizes[view]);
  }
  const Json& meshes = list(root, "meshes");
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const Json& primitives = list(meshes.at(i), "primitives");
    for (std::size_t k = 0; k < primitives.size(); ++k) {
      const std::string where = fmt::format("{}: mesh {}, primitive {}", name, i, k);
      if (primitives.at(k).has("indices"))
        index_of(primitives.at(k), "indices", accessors.size(), where);
      if (!primitives.at(k).has("attributes"))
        fail(ErrorKind::Input, "{}: it has no attributes", where);
      std::int64_t count = -1;
      for (const auto& [attribute, number] : primitives.at(k).at("attributes").members()) {
        const std::int64_t row = number.integer();
        if (row < 0 || static_cast<std::size_t>(row) >= accessors.size())
          fail(ErrorKind::Input, "{}: {} = {}, and there are {} accessors", where, attribute, row,
               accessors.size());
        const std::int64_t own = accessors.at(static_cast<std::size_t>(row)).at("count").integer();
        if (count >= 0 && own != count)
          fail(ErrorKind::Input, "{}: attributes of {} and {} vertices", where, count, own);
        count = own;
      }
      if (primitives.at(k).has("material"))
        index_of(primitives.at(k), "material", list(root, "materials").size(), where);
    }
  }
}

void check_nodes(const Json& root, const std::string& name) {
  const Json& nodes = list(root, "nodes");
  std::vector<int> parents(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::string where = fmt::format("{}: node {}", name, i);
    if (nodes.at(i).has("mesh")) index_of(nodes.at(i), "mesh", list(root, "meshes").size(), where);
    const Json& children = list(nodes.at(i), "children");
    for (std::size_t k = 0; k < children.size(); ++k) {
      const std::int64_t child = children.at(k).integer();
      if (child < 0 || static_cast<std::size_t>(child) >= nodes.size())
        fail(ErrorKind::Input, "{}: child {}, and there are {} nodes", where, child, nodes.size());
      int& parent = parents[static_cast<std::size_t>(child)];
      if (parent >= 0) fail(ErrorKind::Input, "{}: node {} has two parents", name, child);
      parent = static_cast<int>(i);
    }
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    int depth = 0;
    for (int at = static_cast<int>(i); at >= 0; at = parents[static_cast<std::size_t>(at)])
      if (++depth > kDeepest)
        fail(ErrorKind::Input, "{}: node {} lies in a circle of nodes, or deeper than {}", name, i,
             kDeepest);
  }
  const Json& scenes = list(root, "scenes");
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const Json& own = list(scenes.at(i), "nodes");
    std::set<std::int64_t> known;
    for (std::size_t k = 0; k < own.size(); ++k) {
      const std::int64_t node = own.at(k).integer();
      if (node < 0 || static_cast<std::size_t>(node) >= nodes.size())
        fail(ErrorKind::Input, "{}: scene {} names node {}, and there are {}", name, i, node,
             nodes.size());
      if (parents[static_cast<std::size_t>(node)] >= 0 || !known.insert(node).second)
        fail(ErrorKind::Input,
             "{}: scene {} names node {}, which is another's child or named twice", name, i, node);
    }
  }
  if (root.has("scene")) index_of(root, "scene", scenes.size(), name);
}

bool is_binary_part(std::span<const std::byte> bytes, std::size_t at) {
  return at + 8 <= bytes.size() && word(bytes, at + 4) == 0x004e4942;
}

void check_skins(const Json& root, const std::string& name) {
  const Json& skins = list(root, "skins");
  const Json& nodes = list(root, "nodes");
  for (std::size_t i = 0; i < skins.size(); ++i) {
    const std::string where = fmt::format("{}: skin {}", name, i);
    const Json& joints = list(skins.at(i), "joints");
    for (std::size_t k = 0; k < joints.size(); ++k)
      if (const std::int64_t joint = joints.at(k).integer();
          joint < 0 || static_cast<std::size_t>(joint) >= nodes.size())
        fail(ErrorKind::Input, "{}: joint {}, and there are {} nodes", where, joint, nodes.size());
    if (!skins.at(i).has("inverseBindMatrices")) continue;
    const Json& accessors = list(root, "accessors");
    const Json& matrices =
        accessors.at(index_of(skins.at(i), "inverseBindMatrices", accessors.size(), where));
    if (matrices.at("type").string() != "MAT4" || matrices.at("componentType").integer() != 5126 ||
        static_cast<std::size_t>(matrices.at("count").integer()) < joints.size())
      fail(ErrorKind::Input, "{}: its inverseBindMatrices are not a MAT4 of floats for each joint",
           where);
  }
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (nodes.at(i).has("skin"))
      index_of(nodes.at(i), "skin", skins.size(), fmt::format("{}: node {}", name, i));
}

}  // namespace

const Json& gltf_list(const Json& object, const char* member) {
  static const Json empty = Json::array();
  if (!object.has(member)) return empty;
  const Json& list = object.at(member);
  if (!list.is_array()) static_cast<void>(list.at(std::size_t{0}));  // says what it is, and where
  return list;
}

GltfFile open_gltf(std::span<const std::byte> bytes, const std::string& name) {
  GltfFile file;
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (bytes.size() >= 4 && text.substr(0, 4) == "glTF") {
    if (bytes.size() < 20) fail(ErrorKind::Input, "{}: it ends within its header", name);
    if (word(bytes, 4) != 2)
      fail(ErrorKind::Input,
           "{}: glTF {}.0, and only glTF 2 is read; convert it (gltf-pipeline does)", name,
           word(bytes, 4));
    const std::size_t length = word(bytes, 8);
    const std::size_t json_bytes = word(bytes, 12);
    if (length > bytes.size() || json_bytes > bytes.size() - 20)
      fail(ErrorKind::Input, "{}: {} bytes are stated, and it has {}", name,
           std::max<std::size_t>(length, json_bytes + 20), bytes.size());
    if (word(bytes, 16) != 0x4e4f534a)
      fail(ErrorKind::Input, "{}: its first part is not JSON", name);
    text = text.substr(20, json_bytes);
    // Right behind; or, where its writer counted without the blanks that fill it up, behind these.
    std::size_t next = 20 + json_bytes;
    if (!is_binary_part(bytes, next)) next = 20 + (json_bytes + 3) / 4 * 4;
    if (is_binary_part(bytes, next)) {
      const std::size_t size = word(bytes, next);
      if (size > bytes.size() - next - 8)
        fail(ErrorKind::Input, "{}: its binary part states {} bytes, and {} are there", name, size,
             bytes.size() - next - 8);
      file.binary = bytes.subspan(next + 8, size);
    }
  }
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  file.root = Json::parse(text, name);
  return file;
}

void check_gltf(const GltfFile& file, const ModelFolder& folder) {
  const Json& root = file.root;
  const std::string& name = folder.name();
  if (!root.is_object() || !root.has("asset") || !root.at("asset").has("version"))
    fail(ErrorKind::Input, "{}: no glTF 2: it states no version", name);
  const std::string& version = root.at("asset").at("version").string();
  if (version.rfind("2.", 0) != 0)
    fail(ErrorKind::Input, "{}: glTF {}, and only glTF 2 is read; convert it (gltf-pipeline does)",
         name, version);
  if (root.has("extensionsRequired"))
    for (const std::string& extension : root.at("extensionsRequired").strings())
      if (!is_gltf_extension_read(extension))
        fail(ErrorKind::Input, "{}: it requires {}, which is not read; export the model without it",
             name, extension);
  std::vector<std::int64_t> buffers;
  check_buffers(root, static_cast<std::int64_t>(file.binary.size()), folder, buffers);
  const Json& images = list(root, "images");
  for (std::size_t i = 0; i < images.size(); ++i)
    if (images.at(i).has("uri") && images.at(i).at("uri").string().rfind("data:", 0) != 0)
      folder.path_of_uri(images.at(i).at("uri").string(), fmt::format("{}: image {}", name, i));
  check_views(root, buffers, name);
  check_nodes(root, name);
  check_skins(root, name);
}

}  // namespace terracast::tiler
