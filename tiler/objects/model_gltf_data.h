#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tiler/objects/gltf_check.h"

namespace terracast::tiler {

/// The bytes of all buffers of a glTF file that check_gltf() has looked through. The file must outlive it.
class GltfBuffers {
 public:
  /// throws   Io, Input: as ModelFolder::read; a data URI that is no base64 or shorter than the buffer
  GltfBuffers(const GltfFile& file, ModelFolder& folder);

  const core::Json& root() const { return file_.root; }
  const std::string& name() const { return name_; }
  /// Bytes of a view.
  std::span<const std::byte> view(std::size_t row) const;

 private:
  const GltfFile& file_;
  std::string name_;
  std::vector<std::vector<std::byte>> owned_;
  std::vector<std::span<const std::byte>> buffers_;
};

/// Bytes of a data URI.
/// throws   Input: no base64
std::vector<std::byte> bytes_of_data_uri(const std::string& uri, const std::string& where);

/// Values of an accessor, sparse or not; whole numbers are shares where it says so. The buffers must outlive it.
class GltfAccessor {
 public:
  /// throws   Input: there is no such accessor; sparse indices that do not grow
  GltfAccessor(const GltfBuffers& buffers, std::int64_t row, const std::string& where);

  std::size_t size() const { return size_; }
  int num_components() const { return num_components_; }
  bool is_whole() const { return type_ != 5126; }
  double value(std::size_t element, int component) const;
  /// Of indices and joints.
  std::uint32_t whole(std::size_t element, int component = 0) const;

 private:
  const std::byte* element(std::size_t row) const;
  double raw(const std::byte* at) const;

  std::span<const std::byte> bytes_;  ///< empty: all is 0
  std::size_t size_ = 0, stride_ = 0, component_bytes_ = 0;
  int num_components_ = 0;
  std::int64_t type_ = 0;
  bool is_share_ = false;
  std::vector<std::uint32_t> sparse_;  ///< elements whose values stand elsewhere
  std::span<const std::byte> sparse_bytes_;
};

}  // namespace terracast::tiler
