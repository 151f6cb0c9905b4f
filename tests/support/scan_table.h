#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "validate/npy.h"

namespace terracast::test {

/// The rows of a file of scans, to be edited; they are written when it goes.
class ScanTable {
 public:
  explicit ScanTable(std::filesystem::path file)
      : file_(std::move(file)),
        bytes_(core::read_file(file_)),
        table_(validate::parse_npy_table(bytes_, file_.string())) {}
  ~ScanTable() { core::write_file(file_, bytes_); }
  ScanTable(const ScanTable&) = delete;
  ScanTable& operator=(const ScanTable&) = delete;

  std::size_t size() const { return table_.num_rows; }
  double get(const std::string& column, std::size_t row) const {
    return table_.numbers(column, "")[row];
  }
  /// number   that the column's type can hold
  void set(const std::string& column, std::size_t row, double number) {
    for (const validate::NpyTable::Column& one : table_.columns) {
      if (one.name != column) continue;
      const auto put = [&](auto value) {
        std::memcpy(
            bytes_.data() + bytes_.size() - (table_.num_rows - row) * table_.row_bytes + one.offset,
            &value, sizeof(value));
      };
      if (one.kind == 'f' && one.item_size == 8)
        put(number);
      else if (one.kind == 'f')
        put(static_cast<float>(number));
      else if (one.item_size == 4)
        put(static_cast<std::uint32_t>(number));
      else if (one.item_size == 2)
        put(static_cast<std::uint16_t>(number));
      else
        put(static_cast<std::uint8_t>(number));
    }
  }
  /// change   takes row and number
  void map(const std::string& column, const std::function<double(std::size_t, double)>& change) {
    const std::vector<double> values = table_.numbers(column, "");
    for (std::size_t row = 0; row < size(); ++row) set(column, row, change(row, values[row]));
  }

 private:
  std::filesystem::path file_;
  std::vector<std::byte> bytes_;
  validate::NpyTable table_;
};

}  // namespace terracast::test
