#pragma once

#include <filesystem>
#include <string>

namespace terracast::tiler {

/// A folder of map tiles z/x/y.png (Web Mercator, EPSG:3857; y from the north; all of one size) as
/// one raster: the text of a GDAL VRT of bands red, green, blue and alpha. The deepest z that has
/// tiles is taken; alpha is 0 where a tile is missing.
/// written   the folder's name for messages
/// throws    Input: no tiles, of unlike sizes or not of colours, addresses that no zoom has, too
///           many
std::string vrt_of_terrain_tiles(const std::filesystem::path& folder, const std::string& written);

}  // namespace terracast::tiler
