#include "tests/export/readers.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace terracast::test {

Eigen::Vector3d Wgs84::ecef(double lat_deg, double lon_deg, double height_m) {
  const double a = 6378137.0, f = 1.0 / 298.257223563, e2 = f * (2.0 - f);
  const double lat = lat_deg * M_PI / 180.0, lon = lon_deg * M_PI / 180.0;
  const double n = a / std::sqrt(1.0 - e2 * std::sin(lat) * std::sin(lat));
  return {(n + height_m) * std::cos(lat) * std::cos(lon),
          (n + height_m) * std::cos(lat) * std::sin(lon),
          (n * (1.0 - e2) + height_m) * std::sin(lat)};
}

Eigen::Matrix3d Wgs84::ecef_from_enu(double lat_deg, double lon_deg) {
  const double lat = lat_deg * M_PI / 180.0, lon = lon_deg * M_PI / 180.0;
  Eigen::Matrix3d enu_from_ecef;
  enu_from_ecef << -std::sin(lon), std::cos(lon), 0.0,  //
      -std::sin(lat) * std::cos(lon), -std::sin(lat) * std::sin(lon), std::cos(lat),
      std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat);
  return enu_from_ecef.transpose();
}

std::string slurp(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::vector<std::vector<double>> read_rows(const std::filesystem::path& file) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(slurp(file));
  for (std::string line; std::getline(lines, line);) {
    EXPECT_EQ(line.find("  "), std::string::npos) << line;
    EXPECT_TRUE(line.empty() || line.back() != ' ') << line;
    rows.emplace_back();
    std::istringstream words(line);
    for (std::string word; words >> word;) rows.back().push_back(std::stod(word));
  }
  return rows;
}

}  // namespace terracast::test
