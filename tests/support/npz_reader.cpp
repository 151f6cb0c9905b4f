#include "tests/support/npz_reader.h"

#include <zip.h>

#include <cstdint>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace terracast::test {
namespace {

void demand(bool condition, const char* what) {
  if (!condition) throw std::runtime_error(std::string("npy: ") + what);
}

template <class Value>
double value_at(const std::string& data, std::size_t i) {
  Value value;
  std::memcpy(&value, data.data() + sizeof value * i, sizeof value);
  return static_cast<double>(value);
}

double number_at(const std::string& data, std::size_t i, const std::string& type) {
  if (type == "<f8") return value_at<double>(data, i);
  if (type == "<f4") return double{value_at<float>(data, i)};
  if (type == "<i4") return value_at<std::int32_t>(data, i);
  if (type == "<u4") return value_at<std::uint32_t>(data, i);
  const double byte = value_at<std::uint8_t>(data, i);
  demand(type == "|u1" || byte <= 1, "bool");
  return byte;
}

}  // namespace

double Array::at(const std::vector<int>& place) const {
  demand(place.size() == shape.size(), "rank");
  std::size_t index = 0;
  for (std::size_t axis = 0; axis < shape.size(); ++axis) {
    demand(place[axis] >= 0 && place[axis] < shape[axis], "place");
    index = index * static_cast<std::size_t>(shape[axis]) + static_cast<std::size_t>(place[axis]);
  }
  return numbers[index];
}

Array parse_npy(const std::string& bytes) {
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
  const std::map<std::string, std::size_t> bytes_of = {{"<f8", 8}, {"<f4", 4}, {"<i4", 4},
                                                       {"<u4", 4}, {"|b1", 1}, {"|u1", 1}};
  demand(bytes_of.contains(array.type), "type");
  const std::string data = bytes.substr(10 + length);
  demand(data.size() == count * bytes_of.at(array.type), "size");
  const bool is_of_floats = array.type == "<f4" || bytes_of.at(array.type) == 1;
  for (std::size_t i = 0; i < count; ++i) {
    array.numbers.push_back(number_at(data, i, array.type));
    if (is_of_floats) array.values.push_back(static_cast<float>(array.numbers.back()));
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

}  // namespace terracast::test
