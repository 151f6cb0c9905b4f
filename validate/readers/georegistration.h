#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>

/// COLMAP's georegistration.txt: an image's name and three numbers a line, as `model_aligner` takes them.
namespace terracast::validate {

/// By name: latitude and longitude in degrees and height above the ellipsoid in metres, if the file is right. Numbers
/// need not be places.
using GeoregistrationPlaces = std::map<std::string, std::array<double, 3>>;

/// where   of the file, for messages
/// throws  Input: a line that is not a name and three numbers, a name that stands twice; Io
GeoregistrationPlaces read_georegistration(const std::filesystem::path& file,
                                           const std::string& where);

}  // namespace terracast::validate
