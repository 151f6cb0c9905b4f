#include "validate/oracle/world_folder.h"

#include "world/tile_store.h"

namespace terracast::oracle {

WorldFolder::WorldFolder(const std::filesystem::path& folder)
    : folder_(folder),
      store_(std::make_shared<const world::TileStore>(world::TileStore::open(folder))) {}

const std::string& WorldFolder::name() const { return store_->manifest().name; }

const std::string& WorldFolder::input_hash() const { return store_->manifest().input_hash; }

WorldFolder::Origin WorldFolder::origin() const {
  const auto& origin = store_->manifest().origin;
  return {origin.lat_deg, origin.lon_deg, origin.height_m};
}

}  // namespace terracast::oracle
