#pragma once

#include <cstdint>
#include <string>

#include "core/schema.h"

namespace terracast::tiler {

/// An .osm file with its nodes before its ways and these before its relations, each by number and once, as GDAL wants
/// them: of others it leaves out what it has no room to wait for, or ends. Held in memory for as long as this lives.
class OrderedOsm {
 public:
  /// file     for messages
  /// path     as GDAL knows it
  /// cost     twice the file's bytes of memory
  /// throws   Input: an element without an end, or more than kMost_bytes
  OrderedOsm(const core::Path& file, const std::string& path);
  ~OrderedOsm();
  OrderedOsm(const OrderedOsm&) = delete;
  OrderedOsm& operator=(const OrderedOsm&) = delete;

  /// As open_gdal_vectors() takes it.
  core::Path file() const { return {written_, path_}; }

  static constexpr std::uint64_t kMost_bytes = std::uint64_t{2} << 30;
  /// Files in memory are read by names that begin so alone.
  static constexpr const char* kFolder = "/vsimem/terracast_ordered/";

 private:
  std::string written_;
  std::string path_;
  std::string bytes_;
};

}  // namespace terracast::tiler
