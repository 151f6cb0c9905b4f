#include "tests/export/readers.h"

#include <gtest/gtest.h>
#include <zip.h>

#include <cstdint>
#include <cstring>
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

Array parse_npy(const std::string& bytes) {
  const auto demand = [](bool condition, const char* what) {
    if (!condition) throw std::runtime_error(std::string("npy: ") + what);
  };
  demand(bytes.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8), "magic");
  const std::size_t length = static_cast<unsigned char>(bytes[8]) |
                             static_cast<std::size_t>(static_cast<unsigned char>(bytes[9])) << 8;
  demand((10 + length) % 64 == 0 && bytes[9 + length] == '\n', "alignment");
  const std::string header = bytes.substr(10, length);
  Array array;
  const auto quoted = [&](const std::string& key) {
    const std::size_t at = header.find("'" + key + "': '");
    demand(at != std::string::npos, "key");
    const std::size_t begin = at + key.size() + 5;
    return header.substr(begin, header.find('\'', begin) - begin);
  };
  array.type = quoted("descr");
  demand(header.find("'fortran_order': False") != std::string::npos, "order");
  std::string sizes = header.substr(header.find('(') + 1);
  sizes = sizes.substr(0, sizes.find(')'));
  for (char& c : sizes)
    if (c == ',') c = ' ';
  std::istringstream stream(sizes);
  std::size_t count = 1;
  for (int size = 0; stream >> size;) {
    array.shape.push_back(size);
    count *= static_cast<std::size_t>(size);
  }
  const std::string data = bytes.substr(10 + length);
  const std::size_t value_bytes = array.type == "<f4" ? 4 : 1;
  demand(array.type == "<f4" || array.type == "|b1" || array.type == "|u1", "type");
  demand(data.size() == count * value_bytes, "size");
  array.values.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (value_bytes == 4) {
      std::memcpy(&array.values[i], data.data() + 4 * i, 4);
    } else {
      const auto value = static_cast<unsigned char>(data[i]);
      demand(array.type == "|u1" || value <= 1, "bool");
      array.values[i] = static_cast<float>(value);
    }
  }
  return array;
}

std::map<std::string, Array> read_npz(const std::filesystem::path& file) {
  int code = 0;
  zip_t* archive = zip_open(file.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &code);
  if (archive == nullptr) throw std::runtime_error("zip error " + std::to_string(code));
  std::map<std::string, Array> arrays;
  for (zip_int64_t i = 0; i < zip_get_num_entries(archive, 0); ++i) {
    zip_stat_t stat;
    zip_stat_index(archive, static_cast<zip_uint64_t>(i), 0, &stat);
    std::string bytes(stat.size, '\0');
    zip_file_t* entry = zip_fopen_index(archive, static_cast<zip_uint64_t>(i), 0);
    if (zip_fread(entry, bytes.data(), stat.size) != static_cast<zip_int64_t>(stat.size))
      throw std::runtime_error("zip: short");
    zip_fclose(entry);
    const std::string name = stat.name;
    arrays[name.substr(0, name.size() - 4)] = parse_npy(bytes);
  }
  zip_close(archive);
  return arrays;
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
