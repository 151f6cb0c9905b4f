#pragma once

#include <filesystem>
#include <memory>
#include <string>

namespace terracast::world {
class TileStore;
}

namespace terracast::oracle {

/// A world's folder, whose tiles the oracle reads. Threads: safe.
class WorldFolder {
 public:
  /// throws  Io: no such folder; Input: no finished world there, or a damaged one
  explicit WorldFolder(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  const std::string& name() const;
  /// Of everything that determines the tiles.
  const std::string& input_hash() const;

  /// The world's frame (east, north, up) is tangent to WGS84 there.
  struct Origin {
    double lat_deg, lon_deg, height_m;
  };
  Origin origin() const;

  const world::TileStore& store() const { return *store_; }

 private:
  std::filesystem::path folder_;
  std::shared_ptr<const world::TileStore> store_;
};

}  // namespace terracast::oracle
