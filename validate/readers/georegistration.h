#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

/// COLMAP's georegistration.txt: an image's name and three numbers a line, as `model_aligner` takes them.
namespace terracast::validate {

/// Of an image: latitude and longitude in degrees and height above the ellipsoid in metres, if the file is right. Numbers
/// need not be places.
using GeoregistrationPlace = std::array<double, 3>;
/// By name.
using GeoregistrationPlaces = std::map<std::string, GeoregistrationPlace>;

/// In the order of the file's lines.
/// where   of the file, for messages
/// throws  Input: a line that is not a name and three numbers; Io
std::vector<std::pair<std::string, GeoregistrationPlace>> read_georegistration_lines(
    const std::filesystem::path& file, const std::string& where);

/// where   of the file, for messages
/// throws  Input: a line that is not a name and three numbers, a name that stands twice; Io
GeoregistrationPlaces read_georegistration(const std::filesystem::path& file,
                                           const std::string& where);

}  // namespace terracast::validate
