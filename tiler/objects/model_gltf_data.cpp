#include "tiler/objects/model_gltf_data.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "core/error.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

std::size_t whole_of(const Json& object, const char* member) {
  return object.has(member) ? static_cast<std::size_t>(object.at(member).integer()) : 0;
}

std::size_t bytes_of_component(std::int64_t type) {
  return type == 5120 || type == 5121 ? 1 : type == 5122 || type == 5123 ? 2 : 4;
}
int components_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  if (type.starts_with("VEC")) return type.back() - '0';
  const int side = type.back() - '0';
  return side * side;
}

std::uint32_t bits_of(const std::byte* at, std::size_t num_bytes) {
  std::uint32_t bits = 0;
  for (std::size_t k = 0; k < num_bytes; ++k) bits |= static_cast<std::uint32_t>(at[k]) << (8 * k);
  return bits;
}

constexpr std::array<std::int8_t, 256> kSixBits = [] {
  std::array<std::int8_t, 256> values{};
  for (auto& value : values) value = -1;
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < kLetters.size(); ++i)
    values[static_cast<unsigned char>(kLetters[i])] = static_cast<std::int8_t>(i);
  return values;
}();

}  // namespace

std::vector<std::byte> bytes_of_data_uri(const std::string& uri, const std::string& where) {
  const std::size_t comma = uri.find(',');
  if (comma == std::string::npos || !uri.substr(0, comma).ends_with(";base64"))
    fail(ErrorKind::Input, "{}: a data URI without ;base64, which is not read", where);
  std::string_view text = std::string_view(uri).substr(comma + 1);
  while (text.ends_with('=')) text.remove_suffix(1);
  std::vector<std::byte> bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int num_bits = 0;
  for (const char c : text) {
    const std::int8_t value = kSixBits[static_cast<unsigned char>(c)];
    if (value < 0)
      fail(ErrorKind::Input, "{}: its data URI is no base64: '{}' stands in it", where,
           c >= ' ' && c <= '~' ? std::string(1, c) : std::string("?"));
    bits = bits << 6U | static_cast<std::uint32_t>(value);
    num_bits += 6;
    if (num_bits < 8) continue;
    num_bits -= 8;
    bytes.push_back(static_cast<std::byte>(bits >> num_bits & 255U));
  }
  return bytes;
}

GltfBuffers::GltfBuffers(const GltfFile& file, ModelFolder& folder)
    : file_(file), name_(folder.name()) {
  const Json& buffers = gltf_list(file.root, "buffers");
  owned_.reserve(buffers.size());
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const Json& buffer = buffers.at(i);
    const std::string where = fmt::format("{}: buffer {}", name_, i);
    const std::size_t size = whole_of(buffer, "byteLength");
    std::span<const std::byte> bytes = file.binary;
    if (buffer.has("uri")) {
      const std::string& uri = buffer.at("uri").string();
      owned_.push_back(uri.starts_with("data:") ? bytes_of_data_uri(uri, where)
                                                : folder.read(folder.path_of_uri(uri, where), uri));
      bytes = owned_.back();
    }
    if (bytes.size() < size)
      fail(ErrorKind::Input, "{}: {} bytes are stated, and {} are there", where, size,
           bytes.size());
    buffers_.push_back(bytes.first(size));
  }
}

std::span<const std::byte> GltfBuffers::view(std::size_t row) const {
  const Json& view = file_.root.at("bufferViews").at(row);
  return buffers_.at(whole_of(view, "buffer"))
      .subspan(whole_of(view, "byteOffset"), whole_of(view, "byteLength"));
}

GltfAccessor::GltfAccessor(const GltfBuffers& buffers, std::int64_t row, const std::string& where) {
  const Json& accessors = gltf_list(buffers.root(), "accessors");
  if (row < 0 || static_cast<std::size_t>(row) >= accessors.size())
    fail(ErrorKind::Input, "{}: accessor {}, and there are {}", where, row, accessors.size());
  const Json& accessor = accessors.at(static_cast<std::size_t>(row));
  size_ = whole_of(accessor, "count");
  type_ = accessor.at("componentType").integer();
  component_bytes_ = bytes_of_component(type_);
  num_components_ = components_of(accessor.at("type").string());
  is_share_ = accessor.has("normalized") && accessor.at("normalized").boolean();
  stride_ = component_bytes_ * static_cast<std::size_t>(num_components_);
  if (accessor.has("bufferView")) {
    const std::size_t view = whole_of(accessor, "bufferView");
    bytes_ = buffers.view(view).subspan(size_ == 0 ? 0 : whole_of(accessor, "byteOffset"));
    if (const std::size_t own = whole_of(buffers.root().at("bufferViews").at(view), "byteStride");
        own != 0)
      stride_ = own;
  }
  if (!accessor.has("sparse")) return;
  const Json& sparse = accessor.at("sparse");
  const Json& indices = sparse.at("indices");
  const std::size_t num = whole_of(sparse, "count");
  const std::size_t index_bytes = bytes_of_component(indices.at("componentType").integer());
  const std::byte* at =
      buffers.view(whole_of(indices, "bufferView")).data() + whole_of(indices, "byteOffset");
  for (std::size_t i = 0; i < num; ++i) {
    const std::uint32_t index = bits_of(at + i * index_bytes, index_bytes);
    if (index >= size_ || (i > 0 && index <= sparse_.back()))
      fail(ErrorKind::Input,
           "{}: sparse index {} is {}: it must be above the one before and below {}", where, i,
           index, size_);
    sparse_.push_back(index);
  }
  const Json& values = sparse.at("values");
  sparse_bytes_ = buffers.view(whole_of(values, "bufferView"));
  if (num > 0) sparse_bytes_ = sparse_bytes_.subspan(whole_of(values, "byteOffset"));
}

const std::byte* GltfAccessor::element(std::size_t row) const {
  const auto sparse = std::lower_bound(sparse_.begin(), sparse_.end(), row);
  if (sparse != sparse_.end() && *sparse == row)
    return sparse_bytes_.data() + static_cast<std::size_t>(sparse - sparse_.begin()) *
                                      component_bytes_ * static_cast<std::size_t>(num_components_);
  return bytes_.empty() ? nullptr : bytes_.data() + row * stride_;
}

double GltfAccessor::raw(const std::byte* at) const {
  const std::uint32_t bits = bits_of(at, component_bytes_);
  switch (type_) {
    case 5120:
      return static_cast<std::int8_t>(bits);
    case 5122:
      return static_cast<std::int16_t>(bits);
    case 5126: {
      float value = 0.0F;
      std::memcpy(&value, &bits, sizeof value);
      return static_cast<double>(value);
    }
    default:
      return bits;
  }
}

double GltfAccessor::value(std::size_t row, int component) const {
  const std::byte* at = element(row);
  if (at == nullptr) return 0.0;
  const double value = raw(at + static_cast<std::size_t>(component) * component_bytes_);
  if (!is_share_) return value;
  switch (type_) {
    case 5120:
      return std::max(value / 127.0, -1.0);
    case 5121:
      return value / 255.0;
    case 5122:
      return std::max(value / 32767.0, -1.0);
    case 5123:
      return value / 65535.0;
    default:
      return value;
  }
}

std::uint32_t GltfAccessor::whole(std::size_t row, int component) const {
  const std::byte* at = element(row);
  return at == nullptr ? 0
                       : bits_of(at + static_cast<std::size_t>(component) * component_bytes_,
                                 component_bytes_);
}

}  // namespace terracast::tiler
