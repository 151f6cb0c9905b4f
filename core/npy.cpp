#include "core/npy.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <string>

#include "core/error.h"

namespace terracast::core {
namespace {

static_assert(std::endian::native == std::endian::little,
              "npy files are written as memory holds them");

/// descr   as Python writes it
std::vector<std::byte> file_of(const std::string& descr, const std::string& sizes,
                               std::span<const std::byte> values) {
  std::string header =
      fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': ({}), }}", descr, sizes);
  // Magic, version and length are 10 bytes; the values start at a multiple of 64.
  header.append(63 - (10 + header.size()) % 64, ' ');
  header += '\n';
  TERRACAST_CHECK(header.size() <= 0xffff, "a header of {} bytes", header.size());
  std::string start("\x93NUMPY\x01\x00", 8);
  start += static_cast<char>(header.size() & 0xff);
  start += static_cast<char>(header.size() >> 8);
  start += header;
  std::vector<std::byte> bytes(start.size() + values.size());
  std::memcpy(bytes.data(), start.data(), start.size());
  if (!values.empty()) std::memcpy(bytes.data() + start.size(), values.data(), values.size());
  return bytes;
}

std::vector<std::byte> with_header(const char* type, std::span<const std::byte> values,
                                   std::size_t value_bytes, const std::vector<int>& shape) {
  std::size_t num_values = 1;
  std::string sizes;
  for (const int size : shape) {
    num_values *= static_cast<std::size_t>(size);
    sizes += fmt::format("{}{}", sizes.empty() ? "" : ", ", size);
  }
  if (shape.size() == 1) sizes += ",";
  TERRACAST_CHECK(num_values * value_bytes == values.size(), "shape ({}) of {} bytes", sizes,
                  values.size());
  return file_of(fmt::format("'{}'", type), sizes, values);
}

template <class Pixel>
std::vector<int> shape_of(const Image<Pixel>& image) {
  if (image.channels() == 1) return {image.height(), image.width()};
  return {image.height(), image.width(), image.channels()};
}

}  // namespace

std::vector<std::byte> npy_bytes(std::span<const float> values, const std::vector<int>& shape) {
  return with_header("<f4", std::as_bytes(values), sizeof(float), shape);
}

std::vector<std::byte> npy_bytes(std::span<const double> values, const std::vector<int>& shape) {
  return with_header("<f8", std::as_bytes(values), sizeof(double), shape);
}

std::vector<std::byte> npy_bytes(std::span<const std::int32_t> values,
                                 const std::vector<int>& shape) {
  return with_header("<i4", std::as_bytes(values), sizeof(std::int32_t), shape);
}

std::vector<std::byte> npy_bytes(std::span<const std::uint32_t> values,
                                 const std::vector<int>& shape) {
  return with_header("<u4", std::as_bytes(values), sizeof(std::uint32_t), shape);
}

std::vector<std::byte> npy_bool_bytes(std::span<const std::uint8_t> values,
                                      const std::vector<int>& shape) {
  std::vector<std::uint8_t> flags(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) flags[i] = values[i] != 0 ? 1 : 0;
  return with_header("|b1", std::as_bytes(std::span<const std::uint8_t>(flags)), 1, shape);
}

std::vector<std::byte> npy_bytes(const ImageF& image) {
  return npy_bytes(image.data(), shape_of(image));
}

std::vector<std::byte> npy_bytes(const Image8& image) {
  return with_header("|u1", std::as_bytes(image.data()), 1, shape_of(image));
}

std::vector<std::byte> npy_bytes(const ImageU32& image) {
  return npy_bytes(std::span<const std::uint32_t>(image.data()), shape_of(image));
}

std::vector<std::byte> npy_table_bytes(std::span<const NpyField> fields, std::size_t num_rows,
                                       std::span<const std::byte> rows) {
  std::string descr;
  std::size_t row_bytes = 0;
  for (const NpyField& field : fields) {
    descr += fmt::format("{}('{}', '{}')", descr.empty() ? "[" : ", ", field.name, field.type);
    row_bytes += static_cast<std::size_t>(field.type.back() - '0');
  }
  TERRACAST_CHECK(num_rows * row_bytes == rows.size(), "{} rows of {} bytes: {}", num_rows,
                  row_bytes, rows.size());
  return file_of(descr + "]", fmt::format("{},", num_rows), rows);
}

}  // namespace terracast::core
